#include "core/gap/diagnose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "core/gap/rivals.hpp"
#include "core/gap/unknown.hpp"

namespace wheelhop {
namespace {

constexpr double kLimit = 0.99;         // no probability is ever 1
constexpr double kNotice = 40;          // fall of chi2 over the noise's colour from which an effect is more than chance
constexpr double kWorthFitting = 0.25;  // of that, expected by the screen
constexpr double kOutOfTolerance = 3;   // surprise of a parameter
constexpr double kExplains = 0.7;       // closure below which no family of the catalogue fits
constexpr double kExplainsWell = 0.9;   // closure from which the place need not be asked
constexpr double kElsewhere = 1.5;      // leftover over that of the best place, from which the gap enters elsewhere
constexpr double kSecond = 0.5;         // share of what is left that a second effect has to remove
constexpr double kSecondThere = 0.7;    // likewise, where the first one stands
constexpr double kWorthSecond = 0.06;   // share of the gap that must be left for a second effect to be looked for
constexpr double kConsidered = 0.05;    // probability from which a rival is named
constexpr double kOwnDoing = 0.04;  // share of an unknown signal that states explain, below which it is from outside
constexpr double kRounded = 0.15;   // share of the floor that rounding makes, from which the converter is named
constexpr double kRoundingSeen = 0.95;  // probability of a lattice that was seen in the readings
constexpr double kPlausible = -4;       // log density of an answer's sizes, below which they are odd
constexpr double kSame = 0.9;           // closure from which a rival would have done as well
constexpr double kTooSmall = 0.1;       // misfit - 1 below which an unexplained gap is no ground for any statement
constexpr const char* kGuide = "guide:";
constexpr double kFarBehind = 3;  // of what the best first effect leaves
constexpr std::size_t kBeam = 3;  // first effects to which a second is tried

/// What has been computed and is being judged.
struct Case {
  const Study& study;
  const DiagnoseOptions& options;
  const Hypothesis& delivered;
  const Hypothesis& retuned;
  Random& random;
  const std::function<void(const std::string&)>& step;
  double floor_chi2() const { return study.data.samples; }
};

std::vector<FittedParameter> fitted_parameters(const PlantFit& fit, const std::vector<FitParameter>& list,
                                               std::size_t first) {
  std::vector<FittedParameter> out;
  for (std::size_t i = first; i < list.size(); ++i) {
    const double variance =
        fit.covariance.size() > 0 ? fit.covariance(static_cast<Index>(i), static_cast<Index>(i)) : 0.0;
    out.push_back({list[i].name, get_parameter(fit.plant, list[i].name), std::sqrt(variance) * list[i].scale});
  }
  return out;
}

void add_locations(const std::vector<Rival>& rivals, Diagnosis& diagnosis) {
  std::map<std::string, double> sums;
  for (const Rival& rival : rivals) sums[rival.location] += rival.probability;
  diagnosis.locations.clear();
  for (const auto& [location, sum] : sums) diagnosis.locations.push_back({location, std::min(sum, kLimit)});
  std::stable_sort(diagnosis.locations.begin(), diagnosis.locations.end(),
                   [](const auto& a, const auto& b) { return a.probability > b.probability; });
}

void add_ambiguous(const std::vector<Rival>& rivals, Diagnosis& diagnosis) {
  for (const Rival& rival : rivals)
    if (rival.probability > kConsidered &&
        std::find(diagnosis.named.begin(), diagnosis.named.end(), rival.name()) == diagnosis.named.end())
      diagnosis.ambiguous_with.push_back(rival.name());
}

Suspect suspect_of(const Case& c, const Rival& rival, const Hypothesis& hypothesis) {
  return {rival.effect,
          rival.location,
          hypothesis.effects.back().form,
          rival.probability,
          hypothesis.stage.misfit,
          closure(c.retuned.stage.blocks, hypothesis.stage.blocks, c.options.draws, c.random),
          fitted_parameters(hypothesis.fit, hypothesis.parameters, c.study.tolerances.size())};
}

/// Locations by what an unknown signal there leaves, as rivals over blocks of time.
void locate_by_leftover(Diagnosis& diagnosis) {
  if (diagnosis.places.empty()) return;
  Vector leftovers(static_cast<Index>(diagnosis.places.size()));
  for (std::size_t i = 0; i < diagnosis.places.size(); ++i)
    leftovers(static_cast<Index>(i)) = std::max(diagnosis.places[i].leftover, 1e-3);
  const Vector p = rival_probabilities(leftovers, diagnosis.retuned.blocks.size(), kLimit);
  diagnosis.locations.clear();
  for (std::size_t i = 0; i < diagnosis.places.size(); ++i)
    diagnosis.locations.push_back({diagnosis.places[i].location, p(static_cast<Index>(i))});
}

/// Nothing of the catalogue explains the gap: the answer is a place, and whether the plant's states make the signal.
void name_unknown(const Case& c, Diagnosis& diagnosis) {
  diagnosis.outcome = GapOutcome::located_not_in_catalogue;
  diagnosis.ambiguous_with.clear();
  // What fits by chance says nothing of the place; the leftovers do.
  locate_by_leftover(diagnosis);
  if (diagnosis.locations.empty()) return;
  std::string& location = diagnosis.locations.front().location;
  const double own = explained_by_states(c.retuned.fit, c.study.data.fitted, location);
  if (own < kOwnDoing) {  // a force from outside acts on a mass, if the place can be one
    const Place& place = diagnosis.places.front();
    std::vector<std::string> entries = place.same;
    entries.insert(entries.begin(), place.location);
    const auto guide = std::find_if(entries.begin(), entries.end(),
                                    [](const std::string& entry) { return entry.starts_with(kGuide); });
    if (guide != entries.end()) {
      location = *guide;
      diagnosis.outcome = GapOutcome::exogenous;
    }
  }
  // A force between the ground and a mass is one on the mass.
  if (location.starts_with(kGuide)) location.erase(0, std::strlen(kGuide));
  diagnosis.named = {(diagnosis.outcome == GapOutcome::exogenous ? "exogenous_force@" : "unknown@") + location};
}

/// A converter whose steps make most of the noise: no model removes them, but they are the reason for the floor.
bool name_rounding(const Case& c, Diagnosis& diagnosis) {
  const FitRecord& record = c.study.data.fitted.front();
  for (Index j = 0; j < record.quantum.size(); ++j) {
    const double rounding = record.quantum(j) / std::sqrt(12.0);
    if (!(rounding * rounding > kRounded * diagnosis.floor.std(j) * diagnosis.floor.std(j))) continue;
    const std::string location = "sensor:" + c.study.nominal.sensors[static_cast<std::size_t>(j)].name;
    diagnosis.outcome = GapOutcome::effect;
    diagnosis.named = {"quantisation@" + location};
    diagnosis.locations = {{location, kRoundingSeen}};
    diagnosis.suspects = {{"quantisation",
                           location,
                           "rounding",
                           kRoundingSeen,
                           c.retuned.stage.misfit,
                           {},
                           {{location + ".quantum", record.quantum(j), 0}}}};
    return true;
  }
  return false;
}

/// The answer is one parameter of the plant, free of its tolerance.
void name_parameter(const Case& c, const Rival& rival, Diagnosis& diagnosis) {
  std::vector<FitParameter> free = c.study.tolerances;
  free[rival.hypothesis].prior_std = 0;
  Hypothesis answer = fit_from(c.study, c.retuned, free);
  if (!answer.fit.error.empty()) linearise(answer.fit, free, c.study.data.fitted);
  const Hypothesis& best = answer.fit.error.empty() ? c.retuned : answer;
  diagnosis.outcome = GapOutcome::parameter;
  diagnosis.named = {rival.name()};
  diagnosis.corrected = best.stage;
  diagnosis.plant = best.fit.plant;
  diagnosis.closure = closure(c.delivered.stage.blocks, best.stage.blocks, c.options.draws, c.random);
  const FittedParameter fitted = fitted_parameters(best.fit, free, 0)[rival.hypothesis];
  diagnosis.suspects = {
      {rival.effect, rival.location, "", rival.probability, best.stage.misfit, diagnosis.closure, {fitted}}};
}

void name_nothing(const Case& c, Diagnosis& diagnosis) {
  diagnosis.outcome = GapOutcome::none;
  diagnosis.corrected = c.retuned.stage;
  diagnosis.plant = c.retuned.fit.plant;
  diagnosis.closure = closure(c.delivered.stage.blocks, c.retuned.stage.blocks, c.options.draws, c.random);
}

/// Every second effect for each of the best first ones.
std::vector<Hypothesis> pairs(const Case& c, std::vector<Hypothesis>& singles, const std::vector<Rival>& rivals,
                              Changes& changes) {
  std::vector<Hypothesis> all;
  for (std::size_t i = 0; i < std::min(kBeam, rivals.size()); ++i) {
    if (rivals[i].is_parameter) continue;
    Hypothesis& first = singles[rivals[i].hypothesis];
    // Of two effects either alone leaves about as much as the other; what leaves far more is no part of the answer.
    if (first.chi2 - c.floor_chi2() > kFarBehind * (singles.front().chi2 - c.floor_chi2())) continue;
    if (c.step) c.step(fmt::format("a second effect beside {}", rivals[i].name()));
    if (first.fit.jacobian.size() == 0 && !linearise(first.fit, first.parameters, c.study.data.fitted)) continue;
    Hypothesis base = first;
    base.held_out =
        fit_plant(first.fit.plant, {}, c.study.data.held_out, c.study.solvers.quick, {2, &c.retuned.held_out});
    if (base.held_out.error.empty()) continue;
    for (Hypothesis& pair :
         extend(c.study, base, {.shortlist = 5, .polished = 1, .without = rivals[i].name()}, changes))
      all.push_back(std::move(pair));
  }
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.chi2 < b.chi2; });
  return all;
}

void add_check(Diagnosis& diagnosis, const std::string& name, bool passed, std::string detail) {
  diagnosis.checks.push_back({name, passed, std::move(detail)});
}

/// @param answer linearised
void check_answer(const Case& c, const Hypothesis& answer, Diagnosis& diagnosis) {
  const double left = answer.fit.misfit - 1;
  add_check(diagnosis, "nothing of note is left", left < kTooSmall,
            fmt::format("misfit {:.3f} of the fitted records, 1 is the floor", answer.fit.misfit));
  const auto count = static_cast<Index>(c.study.tolerances.size());
  const Vector z = answer.fit.theta.head(count);
  if (answer.fit.covariance.size() > 0 && count > 0) {
    Index most = 0;
    const double surprise = surprises(answer.fit, count).cwiseAbs().maxCoeff(&most);
    add_check(diagnosis, "parameters come home into their tolerances", surprise < kOutOfTolerance,
              fmt::format("sum of squares {:.1f} tolerances, {:.1f} without the effect; furthest {} at {:.1f}",
                          z.squaredNorm(), c.retuned.fit.theta.squaredNorm(),
                          c.study.tolerances[static_cast<std::size_t>(most)].name, z(most)));
  }
  add_check(diagnosis, "sizes are those of the literature", answer.plausibility > kPlausible,
            fmt::format("log density {:.1f} against the middle of what is usual", answer.plausibility));
  for (const Suspect& suspect : diagnosis.suspects) {
    if (suspect.effect == diagnosis.suspects.front().effect) continue;
    add_check(diagnosis, "without its family the answer would not be the same", suspect.closure.value < kSame,
              fmt::format("next is {} at {}, which removes {:.0f} %", suspect.effect, suspect.location,
                          100 * suspect.closure.value));
    break;
  }
}

/// What would tell the answer and its nearest rival apart.
void find_separating_test(const Case& c, Diagnosis& diagnosis) {
  if (diagnosis.ambiguous_with.empty() || diagnosis.named.empty()) return;
  if (c.step) c.step("a test that would tell " + diagnosis.named.front() + " and " + diagnosis.ambiguous_with.front());
  Operation operation;
  if (!operation_of(c.study.nominal, c.study.data.fitted, {}, operation)) return;
  const EffectCandidate *a = nullptr, *b = nullptr;
  const std::vector<EffectCandidate> all = c.study.candidates(c.study.nominal, operation);
  for (const EffectCandidate& candidate : all) {
    if (!a && name_of(candidate) == diagnosis.named.front()) a = &candidate;
    if (!b && name_of(candidate) == diagnosis.ambiguous_with.front()) b = &candidate;
  }
  if (a && b) diagnosis.separating = separating_test(c.study.nominal, c.study.data.fitted, *a, *b);
}

/// Looks for a second effect beside the best first ones. @param answer replaced if there is one, or if the search has
/// found a better fit of the first alone
void add_second(const Case& c, std::vector<Hypothesis>& singles, const std::vector<Rival>& rivals, Changes& changes,
                Hypothesis& answer, Diagnosis& diagnosis) {
  std::vector<Hypothesis> seconds = pairs(c, singles, rivals, changes);
  if (seconds.empty()) return;
  const Hypothesis& pair = seconds.front();
  const double notice = kNotice * diagnosis.floor.colour;
  // At one place a second effect may be no more than what the first one's form does not fit: it has to do better.
  const bool one_place = pair.effects[0].location == pair.effects[1].location;
  const auto needed = [&](const Hypothesis& alone) {
    const double remains = alone.chi2 - c.floor_chi2();
    return alone.chi2 - pair.chi2 > std::max((one_place ? kSecondThere : kSecond) * remains, notice);
  };
  if (!needed(answer)) return;
  const auto first = std::find_if(singles.begin(), singles.end(), [&](const Hypothesis& single) {
    return single.fit.jacobian.size() > 0 && name_of(single.effects.back()) == name_of(pair.effects[0]);
  });
  if (first != singles.end()) {
    const Hypothesis alone = fit_at(c.study, *first, pair.fit.plant);
    if (!alone.fit.error.empty() && !needed(alone)) {  // the pair had only found the first one's better fit
      answer = alone;
      diagnosis.named = {name_of(alone.effects.back())};
      return;
    }
  }
  diagnosis.named = {name_of(pair.effects[0]), name_of(pair.effects[1])};
  diagnosis.outcome = GapOutcome::several;
  const auto own = std::find_if(diagnosis.suspects.begin(), diagnosis.suspects.end(), [&](const Suspect& suspect) {
    return suspect.effect + "@" + suspect.location == diagnosis.named.front();
  });
  if (own != diagnosis.suspects.end()) std::rotate(diagnosis.suspects.begin(), own, own + 1);
  // Alone the first effect may have looked like another; beside the second it is as sure as the pair.
  std::vector<Rival> others = rivals_of(seconds);
  weigh(others, {diagnosis.floor.colour, answer.chi2 - c.floor_chi2(), c.floor_chi2()});
  Suspect& leading = diagnosis.suspects.front();
  leading.probability = std::max(leading.probability, others.front().probability);
  diagnosis.suspects.insert(diagnosis.suspects.begin() + 1, suspect_of(c, others.front(), pair));
  answer = pair;
}

/// What an unknown signal at the place of "effect@location" leaves; that of the best place where it is not known.
double leftover_of(const Diagnosis& diagnosis, const std::string& name) {
  const std::string location = name.substr(name.find('@') + 1), guide = kGuide + location;
  for (const Place& place : diagnosis.places)
    if (place.location == location || place.location == guide ||
        std::find(place.same.begin(), place.same.end(), location) != place.same.end() ||
        std::find(place.same.begin(), place.same.end(), guide) != place.same.end())
      return place.leftover;
  return diagnosis.places.empty() ? 0 : diagnosis.places.front().leftover;
}

void judge(const Case& c, Diagnosis& diagnosis) {
  if (c.step) c.step("every effect at every place");
  Changes changes;
  std::vector<Hypothesis> singles =
      extend(c.study, c.retuned, {.least = kWorthFitting * kNotice * diagnosis.floor.colour}, changes);
  std::vector<Rival> rivals = rivals_of(singles);
  const Vector t = surprises(c.retuned.fit, static_cast<Index>(c.study.tolerances.size()));
  const double surprise = t.size() > 0 ? t.cwiseAbs().maxCoeff() : 0;
  const double gain = singles.empty() ? 0 : c.retuned.chi2 - singles.front().chi2;
  const bool effect_seen = gain > kNotice * diagnosis.floor.colour;
  const double left = c.retuned.chi2 / c.floor_chi2() - 1;
  if (!effect_seen && surprise < kOutOfTolerance) {
    name_nothing(c, diagnosis);
    if (!name_rounding(c, diagnosis) && left > kTooSmall) name_unknown(c, diagnosis);
    return;
  }
  // A parameter that is free inside its tolerance, and a wide one, would have been tuned to the floor.
  if (left <= kTooSmall || rivals.empty())
    for (Rival& parameter : parameter_rivals(c.study, c.retuned)) rivals.push_back(std::move(parameter));
  if (rivals.empty()) return name_unknown(c, diagnosis);
  double best = c.retuned.chi2;
  for (const Rival& rival : rivals) best = std::min(best, rival.chi2);
  weigh(rivals, {diagnosis.floor.colour, c.retuned.chi2 - best, c.floor_chi2()});
  add_locations(rivals, diagnosis);
  if (rivals.front().is_parameter) {
    name_parameter(c, rivals.front(), diagnosis);
    add_ambiguous(rivals, diagnosis);
    return;
  }

  diagnosis.named = {rivals.front().name()};
  diagnosis.outcome = GapOutcome::effect;
  for (const Rival& rival : rivals)
    if (!rival.is_parameter) diagnosis.suspects.push_back(suspect_of(c, rival, singles[rival.hypothesis]));
  Hypothesis answer = singles[rivals.front().hypothesis];
  const double gap = c.retuned.chi2 - c.floor_chi2(), remains = answer.chi2 - c.floor_chi2();
  if (c.options.effects > 1 && remains > std::max(kNotice * diagnosis.floor.colour, kWorthSecond * gap))
    add_second(c, singles, rivals, changes, answer, diagnosis);
  if (diagnosis.outcome == GapOutcome::effect) {
    add_ambiguous(rivals, diagnosis);
    if (!diagnosis.ambiguous_with.empty()) diagnosis.outcome = GapOutcome::ambiguous;
  }
  if (linearise(answer.fit, answer.parameters, c.study.data.fitted))
    diagnosis.suspects.front().parameters = fitted_parameters(answer.fit, answer.parameters, c.study.tolerances.size());
  check_answer(c, answer, diagnosis);
  find_separating_test(c, diagnosis);
  diagnosis.corrected = answer.stage;
  diagnosis.plant = answer.fit.plant;
  diagnosis.closure = closure(c.retuned.stage.blocks, answer.stage.blocks, c.options.draws, c.random);
  const double explained = (c.retuned.chi2 - answer.chi2) / std::max(gap, 1.0);
  // What explains a part of the gap from a place at which no signal would explain the rest is a mask.
  const bool misplaced =
      diagnosis.outcome != GapOutcome::several && explained < kExplainsWell && !diagnosis.places.empty() &&
      leftover_of(diagnosis, diagnosis.named.front()) > kElsewhere * diagnosis.places.front().leftover;
  if (explained < kExplains || misplaced) name_unknown(c, diagnosis);
}

/// For each place the smaller leftover of two fits, in ascending order.
std::vector<Place> better_places(std::vector<Place> places, const std::vector<Place>& others) {
  for (Place& place : places)
    for (const Place& other : others)
      if (other.location == place.location) place.leftover = std::min(place.leftover, other.leftover);
  std::stable_sort(places.begin(), places.end(),
                   [](const Place& a, const Place& b) { return a.leftover < b.leftover; });
  return places;
}

}  // namespace

std::string to_string(GapOutcome outcome) {
  switch (outcome) {
    case GapOutcome::none: return "none";
    case GapOutcome::parameter: return "parameter";
    case GapOutcome::effect: return "effect";
    case GapOutcome::several: return "several";
    case GapOutcome::located_not_in_catalogue: return "located_not_in_catalogue";
    case GapOutcome::exogenous: return "exogenous";
    case GapOutcome::ambiguous: return "ambiguous";
    default: return "insufficient";
  }
}

Diagnosis diagnose(const Plant& plant, const RecordSet& set, const CandidateList& candidates, const GapSolvers& solvers,
                   const DiagnoseOptions& options, Random& random,
                   const std::function<void(const std::string&)>& step) {
  Diagnosis diagnosis;
  diagnosis.plant = diagnosis.retuned_plant = plant;
  diagnosis.floor = noise_floor(set);
  const GapData data = gap_data(plant, set, diagnosis.floor, options.block_s);
  diagnosis.held_out = data.apart;
  const Study study{plant, data, solvers, candidates, tolerance_parameters(plant), options.iterations};
  if (step) step("the plant as delivered");
  const Hypothesis delivered = fit_hypothesis(study, plant, {});
  if (step) step("re-tuning inside the tolerances");
  const Hypothesis retuned = fit_hypothesis(study, plant, study.tolerances);
  diagnosis.delivered = delivered.stage;
  diagnosis.retuned = retuned.stage;
  if (delivered.stage.blocks.size() == 0 || retuned.stage.blocks.size() == 0) {
    diagnosis.status = Status::outside_domain;
    diagnosis.outcome = GapOutcome::insufficient;
    diagnosis.message = "the plant as delivered cannot follow the drives of the records: " +
                        (delivered.stage.blocks.size() == 0 ? delivered : retuned).fit.solution.message;
    return diagnosis;
  }
  diagnosis.retuned_plant = retuned.fit.plant;
  diagnosis.tolerances = fitted_parameters(retuned.fit, study.tolerances, 0);
  for (std::size_t i = 0; i < study.tolerances.size(); ++i) {
    diagnosis.tolerances[i].value = retuned.fit.theta(static_cast<Index>(i));
    diagnosis.tolerances[i].std /= study.tolerances[i].scale;
  }
  diagnosis.closure_of_retuning = 1 - (diagnosis.retuned.misfit - 1) / (diagnosis.delivered.misfit - 1);
  if (step) step("where it enters");
  diagnosis.places = better_places(locate(delivered.fit, data.fitted), locate(retuned.fit, data.fitted));
  judge({study, options, delivered, retuned, random, step}, diagnosis);
  return diagnosis;
}

}  // namespace wheelhop
