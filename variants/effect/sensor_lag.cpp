#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_sensor_lag(const EffectOptions&) {
  return effect_family("sensor_lag", [](const Plant& plant, const Operation&, std::vector<EffectCandidate>& list) {
    for (const Sensor& sensor : plant.sensors) {
      const std::string place = "sensor:" + sensor.name;
      list.push_back(
          with_path(plant, "sensor_lag", place, "first order", {{place + ".lag.time_constant_s", 0.002, 0.001}}));
    }
  });
}

}  // namespace wheelhop
