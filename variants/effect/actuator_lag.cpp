#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_actuator_lag(const EffectOptions&) {
  return effect_family("actuator_lag", [](const Plant& plant, const Operation&, std::vector<EffectCandidate>& list) {
    for (const PlantInput& input : plant.inputs) {
      const std::string path = "actuator:" + input.name;
      list.push_back(with_path(plant, "actuator_lag", actuator_of(plant, input), "first order",
                               {{path + ".lag.time_constant_s", 0.003, 0.001}, {path + ".sampling_phase", 0.5, 0.2}}));
      list.push_back(with_path(plant, "actuator_lag", actuator_of(plant, input), "second order",
                               {{path + ".lag.cutoff_hz", 40, 10},
                                {path + ".lag.damping_ratio", 0.7, 0.2},
                                {path + ".sampling_phase", 0.5, 0.2}}));
      list.back().proportional = false;
    }
  });
}

}  // namespace wheelhop
