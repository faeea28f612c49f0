#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/gap/verdict/posterior.hpp"
#include "core/gap/where/probe.hpp"
#include "core/gap/which/force_screen.hpp"
#include "core/gap/which/search.hpp"
#include "core/plant/rotary.hpp"

namespace wheelhop {
namespace {

/// What the screen must expect of the best candidate for any to be fitted, in chi-square.
double least_expected(const Search& search, double colour) {
  return search.effort.screened * search.thresholds.notice * colour;
}

std::vector<double> leading(const Vector& values, std::size_t count) {
  return {values.data(), values.data() + std::min<Index>(static_cast<Index>(count), values.size())};
}

/// Leave-prior-out z of the tolerances; empty where the fit is not linearised.
std::vector<double> z_of(const PlantFit& fit, std::size_t count) {
  if (fit.covariance.size() == 0 || count == 0) return {};
  return leading(leave_prior_out_z(fit.theta.head(static_cast<Index>(count)), fit.covariance), count);
}

}  // namespace

std::vector<FittedParameter> fitted_parameters(const PlantFit& fit, const std::vector<FitParameter>& list,
                                               std::size_t first) {
  std::vector<FittedParameter> out;
  for (std::size_t i = first; i < list.size(); ++i) {
    const double variance =
        fit.covariance.size() > 0 ? fit.covariance(static_cast<Index>(i), static_cast<Index>(i)) : 0.0;
    out.push_back({shown_name(fit.plant, list[i].name), get_parameter(fit.plant, list[i].name),
                   std::sqrt(variance) * list[i].scale});
  }
  return out;
}

namespace {

/// Values and standard deviations of the parameters of each effect of a fit.
std::vector<std::vector<FittedParameter>> fitted_by_effect(const Search& search, const Hypothesis& hypothesis) {
  const std::vector<FittedParameter> fitted =
      fitted_parameters(hypothesis.fit, hypothesis.parameters, search.study.tolerances.size());
  std::vector<std::vector<FittedParameter>> list;
  auto next = fitted.begin();
  for (const EffectCandidate& effect : hypothesis.effects) {
    const auto first = next;
    next += static_cast<std::ptrdiff_t>(effect.parameters.size());
    list.emplace_back(first, next);
  }
  return list;
}

std::vector<DefiningSize> defining_sizes(const Label& label, const Plant& fitted) {
  std::vector<DefiningSize> list;
  for (const Plausible& plausible : label.plausible) {
    if (!plausible.defining) continue;
    const double value = get_parameter(fitted, plausible.parameter);
    const bool about = plausible.ideal != 0;  // low and high are of what it deviates
    list.push_back({shown_name(fitted, plausible.parameter), value,
                    about ? plausible.ideal - plausible.high : plausible.low, plausible.ideal + plausible.high,
                    plausible.deviation(value)});
  }
  return list;
}

/// The kind of law whose parameter is the strength of an effect; null of what is no law.
const LawKind* law_of(const EffectCandidate& effect, const std::vector<PlantParameter>& fitted) {
  if (effect.parameters.empty()) return nullptr;
  const auto own = std::find_if(fitted.begin(), fitted.end(), [&](const PlantParameter& parameter) {
    return parameter.name == effect.parameters.front().name;
  });
  return own == fitted.end() ? nullptr : own->handle.law;
}

/// What a fit tells whatever its effects are called.
CandidateEvidence unlabelled(const Search& search, const Hypothesis& hypothesis) {
  CandidateEvidence out;
  const std::size_t tolerances = search.study.tolerances.size();
  out.chi2 = hypothesis.chi2;
  out.prior_chi2 = hypothesis.prior_chi2;
  out.parameters = hypothesis.parameters.size();
  // A finer form took over a label of its coarser one because it was worth it, and stands under the same name.
  for (const EffectCandidate& effect : hypothesis.effects) out.parameters -= effect.finer_by;
  out.misfit = hypothesis.fit.misfit;
  out.stage = hypothesis.stage;
  out.closure = closure(search.retuned.stage.blocks, hypothesis.stage.blocks, search.bootstrap);
  out.theta = leading(hypothesis.fit.theta, tolerances);
  out.z = z_of(hypothesis.fit, tolerances);
  return out;
}

}  // namespace

std::vector<CandidateEvidence> evidence_of(const Search& search, const Hypothesis& hypothesis, std::size_t number) {
  const CandidateEvidence common = unlabelled(search, hypothesis);
  const std::vector<std::vector<FittedParameter>> sizes = fitted_by_effect(search, hypothesis);
  const Plant& fitted = hypothesis.fit.plant;
  const std::vector<PlantParameter> numbers = plant_parameters(fitted);
  std::vector<CandidateEvidence> list;
  for (const std::vector<std::size_t>& labels : labellings(hypothesis.effects)) {
    CandidateEvidence own = common;
    own.fit = number;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const EffectCandidate& effect = hypothesis.effects[i];
      const Label& label = effect.labels[labels[i]];
      const LawKind* law = law_of(effect, numbers);
      own.effects.push_back({label.effect, effect.location, form_of(label, fitted), sizes[i],
                             defining_sizes(label, fitted), law != nullptr && law->is_elastic(),
                             law != nullptr && law->is_dissipative()});
      own.log_plausibility += log_plausibility(label, fitted);
    }
    list.push_back(std::move(own));
  }
  return list;
}

void add_candidates(const Search& search, Hypothesis hypothesis, Candidates& candidates) {
  std::vector<CandidateEvidence> told = evidence_of(search, hypothesis, candidates.fits.size());
  std::move(told.begin(), told.end(), std::back_inserter(candidates.evidence));
  candidates.fits.push_back(std::move(hypothesis));
}

void add_linearisation(const Search& search, const Hypothesis& hypothesis, CandidateEvidence& evidence) {
  const std::vector<std::vector<FittedParameter>> sizes = fitted_by_effect(search, hypothesis);
  for (std::size_t i = 0; i < sizes.size(); ++i) evidence.effects[i].parameters = sizes[i];
  evidence.theta = leading(hypothesis.fit.theta, search.study.tolerances.size());
  evidence.z = z_of(hypothesis.fit, search.study.tolerances.size());
}

namespace {

/// Candidates of fits in their order.
Candidates told_by(const Search& search, std::vector<Hypothesis> fits) {
  Candidates candidates;
  for (Hypothesis& own : fits) add_candidates(search, std::move(own), candidates);
  return candidates;
}

}  // namespace

Candidates find_singles(const Search& search, double colour, Changes& changes) {
  std::vector<Hypothesis> fits =
      extend(search.study, search.retuned, {.shortlist = search.effort.fits, .least = least_expected(search, colour)},
             {}, &changes);
  finish(search.study, search.retuned.chi2, static_cast<std::size_t>(search.effort.finished), fits);
  return told_by(search, std::move(fits));
}

namespace {

/// Adds fits to singles, and finishes the best of all. @return false if nothing was added
bool add_singles(const Search& search, std::vector<Hypothesis> more, Candidates& singles) {
  if (more.empty()) return false;
  std::vector<Hypothesis> fits = std::move(singles.fits);
  std::move(more.begin(), more.end(), std::back_inserter(fits));
  std::stable_sort(fits.begin(), fits.end(), [](const Hypothesis& a, const Hypothesis& b) { return a.chi2 < b.chi2; });
  finish(search.study, search.retuned.chi2, static_cast<std::size_t>(search.effort.finished), fits);
  singles = told_by(search, std::move(fits));
  return true;
}

}  // namespace

bool add_less_expected(const Search& search, double colour, const PlantFit* around, Candidates& singles) {
  return !singles.fits.empty() && add_singles(search,
                                              extend(search.study, search.retuned,
                                                     {.shortlist = search.effort.fits,
                                                      .forms = 2,
                                                      .worth = 0,
                                                      .least = least_expected(search, colour),
                                                      .around = around,
                                                      .tried = &singles.fits}),
                                              singles);
}

bool add_best_expected(const Search& search, double colour, const PlantFit& around, Candidates& singles) {
  return add_singles(search,
                     extend(search.study, search.retuned,
                            {.shortlist = search.effort.fits_at_home,
                             .forms = 1,
                             .worth = search.thresholds.second,
                             .least = least_expected(search, colour),
                             .around = &around,
                             .tried = &singles.fits}),
                     singles);
}

bool add_by_force(const Search& search, const std::vector<PlaceLeftover>& places, Candidates& singles) {
  const PlantFit& home = search.delivered.fit;
  const auto most = static_cast<std::size_t>(search.effort.places_by_force);
  std::vector<Place> asked;
  ForcePlace place;
  for (const PlaceLeftover& own : places) {
    if (asked.size() == most) break;
    // Of names that enter alike an element, which has laws of its own, before a guide.
    std::vector<Place> entries = entries_of(own);
    std::erase_if(entries,
                  [&](const Place& entry) { return is_path(entry) || !force_place_of(home.plant, entry, place); });
    const auto element =
        std::find_if(entries.begin(), entries.end(), [&](const Place& entry) { return entry.kind == PlaceKind::part; });
    if (!entries.empty()) asked.push_back(element != entries.end() ? *element : entries.front());
  }
  if (places.empty())
    for (const Element& element : home.plant.elements) asked.push_back(location_of(element));
  std::vector<Hypothesis> more;
  for (const Place& location : asked) {
    const ForceScreened found =
        screen_by_force(search.study, home, search.retuned.fit, location,
                        {static_cast<std::size_t>(search.effort.sized_by_force), search.effort.made_by_law,
                         static_cast<std::size_t>(search.effort.fits_by_force)});
    std::vector<Hypothesis> fits = fit_shortlist(search.study, search.retuned, found.candidates, found.screened);
    std::move(fits.begin(), fits.end(), std::back_inserter(more));
    if (!found.screened.empty() && found.screened.front().gain > search.effort.made_whole) break;
  }
  return add_singles(search, std::move(more), singles);
}

bool add_at_masses(const Search& search, const std::vector<PlaceLeftover>& places, Candidates& singles) {
  const PlantFit& base = search.retuned.fit;
  Operation operation;
  if (places.empty() || !operation_of(base.plant, search.study.data.fitted, base.initial_states, operation))
    return false;
  const auto most = static_cast<std::size_t>(search.effort.places_by_force);
  std::vector<Place> hosts;
  for (const PlaceLeftover& own : places) {
    const std::vector<Place> entries = entries_of(own);
    for (const Mass& mass : base.plant.masses)
      if (hosts.size() < most && std::find(entries.begin(), entries.end(), guide_place(mass.name)) != entries.end())
        hosts.push_back(part_place(mass.name));
  }
  const std::vector<EffectCandidate> candidates = search.study.candidates(base.plant, operation);
  std::vector<Screened> shortlist;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (!candidates[i].refines.empty() || std::find(hosts.begin(), hosts.end(), candidates[i].location) == hosts.end())
      continue;
    shortlist.push_back({.candidate = i, .strength = 1, .retuning = Vector::Zero(base.theta.size())});
    shortlist.push_back({.candidate = i, .strength = 1, .retuning = -base.theta});  // the plant as delivered
  }
  return add_singles(search, fit_shortlist(search.study, search.retuned, candidates, shortlist), singles);
}

bool add_rivals(const Search& search, const Hypothesis& answer, Candidates& singles) {
  std::vector<Place> asked;
  std::vector<Hypothesis> more;
  for (const EffectCandidate& effect : answer.effects) {
    const Place& location = effect.location;
    if (is_path(location) || std::find(asked.begin(), asked.end(), location) != asked.end()) continue;
    asked.push_back(location);
    const auto rival = [&](const EffectCandidate& candidate) {
      return std::none_of(answer.effects.begin(), answer.effects.end(),
                          [&](const EffectCandidate& own) { return name_of(own) == name_of(candidate); }) &&
             std::none_of(singles.fits.begin(), singles.fits.end(),
                          [&](const Hypothesis& fitted) { return same_form(fitted.effects.back(), candidate); });
    };
    const ForceScreened found =
        screen_rivals(search.study, answer.fit, search.retuned.fit, location, rival,
                      {static_cast<std::size_t>(search.effort.sized_by_force), search.effort.made_whole,
                       static_cast<std::size_t>(search.effort.fits_by_force)});
    std::vector<Hypothesis> fits = fit_shortlist(search.study, search.retuned, found.candidates, found.screened);
    std::move(fits.begin(), fits.end(), std::back_inserter(more));
  }
  return add_singles(search, std::move(more), singles);
}

bool refine_singles(const Search& search, const std::vector<EffectAt>& names, Candidates& singles) {
  if (!refine(search.study, search.retuned, names, search.thresholds.second, singles.fits)) return false;
  singles = told_by(search, std::move(singles.fits));
  return true;
}

std::vector<EffectAt> worth_refining(const Search& search, const Candidates& singles) {
  std::vector<EffectAt> names;
  const double floor = search.study.data.samples, gap = search.retuned.chi2 - floor;
  for (const CandidateEvidence& single : singles.evidence)
    if (single.chi2 - floor < search.effort.far_behind * (singles.evidence.front().chi2 - floor) &&
        single.chi2 - floor < (1 - search.thresholds.worth_pair) * gap)
      names.push_back(single.last().name());
  return names;
}

std::vector<std::size_t> parameters_to_free(const Search& search, const Evidence& evidence) {
  std::vector<std::size_t> which;
  const auto count = static_cast<Index>(evidence.tolerances.size());
  if (count == 0) return which;
  double most = 0;
  Vector theta(count);
  for (Index i = 0; i < count; ++i) {
    const ToleranceEvidence& own = evidence.tolerances[static_cast<std::size_t>(i)];
    most = std::max(most, std::abs(own.z));
    theta(i) = own.theta;
  }
  const bool alone = gap_left(evidence) <= negligible(evidence, search.thresholds) || evidence.singles.empty();
  if (most > search.effort.freeing_z && (alone || evidence.retuned_stopped))
    for (std::size_t i = 0; i < evidence.tolerances.size(); ++i) {
      const ToleranceEvidence& own = evidence.tolerances[i];
      if (std::abs(own.z) >= search.effort.freed_z && (alone || std::abs(own.theta) >= kAtEnd)) which.push_back(i);
    }
  if (gap_left(evidence) > negligible(evidence, search.thresholds)) return which;
  const Vector p = standing_out(theta, evidence.tolerance_covariance, evidence.noise.colour, search.thresholds);
  Index first = 0;
  if (p.maxCoeff(&first) > search.effort.stands_out &&
      std::find(which.begin(), which.end(), static_cast<std::size_t>(first)) == which.end())
    which.push_back(static_cast<std::size_t>(first));
  return which;
}

namespace {

constexpr double kTold = 3;      // standard deviations of a parameter by the data alone, from which they tell it
constexpr double kMoves = 0.05;  // of its own change of the outputs, from which another parameter moves with it

/// Tolerances with which a parameter would move unseen, see FreedEvidence::not_told_from.
/// With H = J'J of all parameters and initial states, the data alone leave theta_i a variance of (H^-1)_ii, and along
/// the direction that they see least the others move by -H_oo^-1 H_oi.
std::vector<std::size_t> not_told_from(const PlantFit& fit, std::size_t parameter, std::size_t tolerances) {
  std::vector<std::size_t> with;
  const auto i = static_cast<Index>(parameter), count = static_cast<Index>(tolerances);
  if (fit.jacobian.cols() < count || fit.theta.size() <= i) return with;
  Matrix H = fit.layout.gram(fit.jacobian);
  // Initial states have a prior around rest, parameters none; round-off of the rest keeps the factor from breaking
  // down.
  H.diagonal().tail(H.rows() - fit.theta.size()) += fit.precision.tail(H.rows() - fit.theta.size());
  H.diagonal() *= 1 + 1e-12;
  Matrix others = H;
  others.row(i).setZero();
  others.col(i).setZero();
  others(i, i) = 1;
  Vector common = H.col(i);
  common(i) = 0;
  const Vector moved = -others.ldlt().solve(common);
  const double seen = H(i, i) + common.dot(moved), change = std::sqrt(H(i, i));
  if (fit.theta(i) * fit.theta(i) * std::max(seen, 0.0) > kTold * kTold) return with;
  for (Index k = 0; k < count; ++k)
    if (k != i && std::abs(moved(k)) * std::sqrt(H(k, k)) > kMoves * change)
      with.push_back(static_cast<std::size_t>(k));
  return with;
}

/// What a fit with a parameter free of its tolerance tells.
FreedEvidence freed_evidence(const Search& search, const Hypothesis& fitted, std::size_t tolerance) {
  const std::size_t count = search.study.tolerances.size();
  FreedEvidence out;
  out.tolerance = tolerance;
  out.chi2 = fitted.chi2;
  out.prior_chi2 = fitted.prior_chi2;
  out.stage = fitted.stage;
  out.closure_of_delivered = closure(search.delivered.stage.blocks, fitted.stage.blocks, search.bootstrap);
  out.closure_of_retuned = closure(search.retuned.stage.blocks, fitted.stage.blocks, search.bootstrap);
  out.fitted = fitted_parameters(fitted.fit, fitted.parameters, 0)[tolerance];
  const auto i = static_cast<Index>(tolerance);
  if (fitted.fit.covariance.rows() > i) {
    // With S the covariance of all parameters and P the precision of their priors, S = S (J'J / dispersion + P) S: the
    // first part is what noise makes, S P S what priors that are off do.
    const Matrix& S = fitted.fit.covariance;
    out.std = std::sqrt(S(i, i));
    double of_priors = 0;
    for (Index k = 0; k < std::min(S.cols(), static_cast<Index>(fitted.parameters.size())); ++k)
      if (const double prior = fitted.parameters[static_cast<std::size_t>(k)].prior_std; prior > 0)
        of_priors += S(i, k) * S(i, k) / (prior * prior);
    out.std_of_tolerances = std::sqrt(std::min(of_priors, S(i, i)));
  }
  out.theta = leading(fitted.fit.theta, count);
  out.not_told_from = not_told_from(fitted.fit, tolerance, count);
  out.z = z_of(fitted.fit, count);
  return out;
}

}  // namespace

namespace {

/// True of the damping of an element where a damper that saturates stands beside the viscous one: it has a slope of its
/// own at rest, and what the viscous one had there is part of its form.
bool shaped_by(const CandidateEvidence& answer, const ToleranceEvidence& own) {
  return own.effect == "damping_error" &&
         std::any_of(answer.effects.begin(), answer.effects.end(), [&](const EffectEvidence& effect) {
           return effect.location == own.location && effect.effect == "damper_nonlinearity" &&
                  effect.form == "saturating";
         });
}

/// What a fit minimised: of the fitted records, with the priors of the parameters.
double objective(const PlantFit& fit) {
  return fit.residual.squaredNorm() + fit.theta.cwiseAbs2().dot(fit.precision.head(fit.theta.size()));
}

/// Parameters to set free beside an answer: those that gain most by the linear model. Left out of its prior, one moves
/// to theta / (1 - S_ii) and takes z^2 from the objective, S the covariance of the answer's fit.
std::vector<std::size_t> worth_freeing(const Search& search, const std::vector<ToleranceEvidence>& tolerances,
                                       const CandidateEvidence& candidate, ConstMatrixRef covariance) {
  std::vector<std::pair<double, std::size_t>> list;
  for (std::size_t i = 0; i < candidate.z.size() && candidate.z.size() == tolerances.size(); ++i) {
    if (!is_parameter_error(tolerances[i].effect) || shaped_by(candidate, tolerances[i])) continue;
    const double z = candidate.z[i], left = 1 - covariance(static_cast<Index>(i), static_cast<Index>(i));
    if (!(std::abs(z) > search.effort.beside_z)) continue;
    const double size = candidate.theta[i] / std::max(left, 1e-6);
    list.emplace_back(log_size_prior(size, search.thresholds) + z * z / 2, i);
  }
  std::stable_sort(list.begin(), list.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  if (list.size() > search.effort.beside) list.resize(search.effort.beside);
  std::vector<std::size_t> which;
  for (const auto& [score, i] : list) which.push_back(i);
  return which;
}

}  // namespace

std::vector<Hypothesis> free_beside(const Search& search, const std::vector<ToleranceEvidence>& tolerances,
                                    Hypothesis& answer, CandidateEvidence& candidate) {
  const Study& study = search.study;
  if (!linearise(answer.fit, answer.parameters, study.data.fitted)) return {};
  add_linearisation(search, answer, candidate);
  const std::vector<std::size_t> which = worth_freeing(search, tolerances, candidate, answer.fit.covariance);
  std::vector<Hypothesis> fits(which.size());
  tbb::parallel_for(std::size_t{0}, which.size(), [&](std::size_t k) {
    std::vector<FitParameter> parameters = answer.parameters;
    parameters[which[k]].prior_std = 0;
    fits[k] = fit_from(study, answer, parameters);
    fits[k].effects = answer.effects;
    if (!fits[k].fit.error.empty() && !linearise(fits[k].fit, parameters, study.data.fitted)) fits[k].fit.error.clear();
  });
  std::vector<Hypothesis> found;
  for (std::size_t k = 0; k < fits.size(); ++k) {
    // The held-out records may speak against it within their noise; where what was minimised did not fall, the fit
    // found nothing.
    if (fits[k].fit.error.empty() || objective(fits[k].fit) > objective(answer.fit)) continue;
    candidate.freed.push_back(freed_evidence(search, fits[k], which[k]));
    found.push_back(std::move(fits[k]));
  }
  return found;
}

FreedParameters free_parameters(const Search& search, const std::vector<std::size_t>& which) {
  FreedParameters freed;
  freed.fits.resize(which.size());
  freed.evidence.resize(which.size());
  tbb::parallel_for(std::size_t{0}, which.size(), [&](std::size_t k) {
    const Study& study = search.study;
    std::vector<FitParameter> parameters = study.tolerances;
    parameters[which[k]].prior_std = 0;
    Hypothesis& fitted = freed.fits[k];
    fitted = fit_from(study, search.retuned, parameters);
    if (!fitted.fit.error.empty()) linearise(fitted.fit, parameters, study.data.fitted);
    // A fit that found nothing better is no reason to hold the re-tuned plant for worse than it is.
    const bool better = !fitted.fit.error.empty() && !(fitted.chi2 > search.retuned.chi2);
    freed.evidence[k] = freed_evidence(search, better ? fitted : search.retuned, which[k]);
  });
  return freed;
}

}  // namespace wheelhop
