#include "core/gap/checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/gap/verdict/posterior.hpp"

namespace wheelhop {
namespace {

constexpr double kPlausible = -4;     // log density of an answer's sizes, below which they are odd
constexpr double kStandsApart = 1.5;  // leftover at the worst place over that at the best, which then stands out
constexpr double kSame = 0.9;         // closure from which a rival would have done as well

/// True of a suspect whose family the answer names.
bool is_named(const Verdict& verdict, const Suspect& suspect) {
  return std::any_of(verdict.named.begin(), verdict.named.end(),
                     [&](const EffectAt& name) { return name.effect == suspect.effect; });
}

}  // namespace

std::vector<Check> checks_of(const Study& study, const Hypothesis& retuned, const Hypothesis& answer,
                             const Evidence& evidence, const Verdict& verdict,
                             const std::vector<PlaceLeftover>& places_left, const Thresholds& thresholds) {
  std::vector<Check> checks;
  checks.push_back({"nothing of note is left", answer.fit.misfit - 1 < negligible(evidence, thresholds),
                    fmt::format("misfit {:.3f} of the fitted records, 1 is the floor", answer.fit.misfit)});
  if (!places_left.empty())
    checks.push_back(
        {"no place stands out any more", places_left.back().leftover < kStandsApart * places_left.front().leftover,
         fmt::format("an unknown signal leaves {:.2f} at {} and {:.2f} at {}; without the answer {:.2f} to {:.2f}",
                     places_left.front().leftover, places_left.front().location, places_left.back().leftover,
                     places_left.back().location, evidence.places.front().leftover, evidence.places.back().leftover)});
  const auto count = static_cast<Index>(study.tolerances.size());
  if (answer.fit.covariance.size() > 0 && count > 0) {
    const Vector theta = answer.fit.theta.head(count);
    Index most = 0;
    const double z = leave_prior_out_z(theta, answer.fit.covariance).cwiseAbs().maxCoeff(&most);
    checks.push_back({"parameters come home into their tolerances", z < thresholds.out_of_tolerance,
                      fmt::format("sum of squares {:.1f} tolerances, {:.1f} without the effect; furthest {} at {:.1f}",
                                  theta.squaredNorm(), retuned.fit.theta.squaredNorm(),
                                  study.tolerances[static_cast<std::size_t>(most)].name, theta(most))});
  }
  const double plausibility = candidate_of(evidence, std::get<Effects>(verdict.answer)).log_plausibility;
  checks.push_back({"sizes are those of the literature", plausibility > kPlausible,
                    fmt::format("log density {:.1f} against the middle of what is usual", plausibility)});
  for (const Suspect& suspect : verdict.suspects) {
    if (is_named(verdict, suspect)) continue;
    if (std::isnan(suspect.closure.value)) break;  // the held-out records have no gap that it could close
    checks.push_back({"without its family the answer would not be the same", suspect.closure.value < kSame,
                      fmt::format("next is {} at {}, which removes {:.0f} %", suspect.effect, suspect.location,
                                  100 * suspect.closure.value)});
    break;
  }
  return checks;
}

SeparatingTest separating_test_of(const Study& study, const Verdict& verdict) {
  if (verdict.ambiguous_with.empty() || verdict.named.empty()) return {};
  Operation operation;
  if (!operation_of(study.nominal, study.data.fitted, {}, operation)) return {};
  const EffectAt& last = verdict.named.back();  // of several, the one that the rivals would replace
  const EffectCandidate *a = nullptr, *b = nullptr;
  const std::vector<EffectCandidate> all = study.candidates(study.nominal, operation);
  for (const EffectCandidate& candidate : all) {
    if (!a && name_of(candidate) == last) a = &candidate;
    if (!b && name_of(candidate) == verdict.ambiguous_with.front()) b = &candidate;
  }
  return a && b ? separating_test(study.nominal, study.data.fitted, *a, *b) : SeparatingTest{};
}

}  // namespace wheelhop
