#include "core/gap/verdict/verdict.hpp"

#include <algorithm>

namespace wheelhop {

bool is_parameter_error(const EffectId& effect) {
  return effect == "mass_error" || effect == "stiffness_error" || effect == "damping_error";
}

const CandidateEvidence& candidate_of(const Evidence& evidence, const Effects& effects) {
  const auto& list = effects.count == 1 ? evidence.singles : effects.count == 2 ? evidence.pairs : evidence.larger;
  return list[effects.candidate];
}

GapStage corrected_stage(const Evidence& evidence, const Verdict& verdict) {
  if (const auto* effects = std::get_if<Effects>(&verdict.answer)) {
    const CandidateEvidence& candidate = candidate_of(evidence, *effects);
    return effects->parameter ? candidate.freed[*effects->parameter].stage : candidate.stage;
  }
  if (const auto* parameters = std::get_if<Parameters>(&verdict.answer)) return evidence.freed[parameters->freed].stage;
  return evidence.retuned;
}

Closure closure_of(const Evidence& evidence, const Verdict& verdict) {
  if (is<Instruments>(verdict)) return evidence.correction.closure;
  if (!evidence.correction.faults.empty() && (is<Effects>(verdict) || is<Parameters>(verdict)))
    return evidence.correction.closure_with_answer;
  if (const auto* effects = std::get_if<Effects>(&verdict.answer)) {
    const CandidateEvidence& candidate = candidate_of(evidence, *effects);
    return effects->parameter ? candidate.freed[*effects->parameter].closure_of_retuned : candidate.closure;
  }
  if (const auto* parameters = std::get_if<Parameters>(&verdict.answer))
    return evidence.freed[parameters->freed].closure_of_delivered;
  return kNothingAdded;
}

const GapStage& retuned_of(const Evidence& evidence) {
  return evidence.correction.faults.empty() ? evidence.retuned : evidence.correction.retuned_without;
}

double closure_of_retuning(const Evidence& evidence) {
  const GapStage& retuned = retuned_of(evidence);
  return evidence.delivered.misfit > 1 ? 1 - (retuned.misfit - 1) / (evidence.delivered.misfit - 1) : kUnknown;
}

const ToleranceEvidence* most_retuned(const Evidence& evidence) {
  const auto most = std::max_element(evidence.tolerances.begin(), evidence.tolerances.end(),
                                     [](const auto& a, const auto& b) { return a.influence < b.influence; });
  return most == evidence.tolerances.end() ? nullptr : &*most;
}

std::string outcome_of(const Verdict& verdict) {
  struct Words {
    const Verdict& verdict;
    std::string operator()(const NoGap&) const { return "none"; }
    std::string operator()(const Parameters& parameters) const {
      if (parameters.either) return "ambiguous";
      if (verdict.named.size() > 1) return "several";
      return is_parameter_error(verdict.suspects.front().effect) ? "parameter" : "effect";
    }
    std::string operator()(const Effects&) const {
      if (verdict.named.size() > 1) return "several";
      return verdict.ambiguous_with.empty() ? "effect" : "ambiguous";
    }
    std::string operator()(const Instruments&) const { return verdict.named.size() > 1 ? "several" : "effect"; }
    std::string operator()(const Rounding&) const { return verdict.named.size() > 1 ? "several" : "effect"; }
    std::string operator()(const AtPlace&) const { return "located_not_in_catalogue"; }
    std::string operator()(const AtTwoPlaces&) const { return "located_not_in_catalogue"; }
    std::string operator()(const Exogenous&) const { return "exogenous"; }
    std::string operator()(const Insufficient&) const { return "insufficient"; }
  };
  return std::visit(Words{verdict}, verdict.answer);
}

}  // namespace wheelhop
