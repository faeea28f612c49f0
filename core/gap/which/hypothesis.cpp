#include "core/gap/which/hypothesis.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

namespace wheelhop {
namespace {

// Far from the plant as delivered a fit of all parameters first loses itself in what the data hardly tell.
constexpr Index kPatient = 4;
// Steps back to the plant as delivered from one that does not follow all records, at most, and what each leaves.
constexpr int kReturns = 8;
constexpr double kStepBack = 0.8;
constexpr double kLeastTold = 1e-3;  // 1 - S_ii of a parameter that its prior alone tells
constexpr Index kQuickIterations = 8;
constexpr double kNear = 0.15;  // of the fall of chi2, by which a quick fit may lie behind the best and be fitted on

// Judgements, on the way from a plant far from its records: fits at most, and the largest share of the dispersion that
// one fit expects of that which the fit before expected.
constexpr int kGraduations = 9;
constexpr double kGraduation = 0.1;
// A judgement: a finer form is fitted further as long as chi2 falls below this share of what it was.
constexpr double kGoesOn = 0.9;

constexpr double kWorse = 1.5;         // held-out misfit over the fitted one, from which parameters may be the reason,
constexpr double kWorseByChance = 5;   // if it is by so many standard errors of chi2
constexpr Index kJointIterations = 6;  // the fit of all records begins at that of some

/// True where the held-out records fit so much worse than the fitted ones that what the fit does not know of its
/// parameters may be the reason.
bool fits_worse_held_out(const Study& study, const Hypothesis& hypothesis) {
  const double count = static_cast<double>(hypothesis.held_out.residual.size());
  const double misfit = hypothesis.held_out.misfit, fitted = std::max(hypothesis.fit.misfit, 1.0);
  return study.data.apart && !hypothesis.parameters.empty() && misfit > kWorse * fitted &&
         (misfit - fitted) * count > kWorseByChance * std::sqrt(2 * count) * fitted;
}

/// All records of a study as one fit begins them: the states of both fits, in the scale of the first.
PlantFit states_of_both(const PlantFit& fit, const PlantFit& held_out) {
  PlantFit both;
  both.state_scale = fit.state_scale;
  both.initial_states = fit.initial_states;
  both.initial_states.insert(both.initial_states.end(), held_out.initial_states.begin(), held_out.initial_states.end());
  const auto records = static_cast<Index>(held_out.initial_states.size());
  both.states_at_rest.resize(fit.states_at_rest.size() + held_out.states_at_rest.size());
  both.states_at_rest << fit.states_at_rest,
      held_out.states_at_rest.cwiseProduct(held_out.state_scale.replicate(records, 1))
          .cwiseQuotient(fit.state_scale.replicate(records, 1));
  return both;
}

/// Sum of the squared priors of the parameters.
double prior_chi2_of(const PlantFit& fit) {
  return fit.theta.cwiseAbs2().dot(fit.precision.head(fit.theta.size())) / fit.dispersion;
}

/// chi2 of the held-out records given the fitted ones is that of all records at the parameters which fit all best, less
/// that of the fitted ones: sum r' (I + J S J')^-1 r for a linear plant, S the covariance of the parameters. A record
/// that reaches further than the fitted ones tells parameters which these did not, and cannot refute them.
void weigh_held_out(const Study& study, Hypothesis& hypothesis) {
  if (!fits_worse_held_out(study, hypothesis)) return;
  std::vector<FitRecord> all = study.data.fitted;
  all.insert(all.end(), study.data.held_out.begin(), study.data.held_out.end());
  const PlantFit states = states_of_both(hypothesis.fit, hypothesis.held_out);
  const PlantFit joint = fit_plant(hypothesis.start, hypothesis.parameters, all, study.solvers.thorough,
                                   {kJointIterations, &states, false, hypothesis.fit.theta});
  if (joint.error.empty()) return;
  const double prior = prior_chi2_of(joint);
  const double chi2 = joint.residual.squaredNorm() + prior;
  if (!(chi2 < hypothesis.chi2)) return;
  hypothesis.chi2 = chi2;
  hypothesis.prior_chi2 = prior;
}

/// Fits from `hypothesis.start` and scores; false where a simulation failed, of the held-out records as well.
bool fit_quickly(const Study& study, const Solver& solver, const FitOptions& fitted, const FitOptions& held_out,
                 Hypothesis& hypothesis) {
  hypothesis.fit = fit_plant(hypothesis.start, hypothesis.parameters, study.data.fitted, solver, fitted);
  if (hypothesis.fit.error.empty()) return false;
  hypothesis.held_out = fit_plant(hypothesis.fit.plant, {}, study.data.held_out, solver, held_out);
  // Where another plant began may lie too far away: from rest once more.
  if (held_out.from != nullptr && hypothesis.held_out.misfit > kWorse * std::max(hypothesis.fit.misfit, 1.0)) {
    PlantFit rest;
    rest.state_scale = held_out.from->state_scale;
    rest.states_at_rest = held_out.from->states_at_rest;
    const Index states = rest.state_scale.size();
    for (std::size_t i = 0; i < held_out.from->initial_states.size(); ++i)
      rest.initial_states.push_back(
          Vector(rest.states_at_rest.segment(states * static_cast<Index>(i), states).cwiseProduct(rest.state_scale)));
    FitOptions at_rest = held_out;
    at_rest.from = &rest;
    PlantFit other = fit_plant(hypothesis.fit.plant, {}, study.data.held_out, solver, at_rest);
    if (!other.error.empty() && other.misfit < hypothesis.held_out.misfit) hypothesis.held_out = std::move(other);
  }
  if (hypothesis.held_out.error.empty() || !std::isfinite(hypothesis.held_out.misfit)) {
    hypothesis.stage = {};
    hypothesis.stage.misfit = hypothesis.chi2 = std::numeric_limits<double>::infinity();
    hypothesis.fit.error.clear();
    return false;
  }
  hypothesis.stage = stage_of(study.data, hypothesis.held_out);
  hypothesis.prior_chi2 = prior_chi2_of(hypothesis.fit);
  hypothesis.chi2 = hypothesis.fit.residual.squaredNorm() + hypothesis.prior_chi2;
  if (study.data.apart) hypothesis.chi2 += hypothesis.held_out.residual.squaredNorm();
  return true;
}

/// The same for a fit that stays: its held-out records are weighed with what it does not know of its parameters.
bool complete(const Study& study, const Solver& solver, const FitOptions& fitted, const FitOptions& held_out,
              Hypothesis& hypothesis) {
  if (!fit_quickly(study, solver, fitted, held_out, hypothesis)) return false;
  weigh_held_out(study, hypothesis);
  return true;
}

/// Sum of r^2 and of the squared priors where a fit would start; infinite where the plant does not follow.
double cost_of_start(const Study& study, const Hypothesis& base, const Plant& start, const Vector& theta) {
  Plant plant = start;
  double sum = 0;
  for (std::size_t i = 0; i < base.parameters.size(); ++i) {
    const FitParameter& parameter = base.parameters[i];
    const double deviation = theta(static_cast<Index>(i));
    set_parameter(plant, parameter.name, get_parameter(start, parameter.name) + deviation * parameter.scale);
    if (parameter.prior_std > 0) sum += base.fit.dispersion * std::pow(deviation / parameter.prior_std, 2);
  }
  Vector residual;
  if (!plant_residual(plant, study.data.fitted, base.fit.initial_states, residual))
    return std::numeric_limits<double>::infinity();
  return sum + residual.squaredNorm();
}

/// Where the records of a fit begin, and nothing else of it: another plant may start from there.
PlantFit states_of(const PlantFit& fit) {
  PlantFit states;
  states.state_scale = fit.state_scale;
  states.states_at_rest = fit.states_at_rest;
  states.initial_states = fit.initial_states;
  return states;
}

/// The parameters of a base and of a candidate, which then count from where the base's do: tolerances from the plant
/// as delivered.
std::vector<FitParameter> with_own(const Hypothesis& base, EffectCandidate& candidate) {
  for (const FitParameter& parameter : base.parameters)
    set_parameter(candidate.plant, parameter.name, get_parameter(base.start, parameter.name));
  std::vector<FitParameter> all = base.parameters;
  all.insert(all.end(), candidate.parameters.begin(), candidate.parameters.end());
  return all;
}

/// One quick fit with the new strength as screened.
bool fit_candidate(const Study& study, const Hypothesis& base, EffectCandidate candidate, const Screened& screened,
                   Hypothesis& out) {
  out.effects = base.effects;
  out.parameters = with_own(base, candidate);
  double factor = 1;
  if (candidate.proportional && !candidate.parameters.empty()) {
    const std::string& name = candidate.parameters.front().name;
    const double typical = get_parameter(candidate.plant, name) - candidate.ideal;
    factor = std::copysign(std::clamp(std::abs(screened.strength), 0.05, 10.0), screened.strength);
    set_parameter(candidate.plant, name, candidate.ideal + factor * typical);
  }
  out.start = candidate.plant;
  // Where a missing effect has bent the plant far, the way back leads past the plant as delivered; where it is small,
  // the linear step from the re-tuned plant is nearly the solution.
  const Index known = base.fit.theta.size();
  Vector delivered = base.fit.theta, stepped = base.fit.theta;
  if (screened.retuning.size() == known) stepped += factor * screened.retuning;
  delivered.head(static_cast<Index>(study.tolerances.size())).setZero();
  Hypothesis from;  // as the base, or with initial states that are known better
  const Hypothesis* begin = &base;
  if (!screened.initial_states.empty()) {
    from.parameters = base.parameters;
    from.fit = states_of(base.fit);
    from.fit.dispersion = base.fit.dispersion;
    std::copy(screened.initial_states.begin(), screened.initial_states.end(), from.fit.initial_states.begin());
    begin = &from;
  }
  const bool step =
      cost_of_start(study, *begin, out.start, stepped) < cost_of_start(study, *begin, out.start, delivered);
  const auto fit_with = [&](const Vector& first, Hypothesis& fitted) {
    Vector theta = Vector::Zero(static_cast<Index>(fitted.parameters.size()));
    theta.head(known) = first;
    return fit_quickly(study, study.solvers.quick, {kQuickIterations, &begin->fit, false, theta},
                       {kQuickIterations, &base.held_out, false}, fitted);
  };
  Hypothesis other = out;
  bool fitted = fit_with(step ? stepped : delivered, out);
  // A fit whose parameters ran to their end has lost its way: once more, from the other side.
  const auto count = static_cast<Index>(study.tolerances.size());
  if ((!fitted || (stopped(out.fit, count) && !stopped(base.fit, count))) &&
      fit_with(step ? delivered : stepped, other) && (!fitted || other.chi2 < out.chi2)) {
    out = std::move(other);
    fitted = true;
  }
  if (!fitted) return false;
  out.effects.push_back(std::move(candidate));
  return true;
}

bool by_chi2(const Hypothesis& a, const Hypothesis& b) { return a.chi2 < b.chi2; }

/// Sorts a list by chi2, and keeps the best fit of each form.
void keep_best(std::vector<Hypothesis>& list) {
  std::stable_sort(list.begin(), list.end(), by_chi2);
  std::vector<Hypothesis> kept;
  for (Hypothesis& own : list)
    if (std::none_of(kept.begin(), kept.end(), [&](const Hypothesis& better) { return same_forms(better, own); }))
      kept.push_back(std::move(own));
  list = std::move(kept);
}

/// True of an element or mass that an effect has put into a plant, and of such a mass's guide: no place of the user's.
/// The guide of one of the user's masses is, whoever put an element there.
bool added(const Plant& nominal, const Plant& plant, const std::string& location) {
  const auto named = [&](const auto& part) { return part.name == location || kGuide + part.name == location; };
  return std::any_of(plant.elements.begin() + static_cast<std::ptrdiff_t>(nominal.elements.size()),
                     plant.elements.end(), named) ||
         std::any_of(plant.masses.begin() + static_cast<std::ptrdiff_t>(nominal.masses.size()), plant.masses.end(),
                     named);
}

/// True if a hypothesis has the effect already, or moves one of its parameters.
bool moved_by(const Hypothesis& base, const EffectCandidate& candidate) {
  std::vector<EffectCandidate> with = base.effects;
  with.push_back(candidate);
  return labellings(with).empty() ||
         std::any_of(candidate.parameters.begin(), candidate.parameters.end(), [&](const FitParameter& own) {
           return std::any_of(base.parameters.begin(), base.parameters.end(),
                              [&](const FitParameter& other) { return other.name == own.name; });
         });
}

/// A quick fit is fitted on to the end, and replaced if that is better.
void polish(const Study& study, Hypothesis& hypothesis) {
  if (hypothesis.effects.back().parameters.empty()) return;  // nothing was fitted beyond what it was added to
  if (!linearise(hypothesis.fit, hypothesis.parameters, study.data.fitted)) return;
  Hypothesis longer = hypothesis;
  if (!complete(study, study.solvers.thorough, {study.iterations, &hypothesis.fit, false, hypothesis.fit.theta},
                {study.iterations, &hypothesis.held_out, false}, longer) ||
      longer.chi2 >= hypothesis.chi2)
    return;
  hypothesis = std::move(longer);
}

/// A form fitted from the solution of the one that it refines, and from the form's own typical sizes, with the plant as
/// delivered and with the plant re-tuned around them: the best of these.
Hypothesis refined(const Study& study, const Hypothesis& base, const Hypothesis& coarse, EffectCandidate candidate) {
  Hypothesis out;
  out.effects = base.effects;
  out.parameters = with_own(base, candidate);
  out.start = candidate.plant;
  const Index known = base.fit.theta.size(), own = static_cast<Index>(out.parameters.size()) - known;
  Vector solved = Vector::Zero(known + own), typical = solved;
  solved.head(known) = coarse.fit.theta.head(known);
  for (Index i = known; i < known + own; ++i) {
    const FitParameter& parameter = out.parameters[static_cast<std::size_t>(i)];
    solved(i) =
        (get_parameter(coarse.fit.plant, parameter.name) - get_parameter(out.start, parameter.name)) / parameter.scale;
  }
  typical.head(known) = base.fit.theta;
  typical.head(static_cast<Index>(study.tolerances.size())).setZero();
  const PlantFit fitted = states_of(coarse.fit), held_out = states_of(coarse.held_out);
  const auto options = [&](const Vector& theta) { return FitOptions{study.iterations, &fitted, false, theta}; };
  std::array<Hypothesis, 3> tries = {out, out, out};
  tbb::parallel_for(std::size_t{0}, tries.size(), [&](std::size_t k) {
    Vector start = k == 0 ? solved : typical;
    if (k == 2) {
      const PlantFit around =
          fit_plant(out.start, base.parameters, study.data.fitted, study.solvers.patient, options(typical.head(known)));
      if (around.error.empty()) return;
      start.head(known) = around.theta;
    }
    complete(study, study.solvers.patient, options(start), {study.iterations, &held_out, false}, tries[k]);
  });
  for (const Hypothesis& one : tries)
    if (one.chi2 < out.chi2) out = one;
  // Yielding turns slopes around, and a fit stops early: it goes on as long as that pays.
  for (double before = coarse.chi2; out.chi2 < kGoesOn * before;) {
    before = out.chi2;
    Hypothesis longer = out;
    const PlantFit states = states_of(out.fit), others = states_of(out.held_out);
    complete(study, study.solvers.patient, {kPatient * study.iterations, &states, false, out.fit.theta},
             {study.iterations, &others, false}, longer);
    if (longer.chi2 < out.chi2) out = std::move(longer);
  }
  out.effects.push_back(std::move(candidate));
  return out;
}

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

bool same_forms(const Hypothesis& a, const Hypothesis& b) {
  return std::equal(a.effects.begin(), a.effects.end(), b.effects.begin(), b.effects.end(), same_form);
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
    Operation operation;
    if (!operation_of(plant, study.data.fitted, none.fit.initial_states, operation)) return {};
    // Anew, because its parameters may have other names in a plant without the effects before it.
    std::optional<EffectCandidate> found;
    for (EffectCandidate& candidate : study.candidates(plant, operation))
      if (!found && same_form(candidate, wanted)) found = std::move(candidate);
    if (!found || found->parameters.size() != wanted.parameters.size()) return {};
    values.insert(values.end(), sizes.begin(), sizes.end());
    subset.parameters.insert(subset.parameters.end(), found->parameters.begin(), found->parameters.end());
    subset.effects.push_back(*found);
    plant = found->plant;
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

std::vector<Hypothesis> extend(const Study& study, const Hypothesis& base, const ExtendOptions& options,
                               const Changes& known, Changes* found) {
  const PlantFit& around = options.around ? *options.around : base.fit;
  Operation operation;
  if (!operation_of(around.plant, study.data.fitted, around.initial_states, operation)) return {};
  const std::vector<EffectCandidate> candidates = study.candidates(around.plant, operation);
  const auto tried = [&](const EffectCandidate& candidate) {
    return options.tried && std::any_of(options.tried->begin(), options.tried->end(), [&](const Hypothesis& other) {
             return same_form(other.effects.back(), candidate);
           });
  };
  std::vector<Screened> shortlist;
  std::map<std::string, Index> forms;
  for (const Screened& screened : screen(around, study.data.fitted, candidates, known, found)) {
    if (!candidates[screened.candidate].refines.empty() || moved_by(base, candidates[screened.candidate])) continue;
    const std::string name = name_of(candidates[screened.candidate]);
    if (static_cast<Index>(shortlist.size()) >= options.shortlist || !(screened.gain > 0)) break;
    if (shortlist.empty() && 2 * screened.gain < options.least) break;
    if (!shortlist.empty() && screened.gain < options.worth * shortlist.front().gain) break;
    if (added(study.nominal, base.fit.plant, candidates[screened.candidate].location)) continue;
    if (tried(candidates[screened.candidate]) || ++forms[name] > options.forms) continue;
    shortlist.push_back(screened);
  }
  return fit_shortlist(study, base, candidates, shortlist);
}

std::vector<Hypothesis> fit_shortlist(const Study& study, const Hypothesis& base,
                                      const std::vector<EffectCandidate>& candidates,
                                      const std::vector<Screened>& shortlist) {
  std::vector<Hypothesis> fits(shortlist.size());
  std::vector<char> done(shortlist.size(), 0);
  tbb::parallel_for(std::size_t{0}, shortlist.size(), [&](std::size_t i) {
    done[i] = fit_candidate(study, base, candidates[shortlist[i].candidate], shortlist[i], fits[i]);
  });
  std::vector<Hypothesis> list;
  for (std::size_t i = 0; i < fits.size(); ++i)
    if (done[i]) list.push_back(std::move(fits[i]));
  keep_best(list);
  return list;
}

bool refine(const Study& study, const Hypothesis& base, const std::vector<std::string>& names, double share,
            std::vector<Hypothesis>& list) {
  Operation operation;
  if (list.empty() || !operation_of(base.fit.plant, study.data.fitted, base.fit.initial_states, operation))
    return false;
  const std::vector<EffectCandidate> candidates = study.candidates(base.fit.plant, operation);
  const auto wanted = [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  std::vector<Hypothesis> better;
  for (Hypothesis& coarse : list) {
    EffectCandidate& known = coarse.effects.back();
    std::vector<Label> kept;
    for (const Label& label : known.labels) {
      Hypothesis best;
      for (const EffectCandidate& candidate : candidates) {
        const std::string name = name_of(candidate);
        if (!wanted(name) || name != name_of(known, label) || candidate.refines != label.form) continue;
        Hypothesis finer = refined(study, base, coarse, candidate);
        if (!finer.fit.error.empty() && finer.chi2 < best.chi2) best = std::move(finer);
      }
      if (coarse.chi2 - best.chi2 > share * (coarse.chi2 - study.data.samples))
        better.push_back(std::move(best));
      else
        kept.push_back(label);
    }
    known.labels = std::move(kept);
  }
  if (better.empty()) return false;
  std::erase_if(list, [](const Hypothesis& coarse) { return coarse.effects.back().labels.empty(); });
  std::move(better.begin(), better.end(), std::back_inserter(list));
  std::stable_sort(list.begin(), list.end(), by_chi2);
  return true;
}

void finish(const Study& study, double before, std::size_t most, std::vector<Hypothesis>& list) {
  std::size_t worth = 0;
  while (worth < std::min(list.size(), most) &&
         !(list[worth].chi2 - list[0].chi2 > std::max(kNear * (before - list[0].chi2), kQuickDecrease * list[0].chi2)))
    ++worth;
  tbb::parallel_for(std::size_t{0}, worth, [&](std::size_t k) { polish(study, list[k]); });
  keep_best(list);
}

}  // namespace wheelhop
