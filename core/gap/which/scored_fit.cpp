#include "core/gap/which/scored_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/greybox/force_scale.hpp"
#include "core/plant/dataset.hpp"

namespace wheelhop {
namespace {

// Judgements. What a fit does not know of its parameters may be the reason for a worse fit of the held-out records
// where their misfit is this many times that of the fitted ones, and more by this many standard errors of chi2.
constexpr double kWorseHeldOut = 1.5;
constexpr double kWorseByChance = 5;
// A judgement: the fit of all records begins at the solution of some of them, and needs few iterations.
constexpr Index kJointIterations = 6;
// A judgement: fall of the priors' chi2 from which a fit goes on from another scale of all forces.
constexpr double kWorthHome = 4;

/// True where the held-out records fit so much worse than the fitted ones that what the fit does not know of its
/// parameters may be the reason.
bool fits_worse_held_out(const Study& study, const Hypothesis& hypothesis) {
  const double count = static_cast<double>(hypothesis.held_out.residual.size());
  const double misfit = hypothesis.held_out.misfit, fitted = std::max(hypothesis.fit.misfit, 1.0);
  return study.data.apart && !hypothesis.parameters.empty() && misfit > kWorseHeldOut * fitted &&
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

/// chi2 as `complete` tells, where the held-out records fit so much worse that it matters.
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

/// Misfit of each record of a fit.
std::vector<double> misfits_of(const PlantFit& fit, const std::vector<FitRecord>& records) {
  std::vector<double> list;
  for (std::size_t i = 0; i < fit.error.size(); ++i) {
    const Matrix r = records[i].weight_std.cwiseInverse().asDiagonal() *
                     fit.error[i].rightCols(fit.error[i].cols() - records[i].skip);
    list.push_back(r.squaredNorm() / static_cast<double>(r.size()));
  }
  return list;
}

/// Rest in equilibrium, of each record.
std::vector<InitialState> at_rest(const PlantFit& fit) {
  const Index states = fit.state_scale.size();
  std::vector<InitialState> list;
  for (std::size_t i = 0; i < fit.initial_states.size(); ++i)
    list.emplace_back(
        Vector(fit.states_at_rest.segment(states * static_cast<Index>(i), states).cwiseProduct(fit.state_scale)));
  return list;
}

/// Of records that leave more than `most` and begin where another one ends, the state in which the plant arrives there;
/// of the others what the fit found. None where no record is such a one. In the play of a joint nothing leads a fit of
/// an initial state back from the wrong side.
std::vector<InitialState> continued(const PlantFit& fit, const std::vector<FitRecord>& records, double most) {
  const std::vector<double> misfits = misfits_of(fit, records);
  std::vector<InitialState> list = fit.initial_states;
  bool found = false;
  for (std::size_t i = 1; i < misfits.size(); ++i) {
    if (!records[i].continues || !(misfits[i] > most)) continue;
    const FitRecord& earlier = records[i - 1];
    const Simulation before = simulate_measured(fit.plant, earlier.drive, run_options(fit.plant, earlier, list[i - 1]));
    if (before.status != Status::ok) continue;
    const Index n = fit.plant.mass_count();
    const double step_s = static_cast<double>(earlier.ratio) / fit.plant.hold_hz();
    Vector motion = before.states.rightCols(1).col(0).head(2 * n);
    motion.head(n) += step_s * motion.tail(n);  // one sample further
    list[i] = InitialState(std::move(motion));
    found = true;
  }
  if (!found) list.clear();
  return list;
}

/// Fits the initial states of the held-out records once more from others, which stay where they leave less. Nothing to
/// do for none. @param options of the fit of the held-out records
void try_states(const Study& study, const Solver& solver, FitOptions options, std::vector<InitialState> states,
                Hypothesis& hypothesis) {
  if (states.empty()) return;
  PlantFit from = states_of(hypothesis.held_out);
  from.initial_states = std::move(states);
  options.from = &from;
  PlantFit other = fit_plant(hypothesis.fit.plant, {}, study.data.held_out, solver, options);
  if (!other.error.empty() && other.misfit < hypothesis.held_out.misfit) hypothesis.held_out = std::move(other);
}

}  // namespace

namespace {

/// Fits on from where a common factor of all forces, which motion does not tell, is most probable, if that is worth it.
void bring_forces_home(const Study& study, const Solver& solver, const FitOptions& fitted, Hypothesis& hypothesis) {
  PlantFit& fit = hypothesis.fit;
  const Vector home = with_force_scale_at_home(fit.plant, hypothesis.start, hypothesis.parameters, fit.theta);
  const auto prior = [&](const Vector& theta) {
    return theta.cwiseAbs2().dot(fit.precision.head(theta.size())) / fit.dispersion;
  };
  if (!(prior(fit.theta) - prior(home) > kWorthHome)) return;
  const PlantFit states = states_of(fit);
  FitOptions on = fitted;
  on.from = &states;
  on.theta = home;
  PlantFit other = fit_plant(hypothesis.start, hypothesis.parameters, study.data.fitted, solver, on);
  if (!other.error.empty() && other.solution.cost < fit.solution.cost) fit = std::move(other);
}

}  // namespace

bool fit_quickly(const Study& study, const Solver& solver, const FitOptions& fitted, const FitOptions& held_out,
                 Hypothesis& hypothesis) {
  PlantFit& fit = hypothesis.fit;
  PlantFit& apart = hypothesis.held_out;
  fit = fit_plant(hypothesis.start, hypothesis.parameters, study.data.fitted, solver, fitted);
  if (fit.error.empty()) return false;
  bring_forces_home(study, solver, fitted, hypothesis);
  apart = fit_plant(fit.plant, {}, study.data.held_out, solver, held_out);
  // Where another plant began may lie too far away: from rest once more, and from where the plant arrives.
  const double most = kWorseHeldOut * std::max(fit.misfit, 1.0);
  if (held_out.from != nullptr && !apart.error.empty() && apart.misfit > most)
    try_states(study, solver, held_out, at_rest(apart), hypothesis);
  if (!apart.error.empty() && apart.misfit > most)
    try_states(study, solver, held_out, continued(apart, study.data.held_out, most), hypothesis);
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

bool complete(const Study& study, const Solver& solver, const FitOptions& fitted, const FitOptions& held_out,
              Hypothesis& hypothesis) {
  if (!fit_quickly(study, solver, fitted, held_out, hypothesis)) return false;
  weigh_held_out(study, hypothesis);
  return true;
}

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

PlantFit states_of(const PlantFit& fit) {
  PlantFit states;
  states.state_scale = fit.state_scale;
  states.states_at_rest = fit.states_at_rest;
  states.initial_states = fit.initial_states;
  return states;
}

}  // namespace wheelhop
