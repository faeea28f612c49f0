#include "core/gap/verdict/decide.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <set>

#include "core/gap/verdict/faults.hpp"
#include "core/gap/verdict/parameter_beside.hpp"
#include "core/gap/verdict/posterior.hpp"

namespace wheelhop {
namespace {

/// What is being decided on.
struct Case {
  const Evidence& evidence;
  const Thresholds& thresholds;
};

std::vector<LocationProbability> locations_by(const Case& c, const std::vector<RankedCandidate>& ranked) {
  std::vector<std::pair<Place, double>> speaking;
  for (const RankedCandidate& own : ranked) speaking.emplace_back(own.location, own.probability);
  return locations_of(speaking, c.thresholds.limit);
}

/// Tells the candidates that are probable enough beside those named.
void add_ambiguous(const Case& c, const std::vector<RankedCandidate>& ranked, Verdict& verdict) {
  for (const RankedCandidate& own : ranked)
    if (own.probability > c.thresholds.considered &&
        std::find(verdict.named.begin(), verdict.named.end(), own.name()) == verdict.named.end())
      verdict.ambiguous_with.push_back(own.name());
}

/// One effect of a candidate as a suspect.
Suspect suspect_of(const CandidateEvidence& candidate, const EffectEvidence& effect, double probability) {
  return {effect.effect,          effect.location,   effect.form,      probability,
          candidate.stage.misfit, candidate.closure, effect.parameters};
}

// --- parameters ---------------------------------------------------------------------------------------------------

/// The answer is a parameter, free of its tolerance.
Verdict name_parameter(const Case& c, const RankedCandidate& ranked) {
  const FreedEvidence& freed = c.evidence.freed[ranked.index];
  Verdict verdict;
  verdict.answer = Parameters{ranked.index};
  verdict.named = {ranked.name()};
  verdict.suspects = {{ranked.effect,
                       ranked.location,
                       "",
                       ranked.probability,
                       freed.stage.misfit,
                       freed.closure_of_delivered,
                       {freed.fitted}}};
  return verdict;
}

/// A parameter that was most probable and does not explain the gap: what is left of it among the suspects.
Verdict refuted_parameter(const Case& c, const RankedCandidate& ranked) {
  Verdict verdict = name_parameter(c, ranked);
  verdict.suspects.front().probability *= 1 - c.thresholds.held;
  verdict.suspects.front().closure = c.evidence.freed[ranked.index].closure_of_retuned;
  const std::string out = others_out(c.evidence, c.evidence.freed[ranked.index], c.thresholds);
  if (!out.empty())
    verdict.message = fmt::format("{} at {} would need {} as well", ranked.effect, ranked.location, out);
  return verdict;
}

/// Where the records tell a parameter only against others that all belong to one other component, either may be wrong:
/// with no more surprise, since a component that was changed has all its parameters changed.
void tell_component(const Case& c, const FreedEvidence& freed, Verdict& verdict) {
  if (freed.not_told_from.empty()) return;
  const auto& tolerances = c.evidence.tolerances;
  const Place& there = tolerances[freed.not_told_from.front()].location;
  std::string list;
  std::vector<EffectAt> names;
  for (const std::size_t other : freed.not_told_from) {
    if (tolerances[other].location != there || there == tolerances[freed.tolerance].location) return;
    list += (list.empty() ? "" : ", ") + tolerances[other].parameter;
    names.push_back({tolerances[other].effect, there});
  }
  verdict.message = fmt::format(
      "the records tell {} only against {}: it may be right, and all that belongs to {} off by one factor instead; "
      "weigh "
      "it, or measure a force",
      tolerances[freed.tolerance].parameter, list, there);
  std::get<Parameters>(verdict.answer).either = true;
  verdict.ambiguous_with = names;
  verdict.suspects.front().probability = std::min(verdict.suspects.front().probability, c.thresholds.doubt);
  for (FittedParameter& parameter : verdict.suspects.front().parameters) parameter.std = 0;  // not known
  for (LocationProbability& place : verdict.locations)
    place.probability = std::min(place.probability, c.thresholds.doubt);
}

/// Row 1a: one parameter inside its tolerance, where all others are nearer still, makes the gap as delivered.
bool one_stands_out(const Case& c, Verdict& verdict) {
  const Evidence& e = c.evidence;
  if (e.delivered_chi2 - e.retuned_chi2 < c.thresholds.notice * chance_of(e)) return false;
  const auto count = static_cast<Index>(e.tolerances.size());
  if (count == 0 || e.tolerance_covariance.rows() < count) return false;
  Vector theta(count);
  for (Index i = 0; i < count; ++i) theta(i) = e.tolerances[static_cast<std::size_t>(i)].theta;
  const Vector p = standing_out(theta, e.tolerance_covariance, e.noise.colour, c.thresholds);
  Index most = 0;
  if (p.maxCoeff(&most) < c.thresholds.stands_out) return false;
  const auto freed = std::find_if(e.freed.begin(), e.freed.end(), [&](const FreedEvidence& own) {
    return own.tolerance == static_cast<std::size_t>(most);
  });
  if (freed == e.freed.end()) return false;
  RankedCandidate ranked =
      unranked(*freed, static_cast<std::size_t>(freed - e.freed.begin()), e.tolerances, c.thresholds);
  ranked.probability = p(most);
  if (!parameter_explains(e, *freed, c.thresholds)) return false;
  verdict = name_parameter(c, ranked);
  verdict.message = fmt::format("{} is {:+.1f} tolerances off, and the others lie nearer to what the plant file says",
                                freed->fitted.name, theta(most));
  std::vector<RankedCandidate> all;
  for (std::size_t i = 0; i < e.tolerances.size(); ++i) {
    all.push_back({e.tolerances[i].effect, e.tolerances[i].location});
    all.back().probability = p(static_cast<Index>(i));
  }
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.probability > b.probability; });
  verdict.locations = locations_by(c, all);
  add_ambiguous(c, all, verdict);
  tell_component(c, *freed, verdict);
  return true;
}

// --- effects ------------------------------------------------------------------------------------------------------

/// The best single effect, or the best set of so many.
struct Level {
  const CandidateEvidence* candidate = nullptr;
  std::size_t index = 0;                ///< in the list of the evidence that holds sets of this size
  bool needed = true;                   ///< none of its effects can be spared
  std::vector<CandidateEvidence> sets;  ///< all of this size
  std::vector<RankedCandidate> ranked;  ///< these
};

/// What sets of effects say of locations: each counts for all of its effects. That of the effect named first leads.
std::vector<LocationProbability> locations_of_sets(const Case& c, const std::vector<CandidateEvidence>& sets,
                                                   const std::vector<RankedCandidate>& ranked, const EffectAt& first) {
  std::vector<std::pair<Place, double>> speaking;
  for (const RankedCandidate& own : ranked) {
    std::set<Place> places;
    for (const EffectEvidence& effect : sets[own.index].effects) places.insert(effect.location);
    for (const Place& place : places) speaking.emplace_back(place, own.probability);
  }
  std::vector<LocationProbability> locations = locations_of(speaking, c.thresholds.limit);
  const auto own = std::find_if(locations.begin(), locations.end(),
                                [&](const auto& place) { return place.location == first.place; });
  if (own != locations.end()) std::rotate(locations.begin(), own, own + 1);
  return locations;
}

/// How probable an effect is, by name: that of all sets that hold it.
std::map<EffectAt, double> probabilities_in_sets(const Case& c, const Level& level) {
  std::map<EffectAt, double> told;
  for (const RankedCandidate& own : level.ranked) {
    std::set<EffectAt> names;
    for (const EffectEvidence& effect : level.sets[own.index].effects) names.insert(effect.name());
    for (const EffectAt& name : names) told[name] += own.probability;
  }
  for (auto& [name, probability] : told) probability = std::min(probability, c.thresholds.limit);
  return told;
}

/// "NAME 0.13, usually 0.001 to 0.03" of a size that its name does not stand for, or nothing.
std::string odd_size(const Case& c, const EffectEvidence& effect) {
  for (const DefiningSize& size : effect.defining)
    if (size.z > c.thresholds.odd_size)
      return fmt::format("{} {:.2g}, usually {:g} to {:g}", size.parameter, size.value, size.low, size.high);
  return "";
}

/// The best set of one effect more, if it leaves less.
std::optional<Level> grown(const Case& c, const CandidateEvidence& before) {
  const Evidence& e = c.evidence;
  const bool pairs = before.effects.size() == 1;
  if (pairs && !worth_another(e, before, c.thresholds)) return {};
  Level level;
  const auto& list = pairs ? e.pairs : e.larger;
  std::vector<std::size_t> members;  // of the list
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (list[i].effects.size() != before.effects.size() + 1) continue;
    members.push_back(i);
    level.sets.push_back(list[i]);
  }
  if (members.empty()) return {};
  level.ranked = ranked_sets(e, level.sets, before, c.thresholds);
  level.index = members[level.ranked.front().index];
  level.candidate = &list[level.index];
  const CandidateEvidence& set = *level.candidate;
  const std::size_t last = set.effects.size() - 1;
  const double removes = before.chi2 - set.chi2;
  if (!(removes > std::max(c.thresholds.grows * (before.chi2 - e.samples), c.thresholds.notice * chance_of(e))))
    return {};
  // Where the error of a form enters, another effect is no more than a better form, unless it is of the other kind, or
  // leaves next to nothing: of_rest of the share that counts as nearly whole elsewhere.
  const double gone = c.thresholds.of_rest * c.thresholds.of_rest * (before.chi2 - e.samples);
  if (!differs_in_kind(set, last) && within_form(e, before, c.thresholds) && set.chi2 - e.samples > gone) return {};
  // No effect of a set is named by a size that is not its own.
  const bool home = brings_home(e, before, set, c.thresholds);
  level.needed = effect_needed(e, set, last, before.chi2, c.thresholds, home) &&
                 std::all_of(set.effects.begin(), set.effects.end(),
                             [&](const EffectEvidence& effect) { return odd_size(c, effect).empty(); });
  for (std::size_t i = 0; i <= last; ++i) {
    const double without = last == 1                     ? set.alone_chi2[1 - i]
                           : i < set.without_chi2.size() ? set.without_chi2[i]
                                                         : kUnknown;
    level.needed =
        level.needed && (!std::isfinite(without) || effect_needed(e, set, i, without, c.thresholds, home && i == last));
  }
  return level;
}

/// A single effect and the sets of one effect more each.
std::vector<Level> levels_of(const Case& c, std::size_t single) {
  std::vector<Level> levels(1);
  levels[0].candidate = &c.evidence.singles[single];
  levels[0].index = single;
  while (std::optional<Level> next = grown(c, *levels.back().candidate)) levels.push_back(std::move(*next));
  return levels;
}

/// How many of the levels are named: up to the largest set that can spare none of its effects. What may be the error of
/// a form is explained nearly whole, or not at all.
std::size_t named_levels(const Case& c, const std::vector<Level>& levels) {
  const double floor = c.evidence.samples;
  for (std::size_t count = levels.size(); count > 1; --count) {
    const double left = levels[count - 1].candidate->chi2 - floor;
    const bool whole =
        std::all_of(levels.begin(), levels.begin() + static_cast<std::ptrdiff_t>(count) - 1, [&](const Level& before) {
          return !within_form(c.evidence, *before.candidate, c.thresholds) ||
                 left < c.thresholds.of_rest * (before.candidate->chi2 - floor);
        });
    if (whole && levels[count - 1].needed) return count;
  }
  return 1;
}

/// Names the effects of a level, in their order, before all other suspects.
void name_effects(const Case& c, const Level& level, Verdict& verdict) {
  const CandidateEvidence& set = *level.candidate;
  const std::size_t last = set.effects.size() - 1;
  verdict.named.clear();
  for (const EffectEvidence& effect : set.effects) verdict.named.push_back(effect.name());
  for (std::size_t i = 0; i < last; ++i) {
    const auto place = verdict.suspects.begin() + static_cast<std::ptrdiff_t>(i);
    const auto own = std::find_if(place, verdict.suspects.end(),
                                  [&](const Suspect& suspect) { return suspect.name() == verdict.named[i]; });
    if (own != verdict.suspects.end())
      std::rotate(place, own, own + 1);
    else
      verdict.suspects.insert(place, suspect_of(set, set.effects[i], 0));
  }
  verdict.locations = locations_of_sets(c, level.sets, level.ranked, verdict.named.front());
  // The probability of an effect is that of all sets that hold it. It replaces what the effect had alone.
  const std::map<EffectAt, double> told = probabilities_in_sets(c, level);
  const auto next = verdict.suspects.begin() + static_cast<std::ptrdiff_t>(last);
  const Suspect added = suspect_of(set, set.effects[last], 0);
  verdict.suspects.erase(
      std::remove_if(next, verdict.suspects.end(), [&](const Suspect& own) { return own.name() == added.name(); }),
      verdict.suspects.end());
  verdict.suspects.insert(verdict.suspects.begin() + static_cast<std::ptrdiff_t>(last), added);
  for (Suspect& suspect : verdict.suspects)
    if (const auto own = told.find(suspect.name()); own != told.end()) suspect.probability = own->second;
  std::stable_sort(verdict.suspects.begin() + static_cast<std::ptrdiff_t>(last) + 1, verdict.suspects.end(),
                   [](const Suspect& a, const Suspect& b) { return a.probability > b.probability; });
  verdict.ambiguous_with.clear();
  for (const auto& [name, probability] : told)
    if (probability > c.thresholds.considered &&
        std::find(verdict.named.begin(), verdict.named.end(), name) == verdict.named.end())
      verdict.ambiguous_with.push_back(name);
}

/// Probability that a name is right although its form leaves more than the noise: `held_far` of one that leaves far
/// more than `much_left` and than `of_gap` of the gap, one where it leaves no more than either.
double held_of_form(const Case& c, const CandidateEvidence& answer) {
  const Thresholds& t = c.thresholds;
  const double left = std::max(answer.chi2 / c.evidence.samples - 1, 0.0);
  const double gap = c.evidence.retuned_chi2 / c.evidence.samples - 1;
  const double beyond_noise = 1 - std::min(t.much_left / std::max(left, t.much_left), 1.0);
  const double of_gap = gap > 0 ? std::min(left / (t.of_gap * gap), 1.0) : 1;
  return 1 - beyond_noise * of_gap * (1 - t.held_far);
}

/// Probabilities of effects as often right as they say. What the named ones gain, their rivals lose. Where more than
/// the noise is left, each further effect may follow what the forms of those before it do not.
void calibrate(const Case& c, const CandidateEvidence& answer, Verdict& verdict) {
  const Thresholds& t = c.thresholds;
  const double of_form = held_of_form(c, answer);
  double before = 0, after = 0, held = 1;
  for (Suspect& suspect : verdict.suspects) {
    if (std::find(verdict.named.begin(), verdict.named.end(), suspect.name()) == verdict.named.end()) {
      suspect.probability *= (1 - after) / std::max(1 - before, 1 - t.limit);
      continue;
    }
    const double p = std::clamp(suspect.probability, 1 - t.limit, t.limit);
    const double odds = std::exp(t.calibration_shift) * std::pow(p / (1 - p), t.calibration_slope);
    const double sharpened = std::min(odds / (1 + odds), t.surest);
    before = std::max(before, p);
    after = std::max(after, sharpened);
    held *= of_form;
    suspect.probability = held * sharpened;
  }
}

/// Takes from the probabilities what the answer leaves unexplained. One that explains too little, from the wrong place
/// or by absurd sizes is withdrawn.
Verdict doubted(const Case& c, const CandidateEvidence& answer, const RankedCandidate& most_probable, Verdict verdict) {
  const Evidence& e = c.evidence;
  const Thresholds& t = c.thresholds;
  const bool small = gap_left(e) <= negligible(e, t);
  const double remains = answer.chi2 - (small ? (1 + negligible(e, t)) * e.samples : e.samples);
  double explained = (e.retuned_chi2 - answer.chi2) / std::max(e.retuned_chi2 - e.samples, 1.0);
  // Of a gap that is not told from a floor which is too low, it may be the bent parameters that are explained.
  if (const double unbent = e.retuned_prior_chi2 - answer.prior_chi2; small && unbent > t.notice)
    explained = std::max(explained, unbent / e.retuned_prior_chi2);
  const double held = t.held - t.held_slope * std::max(t.held - explained, 0.0);
  for (Suspect& suspect : verdict.suspects) suspect.probability *= std::max(held, 0.0);
  const EffectEvidence& last = answer.last();
  const std::size_t effects = answer.effects.size();
  // What explains the gap, or a part of it, from a place at which no signal would explain the rest is a mask.
  const bool misplaced =
      effects == 1 && remains > t.notice * chance_of(e) &&
      leftover_ratio(e.places, last.location) > (explained < t.explains_well ? t.elsewhere : t.far_elsewhere);
  const std::string odd = effects > 1 ? "" : odd_size(c, last);
  // Held-out records that never reach the effect have no gap that could be closed.
  const bool reached = e.retuned.misfit > 1 + negligible(e, t);
  const double too_little = is_path(last.location) ? t.explains_well : t.surely_not;
  const bool unexplained =
      explained < t.explains || (reached && explained < t.explains_well && answer.closure.high < too_little);
  if (!unexplained && !misplaced && odd.empty()) {
    verdict.row = "3e";
    verdict.why = effects == 1   ? "the most probable effect"
                  : effects == 2 ? "the most probable effect, and a second one beside it"
                                 : "the most probable effect, and others beside it";
    return verdict;
  }
  if (small && !(e.retuned_prior_chi2 > t.out_of_tolerance * t.out_of_tolerance)) {
    verdict.answer = NoGap{};
    verdict.named.clear();
    verdict.ambiguous_with.clear();
    verdict.row = "3b";
    verdict.why = "what the most probable effect explains is not told from the floor's own error";
    return verdict;
  }
  const std::vector<LocationProbability> by_effects = verdict.locations;
  // Noise rounds differently each time: a converter that is simulated without it explains a part of its error alone.
  const Index lattice = most_probable.effect == "quantisation" ? rounding_seen(e, t) : -1;
  if (lattice >= 0) {
    verdict = decide_rounding(e, t, static_cast<std::size_t>(lattice), std::move(verdict));
    verdict.row = "3c";
  } else {
    verdict = decide_place(e, t, std::move(verdict));
    verdict.row = "3d, " + verdict.row;
  }
  if (misplaced)
    for (Suspect& suspect : verdict.suspects) suspect.probability *= 1 - t.held;
  if (odd.empty()) return verdict;
  verdict.message = fmt::format("it acts as {} would with {}", last.effect, odd);
  verdict.suspects.front().probability *= 1 - t.held;
  if (!(explained > t.explains_well)) return verdict;
  verdict.answer = AtPlace{};  // a law there does it, whatever its name
  verdict.row = "3a";
  verdict.why = "an effect explains the gap by a size that is not its own";
  verdict.locations = by_effects;
  verdict.named = {{"unknown", without_guide(last.location)}};
  return verdict;
}

/// Row 3.
Verdict decide_effects(const Case& c, const std::vector<RankedCandidate>& ranked) {
  Verdict verdict;
  const RankedCandidate* first = nullptr;
  for (const RankedCandidate& own : ranked) {
    if (own.is_parameter) continue;
    if (first == nullptr) first = &own;
    const CandidateEvidence& single = c.evidence.singles[own.index];
    verdict.suspects.push_back(suspect_of(single, single.last(), own.probability));
  }
  verdict.named = {first->name()};
  verdict.locations = locations_by(c, ranked);
  add_ambiguous(c, ranked, verdict);
  const std::vector<Level> levels = levels_of(c, first->index);
  const std::size_t named = named_levels(c, levels);
  for (std::size_t i = 1; i < named; ++i) name_effects(c, levels[i], verdict);
  const Level& answer = levels[named - 1];
  verdict.largest = {levels.size(), levels.back().index};
  verdict.answer = Effects{named, answer.index};
  for (std::size_t i = 0; i < answer.candidate->effects.size(); ++i)
    verdict.suspects[i].parameters = answer.candidate->effects[i].parameters;
  verdict = doubted(c, *answer.candidate, ranked.front(), std::move(verdict));
  if (!is<Effects>(verdict)) return verdict;
  calibrate(c, *answer.candidate, verdict);
  add_parameter_beside(c.evidence, c.thresholds, verdict);
  if (std::get<Effects>(verdict.answer).parameter) {
    verdict.row = "3f";
    verdict.why = "the most probable effect, and a wrong parameter beside it";
  }
  return verdict;
}

}  // namespace

std::vector<LocationProbability> locations_of(const std::vector<std::pair<Place, double>>& speaking, double limit) {
  std::map<Place, double> sums;
  for (const auto& [location, probability] : speaking) sums[location] += probability;
  std::vector<LocationProbability> list;
  for (const auto& [location, sum] : sums) list.push_back({location, std::min(sum, limit)});
  std::stable_sort(list.begin(), list.end(),
                   [](const auto& a, const auto& b) { return a.probability > b.probability; });
  return list;
}

Index rounding_seen(const Evidence& evidence, const Thresholds& thresholds) {
  for (std::size_t i = 0; i < evidence.lattices.size(); ++i)
    if (evidence.lattices[i].noise_share > thresholds.rounded) return static_cast<Index>(i);
  return -1;
}

Verdict decide_rounding(const Evidence& evidence, const Thresholds& thresholds, std::size_t lattice, Verdict verdict) {
  const LatticeEvidence& own = evidence.lattices[lattice];
  const Place location = sensor_place(own.channel);
  verdict.answer = Rounding{lattice};
  verdict.row = "1b";
  verdict.why = "a converter's rounding makes much of the noise floor";
  verdict.ambiguous_with.clear();
  verdict.named = {{"quantisation", location}};
  verdict.locations = {{location, thresholds.rounding_seen}};
  verdict.suspects = {{"quantisation",
                       location,
                       "rounding",
                       thresholds.rounding_seen,
                       evidence.retuned.misfit,
                       {},
                       {{to_string(location) + ".quantum", own.step, 0}}}};
  return verdict;
}

namespace {

/// Rows 1 to 4.
Verdict decide_gap(const Evidence& evidence, const Thresholds& thresholds) {
  const Case c{evidence, thresholds};
  Verdict verdict;
  Contest contest = contest_of(evidence, thresholds);
  const bool small = gap_left(evidence) <= negligible(evidence, thresholds);
  // A correction is as inexact as its form, of a clock or a factor, and a small gap beside it has no name.
  const CorrectionEvidence& correction = evidence.correction;
  const bool inexact = small || gap_left(evidence) <= correction.interpolation;
  const bool seen = contest.effect_seen || contest.parameter_seen;
  if (!seen || (inexact && !correction.faults.empty())) {
    if (small && one_stands_out(c, verdict)) {
      verdict.row = "1a";
      verdict.why = "one parameter is off, and all others are nearer to their values";
      return verdict;
    }
    if (const Index lattice = rounding_seen(evidence, thresholds); lattice >= 0)
      return decide_rounding(evidence, thresholds, static_cast<std::size_t>(lattice), std::move(verdict));
    if (inexact) {
      verdict.answer = NoGap{};
      verdict.row = "1c";
      verdict.why = "nothing gains more than chance does";
      return verdict;
    }
    verdict = decide_place(evidence, thresholds, std::move(verdict));
    verdict.row = "1d, " + verdict.row;
    return verdict;
  }
  if (contest.ranked.front().is_parameter) {
    const RankedCandidate first = contest.ranked.front();
    for (const RankedCandidate& own : contest.ranked) {
      if (!own.is_parameter || own.probability < thresholds.considered) break;
      if (!parameter_explains(evidence, evidence.freed[own.index], thresholds)) continue;
      verdict = name_parameter(c, own);
      verdict.row = "2a";
      verdict.why = "one parameter outside its tolerance explains the gap";
      verdict.locations = locations_by(c, contest.ranked);
      add_ambiguous(c, contest.ranked, verdict);
      tell_component(c, evidence.freed[own.index], verdict);
      return verdict;
    }
    contest = contest_of_closing_effects(evidence, contest, thresholds);
    if (contest.ranked.empty()) {
      verdict = decide_place(evidence, thresholds, refuted_parameter(c, first));
      verdict.row = "2b, " + verdict.row;
      return verdict;
    }
  }
  return decide_effects(c, contest.ranked);
}

}  // namespace

Verdict decide(const Evidence& evidence, const Thresholds& thresholds) {
  Verdict verdict;
  if (!evidence.cannot_follow.empty()) {
    verdict.answer = Insufficient{};
    verdict.row = "0";
    verdict.why = "the plant and the records cannot be compared";
    verdict.message = evidence.cannot_follow;
    return verdict;
  }
  verdict = decide_gap(evidence, thresholds);
  if (is_unnamed(verdict)) {
    const std::string faults = fault_message(evidence.gross_faults);
    if (!faults.empty()) verdict.message = faults + (verdict.message.empty() ? "" : "; " + verdict.message);
  }
  return with_correction(evidence, thresholds, std::move(verdict));
}

}  // namespace wheelhop
