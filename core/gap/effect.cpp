#include "core/gap/effect.hpp"

#include <cmath>

namespace wheelhop {

double log_plausibility(const EffectCandidate& candidate, const Plant& fitted) {
  constexpr double z90 = 1.6448536269514722;
  double sum = 0;
  for (const Plausible& plausible : candidate.plausible) {
    const double size = std::abs(get_parameter(fitted, plausible.parameter) - plausible.ideal);
    const double middle = 0.5 * std::log(plausible.low * plausible.high);
    const double spread = 0.5 * std::log(plausible.high / plausible.low) / z90;
    const double z = (std::log(std::max(size, 1e-300)) - middle) / spread;
    sum -= 0.5 * z * z;
  }
  return sum;
}

EffectCandidate at_typical_size(EffectCandidate candidate) {
  for (const auto& [name, value] : candidate.typical) set_parameter(candidate.plant, name, value);
  return candidate;
}

}  // namespace wheelhop
