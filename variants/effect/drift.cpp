#include "variants/effect/effects.hpp"

namespace wheelhop {
namespace {

constexpr double kSettling = 0.03;   // 1/s; electronics and strain gauges warm up in half a minute to some minutes
constexpr double kUsualRate = 0.05;  // 1/s, of the usual offset: a judgement

}  // namespace

std::shared_ptr<const Effect> make_drift(const EffectOptions&) {
  return effect_family("drift", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
    for (Index i = 0; i < plant.sensor_count(); ++i) {
      const Sensor& sensor = plant.sensors[static_cast<std::size_t>(i)];
      const Place at = sensor_place(sensor.name);
      const std::string place = to_string(at);
      const double size = 0.005 * operation.output_rms(i);  // a tenth of the signal in 20 s
      if (!(size > 0)) continue;
      // A drift starts at a value of its own.
      list.push_back(with_path(plant, "drift", at, "warm-up",
                               {{place + ".drift_per_s", size, size},
                                {place + ".bias", 0, 10 * size},
                                {place + ".drift_settling_per_s", kSettling, kSettling}}));
      list.back().either_sign = true;
      if (usual_offset(sensor) > 0) typically(list.back(), "drift_per_s", kUsualRate * usual_offset(sensor));
    }
  });
}

}  // namespace wheelhop
