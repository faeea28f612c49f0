#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_time_delay(const EffectOptions&) {
  return effect_family("time_delay", [](const Plant& plant, const Operation&, std::vector<EffectCandidate>& list) {
    for (const PlantInput& input : plant.inputs) {
      const std::string path = "actuator:" + input.name;
      list.push_back(with_path(plant, "time_delay", actuator_of(plant, input), "pure",
                               {{path + ".delay_s", 0.002, 0.001}, {path + ".sampling_phase", 0.5, 0.2}}));
      list.back().either_sign = true;
    }
  });
}

}  // namespace wheelhop
