#include "core/gap/judge.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace wheelhop {
namespace {

constexpr double kPlausible = -4;     // log density of an answer's sizes, below which they are odd
constexpr double kStandsApart = 1.5;  // leftover at the worst place over that at the best, which then stands out
constexpr double kSame = 0.9;         // closure from which a rival would have done as well

void add_check(Diagnosis& diagnosis, const std::string& name, bool passed, std::string detail) {
  diagnosis.checks.push_back({name, passed, std::move(detail)});
}

/// True of a suspect whose family the answer names.
bool is_named(const Diagnosis& diagnosis, const Suspect& suspect) {
  return std::any_of(diagnosis.named.begin(), diagnosis.named.end(),
                     [&](const std::string& name) { return name.starts_with(suspect.effect + "@"); });
}

}  // namespace

void check_answer(const GapCase& c, const Hypothesis& answer, Diagnosis& diagnosis) {
  const double left = answer.fit.misfit - 1;
  add_check(diagnosis, "nothing of note is left", left < kTooSmall,
            fmt::format("misfit {:.3f} of the fitted records, 1 is the floor", answer.fit.misfit));
  diagnosis.places_left = locate(answer.fit, c.study.data.fitted, c.study.data.noise_shares);
  if (const std::vector<Place>& now = diagnosis.places_left; !now.empty())
    add_check(diagnosis, "no place stands out any more", now.back().leftover < kStandsApart * now.front().leftover,
              fmt::format("an unknown signal leaves {:.2f} at {} and {:.2f} at {}; without the answer {:.2f} to {:.2f}",
                          now.front().leftover, now.front().location, now.back().leftover, now.back().location,
                          diagnosis.places.front().leftover, diagnosis.places.back().leftover));
  const auto count = static_cast<Index>(c.study.tolerances.size());
  const Vector z = answer.fit.theta.head(count);
  if (answer.fit.covariance.size() > 0 && count > 0) {
    Index most = 0;
    const double surprise = surprises(answer.fit, count).cwiseAbs().maxCoeff(&most);
    add_check(diagnosis, "parameters come home into their tolerances", surprise < kOutOfTolerance,
              fmt::format("sum of squares {:.1f} tolerances, {:.1f} without the effect; furthest {} at {:.1f}",
                          z.squaredNorm(), c.retuned.fit.theta.squaredNorm(),
                          c.study.tolerances[static_cast<std::size_t>(most)].name, z(most)));
  }
  add_check(diagnosis, "sizes are those of the literature", answer.plausibility > kPlausible,
            fmt::format("log density {:.1f} against the middle of what is usual", answer.plausibility));
  for (const Suspect& suspect : diagnosis.suspects) {
    if (is_named(diagnosis, suspect)) continue;
    if (std::isnan(suspect.closure.value)) break;  // the held-out records have no gap that it could close
    add_check(diagnosis, "without its family the answer would not be the same", suspect.closure.value < kSame,
              fmt::format("next is {} at {}, which removes {:.0f} %", suspect.effect, suspect.location,
                          100 * suspect.closure.value));
    break;
  }
}

void find_separating_test(const GapCase& c, Diagnosis& diagnosis) {
  if (diagnosis.ambiguous_with.empty() || diagnosis.named.empty()) return;
  if (c.step) c.step("a test that would tell " + diagnosis.named.back() + " and " + diagnosis.ambiguous_with.front());
  Operation operation;
  if (!operation_of(c.study.nominal, c.study.data.fitted, {}, operation)) return;
  const std::string& last = diagnosis.named.back();  // of several, the one that the rivals would replace
  const EffectCandidate *a = nullptr, *b = nullptr;
  const std::vector<EffectCandidate> all = c.study.candidates(c.study.nominal, operation);
  for (const EffectCandidate& candidate : all) {
    if (!a && name_of(candidate) == last) a = &candidate;
    if (!b && name_of(candidate) == diagnosis.ambiguous_with.front()) b = &candidate;
  }
  if (a && b) diagnosis.separating = separating_test(c.study.nominal, c.study.data.fitted, *a, *b);
}

}  // namespace wheelhop
