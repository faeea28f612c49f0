#include <tbb/parallel_for.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <utility>

#include "core/gap/verdict/posterior.hpp"
#include "core/gap/where/locate.hpp"
#include "core/gap/which/search.hpp"

namespace wheelhop {
namespace {

/// The singles to which a second effect is tried: the most probable ones, no law twice, and, in place of the last of
/// these, the one that leaves least. Alone, the larger of two effects at two places may look improbable for its place.
std::vector<std::size_t> firsts(const Search& search, const std::vector<RankedCandidate>& ranked,
                                const std::vector<Hypothesis>& singles) {
  std::vector<std::size_t> list;  // of singles
  std::size_t least = singles.size();
  for (const RankedCandidate& own : ranked) {
    if (own.is_parameter) continue;
    if (least == singles.size() || singles[own.index].chi2 < singles[least].chi2) least = own.index;
    if (list.size() < search.effort.firsts && std::none_of(list.begin(), list.end(), [&](std::size_t other) {
          return twins(singles[other], singles[own.index]);
        }))
      list.push_back(own.index);
  }
  if (!list.empty() && std::find(list.begin(), list.end(), least) == list.end()) list.back() = least;
  return list;
}

/// Every further effect beside those of a fit.
/// @param known what candidates change around the re-tuned plant, which holds beside the first effect too
std::vector<Hypothesis> beside(const Search& search, Hypothesis& first, const Changes& known) {
  const Study& study = search.study;
  if (first.fit.jacobian.size() == 0 && !linearise(first.fit, first.parameters, study.data.fitted)) return {};
  Hypothesis base = first;
  base.held_out =
      fit_plant(first.fit.plant, {}, study.data.held_out, study.solvers.quick, {2, &search.retuned.held_out, false});
  if (base.held_out.error.empty()) return {};
  const double least = search.effort.second_screened * (first.chi2 - study.data.samples);
  return extend(study, base,
                {.shortlist = search.effort.second_fits, .worth = search.effort.second_worth, .least = least}, known);
}

/// Each pair once more under the other names that the law of its first effect has.
void add_twins(const std::vector<RankedCandidate>& ranked, const std::vector<Hypothesis>& singles,
               std::vector<Hypothesis>& pairs) {
  std::map<std::string, const Hypothesis*> named;
  for (const RankedCandidate& own : ranked)
    if (!own.is_parameter) named[own.name()] = &singles[own.index];
  const std::size_t count = pairs.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Hypothesis& first = *named.at(name_of(pairs[i].effects.front()));
    for (const auto& [name, twin] : named) {
      if (name == name_of(pairs[i].effects.back()) || !twins(first, *twin)) continue;
      pairs.push_back(pairs[i]);
      pairs.back().effects.front() = twin->effects.back();
      pairs.back().plausibility += twin->plausibility - first.plausibility;
    }
  }
}

/// The best pair once more with what is next to its first effect alone, at the same place and by another law. Only that
/// first effect was tried beside the second; two that differ little alone (a delay and a lag) may differ little in a
/// pair as well, and the answer has to weigh both.
void add_exchanged(const Search& search, const std::vector<RankedCandidate>& ranked,
                   const std::vector<Hypothesis>& singles, std::vector<Hypothesis>& pairs) {
  if (pairs.empty()) return;
  const Hypothesis& best =
      *std::min_element(pairs.begin(), pairs.end(), [](const auto& a, const auto& b) { return a.chi2 < b.chi2; });
  const EffectCandidate &first = best.effects.front(), &second = best.effects.back();
  const auto is_first = [&](const RankedCandidate& own) { return !own.is_parameter && own.name() == name_of(first); };
  const auto known = std::find_if(ranked.begin(), ranked.end(), is_first);
  if (known == ranked.end()) return;
  const double floor = search.study.data.samples, of_first = singles[known->index].chi2 - floor;
  const auto is_rival = [&](const RankedCandidate& own) {
    if (own.is_parameter || own.name() == name_of(first) || own.name() == name_of(second)) return false;
    const Hypothesis& single = singles[own.index];
    return single.effects.back().location == first.location && !twins(single, singles[known->index]) &&
           single.chi2 - floor <= search.effort.far_behind * of_first &&
           std::none_of(pairs.begin(), pairs.end(), [&](const Hypothesis& pair) {
             return name_of(pair.effects.front()) == own.name() && name_of(pair.effects.back()) == name_of(second);
           });
  };
  const auto rival = std::find_if(ranked.begin(), ranked.end(), is_rival);
  if (rival == ranked.end()) return;
  const SizedEffect instead = sized_effect(singles[rival->index], singles[rival->index].effects.size() - 1);
  Hypothesis exchanged = fit_set(search.study, search.retuned, {instead, sized_effect(best, 1)}, best);
  if (exchanged.fit.error.empty()) return;
  // Under every name that the second effect has in the pair.
  std::vector<Hypothesis> named = {exchanged};
  for (const Hypothesis& pair : pairs) {
    if (!twins(best, pair)) continue;
    named.push_back(exchanged);
    named.back().effects.back() = pair.effects.back();
    named.back().plausibility += pair.plausibility - best.plausibility;
  }
  std::move(named.begin(), named.end(), std::back_inserter(pairs));
}

/// Every second effect for the best first ones in turn, until a pair closes what the first leaves.
std::vector<Hypothesis> pairs_of(const Search& search, const std::vector<RankedCandidate>& ranked, const Changes& known,
                                 std::vector<Hypothesis>& singles) {
  const double floor = search.study.data.samples;
  const auto by_chi2 = [](const Hypothesis& a, const Hypothesis& b) { return a.chi2 < b.chi2; };
  const double best_left = std::min_element(singles.begin(), singles.end(), by_chi2)->chi2 - floor;
  std::vector<Hypothesis> all;
  double before = 0;
  for (const std::size_t i : firsts(search, ranked, singles)) {
    Hypothesis& first = singles[i];
    // Of two effects either alone leaves about as much as the other; what leaves far more is no part of the answer.
    if (first.chi2 - floor > search.effort.far_behind * best_left) continue;
    if (search.step) search.step("a second effect beside " + name_of(first.effects.back()));
    std::vector<Hypothesis> found = beside(search, first, known);
    std::move(found.begin(), found.end(), std::back_inserter(all));
    std::stable_sort(all.begin(), all.end(), by_chi2);
    before = std::max(before, first.chi2);
    if (!all.empty() && all.front().chi2 - floor < search.effort.closed * (first.chi2 - floor)) break;
  }
  finish(search.study, before, static_cast<std::size_t>(search.effort.finished_pairs), all);
  add_exchanged(search, ranked, singles, all);
  add_twins(ranked, singles, all);
  std::stable_sort(all.begin(), all.end(), by_chi2);
  return all;
}

/// A better fit of an effect alone takes the place of the old ones of its name, and of those of its twins.
void replace(const Search& search, const Hypothesis& better, Evidence& evidence, Candidates& singles) {
  for (Hypothesis& own : with_twins(better, singles.fits)) {
    const std::string name = name_of(own.effects.back());
    for (std::size_t i = singles.fits.size(); i-- > 0;) {
      if (name_of(singles.fits[i].effects.back()) != name) continue;
      singles.fits.erase(singles.fits.begin() + static_cast<std::ptrdiff_t>(i));
      singles.evidence.erase(singles.evidence.begin() + static_cast<std::ptrdiff_t>(i));
    }
    singles.evidence.push_back(evidence_of(search, own));
    singles.fits.push_back(std::move(own));
  }
  evidence.singles = singles.evidence;
}

/// The effects that are ranked for the answer: with wrong parameters, or once these are no answer.
std::vector<RankedCandidate> ranked_effects(const Search& search, const Evidence& evidence) {
  const Contest contest = contest_of(evidence, search.thresholds);
  if (!contest.effect_seen && !contest.parameter_seen) return {};
  if (contest.ranked.empty() || !contest.ranked.front().is_parameter) return contest.ranked;
  if (parameter_explains(evidence, evidence.freed[contest.ranked.front().index], search.thresholds)) return {};
  return contest_of_closing_effects(evidence, contest, search.thresholds).ranked;
}

/// What an unknown signal at a place of the effects leaves once these are in, over what it leaves at the best place: of
/// their places the one where that is least.
double left_at_place(const Search& search, Hypothesis& hypothesis) {
  const Study& study = search.study;
  if (!linearise(hypothesis.fit, hypothesis.parameters, study.data.fitted)) return 1;
  const std::vector<PlaceLeftover> places = locate(hypothesis.fit, study.data.fitted, study.data.noise_shares);
  double least = std::numeric_limits<double>::infinity();
  for (const EffectCandidate& effect : hypothesis.effects)
    least = std::min(least, leftover_ratio(places, effect.location));
  return least;
}

}  // namespace

Candidates find_pairs(const Search& search, const Changes& changes, Evidence& evidence, Candidates& singles) {
  const Study& study = search.study;
  Candidates pairs;
  // Around a plant that was bent by a gross fault, or to the end by what is missing, candidates change other things
  // than beside an effect.
  const Changes anew;
  const Changes& known = evidence.gross_faults.empty() && !evidence.retuned_stopped ? changes : anew;
  for (int count = 0; count < search.effort.searches; ++count) {
    pairs = {};
    const std::vector<RankedCandidate> ranked = ranked_effects(search, evidence);
    const auto leading =
        std::find_if(ranked.begin(), ranked.end(), [](const RankedCandidate& own) { return !own.is_parameter; });
    if (leading == ranked.end()) return pairs;
    const std::size_t index = leading->index;
    if (asks_left_at_place(evidence, evidence.singles[index], search.thresholds))
      evidence.singles[index].left_at_place = singles.evidence[index].left_at_place =
          left_at_place(search, singles.fits[index]);
    const CandidateEvidence first = evidence.singles[index];
    if (!worth_another(evidence, first, search.thresholds)) return pairs;
    pairs.fits = pairs_of(search, ranked, known, singles.fits);
    if (pairs.fits.empty()) return pairs;
    for (const Hypothesis& pair : pairs.fits) pairs.evidence.push_back(evidence_of(search, pair));
    // By chi2 alone the best pair may be one of implausible sizes.
    const std::size_t best = ranked_sets(evidence, pairs.evidence, first, search.thresholds).front().index;
    if (!effect_needed(evidence, pairs.evidence[best], 1, first.chi2, search.thresholds)) return pairs;
    // Backward elimination: the screen, around a plant that is bent by all that is missing, may have found one effect
    // only beside another that nothing needs, or a better fit of one than before.
    std::vector<Hypothesis> alone(2);
    tbb::parallel_for(std::size_t{0}, alone.size(), [&](std::size_t kept) {
      alone[kept] = fit_subset(study, search.retuned, pairs.fits[best], std::size_t{1} << kept);
    });
    bool again = false;
    for (const std::size_t kept : {1U, 0U}) {
      if (alone[kept].fit.error.empty()) continue;
      pairs.evidence[best].alone_chi2[kept] = alone[kept].chi2;
      if (again || effect_needed(evidence, pairs.evidence[best], 1 - kept, alone[kept].chi2, search.thresholds))
        continue;
      replace(search, alone[kept], evidence, singles);
      again = true;
    }
    for (Hypothesis& single : alone)
      if (!again && !single.fit.error.empty()) pairs.alone.push_back(std::move(single));
    if (!again) return pairs;
  }
  return pairs;
}

namespace {

/// A set that lost an effect, as one of its size. Of a pair either effect is fitted alone.
CandidateEvidence evidence_of_rest(const Search& search, const Hypothesis& rest) {
  CandidateEvidence told = evidence_of(search, rest);
  if (rest.effects.size() != 2) return told;
  for (const std::size_t kept : {0U, 1U}) {
    const Hypothesis alone = fit_subset(search.study, search.retuned, rest, std::size_t{1} << kept);
    if (!alone.fit.error.empty()) told.alone_chi2[kept] = alone.chi2;
  }
  return told;
}

}  // namespace

bool grow(const Search& search, const Evidence& evidence, std::size_t count, std::size_t number, bool pending,
          EffectSets& sets) {
  if (count >= search.effort.most_effects) return false;
  Hypothesis base = sets.of(count).fits[number];
  CandidateEvidence& before = sets.of(count).evidence[number];
  if (asks_left_at_place(evidence, before, search.thresholds)) before.left_at_place = left_at_place(search, base);
  const bool above_chance = before.chi2 - evidence.samples > search.thresholds.notice * chance_of(evidence);
  if (!worth_another(evidence, before, search.thresholds) && !(pending && above_chance)) return false;
  std::string names;
  for (const EffectCandidate& effect : base.effects) names += (names.empty() ? "" : " and ") + name_of(effect);
  if (search.step) search.step("a further effect beside " + names);
  std::vector<Hypothesis> found = beside(search, base, {});
  finish(search.study, before.chi2, static_cast<std::size_t>(search.effort.finished_pairs), found);
  if (found.empty()) return false;
  std::vector<CandidateEvidence> told;
  for (const Hypothesis& set : found) told.push_back(evidence_of(search, set));
  const std::size_t best = ranked_sets(evidence, told, before, search.thresholds).front().index;
  std::vector<double>& without = told[best].without_chi2;
  without.assign(count + 1, kUnknown);
  without[count] = before.chi2;
  if (told[best].chi2 < before.chi2) {
    std::vector<Hypothesis> rests(count);
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
      const std::size_t all = (std::size_t{2} << count) - 1;
      rests[i] = fit_subset(search.study, search.retuned, found[best], all ^ std::size_t{1} << i);
    });
    for (std::size_t i = 0; i < count; ++i) {
      if (rests[i].fit.error.empty()) continue;
      without[i] = rests[i].chi2;
      if (effect_needed(evidence, told[best], i, without[i], search.thresholds)) continue;
      sets.of(count).evidence.push_back(evidence_of_rest(search, rests[i]));
      sets.of(count).fits.push_back(std::move(rests[i]));
    }
  }
  std::move(found.begin(), found.end(), std::back_inserter(sets.larger.fits));
  std::move(told.begin(), told.end(), std::back_inserter(sets.larger.evidence));
  return true;
}

}  // namespace wheelhop
