/// \file
/// The verdict of a diagnosis: one answer of nine kinds, and what it rests on.
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/gap/verdict/evidence.hpp"

namespace wheelhop {

/// What the plant leaves is noise, or parameters inside their tolerances explain it.
struct NoGap {};
/// One parameter of the plant is wrong.
struct Parameters {
  std::size_t freed = 0;  ///< index into Evidence::freed
  bool either = false;    ///< or all parameters of another component instead: the records tell only ratios
};
/// Effects of the catalogue, and perhaps a parameter that is wrong beside them.
struct Effects {
  std::size_t count = 1;      ///< of the effects
  std::size_t candidate = 0;  ///< index into Evidence::singles, ::pairs or, of more than two effects, ::larger
  /// Index into CandidateEvidence::freed of the parameter that is named too; none where no parameter is.
  std::optional<std::size_t> parameter = {};
};
/// Gross faults of instruments that were corrected, and no name for what is left beside them, if anything is.
struct Instruments {};
/// A converter's rounding, which no model of the plant takes away.
struct Rounding {
  std::size_t lattice = 0;  ///< index into Evidence::lattices
};
/// Something that no catalogue holds, at one place.
struct AtPlace {};
/// Likewise, at two places at once.
struct AtTwoPlaces {};
/// A force from outside: located, but no function of the plant's states.
struct Exogenous {};
/// The records do not tell.
struct Insufficient {};

using Answer =
    std::variant<NoGap, Parameters, Effects, Instruments, Rounding, AtPlace, AtTwoPlaces, Exogenous, Insufficient>;

/// An effect or a parameter that was considered in full.
struct Suspect {
  EffectId effect;
  Place location;
  std::string form;
  double probability = 0;
  double misfit = 0;  ///< reduced chi-square, held out
  Closure closure;    ///< of what re-tuning leaves; of a parameter: of the gap as delivered
  std::vector<FittedParameter> parameters;
  EffectAt name() const { return {effect, location}; }
};

struct LocationProbability {
  Place location;
  double probability = 0;
};

struct Verdict {
  Answer answer;
  Effects largest;  ///< the largest set of effects that was grown from the next smaller one, named whole or not
  std::string row;  ///< of the decision table that gave it, as "4a"
  std::string why;  ///< that row in words
  std::string message;
  std::vector<EffectAt> named;                 ///< most sure first; of a place alone the effect is "unknown"
  std::vector<Suspect> suspects;               ///< the named ones first, then by probability
  std::vector<LocationProbability> locations;  ///< most probable first
  std::vector<EffectAt> ambiguous_with;        ///< effects that are probable enough to be told beside the answer
};

/// "none", "parameter", "effect", "several", "located_not_in_catalogue", "exogenous", "ambiguous" or "insufficient".
std::string outcome_of(const Verdict& verdict);

/// The plant with the answer on the held-out records: the re-tuned one where the answer is no plant.
GapStage corrected_stage(const Evidence& evidence, const Verdict& verdict);
/// What of the gap that re-tuning leaves the answer removes; of a parameter alone, of the gap as delivered. With
/// corrected instruments, of what re-tuning without the correction leaves. 0 and no
/// interval of an answer that is no plant: nothing missing, rounding, a place outside the catalogue.
Closure closure_of(const Evidence& evidence, const Verdict& verdict);
/// The plant re-tuned inside its tolerances, without any correction.
const GapStage& retuned_of(const Evidence& evidence);
/// 1 - (J_retuned - 1) / (J_delivered - 1) on the held-out records; NaN without a gap.
double closure_of_retuning(const Evidence& evidence);
/// The tolerance whose deviation changes the outputs most after re-tuning; null without any.
const ToleranceEvidence* most_retuned(const Evidence& evidence);
/// The candidate behind an answer of effects.
const CandidateEvidence& candidate_of(const Evidence& evidence, const Effects& effects);

template <class Kind>
bool is(const Verdict& verdict) {
  return std::holds_alternative<Kind>(verdict.answer);
}
/// True of answers that are a place without a name.
inline bool is_place(const Verdict& verdict) {
  return is<AtPlace>(verdict) || is<AtTwoPlaces>(verdict) || is<Exogenous>(verdict);
}
/// True of answers that leave a gap without a name.
inline bool is_unnamed(const Verdict& verdict) { return is_place(verdict) || is<Insufficient>(verdict); }

}  // namespace wheelhop
