#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <utility>

#include "core/gap/verdict/posterior.hpp"
#include "core/gap/where/locate.hpp"
#include "core/gap/which/search.hpp"

namespace wheelhop {
namespace {

/// The singles to which a second effect is tried: the most probable ones, no fit twice, and, in place of the last of
/// these, the one that leaves least. Alone, the larger of two effects at two places may look improbable for its place.
/// @return their numbers among the candidates
std::vector<std::size_t> firsts(const Search& search, const std::vector<RankedCandidate>& ranked,
                                const Candidates& singles) {
  const std::vector<CandidateEvidence>& told = singles.evidence;
  std::vector<std::size_t> list;
  std::size_t least = told.size();
  const auto listed = [&](std::size_t candidate) {
    return std::any_of(list.begin(), list.end(),
                       [&](std::size_t other) { return told[other].fit == told[candidate].fit; });
  };
  for (const RankedCandidate& own : ranked) {
    if (own.is_parameter) continue;
    if (least == told.size() || told[own.index].chi2 < told[least].chi2) least = own.index;
    if (list.size() < search.effort.firsts && !listed(own.index)) list.push_back(own.index);
  }
  if (!list.empty() && !listed(least)) list.back() = least;
  return list;
}

/// The fit of a candidate, its labels first.
Hypothesis called(const Candidates& candidates, std::size_t number) {
  Hypothesis hypothesis = candidates.fit_of(number);
  const CandidateEvidence& told = candidates.evidence[number];
  for (std::size_t i = 0; i < told.effects.size(); ++i) {
    std::vector<Label>& labels = hypothesis.effects[i].labels;
    const auto own = std::find_if(labels.begin(), labels.end(),
                                  [&](const Label& label) { return label.effect == told.effects[i].effect; });
    std::rotate(labels.begin(), own, own == labels.end() ? own : own + 1);
  }
  return hypothesis;
}

/// Every further effect beside those of a candidate, whose fit is linearised by it.
/// @param known what candidates change around the re-tuned plant, which holds beside the first effect too
std::vector<Hypothesis> beside(const Search& search, Candidates& candidates, std::size_t number, const Changes& known) {
  const Study& study = search.study;
  Hypothesis& first = candidates.fit_of(number);
  if (first.fit.jacobian.size() == 0 && !linearise(first.fit, first.parameters, study.data.fitted)) return {};
  Hypothesis base = called(candidates, number);
  base.held_out =
      fit_plant(first.fit.plant, {}, study.data.held_out, study.solvers.quick, {2, &search.retuned.held_out, false});
  if (base.held_out.error.empty()) return {};
  const double least = search.effort.second_screened * (first.chi2 - study.data.samples);
  return extend(study, base,
                {.shortlist = search.effort.second_fits, .worth = search.effort.second_worth, .least = least}, known);
}

/// Puts a pair in the place of one of its forms that leaves more, or adds it. One that leaves no less changes nothing.
void keep_better(Hypothesis pair, std::vector<Hypothesis>& pairs) {
  const auto old = std::find_if(pairs.begin(), pairs.end(),
                                [&](const Hypothesis& other) { return same_forms(other.effects, pair.effects); });
  if (old == pairs.end())
    pairs.push_back(std::move(pair));
  else if (pair.chi2 < old->chi2)
    *old = std::move(pair);
}

/// The best pair once more with other laws at the place of one of its effects, from where it lies: those that leave
/// about as little alone. Two that differ little alone (a delay and a lag) may differ little in a pair as well, and the
/// answer has to weigh both, fitted equally well. Laws of instruments are exact, so that several forms of them are
/// tried; of those of an element the one next to the first effect, if it was not tried beside the second.
void add_exchanged(const Search& search, const std::vector<RankedCandidate>& ranked, const Candidates& singles,
                   std::vector<Hypothesis>& pairs) {
  if (pairs.empty()) return;
  const Hypothesis best =
      *std::min_element(pairs.begin(), pairs.end(), [](const auto& a, const auto& b) { return a.chi2 < b.chi2; });
  const double floor = search.study.data.samples;
  for (const std::size_t which : {0U, 1U}) {
    const EffectCandidate &own = best.effects[which], &other = best.effects[1 - which];
    const auto alone = std::find_if(singles.fits.begin(), singles.fits.end(),
                                    [&](const Hypothesis& single) { return same_form(single.effects.back(), own); });
    if (alone == singles.fits.end()) continue;
    const auto is_rival = [&](const Hypothesis& single) {
      const EffectCandidate& effect = single.effects.back();
      return effect.location == own.location && !same_form(effect, own) && !labellings({effect, other}).empty() &&
             single.chi2 - floor <= search.effort.far_behind * (alone->chi2 - floor);
    };
    std::vector<const Hypothesis*> rivals;
    if (is_path(own.location)) {
      for (const Hypothesis& single : singles.fits)
        if (is_rival(single)) rivals.push_back(&single);
      std::stable_sort(rivals.begin(), rivals.end(), [](const auto* a, const auto* b) { return a->chi2 < b->chi2; });
      if (rivals.size() > search.effort.exchanged) rivals.resize(search.effort.exchanged);
    } else if (which == 0) {
      const auto next = std::find_if(ranked.begin(), ranked.end(), [&](const RankedCandidate& rival) {
        if (rival.is_parameter || !is_rival(singles.fit_of(rival.index))) return false;
        return std::none_of(pairs.begin(), pairs.end(), [&](const Hypothesis& pair) {
          return same_form(pair.effects.front(), singles.fit_of(rival.index).effects.back()) &&
                 same_form(pair.effects.back(), other);
        });
      });
      if (next != ranked.end()) rivals.push_back(&singles.fit_of(next->index));
    }
    std::vector<Hypothesis> exchanged(rivals.size());
    tbb::parallel_for(std::size_t{0}, rivals.size(), [&](std::size_t i) {
      std::vector<SizedEffect> sized = {sized_effect(best, 0), sized_effect(best, 1)};
      sized[which] = sized_effect(*rivals[i], 0);
      exchanged[i] = fit_set(search.study, search.retuned, sized, best);
    });
    for (Hypothesis& pair : exchanged)
      if (!pair.fit.error.empty()) keep_better(std::move(pair), pairs);
  }
}

/// The singles on which a search for pairs depends: the first effects, then all at the instruments of the best pair.
/// @param numbers of the first ones   @param pairs what was found
std::vector<ReadSingle> read_by_search(const std::vector<std::size_t>& numbers, const Candidates& singles,
                                       const Candidates& pairs) {
  std::vector<ReadSingle> list;
  const auto add = [&](std::size_t number) {
    const Hypothesis& fit = singles.fit_of(number);
    list.push_back({singles.evidence[number].last().name(), fit.effects, fit.chi2});
  };
  for (const std::size_t number : numbers) add(number);
  const auto best = std::min_element(pairs.fits.begin(), pairs.fits.end(),
                                     [](const Hypothesis& a, const Hypothesis& b) { return a.chi2 < b.chi2; });
  if (best == pairs.fits.end()) return list;
  for (std::size_t number = 0; number < singles.evidence.size(); ++number) {
    const Place& place = singles.evidence[number].last().location;
    if (is_path(place) && std::any_of(best->effects.begin(), best->effects.end(),
                                      [&](const EffectCandidate& own) { return own.location == place; }))
      add(number);
  }
  return list;
}

bool same_singles(const std::vector<ReadSingle>& a, const std::vector<ReadSingle>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const ReadSingle& one, const ReadSingle& other) {
    return one.name == other.name && one.chi2 == other.chi2 && same_forms(one.effects, other.effects);
  });
}

/// Every second effect for the best first ones in turn, until a pair closes what the first leaves.
/// @param numbers of the first ones
std::vector<Hypothesis> pairs_of(const Search& search, const std::vector<RankedCandidate>& ranked,
                                 const std::vector<std::size_t>& numbers, const Changes& known, Candidates& singles) {
  const double floor = search.study.data.samples;
  const auto by_chi2 = [](const Hypothesis& a, const Hypothesis& b) { return a.chi2 < b.chi2; };
  const double best_left = std::min_element(singles.fits.begin(), singles.fits.end(), by_chi2)->chi2 - floor;
  std::vector<Hypothesis> all;
  double before = 0;
  for (const std::size_t i : numbers) {
    const CandidateEvidence& first = singles.evidence[i];
    // Of two effects either alone leaves about as much as the other; what leaves far more is no part of the answer.
    if (first.chi2 - floor > search.effort.far_behind * best_left) continue;
    if (search.step) search.step("a second effect beside " + to_string(first.last().name()));
    std::vector<Hypothesis> found = beside(search, singles, i, known);
    std::move(found.begin(), found.end(), std::back_inserter(all));
    std::stable_sort(all.begin(), all.end(), by_chi2);
    before = std::max(before, first.chi2);
    if (!all.empty() && all.front().chi2 - floor < search.effort.closed * (first.chi2 - floor)) break;
  }
  finish(search.study, before, static_cast<std::size_t>(search.effort.finished_pairs), all);
  add_exchanged(search, ranked, singles, all);
  std::stable_sort(all.begin(), all.end(), by_chi2);
  return all;
}

/// Puts a fit of a form alone in the place of the earlier one of that form, or adds it.
/// @return false if the earlier one is as good: nothing has changed then
bool replace(const Search& search, Hypothesis better, Evidence& evidence, Candidates& singles) {
  const auto old = std::find_if(singles.fits.begin(), singles.fits.end(),
                                [&](const Hypothesis& single) { return same_forms(single.effects, better.effects); });
  const auto number = static_cast<std::size_t>(old - singles.fits.begin());
  if (old == singles.fits.end()) {
    add_candidates(search, std::move(better), singles);
  } else {
    if (!(better.chi2 < old->chi2)) return false;
    std::erase_if(singles.evidence, [&](const CandidateEvidence& own) { return own.fit == number; });
    std::vector<CandidateEvidence> told = evidence_of(search, better, number);
    std::move(told.begin(), told.end(), std::back_inserter(singles.evidence));
    *old = std::move(better);
  }
  std::stable_sort(singles.evidence.begin(), singles.evidence.end(),
                   [](const CandidateEvidence& a, const CandidateEvidence& b) { return a.chi2 < b.chi2; });
  evidence.singles = singles.evidence;
  return true;
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

Candidates find_pairs(const Search& search, const Changes& changes, Candidates before, Evidence& evidence,
                      Candidates& singles) {
  const Study& study = search.study;
  Candidates pairs;
  // Around a plant that was bent by a gross fault, or to the end by what is missing, candidates change other things
  // than beside an effect.
  const Changes anew;
  const bool near = evidence.gross_faults.empty() && !evidence.retuned_stopped;
  for (int count = 0; count < search.effort.searches; ++count) {
    pairs = {};
    const std::vector<RankedCandidate> ranked = ranked_effects(search, evidence);
    const auto leading =
        std::find_if(ranked.begin(), ranked.end(), [](const RankedCandidate& own) { return !own.is_parameter; });
    if (leading == ranked.end()) return pairs;
    const std::size_t index = leading->index;
    if (asks_left_at_place(evidence, evidence.singles[index], search.thresholds))
      evidence.singles[index].left_at_place = singles.evidence[index].left_at_place =
          left_at_place(search, singles.fit_of(index));
    const CandidateEvidence first = evidence.singles[index];
    if (!worth_another(evidence, first, search.thresholds)) return pairs;
    // An effect that parameters imitate is told by the small rest that they cannot, and changes that were seen around
    // another plant are too inexact for that.
    const Changes& known = near && !bends_elsewhere(evidence, first, search.thresholds) ? changes : anew;
    const std::vector<std::size_t> numbers = firsts(search, ranked, singles);
    if (!before.fits.empty() && same_singles(before.read, read_by_search(numbers, singles, before))) return before;
    for (Hypothesis& pair : pairs_of(search, ranked, numbers, known, singles))
      add_candidates(search, std::move(pair), pairs);
    if (pairs.evidence.empty()) return pairs;
    pairs.read = read_by_search(numbers, singles, pairs);
    // By chi2 alone the best pair may be one of implausible sizes.
    const std::size_t best = ranked_sets(evidence, pairs.evidence, first, search.thresholds).front().index;
    const bool home = brings_home(evidence, first, pairs.evidence[best], search.thresholds);
    if (!effect_needed(evidence, pairs.evidence[best], 1, first.chi2, search.thresholds, home)) return pairs;
    // Backward elimination: the screen, around a plant that is bent by all that is missing, may have found one effect
    // only beside another that nothing needs, or a better fit of one than before.
    std::vector<Hypothesis> alone(2);
    tbb::parallel_for(std::size_t{0}, alone.size(), [&](std::size_t kept) {
      alone[kept] = fit_subset(study, search.retuned, pairs.fit_of(best), std::size_t{1} << kept);
    });
    bool again = false;
    for (const std::size_t kept : {1U, 0U}) {
      if (alone[kept].fit.error.empty()) continue;
      pairs.evidence[best].alone_chi2[kept] = alone[kept].chi2;
      if (again || effect_needed(evidence, pairs.evidence[best], 1 - kept, alone[kept].chi2, search.thresholds,
                                 home && kept == 0))
        continue;
      again = replace(search, alone[kept], evidence, singles);
    }
    for (Hypothesis& single : alone)
      if (!again && !single.fit.error.empty()) pairs.alone.push_back(std::move(single));
    if (!again) return pairs;
  }
  return pairs;
}

namespace {

/// Adds a set that lost an effect to those of its size. Of a pair either effect is fitted alone.
void add_rest(const Search& search, Hypothesis rest, Candidates& sets) {
  std::array<double, 2> alone_chi2{kUnknown, kUnknown};
  for (const std::size_t kept : {0U, 1U}) {
    if (rest.effects.size() != 2) break;
    const Hypothesis alone = fit_subset(search.study, search.retuned, rest, std::size_t{1} << kept);
    if (!alone.fit.error.empty()) alone_chi2[kept] = alone.chi2;
  }
  const std::size_t before = sets.evidence.size();
  add_candidates(search, std::move(rest), sets);
  for (std::size_t i = before; i < sets.evidence.size(); ++i) sets.evidence[i].alone_chi2 = alone_chi2;
}

/// Adds candidates to others, their fits after those that are there.
void append(Candidates more, Candidates& all) {
  for (CandidateEvidence& own : more.evidence) own.fit += all.fits.size();
  std::move(more.evidence.begin(), more.evidence.end(), std::back_inserter(all.evidence));
  std::move(more.fits.begin(), more.fits.end(), std::back_inserter(all.fits));
}

}  // namespace

bool grow(const Search& search, const Evidence& evidence, std::size_t count, std::size_t number, bool pending,
          EffectSets& sets) {
  if (count >= search.effort.most_effects) return false;
  CandidateEvidence& before = sets.of(count).evidence[number];
  if (asks_left_at_place(evidence, before, search.thresholds))
    before.left_at_place = left_at_place(search, sets.of(count).fit_of(number));
  const double chi2_before = before.chi2;
  const bool above_chance = chi2_before - evidence.samples > search.thresholds.notice * chance_of(evidence);
  if (!worth_another(evidence, before, search.thresholds) && !(pending && above_chance)) return false;
  std::string names;
  for (const EffectEvidence& effect : before.effects)
    names += (names.empty() ? "" : " and ") + to_string(effect.name());
  if (search.step) search.step("a further effect beside " + names);
  std::vector<Hypothesis> found = beside(search, sets.of(count), number, {});
  finish(search.study, chi2_before, static_cast<std::size_t>(search.effort.finished_pairs), found);
  if (found.empty()) return false;
  Candidates grown;
  for (Hypothesis& set : found) add_candidates(search, std::move(set), grown);
  const std::size_t best = ranked_sets(evidence, grown.evidence, before, search.thresholds).front().index;
  std::vector<double>& without = grown.evidence[best].without_chi2;
  without.assign(count + 1, kUnknown);
  without[count] = chi2_before;
  if (grown.evidence[best].chi2 < chi2_before) {
    std::vector<Hypothesis> rests(count);
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
      const std::size_t all = (std::size_t{2} << count) - 1;
      rests[i] = fit_subset(search.study, search.retuned, grown.fit_of(best), all ^ std::size_t{1} << i);
    });
    for (std::size_t i = 0; i < count; ++i) {
      if (rests[i].fit.error.empty()) continue;
      without[i] = rests[i].chi2;
      if (!effect_needed(evidence, grown.evidence[best], i, without[i], search.thresholds))
        add_rest(search, std::move(rests[i]), sets.of(count));
    }
  }
  append(std::move(grown), sets.larger);
  return true;
}

}  // namespace wheelhop
