#include "core/gap/judge.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <utility>

namespace wheelhop {
namespace {

constexpr double kSecond = 0.5;       // share of what is left that a second effect has to remove
constexpr double kSecondThere = 0.7;  // likewise, where the first one stands
constexpr double kPromising = 0.025;  // and that the screen has to expect: of a mode it knows a wrong frequency alone
constexpr double kFarBehind = 3;      // of what the best first effect leaves
constexpr double kClosed = 0.1;       // of what a first effect leaves, what a pair may leave for no other to be tried
constexpr std::size_t kBeam = 2;      // first effects to which a second is tried
constexpr std::size_t kFinishedPairs = 3;  // of the quick fits of pairs, the best that are fitted on to the end

/// The first effects to which a second is tried: the most probable ones, no law twice, and, in place of the last of
/// these, the one that leaves least. Alone, the larger of two effects at two places may look improbable for its place.
std::vector<std::size_t> firsts(const Contest& contest) {
  const std::vector<Rival>& rivals = contest.rivals;
  const auto single = [&](std::size_t i) -> const Hypothesis& { return contest.singles[rivals[i].hypothesis]; };
  std::vector<std::size_t> list;
  for (std::size_t i = 0; i < rivals.size() && list.size() < kBeam; ++i)
    if (!rivals[i].is_parameter &&
        std::none_of(list.begin(), list.end(), [&](std::size_t other) { return twins(single(other), single(i)); }))
      list.push_back(i);
  std::size_t least = list.empty() ? 0 : list.front();
  for (std::size_t i = 0; i < rivals.size(); ++i)
    if (!rivals[i].is_parameter && rivals[i].chi2 < rivals[least].chi2) least = i;
  if (!list.empty() && std::find(list.begin(), list.end(), least) == list.end()) list.back() = least;
  return list;
}

/// Every second effect for one first.
/// @param known what candidates change around the re-tuned plant, which holds beside the first effect too
std::vector<Hypothesis> beside(const GapCase& c, Hypothesis& first, const Changes& known) {
  if (first.fit.jacobian.size() == 0 && !linearise(first.fit, first.parameters, c.study.data.fitted)) return {};
  Hypothesis base = first;
  base.held_out =
      fit_plant(first.fit.plant, {}, c.study.data.held_out, c.study.solvers.quick, {2, &c.retuned.held_out, false});
  if (base.held_out.error.empty()) return {};
  const double least = kPromising * (first.chi2 - c.floor_chi2());
  return extend(c.study, base, {.shortlist = 5, .worth = 0.2, .least = least, .without = name_of(first.effects.back())},
                known);
}

/// Each pair once more under the other names that the law of its first effect has.
void add_twins(const Contest& contest, std::vector<Hypothesis>& pairs) {
  std::map<std::string, const Hypothesis*> singles;
  for (const Rival& rival : contest.rivals)
    if (!rival.is_parameter) singles[rival.name()] = &contest.singles[rival.hypothesis];
  const std::size_t own = pairs.size();
  for (std::size_t i = 0; i < own; ++i) {
    const Hypothesis& first = *singles.at(name_of(pairs[i].effects.front()));
    for (const auto& [name, twin] : singles) {
      if (name == name_of(pairs[i].effects.back()) || !twins(first, *twin)) continue;
      pairs.push_back(pairs[i]);
      pairs.back().effects.front() = twin->effects.back();
      pairs.back().plausibility += twin->plausibility - first.plausibility;
    }
  }
}

/// Every second effect for the best first ones in turn, until a pair closes what the first leaves.
std::vector<Hypothesis> pairs(const GapCase& c, Contest& contest) {
  // Around a plant that was bent by a wrong scale, or to the end by what is missing, candidates change other things
  // than beside an effect.
  const bool bent = !c.wrong_scales.empty() || stopped(c.retuned.fit, static_cast<Index>(c.study.tolerances.size()));
  const Changes anew;
  const Changes& known = bent ? anew : std::as_const(contest.changes);
  const auto by_chi2 = [](const Hypothesis& a, const Hypothesis& b) { return a.chi2 < b.chi2; };
  std::vector<Hypothesis> all;
  double before = 0;
  for (const std::size_t i : firsts(contest)) {
    Hypothesis& first = contest.singles[contest.rivals[i].hypothesis];
    // Of two effects either alone leaves about as much as the other; what leaves far more is no part of the answer.
    if (first.chi2 - c.floor_chi2() > kFarBehind * (contest.singles.front().chi2 - c.floor_chi2())) continue;
    if (c.step) c.step("a second effect beside " + contest.rivals[i].name());
    std::vector<Hypothesis> found = beside(c, first, known);
    std::move(found.begin(), found.end(), std::back_inserter(all));
    std::stable_sort(all.begin(), all.end(), by_chi2);
    before = std::max(before, first.chi2);
    if (!all.empty() && all.front().chi2 - c.floor_chi2() < kClosed * (first.chi2 - c.floor_chi2())) break;
  }
  finish(c.study, before, kFinishedPairs, all);
  add_twins(contest, all);
  std::stable_sort(all.begin(), all.end(), by_chi2);
  return all;
}

/// What pairs say of locations: each counts for either of its effects. That of the effect named first leads.
void locate_pairs(const std::vector<Hypothesis>& pairs, const std::vector<Rival>& rivals, Diagnosis& diagnosis) {
  std::map<std::string, double> sums;
  for (const Rival& rival : rivals) {
    std::set<std::string> places;
    for (const EffectCandidate& effect : pairs[rival.hypothesis].effects) places.insert(effect.location);
    for (const std::string& place : places) sums[place] += rival.probability;
  }
  diagnosis.locations = ranked(sums);
  const std::string& name = diagnosis.named.front();
  const auto own = std::find_if(diagnosis.locations.begin(), diagnosis.locations.end(),
                                [&](const auto& place) { return name.ends_with("@" + place.location); });
  if (own != diagnosis.locations.end()) std::rotate(diagnosis.locations.begin(), own, own + 1);
}

/// Puts the suspect that is named first at the head of the list.
void lead(Diagnosis& diagnosis) {
  const auto own = std::find_if(diagnosis.suspects.begin(), diagnosis.suspects.end(), [&](const Suspect& suspect) {
    return suspect.effect + "@" + suspect.location == diagnosis.named.front();
  });
  if (own != diagnosis.suspects.end()) std::rotate(diagnosis.suspects.begin(), own, own + 1);
}

}  // namespace

bool add_second(const GapCase& c, Contest& contest, const Weighing& weighing, Hypothesis& answer,
                Diagnosis& diagnosis) {
  std::vector<Hypothesis>& singles = contest.singles;
  std::vector<Hypothesis> seconds = pairs(c, contest);
  if (seconds.empty()) return false;
  // By chi2 alone the best pair may be one of implausible sizes.
  std::vector<Rival> others = rivals_of(seconds);
  weigh(others, {diagnosis.floor.colour, answer.chi2 - c.floor_chi2(), c.floor_chi2()});
  const Hypothesis& pair = seconds[others.front().hypothesis];
  const double notice = kNotice * diagnosis.floor.colour;
  // At one place a second effect may be no more than what the first one's form does not fit: it has to do better.
  const bool one_place = pair.effects[0].location == pair.effects[1].location;
  const auto needed = [&](const Hypothesis& alone) {
    const double remains = alone.chi2 - c.floor_chi2();
    return alone.chi2 - pair.chi2 > std::max((one_place ? kSecondThere : kSecond) * remains, notice);
  };
  if (!needed(answer)) return false;
  // Backward elimination: the screen, around a plant that is bent by all that is missing, may have found one effect
  // only beside another that nothing needs, or a better fit of one than before.
  std::vector<Hypothesis> alone(2);
  tbb::parallel_for(std::size_t{0}, alone.size(), [&](std::size_t kept) {
    alone[kept] = fit_subset(c.study, c.retuned, pair, std::size_t{1} << kept);
  });
  for (const std::size_t kept : {1U, 0U}) {
    if (alone[kept].fit.error.empty() || needed(alone[kept])) continue;
    for (Hypothesis& single : with_twins(alone[kept], singles)) {
      Rival rival = rivals_of({single}).front();
      std::erase_if(contest.rivals, [&](const Rival& old) { return !old.is_parameter && old.name() == rival.name(); });
      rival.hypothesis = singles.size();
      rival.plausibility -= place_penalty(diagnosis.places, rival.location);
      contest.rivals.push_back(std::move(rival));
      singles.push_back(std::move(single));
    }
    weigh(contest.rivals, weighing);
    answer = name_first(c, singles, contest.rivals, diagnosis);
    return true;
  }
  for (Hypothesis& single : alone)
    if (!single.fit.error.empty()) singles.push_back(std::move(single));
  diagnosis.named = {name_of(pair.effects[0]), name_of(pair.effects[1])};
  diagnosis.outcome = GapOutcome::several;
  lead(diagnosis);
  locate_pairs(seconds, others, diagnosis);
  // A pair stands there in either order, and alone its two effects had shared what they now have together.
  const auto sure_of = [&](const EffectCandidate& effect) {
    double sum = 0;
    for (const Rival& other : others) {
      const std::vector<EffectCandidate>& both = seconds[other.hypothesis].effects;
      if (name_of(both[0]) == name_of(effect) || name_of(both[1]) == name_of(effect)) sum += other.probability;
    }
    return std::min(sum, kLimit);
  };
  Suspect& leading = diagnosis.suspects.front();
  leading.probability = std::max(leading.probability, sure_of(pair.effects[0]));
  const auto own_rival =
      std::find_if(others.begin(), others.end(), [&](const Rival& r) { return r.name() == diagnosis.named.back(); });
  own_rival->probability = sure_of(pair.effects[1]);
  diagnosis.suspects.insert(diagnosis.suspects.begin() + 1, suspect_of(c, *own_rival, pair));
  add_ambiguous(others, diagnosis);
  answer = pair;
  return false;
}

}  // namespace wheelhop
