#include "core/gap/judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/gap/shares.hpp"

namespace wheelhop {
namespace {

constexpr double kExplains = 0.6;       // closure below which no family of the catalogue fits, and
constexpr double kSurelyNot = 0.8;      // one that lies below this with all of its interval, or
constexpr double kNotInPath = 0.9;      // below this, where the forms are few: a bias is a bias on every rig
constexpr double kExplainsWell = 0.9;   // closure from which only a far better place speaks against it
constexpr double kElsewhere = 1.5;      // leftover over that of the best place, from which the gap enters elsewhere
constexpr double kFarElsewhere = 4;     // likewise, where the effect explains the gap well
constexpr double kOfPlace = 4;          // what the log of that ratio counts in a rival's log p
constexpr double kHeld = 0.97;          // probability that the catalogue holds what explains a gap whole ...
constexpr double kHeldSlope = 1.2;      // ... and what a share that stays unexplained takes from it
constexpr double kWorthFitting = 0.25;  // of kNotice, what the screen must expect of the best for any to be fitted
constexpr double kWorthSecond = 0.06;   // share of the gap that must be left for a second effect to be looked for,
                                        // unless it enters at another place
constexpr double kWorthPair = 0.1;      // and that the first must have removed: of two effects one is the larger
constexpr double kWorthFreeing = 2;     // surprise of a parameter from which it is fitted without its tolerance
constexpr double kStandsOut = 0.75;     // probability from which one parameter among nearer ones is named
constexpr double kNotHome = 4;          // surprise from which one wrong parameter is not all that is wrong
constexpr double kConsidered = 0.05;    // probability from which a rival is named
// Log odds of an effect that is named, as they turned out to be: a + b log odds, and no more than those of kSurest.
// Chosen by eye from 754 answers on five generated sets, whose probabilities in seven bins stood beside the share that
// was right: 0.50 and 0.61, 0.63 and 0.77, 0.76 and 0.89, 0.85 and 1.00, 0.93 and 0.99, 0.96 and 0.99.
constexpr double kCalibrationShift = 0.4, kCalibrationSlope = 1.5, kSurest = 0.98;

void add_locations(const std::vector<Rival>& rivals, Diagnosis& diagnosis) {
  std::map<std::string, double> sums;
  for (const Rival& rival : rivals) sums[rival.location] += rival.probability;
  diagnosis.locations = ranked(sums);
}

/// Parameters that are out of their tolerances although that of the rival is free, as "NAME (-7.4 tolerances)", or
/// nothing. Where a law's bend is wrong, all that shapes its element bends with it.
std::string others_out(const GapCase& c, const PlantFit& fit, const Rival& rival) {
  if (fit.covariance.size() == 0) return "";
  const Vector t = surprises(fit, static_cast<Index>(c.study.tolerances.size()));
  std::string list;
  const auto shapes_it = [&](const std::string& name) {
    return !rival.effect.ends_with("_error") && name.starts_with(rival.location + ".");
  };
  for (std::size_t i = 0; i < c.study.tolerances.size(); ++i)
    if (i != rival.hypothesis && !shapes_it(c.study.tolerances[i].name) &&
        std::abs(t(static_cast<Index>(i))) > kNotHome)
      list += fmt::format("{}{} ({:+.1f} tolerances)", list.empty() ? "" : ", ", c.study.tolerances[i].name,
                          fit.theta(static_cast<Index>(i)));
  return list;
}

/// The answer is one parameter of the plant, free of its tolerance. False if that leaves a gap or drives other
/// parameters out of theirs; the message then says so.
bool name_parameter(const GapCase& c, const Rival& rival, Diagnosis& diagnosis) {
  std::vector<FitParameter> free = c.study.tolerances;
  free[rival.hypothesis].prior_std = 0;
  Hypothesis answer = fit_from(c.study, c.retuned, free);
  if (!answer.fit.error.empty()) linearise(answer.fit, free, c.study.data.fitted);
  const Hypothesis& best = answer.fit.error.empty() ? c.retuned : answer;
  diagnosis.outcome = rival.effect.ends_with("_error") ? GapOutcome::parameter : GapOutcome::effect;
  diagnosis.named = {rival.name()};
  diagnosis.corrected = best.stage;
  diagnosis.plant = best.fit.plant;
  diagnosis.closure = c.closure_between(c.delivered.stage, best.stage);
  const FittedParameter fitted = fitted_parameters(best.fit, free, 0)[rival.hypothesis];
  diagnosis.suspects = {
      {rival.effect, rival.location, "", rival.probability, best.stage.misfit, diagnosis.closure, {fitted}}};
  const std::string out = others_out(c, best.fit, rival);
  if (out.empty() && best.chi2 < (1 + kTooSmall) * c.floor_chi2()) return true;
  diagnosis.suspects.front().probability *= 1 - kHeld;
  diagnosis.suspects.front().closure = c.closure_between(c.retuned.stage, best.stage);
  if (!out.empty()) diagnosis.message = rival.effect + " at " + rival.location + " would need " + out + " as well";
  return false;
}

/// One parameter inside its tolerance, where all others are nearer still: it makes the gap of the plant as delivered.
bool name_standing_out(const GapCase& c, Diagnosis& diagnosis) {
  if (c.delivered.chi2 - c.retuned.chi2 < kNotice * diagnosis.floor.colour) return false;
  const auto count = static_cast<Index>(c.study.tolerances.size());
  if (count == 0 || c.retuned.fit.covariance.size() == 0) return false;
  const Vector probabilities = standing_out(c.retuned.fit, count, diagnosis.floor.colour);
  std::vector<Rival> rivals;
  for (std::size_t i = 0; i < c.study.tolerances.size(); ++i) {
    rivals.push_back(parameter_rival(c.study, c.retuned, i));
    rivals.back().probability = probabilities(static_cast<Index>(i));
  }
  std::stable_sort(rivals.begin(), rivals.end(),
                   [](const Rival& a, const Rival& b) { return a.probability > b.probability; });
  if (rivals.front().probability < kStandsOut) return false;
  Diagnosis named = diagnosis;
  if (!name_parameter(c, rivals.front(), named)) return false;
  const FittedParameter& parameter = named.suspects.front().parameters.front();
  named.message = fmt::format("{} is {:+.1f} tolerances off, and the others lie nearer to what the plant file says",
                              parameter.name, c.retuned.fit.theta(static_cast<Index>(rivals.front().hypothesis)));
  add_locations(rivals, named);
  add_ambiguous(rivals, named);
  diagnosis = std::move(named);
  return true;
}

void name_nothing(const GapCase& c, Diagnosis& diagnosis) {
  diagnosis.outcome = GapOutcome::none;
  correct_nothing(c, diagnosis);
}

/// What an unknown signal at a location leaves, over what it leaves at the best place; 1 where it is not known.
double leftover_ratio(const std::vector<Place>& places, const std::string& location) {
  const auto matches = [&](const std::string& entry) {
    return entry == location || entry == kGuide + location ||
           (location == "timebase" && entry.starts_with("actuator"));  // the drive's clock enters with the drive
  };
  for (const Place& place : places)
    if (matches(place.location) || std::any_of(place.same.begin(), place.same.end(), matches))
      return place.leftover / std::max(places.front().leftover, 1e-3);
  return 1;
}

/// True if what an effect leaves enters at another place than its own, although the gap entered there. Of one that
/// masks a gap from elsewhere the remains lie anywhere.
bool leaves_another(const GapCase& c, const Diagnosis& diagnosis, Hypothesis& answer) {
  const std::string& location = answer.effects.back().location;
  if (leftover_ratio(diagnosis.places, location) > kElsewhere) return false;
  if (!linearise(answer.fit, answer.parameters, c.study.data.fitted)) return false;
  return leftover_ratio(locate(answer.fit, c.study.data.fitted, c.study.data.noise_shares), location) > kElsewhere;
}

/// A sensor, an actuator or the clock: no force of the plant.
bool is_path(const std::string& location) {
  return location.starts_with("sensor:") || location == "actuator" || location.starts_with("actuator:") ||
         location == "timebase";
}

/// Probabilities of effects as often right as they say. What the named ones gain, their rivals lose.
void calibrate(Diagnosis& diagnosis) {
  if (diagnosis.suspects.empty()) return;
  double before = 0, after = 0;
  for (Suspect& suspect : diagnosis.suspects) {
    const auto& named = diagnosis.named;
    if (std::find(named.begin(), named.end(), suspect.effect + "@" + suspect.location) == named.end()) {
      suspect.probability *= (1 - after) / std::max(1 - before, 1 - kLimit);
      continue;
    }
    const double p = std::clamp(suspect.probability, 1 - kLimit, kLimit);
    const double odds = std::exp(kCalibrationShift) * std::pow(p / (1 - p), kCalibrationSlope);
    suspect.probability = std::min(odds / (1 + odds), kSurest);
    before = std::max(before, p);
    after = std::max(after, suspect.probability);
  }
}

}  // namespace

std::vector<LocationProbability> ranked(const std::map<std::string, double>& sums) {
  std::vector<LocationProbability> list;
  for (const auto& [location, sum] : sums) list.push_back({location, std::min(sum, kLimit)});
  std::stable_sort(list.begin(), list.end(),
                   [](const auto& a, const auto& b) { return a.probability > b.probability; });
  return list;
}

void correct_nothing(const GapCase& c, Diagnosis& diagnosis) {
  diagnosis.corrected = c.retuned.stage;
  diagnosis.plant = c.retuned.fit.plant;
  diagnosis.closure = kNothingAdded;
  diagnosis.places_left.clear();
}

void add_ambiguous(const std::vector<Rival>& rivals, Diagnosis& diagnosis) {
  for (const Rival& rival : rivals)
    if (rival.probability > kConsidered &&
        std::find(diagnosis.named.begin(), diagnosis.named.end(), rival.name()) == diagnosis.named.end())
      diagnosis.ambiguous_with.push_back(rival.name());
}

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

Suspect suspect_of(const GapCase& c, const Rival& rival, const Hypothesis& hypothesis) {
  return {rival.effect,
          rival.location,
          hypothesis.effects.back().form,
          rival.probability,
          hypothesis.stage.misfit,
          c.closure_between(c.retuned.stage, hypothesis.stage),
          fitted_parameters(hypothesis.fit, hypothesis.parameters, c.study.tolerances.size())};
}

Hypothesis name_first(const GapCase& c, const std::vector<Hypothesis>& singles, const std::vector<Rival>& rivals,
                      Diagnosis& diagnosis) {
  diagnosis.named = {rivals.front().name()};
  diagnosis.outcome = GapOutcome::effect;
  add_locations(rivals, diagnosis);
  diagnosis.suspects.clear();
  for (const Rival& rival : rivals)
    if (!rival.is_parameter) diagnosis.suspects.push_back(suspect_of(c, rival, singles[rival.hypothesis]));
  return singles[rivals.front().hypothesis];
}

void judge(const GapCase& c, Diagnosis& diagnosis) {
  if (c.step) c.step("every effect at every place");
  Changes changes;
  std::vector<Hypothesis> singles =
      extend(c.study, c.retuned, {.least = kWorthFitting * kNotice * diagnosis.floor.colour}, changes);
  std::vector<Rival> rivals = rivals_of(singles);
  for (Rival& rival : rivals)
    rival.plausibility -= kOfPlace * std::log(std::max(leftover_ratio(diagnosis.places, rival.location), 1.0));
  const Vector t = surprises(c.retuned.fit, static_cast<Index>(c.study.tolerances.size()));
  const double surprise = t.size() > 0 ? t.cwiseAbs().maxCoeff() : 0;
  const double gain = singles.empty() ? 0 : c.retuned.chi2 - singles.front().chi2;
  const bool effect_seen = gain > kNotice * diagnosis.floor.colour;
  const double left = c.retuned.chi2 / c.floor_chi2() - 1;
  // A parameter that is free inside its tolerance, and a wide one, would have been tuned to the floor, unless it
  // stopped at the end of what re-tuning may move.
  const bool at_end = stopped(c.retuned.fit, t.size());
  double fall = 0;
  const bool alone = left <= kTooSmall || rivals.empty();
  if (surprise > kWorthFreeing && (alone || at_end))
    for (Rival& parameter : parameter_rivals(c.study, c.retuned, alone ? 0 : kAtEnd)) {
      if (!alone && parameter.chi2 > (1 + kTooSmall) * c.floor_chi2()) continue;
      const double of_priors = c.retuned.prior_chi2 - parameter.prior_chi2;
      fall = std::max(fall, of_priors + (c.retuned.chi2 - parameter.chi2 - of_priors) / diagnosis.floor.colour);
      rivals.push_back(std::move(parameter));
    }
  if (!effect_seen && fall < kOutOfTolerance * kOutOfTolerance) {
    if (left <= kTooSmall && name_standing_out(c, diagnosis)) return;
    name_nothing(c, diagnosis);
    if (!name_rounding(c, diagnosis) && left > kTooSmall) name_unknown(c, diagnosis);
    return;
  }
  double best = c.retuned.chi2;
  for (const Rival& rival : rivals) best = std::min(best, rival.chi2);
  const Weighing weighing = {diagnosis.floor.colour, c.retuned.chi2 - best, c.floor_chi2()};
  weigh(rivals, weighing);
  add_locations(rivals, diagnosis);
  if (rivals.front().is_parameter) {
    if (name_parameter(c, rivals.front(), diagnosis)) {
      add_ambiguous(rivals, diagnosis);
      return;
    }
    // One wrong parameter is not it; an effect that closes the gap by itself may be.
    std::erase_if(rivals, [&](const Rival& rival) {
      return rival.is_parameter || rival.chi2 > (1 + kTooSmall) * c.floor_chi2();
    });
    if (rivals.empty()) {
      name_unknown(c, diagnosis);
      return;
    }
    diagnosis.message.clear();
    diagnosis.suspects.clear();
    weigh(rivals, weighing);
    add_locations(rivals, diagnosis);
  }

  Hypothesis answer = name_first(c, singles, rivals, diagnosis);
  const double gap = c.retuned.chi2 - c.floor_chi2(), remains = answer.chi2 - c.floor_chi2();
  if (c.options.effects > 1 && remains < (1 - kWorthPair) * gap && remains > kNotice * diagnosis.floor.colour &&
      (remains > kWorthSecond * gap || leaves_another(c, diagnosis, answer)))
    add_second(c, singles, rivals, weighing, changes, answer, diagnosis);
  if (diagnosis.outcome == GapOutcome::effect) {
    add_ambiguous(rivals, diagnosis);
    if (!diagnosis.ambiguous_with.empty()) diagnosis.outcome = GapOutcome::ambiguous;
  }
  if (linearise(answer.fit, answer.parameters, c.study.data.fitted)) {
    auto fitted = fitted_parameters(answer.fit, answer.parameters, c.study.tolerances.size());
    auto next = fitted.begin();
    for (std::size_t i = 0; i < answer.effects.size(); ++i) {
      const auto own = next;
      next += static_cast<std::ptrdiff_t>(answer.effects[i].parameters.size());
      diagnosis.suspects[i].parameters.assign(own, next);
    }
  }
  check_answer(c, answer, diagnosis);
  find_separating_test(c, diagnosis);
  diagnosis.corrected = answer.stage;
  diagnosis.plant = answer.fit.plant;
  diagnosis.closure = c.closure_between(c.retuned.stage, answer.stage);
  const double explained = (c.retuned.chi2 - answer.chi2) / std::max(gap, 1.0);
  const double held = kHeld - kHeldSlope * std::max(kHeld - explained, 0.0);
  for (Suspect& suspect : diagnosis.suspects) suspect.probability *= std::max(held, 0.0);
  // What explains the gap, or a part of it, from a place at which no signal would explain the rest is a mask.
  const bool misplaced = diagnosis.outcome != GapOutcome::several &&
                         answer.chi2 - c.floor_chi2() > kNotice * diagnosis.floor.colour &&
                         leftover_ratio(diagnosis.places, answer.effects.back().location) >
                             (explained < kExplainsWell ? kElsewhere : kFarElsewhere);
  const std::string odd =
      diagnosis.outcome != GapOutcome::several ? undefined_size(answer.effects.back(), answer.fit.plant) : "";
  // Held-out records that never reach the effect have no gap that could be closed.
  const bool reached = c.retuned.stage.misfit > 1 + kTooSmall;
  const double too_little = is_path(answer.effects.back().location) ? kNotInPath : kSurelyNot;
  const bool unexplained =
      explained < kExplains || (reached && explained < kExplainsWell && diagnosis.closure.high < too_little);
  if (unexplained || misplaced || !odd.empty()) {
    const std::vector<LocationProbability> by_rivals = diagnosis.locations;
    // Noise rounds differently each time: a converter that is simulated without it explains a part of its error alone.
    const bool rounding = rivals.front().effect == "quantisation" && name_rounding(c, diagnosis);
    if (!rounding) name_unknown(c, diagnosis);
    if (misplaced)
      for (Suspect& suspect : diagnosis.suspects) suspect.probability *= 1 - kHeld;
    if (!odd.empty()) {
      diagnosis.message = fmt::format("it acts as {} would with {}", answer.effects.back().effect, odd);
      diagnosis.suspects.front().probability *= 1 - kHeld;
      if (explained > kExplainsWell) {  // a law there does it, whatever its name
        diagnosis.outcome = GapOutcome::located_not_in_catalogue;
        diagnosis.locations = by_rivals;
        diagnosis.named = {"unknown@" + answer.effects.back().location};
      }
    }
  }
  if (diagnosis.outcome == GapOutcome::effect || diagnosis.outcome == GapOutcome::ambiguous ||
      diagnosis.outcome == GapOutcome::several)
    calibrate(diagnosis);
  if (diagnosis.outcome == GapOutcome::several) diagnosis.shares = effect_shares(c.study, c.retuned, answer, singles);
}

}  // namespace wheelhop
