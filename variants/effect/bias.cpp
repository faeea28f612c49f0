#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_bias(const EffectOptions&) {
  return effect_family("bias", [](const Plant& plant, std::vector<EffectCandidate>& list) {
    for (const Sensor& sensor : plant.sensors) {
      const std::string place = "sensor:" + sensor.name;
      const double size = sensor.kind == SensorKind::acceleration ? 0.1
                          : sensor.kind == SensorKind::velocity   ? 0.01
                                                                  : 0.002;
      list.push_back(with_path(plant, "bias", place, "constant", {{place + ".bias", size, size}}));
      list.back().either_sign = true;
    }
  });
}

}  // namespace wheelhop
