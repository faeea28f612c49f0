#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_clock_skew(const EffectOptions&) {
  return effect_family("clock_skew", [](const Plant& plant, const Operation&, std::vector<EffectCandidate>& list) {
    list.push_back(
        with_path(plant, "clock_skew", clock_place(), "linear in time", {{"timebase.clock_skew", 5e-5, 5e-5}}));
    list.back().either_sign = true;
  });
}

}  // namespace wheelhop
