#include <cmath>

#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_rate_limit(const EffectOptions&) {
  return effect_family("rate_limit", [](const Plant& plant, const Operation& operation,
                                        std::vector<EffectCandidate>& list) {
    for (Index i = 0; i < plant.input_count(); ++i) {
      const PlantInput& input = plant.inputs[static_cast<std::size_t>(i)];
      const std::string path = "actuator:" + input.name;
      for (const double share : {0.5, 0.8}) {  // of the fastest command: a limit above it does nothing
        const double limit = share * operation.drive_rate_peak(i);
        if (!(limit > 0)) continue;
        list.push_back(with_path(plant, "rate_limit", actuator_of(plant, input), "rate",
                                 {{path + ".rate_limit", limit, 0.2 * limit}}));
        list.back().proportional = false;
        if (input.kind == InputKind::displacement) typically(list.back(), "rate_limit", 0.8);
      }
    }
    for (Index i = 0; i < plant.sensor_count(); ++i) {
      const Sensor& sensor = plant.sensors[static_cast<std::size_t>(i)];
      const Place at = sensor_place(sensor.name);
      const std::string place = to_string(at);
      if (std::isfinite(sensor.path.rate_limit)) continue;
      for (const double share : {0.5, 0.8}) {  // of the fastest reading
        const double limit = share * operation.output_rate_peak(i);
        if (!(limit > 0)) continue;
        list.push_back(with_path(plant, "rate_limit", at, "amplifier", {{place + ".rate_limit", limit, 0.2 * limit}}));
        list.back().proportional = false;
      }
    }
  });
}

}  // namespace wheelhop
