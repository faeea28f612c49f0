#include "core/gap/which/hypothesis.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "core/gap/which/scored_fit.hpp"

namespace wheelhop {
namespace {

// Steps back to the plant as delivered from one that does not follow all records, at most, and what each leaves.
constexpr int kReturns = 8;
constexpr double kStepBack = 0.8;
constexpr double kLeastTold = 1e-3;  // 1 - S_ii of a parameter that its prior alone tells

// Judgements, on the way from a plant far from its records: fits at most, and the largest share of the dispersion that
// one fit expects of that which the fit before expected.
constexpr int kGraduations = 9;
constexpr double kGraduation = 0.1;

/// A fit whose parameters ran to their ends, anew: first with residuals expected as large as the plant as delivered
/// leaves them, where the priors hold the parameters at home, then with ever smaller ones (a continuation in the
/// dispersion). What lies near the plant as delivered is found before what lies far away.
Hypothesis graduated(const Study& study, const Hypothesis& lost) {
  GapData data = study.data;
  const Study own{study.nominal, data, study.solvers, study.candidates, study.tolerances, study.iterations};
  const double least = lost.fit.dispersion;
  Hypothesis out;
  out.parameters = lost.parameters;
  out.start = lost.start;
  FitOptions options = {.linearise = false, .alone = true};
  options.iterations = 0;
  PlantFit fit = fit_plant(out.start, out.parameters, data.fitted, study.solvers.patient, options);
  options.iterations = kPatient * study.iterations;
  double dispersion = fit.misfit;
  for (int step = 0; step < kGraduations && !fit.error.empty() && dispersion > least; ++step) {
    disperse(data, dispersion);
    const PlantFit states = states_of(fit);
    options.from = &states;
    options.theta = fit.theta;
    fit = fit_plant(out.start, out.parameters, data.fitted, study.solvers.patient, options);
    dispersion = std::min(kGraduation * dispersion, fit.misfit);
  }
  if (fit.error.empty()) return out;
  disperse(data, least);
  const PlantFit states = states_of(fit);
  complete(own, study.solvers.patient,
           {.iterations = kPatient * study.iterations, .from = &states, .theta = fit.theta, .alone = true},
           {.iterations = study.iterations, .linearise = false}, out);
  return out;
}

}  // namespace

bool same_forms(const std::vector<EffectCandidate>& a, const std::vector<EffectCandidate>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), same_form);
}

bool far_off(const Hypothesis& hypothesis) {
  const std::vector<double>& nrmse = hypothesis.stage.nrmse;
  return std::any_of(nrmse.begin(), nrmse.end(), [](double own) { return own > kFarOff; });
}

bool stopped(const PlantFit& fit, Index count) {
  return count > 0 && fit.theta.head(count).cwiseAbs().maxCoeff() > kAtEnd;
}

Hypothesis fit_hypothesis(const Study& study, const Plant& plant, std::vector<FitParameter> parameters) {
  Hypothesis hypothesis;
  hypothesis.parameters = std::move(parameters);
  hypothesis.start = plant;
  FitOptions fitted = {.iterations = kPatient * study.iterations, .alone = true};
  bool done =
      complete(study, study.solvers.patient, fitted, {.iterations = study.iterations, .linearise = false}, hypothesis);
  // Bent around a wrong drive a plant may lie where it follows the fitted records alone, or these just so: nearer to
  // the plant as delivered, which follows all.
  fitted.iterations = 0;
  for (int step = 0; step < kReturns && !done && hypothesis.fit.theta.size() > 0; ++step) {
    fitted.theta = kStepBack * hypothesis.fit.theta;
    done = complete(study, study.solvers.patient, fitted, {.iterations = study.iterations, .linearise = false},
                    hypothesis);
  }
  if (done && far_off(hypothesis) && stopped(hypothesis.fit, hypothesis.fit.theta.size())) {
    Hypothesis other = graduated(study, hypothesis);
    if (other.chi2 < hypothesis.chi2) return other;
  }
  return hypothesis;
}

namespace {

/// Where the solution of a linearised fit goes to once some priors are gone: one after the other,
///   theta + S e_i theta_i / (1 - S_ii),
/// S the covariance with the prior of theta_i. A search along what the records hardly tell would take many steps.
Vector without_priors(const Hypothesis& base, const std::vector<FitParameter>& parameters) {
  Vector theta = base.fit.theta;
  const Matrix& S = base.fit.covariance;
  if (S.rows() < theta.size()) return theta;
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const auto i = static_cast<Index>(k);
    if (parameters[k].prior_std > 0 || !(base.parameters[k].prior_std > 0)) continue;
    theta += S.col(i).head(theta.size()) * theta(i) / std::max(1 - S(i, i), kLeastTold);
  }
  for (std::size_t k = 0; k < parameters.size(); ++k)
    if (parameters[k].prior_std > 0)
      theta(static_cast<Index>(k)) = std::clamp(theta(static_cast<Index>(k)), -kFarthest, kFarthest);
  return theta;
}

}  // namespace

Hypothesis fit_from(const Study& study, const Hypothesis& base, std::vector<FitParameter> parameters) {
  Hypothesis hypothesis;
  hypothesis.parameters = std::move(parameters);
  hypothesis.start = base.start;
  Hypothesis priced = base;  // with the priors that are left
  priced.parameters = hypothesis.parameters;
  Vector theta = without_priors(base, hypothesis.parameters);
  if (!(cost_of_start(study, priced, base.start, theta) < cost_of_start(study, priced, base.start, base.fit.theta)))
    theta = base.fit.theta;
  complete(study, study.solvers.patient, {kPatient * study.iterations, &base.fit, false, theta},
           {study.iterations, &base.held_out, false}, hypothesis);
  return hypothesis;
}

SizedEffect sized_effect(const Hypothesis& of, std::size_t number) {
  std::size_t first = of.parameters.size();
  for (std::size_t i = number; i < of.effects.size(); ++i) first -= of.effects[i].parameters.size();
  SizedEffect sized{of.effects[number], {}};
  for (std::size_t j = first; j < first + sized.effect.parameters.size(); ++j)
    sized.values.push_back(get_parameter(of.fit.plant, of.parameters[j].name));
  return sized;
}

Hypothesis fit_subset(const Study& study, const Hypothesis& none, const Hypothesis& all, std::size_t members) {
  std::vector<SizedEffect> wanted;
  for (std::size_t i = 0; i < all.effects.size(); ++i)
    if (members >> i & 1) wanted.push_back(sized_effect(all, i));
  return fit_set(study, none, wanted, all);
}

Hypothesis fit_set(const Study& study, const Hypothesis& none, const std::vector<SizedEffect>& effects,
                   const Hypothesis& near) {
  Hypothesis subset;
  subset.parameters = none.parameters;
  std::vector<double> values;  // where the fit begins
  for (const FitParameter& parameter : none.parameters) values.push_back(get_parameter(near.fit.plant, parameter.name));
  Plant plant = none.fit.plant;
  for (const auto& [wanted, sizes] : effects) {
    std::optional<EffectCandidate> effect = in_plant(wanted, plant);
    if (!effect) return {};
    values.insert(values.end(), sizes.begin(), sizes.end());
    for (std::size_t k = 0; k < sizes.size(); ++k)
      if (FitParameter& own = effect->parameters[k]; own.lowered) own.least = std::min(own.least, sizes[k]);
    subset.parameters.insert(subset.parameters.end(), effect->parameters.begin(), effect->parameters.end());
    plant = effect->plant;
    subset.effects.push_back(std::move(*effect));
  }
  // Tolerances count from the plant as delivered.
  for (const FitParameter& parameter : none.parameters)
    set_parameter(plant, parameter.name, get_parameter(none.start, parameter.name));
  subset.start = std::move(plant);
  Vector theta(static_cast<Index>(values.size()));
  for (std::size_t k = 0; k < values.size(); ++k) {
    const FitParameter& parameter = subset.parameters[k];
    theta(static_cast<Index>(k)) = (values[k] - get_parameter(subset.start, parameter.name)) / parameter.scale;
  }
  // The other effects may have bent the plant: it is fitted from how it was delivered as well.
  Vector at_home = theta;
  at_home.head(static_cast<Index>(study.tolerances.size())).setZero();
  const PlantFit fitted = states_of(near.fit), held_out = states_of(near.held_out);
  std::array<Hypothesis, 2> tries = {subset, subset};
  tbb::parallel_for(std::size_t{0}, tries.size(), [&](std::size_t k) {
    complete(study, study.solvers.thorough, {study.iterations, &fitted, false, k == 0 ? theta : at_home},
             {study.iterations, &held_out, false}, tries[k]);
  });
  return std::move(tries[1].chi2 < tries[0].chi2 ? tries[1] : tries[0]);
}

}  // namespace wheelhop
