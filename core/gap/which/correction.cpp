#include "core/gap/which/correction.hpp"

#include <algorithm>
#include <cmath>

#include "core/gap/verdict/faults.hpp"

namespace wheelhop {
namespace {

/// The effect of the catalogue that a fault is, in a plant that may have others already; its size that of the fault.
std::optional<EffectCandidate> candidate_of(const Study& study, const Plant& plant, const Operation& operation,
                                            const InstrumentFault& fault) {
  for (EffectCandidate& candidate : study.candidates(plant, operation)) {
    if (candidate.effect != fault.effect || candidate.location != fault.location || candidate.parameters.empty())
      continue;
    set_parameter(candidate.plant, candidate.parameters.front().name, fault.value);
    return candidate;
  }
  return std::nullopt;
}

/// A study of another plant, otherwise the same.
Study study_of(const Study& study, const Plant& plant) {
  return {plant, study.data, study.solvers, study.candidates, tolerance_parameters(plant), study.iterations};
}

}  // namespace

std::optional<Base> corrected(const Study& study, const Base& base, const std::vector<InstrumentFault>& faults,
                              double colour, const Bootstrap& bootstrap, const Thresholds& thresholds,
                              CorrectionEvidence& evidence) {
  Operation operation;
  if (faults.empty() || !operation_of(base.plant, study.data.fitted, base.delivered.fit.initial_states, operation))
    return std::nullopt;
  Plant plant = base.plant;
  std::vector<EffectCandidate> effects;
  for (const InstrumentFault& fault : faults) {
    std::optional<EffectCandidate> candidate = candidate_of(study, plant, operation, fault);
    if (!candidate) return std::nullopt;
    plant = candidate->plant;
    effects.push_back(std::move(*candidate));
  }
  const Study coarse = study_of(study, plant);
  const Hypothesis first = fit_hypothesis(coarse, plant, coarse.tolerances);
  if (!faults_explain(base.retuned.chi2, first.chi2, study.data.samples, colour, thresholds)) return std::nullopt;
  for (const EffectCandidate& effect : effects) {
    const std::string& name = effect.parameters.front().name;
    set_parameter(plant, name, get_parameter(first.fit.plant, name));
  }
  const Study fine = study_of(study, plant);
  Base with{plant, fit_hypothesis(fine, plant, {}), fit_hypothesis(fine, plant, fine.tolerances)};
  if (with.delivered.stage.blocks.size() == 0 || with.retuned.stage.blocks.size() == 0) return std::nullopt;
  for (const EffectCandidate& effect : effects) {
    const std::string& name = effect.parameters.front().name;
    const auto own = std::find_if(fine.tolerances.begin(), fine.tolerances.end(),
                                  [&](const FitParameter& parameter) { return parameter.name == name; });
    const Index i = own - fine.tolerances.begin();
    const Matrix& covariance = with.retuned.fit.covariance;
    const double std =
        own != fine.tolerances.end() && i < covariance.rows() ? std::sqrt(covariance(i, i)) * own->scale : 0;
    evidence.faults.push_back(
        {effect.effect, effect.location, effect.form, {{name, get_parameter(with.retuned.fit.plant, name), std}}, {}});
  }
  evidence.retuned_without = base.retuned.stage;
  evidence.chi2_without = base.retuned.chi2;
  evidence.closure = closure(base.retuned.stage.blocks, with.retuned.stage.blocks, bootstrap);
  evidence.closure_with_answer = evidence.closure;
  return with;
}

}  // namespace wheelhop
