#include "core/gap/judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/gap/shares.hpp"

namespace wheelhop {
namespace {

constexpr std::size_t kFinished = 4;    // of the quick fits, the best that are fitted on to the end
constexpr double kOfPlace = 4;          // what the log of that ratio counts in a rival's log p
constexpr double kWorthFitting = 0.25;  // of kNotice, what the screen must expect of the best for any to be fitted
constexpr double kWorthSecond = 0.06;   // share of the gap that must be left for a second effect to be looked for,
                                        // unless it enters at another place
constexpr double kWorthPair = 0.1;      // and that the first must have removed: of two effects one is the larger
constexpr int kSearches = 2;            // for a second effect, where the first one's fit became better by it
constexpr double kWorthFreeing = 2;     // surprise of a parameter from which it is fitted without its tolerance
constexpr double kConsidered = 0.05;    // probability from which a rival is named
// Log odds of an effect that is named, as they turned out to be: a + b log odds, and no more than those of kSurest.
// Chosen by eye from 754 answers on five generated sets, whose probabilities in seven bins stood beside the share that
// was right: 0.50 and 0.61, 0.63 and 0.77, 0.76 and 0.89, 0.85 and 1.00, 0.93 and 0.99, 0.96 and 0.99.
constexpr double kCalibrationShift = 0.4, kCalibrationSlope = 1.5, kSurest = 0.98;

/// True if what an effect leaves enters at another place than its own, although the gap entered there. Of one that
/// masks a gap from elsewhere the remains lie anywhere.
bool leaves_another(const GapCase& c, const Diagnosis& diagnosis, Hypothesis& answer) {
  const std::string& location = answer.effects.back().location;
  if (leftover_ratio(diagnosis.places, location) > kElsewhere) return false;
  if (!linearise(answer.fit, answer.parameters, c.study.data.fitted)) return false;
  return leftover_ratio(locate(answer.fit, c.study.data.fitted, c.study.data.noise_shares), location) > kElsewhere;
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

/// Parameters join the rivals if one is far enough from its tolerance. One that is free inside its tolerance, and a
/// wide one, would have been tuned to the floor, unless it stopped at the end of what re-tuning may move.
void add_parameters(const GapCase& c, double colour, Contest& contest) {
  const Vector t = surprises(c.retuned.fit, static_cast<Index>(c.study.tolerances.size()));
  const double surprise = t.size() > 0 ? t.cwiseAbs().maxCoeff() : 0;
  const bool alone = contest.left <= kTooSmall || contest.rivals.empty();
  if (surprise <= kWorthFreeing || !(alone || stopped(c.retuned.fit, t.size()))) return;
  for (Rival& parameter : parameter_rivals(c.study, c.retuned, alone ? 0 : kAtEnd)) {
    if (!alone && parameter.chi2 > (1 + kTooSmall) * c.floor_chi2()) continue;
    const double of_priors = c.retuned.prior_chi2 - parameter.prior_chi2;
    const double fall = of_priors + (c.retuned.chi2 - parameter.chi2 - of_priors) / colour;
    contest.parameter_seen = contest.parameter_seen || fall >= kOutOfTolerance * kOutOfTolerance;
    contest.rivals.push_back(std::move(parameter));
  }
}

/// Puts the initial states of a fit, 2n a record, where the plant rests in equilibrium.
void begin_at_rest(PlantFit& fit) {
  const Index states = fit.state_scale.size();
  for (std::size_t i = 0; i < fit.initial_states.size(); ++i)
    fit.initial_states[i] =
        fit.states_at_rest.segment(states * static_cast<Index>(i), states).cwiseProduct(fit.state_scale);
}

/// A channel, or the drive, that reads in another unit or with the other sign: re-tuning bends the plant so far around
/// it that the screen there may miss it. At the plant as delivered its factor is seen, and from there it is fitted.
void add_wrong_scale(const GapCase& c, Contest& contest) {
  const Plant& plant = c.delivered.fit.plant;
  Operation operation;
  if (!one_scale(c.wrong_scales, plant.sensors.size()) ||
      !operation_of(plant, c.study.data.fitted, c.delivered.fit.initial_states, operation))
    return;
  const WrongScale& wrong = c.wrong_scales.front();
  const std::string place = c.wrong_scales.size() > 1 ? "actuator" : "sensor:" + wrong.channel;
  for (const EffectCandidate& candidate : c.study.candidates(plant, operation)) {
    if (candidate.effect != "gain_error" || candidate.location != place) continue;
    Hypothesis scaled = c.delivered;
    scaled.effects = {candidate};
    scaled.parameters = c.retuned.parameters;
    scaled.parameters.insert(scaled.parameters.end(), candidate.parameters.begin(), candidate.parameters.end());
    scaled.fit.plant = candidate.plant;
    set_parameter(scaled.fit.plant, candidate.parameters.front().name, wrong.reads);
    begin_at_rest(scaled.fit);  // the states that were fitted follow the wrong factor
    begin_at_rest(scaled.held_out);
    Hypothesis fitted = fit_subset(c.study, c.retuned, scaled, 1);
    if (fitted.fit.error.empty()) continue;
    std::erase_if(contest.singles, [&](const Hypothesis& old) { return same_form(old.effects.back(), candidate); });
    contest.singles.push_back(std::move(fitted));
  }
  std::stable_sort(contest.singles.begin(), contest.singles.end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.chi2 < b.chi2; });
}

Contest contest_of(const GapCase& c, const Diagnosis& diagnosis) {
  Contest contest;
  const double notice = kNotice * diagnosis.floor.colour;
  contest.singles = extend(c.study, c.retuned, {.least = kWorthFitting * notice}, {}, &contest.changes);
  finish(c.study, c.retuned.chi2, kFinished, contest.singles);
  add_wrong_scale(c, contest);
  contest.rivals = rivals_of(contest.singles);
  for (Rival& rival : contest.rivals) rival.plausibility -= place_penalty(diagnosis.places, rival.location);
  contest.effect_seen = !contest.singles.empty() && c.retuned.chi2 - contest.singles.front().chi2 > notice;
  contest.left = c.retuned.chi2 / c.floor_chi2() - 1;
  add_parameters(c, diagnosis.floor.colour, contest);
  return contest;
}

/// Nothing gains more than chance: no gap, or one that no effect of the catalogue touches.
void name_none(const GapCase& c, const Contest& contest, Diagnosis& diagnosis) {
  if (contest.left <= kTooSmall && name_standing_out(c, diagnosis)) return;
  diagnosis.outcome = GapOutcome::none;
  correct_nothing(c, diagnosis);
  if (!name_rounding(c, diagnosis) && contest.left > kTooSmall) name_unknown(c, diagnosis);
}

/// One wrong parameter is not it; an effect that closes the gap by itself may be. @return false if there is none
bool drop_parameters(const GapCase& c, const Weighing& weighing, std::vector<Rival>& rivals, Diagnosis& diagnosis) {
  std::erase_if(
      rivals, [&](const Rival& rival) { return rival.is_parameter || rival.chi2 > (1 + kTooSmall) * c.floor_chi2(); });
  if (rivals.empty()) return false;
  diagnosis.message.clear();
  diagnosis.suspects.clear();
  weigh(rivals, weighing);
  add_locations(rivals, diagnosis);
  return true;
}

/// Whether what the first effect leaves is worth the search for a second one.
bool worth_second(const GapCase& c, const Diagnosis& diagnosis, Hypothesis& answer) {
  const double gap = c.retuned.chi2 - c.floor_chi2(), remains = answer.chi2 - c.floor_chi2();
  return c.options.effects > 1 && remains < (1 - kWorthPair) * gap && remains > kNotice * diagnosis.floor.colour &&
         (remains > kWorthSecond * gap || leaves_another(c, diagnosis, answer));
}

/// Values and deviations of the parameters of all effects of the answer, from their common fit.
void size_effects(const GapCase& c, Hypothesis& answer, Diagnosis& diagnosis) {
  if (!linearise(answer.fit, answer.parameters, c.study.data.fitted)) return;
  const auto fitted = fitted_parameters(answer.fit, answer.parameters, c.study.tolerances.size());
  auto next = fitted.begin();
  for (std::size_t i = 0; i < answer.effects.size(); ++i) {
    const auto own = next;
    next += static_cast<std::ptrdiff_t>(answer.effects[i].parameters.size());
    diagnosis.suspects[i].parameters.assign(own, next);
  }
}

/// An effect leads: looks for a second one, checks the answer and casts doubt on it.
void name_effects(const GapCase& c, Contest& contest, const Weighing& weighing, Diagnosis& diagnosis) {
  std::vector<Rival>& rivals = contest.rivals;
  Hypothesis answer = name_first(c, contest.singles, rivals, diagnosis);
  for (int search = 0; search < kSearches && worth_second(c, diagnosis, answer); ++search)
    if (!add_second(c, contest, weighing, answer, diagnosis)) break;
  if (diagnosis.outcome == GapOutcome::effect) {
    add_ambiguous(rivals, diagnosis);
    if (!diagnosis.ambiguous_with.empty()) diagnosis.outcome = GapOutcome::ambiguous;
  }
  size_effects(c, answer, diagnosis);
  check_answer(c, answer, diagnosis);
  find_separating_test(c, diagnosis);
  diagnosis.corrected = answer.stage;
  diagnosis.plant = answer.fit.plant;
  diagnosis.closure = c.closure_between(c.retuned.stage, answer.stage);
  doubt_answer(c, answer, rivals, diagnosis);
  if (diagnosis.outcome == GapOutcome::effect || diagnosis.outcome == GapOutcome::ambiguous ||
      diagnosis.outcome == GapOutcome::several)
    calibrate(diagnosis);
  if (diagnosis.outcome == GapOutcome::several)
    diagnosis.shares = effect_shares(c.study, c.retuned, answer, contest.singles);
}

}  // namespace

void add_locations(const std::vector<Rival>& rivals, Diagnosis& diagnosis) {
  std::map<std::string, double> sums;
  for (const Rival& rival : rivals) sums[rival.location] += rival.probability;
  diagnosis.locations = ranked(sums);
}

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

double place_penalty(const std::vector<Place>& places, const std::string& location) {
  return kOfPlace * std::log(std::max(leftover_ratio(places, location), 1.0));
}

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
  diagnosis.checks.clear();  // those of an answer that was withdrawn
  diagnosis.separating = {};
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
  const auto first = std::find_if(rivals.begin(), rivals.end(), [](const Rival& rival) { return !rival.is_parameter; });
  diagnosis.named = {first->name()};
  diagnosis.outcome = GapOutcome::effect;
  add_locations(rivals, diagnosis);
  diagnosis.suspects.clear();
  for (const Rival& rival : rivals)
    if (!rival.is_parameter) diagnosis.suspects.push_back(suspect_of(c, rival, singles[rival.hypothesis]));
  return singles[first->hypothesis];
}

void judge(const GapCase& c, Diagnosis& diagnosis) {
  if (c.step) c.step("every effect at every place");
  Contest contest = contest_of(c, diagnosis);
  if (!contest.effect_seen && !contest.parameter_seen) {
    name_none(c, contest, diagnosis);
    return;
  }
  std::vector<Rival>& rivals = contest.rivals;
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
    if (!drop_parameters(c, weighing, rivals, diagnosis)) {
      name_unknown(c, diagnosis);
      return;
    }
  }
  name_effects(c, contest, weighing, diagnosis);
}

}  // namespace wheelhop
