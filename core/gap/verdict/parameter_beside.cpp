#include "core/gap/verdict/parameter_beside.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/gap/verdict/posterior.hpp"

namespace wheelhop {
namespace {

/// True of a parameter that an inexact form of the effects bends, since it belongs to an element where one of them
/// acts: the bend of a spring whichever parameter is free; a stiffness or damping where the free parameter is of a part
/// without effects; beside a free parameter of the same element, the damping where all effects there store nothing, and
/// the stiffness where all of them are elastic.
bool bends_with_form(const CandidateEvidence& candidate, const ToleranceEvidence& free,
                     const ToleranceEvidence& other) {
  bool acts = false, acts_at_free = false, elastic = true, dissipative = true;
  for (const EffectEvidence& effect : candidate.effects) {
    acts_at_free = acts_at_free || effect.location == free.location;
    if (effect.location != other.location) continue;
    acts = true;
    elastic = elastic && effect.elastic;
    dissipative = dissipative && effect.dissipative;
  }
  if (!acts) return false;
  if (!is_parameter_error(other.effect) || !acts_at_free) return true;
  if (free.location != other.location || free.effect == other.effect) return false;
  return (dissipative && other.effect == "damping_error") || (elastic && other.effect == "stiffness_error");
}

}  // namespace

void add_parameter_beside(const Evidence& evidence, const Thresholds& thresholds, Verdict& verdict) {
  Effects& effects = std::get<Effects>(verdict.answer);
  const CandidateEvidence& candidate = candidate_of(evidence, effects);
  if (candidate.freed.empty()) return;
  const std::vector<double> probabilities = probabilities_beside(evidence, candidate, thresholds);
  const auto most = std::max_element(probabilities.begin(), probabilities.end());
  if (!(*most > thresholds.stands_out)) return;
  const auto index = static_cast<std::size_t>(most - probabilities.begin());
  const FreedEvidence& freed = candidate.freed[index];
  const ToleranceEvidence& own = evidence.tolerances[freed.tolerance];
  for (std::size_t i = 0; i < freed.z.size(); ++i)
    if (i != freed.tolerance && std::abs(freed.z[i]) > thresholds.not_home &&
        !bends_with_form(candidate, own, evidence.tolerances[i]))
      return;
  const Suspect suspect{
      own.effect,    own.location, "", std::min(*most, thresholds.surest), freed.stage.misfit, freed.closure_of_retuned,
      {freed.fitted}};
  effects.parameter = index;
  verdict.named.push_back(suspect.name());
  std::erase(verdict.ambiguous_with, suspect.name());
  verdict.suspects.insert(verdict.suspects.begin() + static_cast<std::ptrdiff_t>(candidate.effects.size()), suspect);
  // Its place is as probable as it is, and stands behind that of the first effect.
  const auto place = std::find_if(verdict.locations.begin(), verdict.locations.end(),
                                  [&](const LocationProbability& other) { return other.location == own.location; });
  if (place == verdict.locations.end())
    verdict.locations.push_back({own.location, suspect.probability});
  else
    place->probability = std::max(place->probability, suspect.probability);
  std::stable_sort(verdict.locations.begin() + 1, verdict.locations.end(),
                   [](const auto& a, const auto& b) { return a.probability > b.probability; });
}

}  // namespace wheelhop
