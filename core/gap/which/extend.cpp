#include "core/gap/which/extend.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>

#include "core/gap/which/scored_fit.hpp"

namespace wheelhop {
namespace {

// Judgements: iterations of a quick fit, and the share of the fall of chi2 by which one may lie behind the best and be
// fitted on.
constexpr Index kQuickIterations = 8;
constexpr double kNear = 0.15;
// A judgement: a finer form is fitted further as long as chi2 falls below this share of what it was.
constexpr double kGoesOn = 0.9;
// Judgements: an end that is lowered, of what it was; and where a parameter rests there, in such ends.
constexpr double kLower = 0.3, kRests = 1.01;

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

/// Sorts a list by chi2, and keeps the best fit of each form; of fits that differ by less than a share of it all.
void keep_best(double share, std::vector<Hypothesis>& list) {
  std::stable_sort(list.begin(), list.end(), by_chi2);
  std::vector<Hypothesis> kept;
  for (Hypothesis& own : list)
    if (std::none_of(kept.begin(), kept.end(), [&](const Hypothesis& better) {
          return same_forms(better.effects, own.effects) && own.chi2 - better.chi2 >= share * better.chi2;
        }))
      kept.push_back(std::move(own));
  list = std::move(kept);
}

/// True of an element or mass that an effect has put into a plant, and of such a mass's guide: no place of the user's.
/// The guide of one of the user's masses is, whoever put an element there.
bool added(const Plant& nominal, const Plant& plant, const Place& location) {
  const auto named = [&](const auto& part) {
    return location == part_place(part.name) || location == guide_place(part.name);
  };
  return std::any_of(plant.elements.begin() + static_cast<std::ptrdiff_t>(nominal.elements.size()),
                     plant.elements.end(), named) ||
         std::any_of(plant.masses.begin() + static_cast<std::ptrdiff_t>(nominal.masses.size()), plant.masses.end(),
                     named);
}

/// True if a hypothesis has the effect already, by the first labels of both, or moves one of its parameters.
bool moved_by(const Hypothesis& base, const EffectCandidate& candidate) {
  return std::any_of(base.effects.begin(), base.effects.end(),
                     [&](const EffectCandidate& own) { return name_of(own) == name_of(candidate); }) ||
         std::any_of(candidate.parameters.begin(), candidate.parameters.end(), [&](const FitParameter& own) {
           return std::any_of(base.parameters.begin(), base.parameters.end(),
                              [&](const FitParameter& other) { return other.name == own.name; });
         });
}

/// A quick fit is fitted on to the end, and replaced if that is better. @return false if it is not
bool fit_on(const Study& study, Hypothesis& hypothesis) {
  if (!linearise(hypothesis.fit, hypothesis.parameters, study.data.fitted)) return false;
  Hypothesis longer = hypothesis;
  if (!complete(study, study.solvers.thorough, {study.iterations, &hypothesis.fit, false, hypothesis.fit.theta},
                {study.iterations, &hypothesis.held_out, false}, longer) ||
      longer.chi2 >= hypothesis.chi2)
    return false;
  hypothesis = std::move(longer);
  return true;
}

/// Lowers the ends of those parameters of the last effect that rest there, where they may be lowered. @return whether
/// there are any
bool lower_ends(Hypothesis& hypothesis) {
  bool any = false;
  std::vector<FitParameter>& own = hypothesis.effects.back().parameters;
  for (std::size_t i = 0; i < own.size(); ++i) {
    FitParameter& moved = hypothesis.parameters[hypothesis.parameters.size() - own.size() + i];
    if (!moved.lowered || get_parameter(hypothesis.fit.plant, moved.name) > kRests * moved.least) continue;
    moved.least *= kLower;
    own[i].least = moved.least;
    any = true;
  }
  return any;
}

/// To the end, and on from there where a parameter rests at an end that may be lowered (a continuation in it), as long
/// as that pays.
void polish(const Study& study, Hypothesis& hypothesis) {
  if (hypothesis.effects.back().parameters.empty()) return;  // nothing was fitted beyond what it was added to
  fit_on(study, hypothesis);
  bool lowered = false, pays = false;
  for (Hypothesis next = hypothesis; lower_ends(next) || (lowered && pays); hypothesis = next) {
    lowered = true;
    if (!fit_on(study, next)) break;
    pays = next.chi2 < kGoesOn * hypothesis.chi2;
  }
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

}  // namespace

std::vector<Hypothesis> extend(const Study& study, const Hypothesis& base, const ExtendOptions& options,
                               const Changes& known, Changes* found) {
  const PlantFit& around = options.around ? *options.around : base.fit;
  Operation operation;
  if (!operation_of(around.plant, study.data.fitted, around.initial_states, operation)) return {};
  const std::vector<EffectCandidate> candidates = study.candidates(around.plant, operation);
  const auto tried = [&](const EffectCandidate& candidate) {
    // A form that bends either way is tried once to each side.
    const std::string words = form_of(candidate.label(), candidate.plant);
    return options.tried && std::any_of(options.tried->begin(), options.tried->end(), [&](const Hypothesis& other) {
             const EffectCandidate& before = other.effects.back();
             return same_form(before, candidate) && form_of(before.label(), other.fit.plant) == words;
           });
  };
  std::vector<Screened> shortlist;
  std::map<EffectAt, Index> forms;
  for (const Screened& screened : screen(around, study.data.fitted, candidates, known, found)) {
    if (!candidates[screened.candidate].refines.empty() || moved_by(base, candidates[screened.candidate])) continue;
    const EffectAt name = name_of(candidates[screened.candidate]);
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
  std::stable_sort(list.begin(), list.end(), by_chi2);
  return list;
}

bool refine(const Study& study, const Hypothesis& base, const std::vector<EffectAt>& names, double share,
            std::vector<Hypothesis>& list) {
  Operation operation;
  if (list.empty() || !operation_of(base.fit.plant, study.data.fitted, base.fit.initial_states, operation))
    return false;
  const std::vector<EffectCandidate> candidates = study.candidates(base.fit.plant, operation);
  const auto wanted = [&](const EffectAt& name) { return std::find(names.begin(), names.end(), name) != names.end(); };
  std::vector<Hypothesis> better;
  for (Hypothesis& coarse : list) {
    EffectCandidate& known = coarse.effects.back();
    std::vector<Label> kept;
    for (const Label& label : known.labels) {
      Hypothesis best;
      for (const EffectCandidate& candidate : candidates) {
        const EffectAt name = name_of(candidate);
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
  keep_best(kQuickDecrease, list);
  std::size_t worth = 0;
  while (worth < std::min(list.size(), most) &&
         !(list[worth].chi2 - list[0].chi2 > std::max(kNear * (before - list[0].chi2), kQuickDecrease * list[0].chi2)))
    ++worth;
  tbb::parallel_for(std::size_t{0}, worth, [&](std::size_t k) { polish(study, list[k]); });
  keep_best(0, list);
}

}  // namespace wheelhop
