#include "variants/effect/effects.hpp"

namespace wheelhop {
namespace {

// Nine of ten readings that come over a bus or a radio are late by times between these. What an analogue chain adds is
// less and has the phase of its filters, so it goes by the name of a sensor's lag. Both bounds are judgements, chosen
// while looking at generated cases of either kind.
constexpr double kShortest = 0.002, kLongest = 0.05;  // s

}  // namespace

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
      const std::string place = "sensor:" + sensor.name;
      // Far from either start a fit of fast motion ends at a period too many or too few.
      for (const double start : {0.002, 0.015}) {
        list.push_back(
            with_path(plant, "time_delay", place, "late reading", {{place + ".delay_s", start, 0.5 * start}}));
        plausibly(list.back(), "delay_s", kShortest, kLongest);
      }
    }
  });
}

}  // namespace wheelhop
