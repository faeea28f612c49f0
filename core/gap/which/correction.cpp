#include "core/gap/which/correction.hpp"

#include <algorithm>
#include <cmath>

#include "core/gap/verdict/faults.hpp"

namespace wheelhop {
namespace {

// Judgements: the tolerances within which the size of a fault is known at first, and the standard deviations by which
// the records must tell the sign of a channel.
constexpr double kCoarse = 10;
constexpr double kSignTold = 4;

/// The effect of the catalogue that a fault is, in a plant that may have others already; its size that of the fault.
std::optional<EffectCandidate> candidate_of(const std::vector<EffectCandidate>& catalogue, const Plant& plant,
                                            const InstrumentFault& fault) {
  for (const EffectCandidate& own : catalogue) {
    if (own.label().effect != fault.effect || own.location != fault.location || own.parameters.empty()) continue;
    std::optional<EffectCandidate> candidate = in_plant(own, plant);
    if (candidate) set_parameter(candidate->plant, candidate->parameters.front().name, fault.value);
    return candidate;
  }
  return std::nullopt;
}

/// A study of another plant, otherwise the same.
Study study_of(const Study& study, const GapData& data, const Plant& plant) {
  return {plant, data, study.solvers, study.candidates, tolerance_parameters(plant), study.iterations};
}

bool is_turned(const InstrumentFault& fault) { return fault.effect == "gain_error" && fault.value < 0; }

/// The records, with residuals expected as large as the re-tuned plant leaves them without a correction.
GapData held_at_home(const Study& study, const Base& base) {
  GapData data = study.data;
  disperse(data,
           std::max(data.fitted.front().dispersion, dispersion_of(data, base.retuned.fit, base.retuned.held_out)));
  return data;
}

/// The plant re-tuned inside its tolerances, with sizes of faults that little but the records tells.
Hypothesis with_free_sizes(const Study& study, const Plant& plant, const std::vector<std::string>& sizes) {
  std::vector<FitParameter> parameters = study.tolerances;
  for (FitParameter& parameter : parameters)
    if (std::find(sizes.begin(), sizes.end(), parameter.name) != sizes.end()) parameter.prior_std = kCoarse;
  return fit_hypothesis(study, plant, parameters);
}

/// Readings that stood on another clock were put onto the one of the file by somebody, linearly between them as a rule.
/// At a fraction f between two of them that misses y by f (1 - f) / 2 times the second difference of y; its mean square
/// over f is the square of that difference over 120, of which noise makes 6 variances.
/// @return that mean square over the noise's, mean over samples and channels
double interpolation_error(const std::vector<FitRecord>& records) {
  double sum = 0, count = 0;
  for (const FitRecord& record : records) {
    const Index kept = record.y.cols() - record.skip;
    if (kept < 3) continue;
    const Matrix r = record.weight_std.cwiseInverse().asDiagonal() * record.y.rightCols(kept);
    const Matrix second = r.leftCols(kept - 2) - 2 * r.middleCols(1, kept - 2) + r.rightCols(kept - 2);
    sum += second.squaredNorm() / 120;
    count += static_cast<double>(second.size());
  }
  return count > 0 ? std::max(sum / count - 6.0 / 120, 0.0) : 0;
}

}  // namespace

std::vector<InstrumentFault> wrong_sign(const Study& study, const Base& base, double colour,
                                        const Thresholds& thresholds) {
  Operation operation;
  if (!operation_of(base.plant, study.data.fitted, base.delivered.fit.initial_states, operation)) return {};
  const GapData data = held_at_home(study, base);
  std::vector<InstrumentFault> best;
  double least = base.retuned.chi2;
  for (EffectCandidate& candidate : study.candidates(base.plant, operation)) {
    if (candidate.label().effect != "gain_error" || candidate.parameters.size() != 1) continue;
    const std::string& gain = candidate.parameters.front().name;
    set_parameter(candidate.plant, gain, -get_parameter(base.plant, gain));
    const Study turned = study_of(study, data, candidate.plant);
    const Hypothesis fitted = with_free_sizes(turned, candidate.plant, {gain});
    if (fitted.fit.error.empty() || !(fitted.chi2 < least)) continue;
    const auto own = std::find_if(turned.tolerances.begin(), turned.tolerances.end(),
                                  [&](const FitParameter& parameter) { return parameter.name == gain; });
    const Index i = own - turned.tolerances.begin();
    const double now = get_parameter(fitted.fit.plant, gain), told = kSignTold * std::sqrt(fitted.fit.covariance(i, i));
    const bool sure = now * get_parameter(base.plant, gain) < 0 && std::abs(now) > told * own->scale;
    if (!sure || !faults_explain(base.retuned.chi2, fitted.chi2, study.data.samples, colour, true, thresholds))
      continue;
    least = fitted.chi2;
    best = {{candidate.label().effect, candidate.location, now}};
  }
  return best;
}

std::optional<Base> corrected(const Study& study, const Base& base, const std::vector<InstrumentFault>& faults,
                              double colour, const Bootstrap& bootstrap, const Thresholds& thresholds,
                              CorrectionEvidence& evidence) {
  Operation operation;
  if (faults.empty() || !operation_of(base.plant, study.data.fitted, base.delivered.fit.initial_states, operation))
    return std::nullopt;
  Plant plant = base.plant;
  std::vector<EffectCandidate> effects;
  std::vector<std::string> sizes;
  const std::vector<EffectCandidate> catalogue = study.candidates(base.plant, operation);
  for (const InstrumentFault& fault : faults) {
    std::optional<EffectCandidate> candidate = candidate_of(catalogue, plant, fault);
    if (!candidate) return std::nullopt;
    plant = candidate->plant;
    sizes.push_back(candidate->parameters.front().name);
    effects.push_back(std::move(*candidate));
  }
  const GapData data = held_at_home(study, base);
  const Hypothesis first = with_free_sizes(study_of(study, data, plant), plant, sizes);
  const bool turned = std::any_of(faults.begin(), faults.end(), is_turned);
  if (!faults_explain(base.retuned.chi2, first.chi2, study.data.samples, colour, turned, thresholds))
    return std::nullopt;
  for (const std::string& name : sizes) set_parameter(plant, name, get_parameter(first.fit.plant, name));
  const Study fine = study_of(study, study.data, plant);
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
    evidence.faults.push_back({effect.label().effect,
                               effect.location,
                               form_of(effect.label(), with.retuned.fit.plant),
                               {{name, get_parameter(with.retuned.fit.plant, name), std}},
                               {}});
  }
  if (std::any_of(faults.begin(), faults.end(),
                  [](const InstrumentFault& fault) { return fault.effect == "clock_skew"; }))
    evidence.interpolation = interpolation_error(study.data.fitted);
  evidence.retuned_without = base.retuned.stage;
  evidence.chi2_without = base.retuned.chi2;
  evidence.closure = closure(base.retuned.stage.blocks, with.retuned.stage.blocks, bootstrap);
  evidence.closure_with_answer = evidence.closure;
  return with;
}

}  // namespace wheelhop
