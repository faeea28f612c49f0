#include "variants/effect/effects.hpp"

namespace wheelhop {

// The step is read off the record: readings on a lattice are rounded ones.
std::shared_ptr<const Effect> make_quantisation(const EffectOptions&) {
  return effect_family(
      "quantisation", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
        for (Index i = 0; i < plant.sensor_count(); ++i) {
          const Sensor& sensor = plant.sensors[static_cast<std::size_t>(i)];
          if (!(operation.output_quantum(i) > 0) || sensor.path.quantum > 0) continue;
          EffectCandidate candidate = with_path(
              plant, "quantisation", sensor_place(sensor.name), "rounding",
              {{"sensor:" + sensor.name + ".quantum", operation.output_quantum(i), operation.output_quantum(i)}});
          candidate.parameters.clear();
          candidate.proportional = false;
          list.push_back(std::move(candidate));
        }
      });
}

}  // namespace wheelhop
