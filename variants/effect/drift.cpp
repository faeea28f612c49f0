#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_drift(const EffectOptions&) {
  return effect_family("drift", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
    for (Index i = 0; i < plant.sensor_count(); ++i) {
      const std::string place = "sensor:" + plant.sensors[static_cast<std::size_t>(i)].name;
      const double size = 0.005 * operation.output_rms(i);  // a tenth of the signal in 20 s
      if (!(size > 0)) continue;
      // A drift starts at a value of its own.
      list.push_back(with_path(plant, "drift", place, "linear in time",
                               {{place + ".drift_per_s", size, size}, {place + ".bias", 0, 10 * size}}));
      list.back().either_sign = true;
      const SensorKind kind = plant.sensors[static_cast<std::size_t>(i)].kind;
      typically(list.back(), "drift_per_s",
                0.05 * (kind == SensorKind::acceleration ? 0.1
                        : kind == SensorKind::velocity   ? 0.01
                                                         : 0.002));
    }
  });
}

}  // namespace wheelhop
