#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_time_delay(const EffectOptions&) {
  return effect_family("time_delay", [](const Plant& plant, const Operation&, std::vector<EffectCandidate>& list) {
    for (const PlantInput& input : plant.inputs) {
      const std::string path = "actuator:" + input.name;
      list.push_back(with_path(plant, "time_delay", actuator_of(plant, input), "pure",
                               {{path + ".delay_s", 0.002, 0.001}, {path + ".sampling_phase", 0.5, 0.2}}));
      list.back().either_sign = true;
    }
    for (const Sensor& sensor : plant.sensors) {
      if (sensor.path.delay_s != 0) continue;
      const Place at = sensor_place(sensor.name);
      const std::string place = to_string(at);
      // Two starts, because a fit of fast motion that begins far from the delay ends a period too early or too late. No
      // range of plausible sizes is given: delays of a bus and lags of a filter have the same sizes.
      for (const double start : {0.002, 0.015}) {
        list.push_back(with_path(plant, "time_delay", at, "late reading", {{place + ".delay_s", start, 0.5 * start}}));
      }
    }
  });
}

}  // namespace wheelhop
