#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_bias(const EffectOptions&) {
  return effect_family("bias", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
    for (Index i = 0; i < plant.sensor_count(); ++i) {
      const Sensor& sensor = plant.sensors[static_cast<std::size_t>(i)];
      const Place at = sensor_place(sensor.name);
      const std::string place = to_string(at);
      const double size = 0.1 * operation.output_rms(i);
      if (!(size > 0)) continue;
      list.push_back(with_path(plant, "bias", at, "constant", {{place + ".bias", size, size}}));
      list.back().either_sign = true;
      if (usual_offset(sensor) > 0) typically(list.back(), "bias", usual_offset(sensor));
    }
  });
}

}  // namespace wheelhop
