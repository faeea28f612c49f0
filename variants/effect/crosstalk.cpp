#include <algorithm>
#include "variants/effect/effects.hpp"

namespace wheelhop {
namespace {

bool sees(const Sensor& sensor, const std::string& other) {
  return std::any_of(sensor.path.crosstalk.begin(), sensor.path.crosstalk.end(),
                     [&](const auto& entry) { return entry.first == other; });
}

}  // namespace

// A tilted mount or a shared ground lets one channel see 0.5 to 3 % of another, in the size that this has here.
std::shared_ptr<const Effect> make_crosstalk(const EffectOptions&) {
  return effect_family("crosstalk",
                       [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
                         // Where channels are many, only those of a kind share a mount; all pairs of them would be
                         // hundreds.
                         const bool all_pairs = plant.sensor_count() <= 4;
                         for (Index i = 0; i < plant.sensor_count(); ++i)
                           for (Index j = 0; j < plant.sensor_count(); ++j) {
                             const Sensor &own = plant.sensors[static_cast<std::size_t>(i)],
                                          &other = plant.sensors[static_cast<std::size_t>(j)];
                             if (i == j || !(all_pairs || own.kind == other.kind) || !(operation.output_rms(j) > 0))
                               continue;
                             if (sees(own, other.name)) continue;
                             const auto couple = [place = i, from = other.name](Plant& coupled) {
                               Sensor& sensor = coupled.sensors[static_cast<std::size_t>(place)];
                               if (sees(sensor, from)) return false;
                               sensor.path.crosstalk.emplace_back(from, 0.0);
                               return true;
                             };
                             const Place at = sensor_place(own.name);
                             const std::string place = to_string(at);
                             const double factor = 0.02 * operation.output_rms(i) / operation.output_rms(j);
                             list.push_back(with_path(plant, "crosstalk", at, "from " + other.name,
                                                      {{place + ".crosstalk." + other.name, factor, factor}}, couple));
                             list.back().either_sign = true;
                             // No mount is so straight that its tilt is seen; of other units no share is known.
                             if (own.kind == other.kind) plausibly(list.back(), "crosstalk." + other.name, 0.005, 0.05);
                           }
                       });
}

}  // namespace wheelhop
