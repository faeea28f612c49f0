#include "core/gap/diagnose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/data/metrics.hpp"
#include "core/gap/screen.hpp"

namespace wheelhop {
namespace {

constexpr double kLimit = 0.99;          // no probability is ever 1
constexpr double kAtFloor = 0.1;         // a misfit of 1.1 or less counts as the floor: gap of 0.3 noise levels
constexpr double kGapOfNote = 1;         // misfit - 1 from which a gap inside the tolerances is worth a name
constexpr double kOutOfTolerance = 2.5;  // leave-one-prior-out score
constexpr double kExplains = 0.6;        // closure below which no family of the catalogue fits
constexpr double kTogether = 0.95;       // closure that several must reach where no single one explains
constexpr double kSecond = 0.5;          // share of what is left that a second effect has to remove
constexpr double kConsidered = 0.05;     // probability from which a rival is named

struct Data {
  std::vector<FitRecord> fitted, held_out;
  std::vector<Matrix> held_out_outputs;
  Index block = 1;
};

/// Everything a step reads.
struct Study {
  const Plant& nominal;
  const Data& data;
  const Solver& solver;
  const DiagnoseOptions& options;
  std::vector<FitParameter> tolerances;
};

GapStage score(const Study& study, const Plant& plant) {
  GapStage stage;
  const PlantFit run = fit_plant(plant, {}, study.data.held_out, study.solver, study.options.iterations);
  if (run.error.size() != study.data.held_out.size()) {
    stage.misfit = std::numeric_limits<double>::infinity();
    return stage;
  }
  stage.misfit = run.misfit;
  Vector error_power = Vector::Zero(plant.sensor_count()), power = error_power;
  std::vector<double> blocks;
  for (std::size_t i = 0; i < run.error.size(); ++i) {
    const FitRecord& record = study.data.held_out[i];
    const Index kept = record.y.cols() - record.skip;
    const Matrix error = run.error[i].rightCols(kept);
    error_power += error.rowwise().squaredNorm();
    power += record.y.rightCols(kept).rowwise().squaredNorm();
    const Vector own = block_misfits(record.weight_std.cwiseInverse().asDiagonal() * error, study.data.block);
    blocks.insert(blocks.end(), own.begin(), own.end());
  }
  stage.blocks = Eigen::Map<Vector>(blocks.data(), static_cast<Index>(blocks.size()));
  for (Index i = 0; i < power.size(); ++i) stage.nrmse.push_back(std::sqrt(error_power(i) / power(i)));
  return stage;
}

Data prepare(const Plant& plant, const RecordSet& set, const NoiseFloor& floor, const DiagnoseOptions& options,
             bool& held_out) {
  Data data;
  data.block = std::max<Index>(1, std::llround(options.block_s * set.sampling_hz));
  for (const Measured& measured : merge_repeats(set)) {
    FitRecord record = fit_record(plant, measured.signal, floor.std / std::sqrt(static_cast<double>(measured.repeats)));
    if (record.y.cols() < record.skip + 4 * data.block)
      throw UserError(fmt::format("{}: expected at least {:g} s to diagnose, found {:g} s", measured.name,
                                  static_cast<double>(record.skip + 4 * data.block) / set.sampling_hz,
                                  static_cast<double>(record.y.cols()) / set.sampling_hz));
    (measured.role == "validation" ? data.held_out : data.fitted).push_back(std::move(record));
  }
  if (data.fitted.empty()) throw UserError("expected a record with the role \"estimation\"");
  held_out = !data.held_out.empty();
  if (!held_out) data.held_out = data.fitted;
  return data;
}

std::string error_id(const std::string& parameter) {
  if (parameter.find("mass_kg") != std::string::npos) return "mass_error";
  if (parameter.find("damping") != std::string::npos) return "damping_error";
  return "stiffness_error";
}

std::string location_of(const Plant& plant, const std::string& name) {
  for (const PlantParameter& parameter : plant_parameters(plant))
    if (parameter.name == name) return parameter.location;
  return name.substr(0, name.find('.'));
}

/// How surprising the prior of each parameter is to everything else: with the prior left out the posterior is N(z / (1
/// - s), s / (1 - s)), s its variance in tolerances, against a prior of N(0, 1).
Vector surprises(const PlantFit& fit, Index count) {
  Vector t(count);
  for (Index i = 0; i < count; ++i) {
    const double left = std::max(1 - fit.covariance(i, i), 1e-6);
    t(i) = fit.theta(i) / left / std::sqrt(fit.covariance(i, i) / left + 1);
  }
  return t;
}

std::vector<FittedParameter> fitted_parameters(const PlantFit& fit, const std::vector<FitParameter>& list,
                                               std::size_t first) {
  std::vector<FittedParameter> out;
  for (std::size_t i = first; i < list.size(); ++i)
    out.push_back(
        {list[i].name, get_parameter(fit.plant, list[i].name),
         std::sqrt(std::max(fit.covariance(static_cast<Index>(i), static_cast<Index>(i)), 0.0)) * list[i].scale});
  return out;
}

struct Fitted {
  EffectCandidate candidate;
  PlantFit fit;
  GapStage stage;
  std::vector<FitParameter> parameters;  // tolerances first, then those of effects
};

/// One full fit of a candidate from the base plant with its earlier effects, the strength as screened.
bool fit_candidate(const Study& study, const std::vector<FitParameter>& before, EffectCandidate candidate,
                   double strength, const std::vector<Vector>& initial_states, Fitted& out) {
  out.parameters = before;
  out.parameters.insert(out.parameters.end(), candidate.parameters.begin(), candidate.parameters.end());
  // Tolerances count from the plant as delivered, not from where re-tuning without the effect has bent it.
  for (const FitParameter& parameter : study.tolerances)
    set_parameter(candidate.plant, parameter.name, get_parameter(study.nominal, parameter.name));
  if (candidate.proportional) {
    const std::string& name = candidate.parameters.front().name;
    const double typical = get_parameter(candidate.plant, name) - candidate.ideal;
    const double factor = std::copysign(std::clamp(std::abs(strength), 0.1, 5.0), strength);
    set_parameter(candidate.plant, name, candidate.ideal + factor * typical);
  }
  out.fit = fit_plant(candidate.plant, out.parameters, study.data.fitted, study.solver, study.options.iterations,
                      initial_states);
  if (out.fit.error.empty()) return false;
  out.stage = score(study, out.fit.plant);
  out.candidate = std::move(candidate);
  return std::isfinite(out.stage.misfit);
}

/// The shortlist of the screen on a base fit, fitted in full, by held-out misfit.
std::vector<Fitted> fit_shortlist(const Study& study, const PlantFit& base, const std::vector<FitParameter>& before,
                                  const std::vector<EffectCandidate>& candidates,
                                  const std::function<void(const std::string&)>& step) {
  std::vector<Fitted> fits;
  Index count = 0;
  for (const Screened& screened : screen(base, study.data.fitted, candidates)) {
    if (count++ >= study.options.shortlist || !(screened.gain > 0)) break;
    const EffectCandidate& candidate = candidates[screened.candidate];
    if (step) step(fmt::format("{} at {}", candidate.effect, candidate.location));
    Fitted fitted;
    if (fit_candidate(study, before, candidate, screened.strength, base.initial_states, fitted))
      fits.push_back(std::move(fitted));
  }
  std::stable_sort(fits.begin(), fits.end(),
                   [](const Fitted& a, const Fitted& b) { return a.stage.misfit < b.stage.misfit; });
  return fits;
}

/// The gap lies inside the tolerances, or one parameter is beyond its own.
void judge_parameters(const Study& study, const PlantFit& retuned, Random& random, Diagnosis& diagnosis) {
  const Index count = static_cast<Index>(study.tolerances.size());
  const Vector surprise = surprises(retuned, count);
  Index most = 0;
  surprise.cwiseAbs().maxCoeff(&most);
  const bool beyond = std::abs(surprise(most)) > kOutOfTolerance;
  // One parameter alone that does what all do together is the one that is wrong.
  Suspect alone;
  PlantFit best;
  GapStage stage;
  std::vector<double> misfits;  // held out, of every parameter alone: the rivals
  Index winner = 0;
  if (diagnosis.delivered.misfit - 1 > kGapOfNote) {
    for (Index i = 0; i < count; ++i) {
      if (std::abs(retuned.theta(i)) < 0.5) continue;
      const FitParameter& parameter = study.tolerances[static_cast<std::size_t>(i)];
      const PlantFit fit = fit_plant(study.nominal, {{parameter.name, parameter.scale, 0}}, study.data.fitted,
                                     study.solver, study.options.iterations);
      if (fit.error.empty()) continue;
      GapStage own = score(study, fit.plant);
      if (!std::isfinite(own.misfit)) continue;
      misfits.push_back(own.misfit);
      if (!best.error.empty() && fit.misfit >= best.misfit) continue;
      best = fit;
      stage = std::move(own);
      winner = static_cast<Index>(misfits.size()) - 1;
      alone.effect = error_id(parameter.name);
      alone.location = location_of(study.nominal, parameter.name);
      alone.parameters = fitted_parameters(fit, {parameter}, 0);
    }
  }
  if (!best.error.empty())
    alone.closure = closure(diagnosis.delivered.blocks, stage.blocks, study.options.draws, random);
  const bool explains = !best.error.empty() && alone.closure.value > 0.9;
  diagnosis.corrected = diagnosis.retuned;
  diagnosis.plant = retuned.plant;
  diagnosis.closure = closure(diagnosis.delivered.blocks, diagnosis.retuned.blocks, study.options.draws, random);
  if (!beyond && !explains) {
    diagnosis.outcome = GapOutcome::none;
    return;
  }
  Suspect named = alone;
  if (!explains) {
    const FitParameter& parameter = study.tolerances[static_cast<std::size_t>(most)];
    named.effect = error_id(parameter.name);
    named.location = location_of(study.nominal, parameter.name);
    named.parameters = {{parameter.name, get_parameter(retuned.plant, parameter.name),
                         std::sqrt(retuned.covariance(most, most)) * parameter.scale}};
    named.closure = diagnosis.closure;
  } else {
    diagnosis.plant = best.plant;
    diagnosis.corrected = stage;
    diagnosis.closure = alone.closure;
  }
  if (explains) {
    const Vector rivals = Eigen::Map<Vector>(misfits.data(), static_cast<Index>(misfits.size()));
    named.probability = rival_probabilities(rivals, stage.blocks.size(), kLimit)(winner);
  } else {  // odds of the surprises against each other
    const Vector odds = (0.5 * (surprise.cwiseAbs2().array() - surprise(most) * surprise(most))).exp();
    named.probability = std::min(kLimit, 1 / odds.sum());
  }
  named.misfit = diagnosis.corrected.misfit;
  diagnosis.outcome = GapOutcome::parameter;
  diagnosis.suspects = {named};
  diagnosis.locations = {{named.location, named.probability, named.misfit}};
  diagnosis.named = {named.effect + "@" + named.location};
}

Vector probabilities_of(const std::vector<Fitted>& fits, Index blocks) {
  Vector misfits(static_cast<Index>(fits.size()));
  for (std::size_t i = 0; i < fits.size(); ++i) misfits(static_cast<Index>(i)) = fits[i].stage.misfit;
  return rival_probabilities(misfits, blocks, kLimit);
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

/// Locations by what an unknown signal there leaves, as rivals over blocks of time.
void locate_by_leftover(Diagnosis& diagnosis) {
  Vector leftovers(static_cast<Index>(diagnosis.places.size()));
  for (std::size_t i = 0; i < diagnosis.places.size(); ++i)
    leftovers(static_cast<Index>(i)) = std::max(diagnosis.places[i].leftover, 1e-3);
  const Vector p = rival_probabilities(leftovers, diagnosis.retuned.blocks.size(), kLimit);
  diagnosis.locations.clear();
  for (std::size_t i = 0; i < diagnosis.places.size(); ++i)
    diagnosis.locations.push_back(
        {diagnosis.places[i].location, p(static_cast<Index>(i)), diagnosis.places[i].leftover});
}

void judge_effects(const Study& study, const PlantFit& retuned,
                   const std::function<std::vector<EffectCandidate>(const Plant&)>& candidates, Random& random,
                   const std::function<void(const std::string&)>& step, Diagnosis& diagnosis) {
  std::vector<Fitted> fits = fit_shortlist(study, retuned, study.tolerances, candidates(retuned.plant), step);
  if (fits.empty()) {
    diagnosis.outcome = GapOutcome::insufficient;
    diagnosis.message = "no candidate of the catalogue could be fitted";
    return;
  }
  const Vector p = probabilities_of(fits, diagnosis.retuned.blocks.size());
  std::map<std::string, LocationProbability> places;
  for (std::size_t i = 0; i < fits.size(); ++i) {
    const Fitted& fitted = fits[i];
    Suspect suspect{fitted.candidate.effect,
                    fitted.candidate.location,
                    fitted.candidate.form,
                    p(static_cast<Index>(i)),
                    fitted.stage.misfit,
                    closure(diagnosis.retuned.blocks, fitted.stage.blocks, study.options.draws, random),
                    fitted_parameters(fitted.fit, fitted.parameters, study.tolerances.size())};
    LocationProbability& place = places[suspect.location];
    if (place.location.empty()) place = {suspect.location, 0, suspect.misfit};
    place.probability = std::min(kLimit, place.probability + suspect.probability);
    place.misfit = std::min(place.misfit, suspect.misfit);
    const auto same = [&](const Suspect& other) {
      return other.effect == suspect.effect && other.location == suspect.location;
    };
    const auto known = std::find_if(diagnosis.suspects.begin(), diagnosis.suspects.end(), same);
    if (known == diagnosis.suspects.end())
      diagnosis.suspects.push_back(std::move(suspect));
    else
      known->probability = std::min(kLimit, known->probability + suspect.probability);
  }
  for (auto& [name, place] : places) diagnosis.locations.push_back(place);
  std::stable_sort(diagnosis.locations.begin(), diagnosis.locations.end(),
                   [](const auto& a, const auto& b) { return a.probability > b.probability; });

  Fitted answer = std::move(fits.front());
  const Suspect first = diagnosis.suspects.front();
  const double first_closure = first.closure.value;
  diagnosis.named = {first.effect + "@" + first.location};
  diagnosis.outcome = GapOutcome::effect;
  for (std::size_t i = 1; i < diagnosis.suspects.size(); ++i)
    if (diagnosis.suspects[i].probability > kConsidered)
      diagnosis.ambiguous_with.push_back(diagnosis.suspects[i].effect + "@" + diagnosis.suspects[i].location);
  if (!diagnosis.ambiguous_with.empty()) diagnosis.outcome = GapOutcome::ambiguous;

  while (static_cast<Index>(diagnosis.named.size()) < study.options.effects && answer.stage.misfit - 1 > kAtFloor) {
    std::vector<Fitted> seconds =
        fit_shortlist(study, answer.fit, answer.parameters, candidates(answer.fit.plant), step);
    if (seconds.empty()) break;
    const double left = (seconds.front().stage.misfit - 1) / (answer.stage.misfit - 1);
    if (left > 1 - kSecond) break;
    const Vector among_rivals = probabilities_of(seconds, diagnosis.retuned.blocks.size());
    answer = std::move(seconds.front());
    const std::string name = answer.candidate.effect + "@" + answer.candidate.location;
    if (std::find(diagnosis.named.begin(), diagnosis.named.end(), name) == diagnosis.named.end()) {
      diagnosis.named.push_back(name);
      diagnosis.outcome = GapOutcome::several;
      diagnosis.suspects.push_back({answer.candidate.effect,
                                    answer.candidate.location,
                                    answer.candidate.form,
                                    among_rivals(0),
                                    answer.stage.misfit,
                                    Closure{},
                                    {}});
    } else {
      break;
    }
  }
  diagnosis.corrected = answer.stage;
  diagnosis.plant = answer.fit.plant;
  diagnosis.closure = closure(diagnosis.retuned.blocks, answer.stage.blocks, study.options.draws, random);
  // Two effects that each explain little, and even together leave much, are not causes but what fits by chance.
  if (diagnosis.closure.value < kExplains || (first_closure < kExplains && diagnosis.closure.value < kTogether)) {
    diagnosis.outcome = GapOutcome::located_not_in_catalogue;
    // What fits by chance says nothing of the place; the leftovers do.
    if (!diagnosis.places.empty()) locate_by_leftover(diagnosis);
    diagnosis.named = {"unknown@" + diagnosis.locations.front().location};
  }
}

}  // namespace

std::string to_string(GapOutcome outcome) {
  switch (outcome) {
    case GapOutcome::none: return "none";
    case GapOutcome::parameter: return "parameter";
    case GapOutcome::effect: return "effect";
    case GapOutcome::several: return "several";
    case GapOutcome::located_not_in_catalogue: return "located_not_in_catalogue";
    case GapOutcome::ambiguous: return "ambiguous";
    default: return "insufficient";
  }
}

Diagnosis diagnose(const Plant& plant, const RecordSet& set,
                   const std::function<std::vector<EffectCandidate>(const Plant&)>& candidates, const Solver& solver,
                   const DiagnoseOptions& options, Random& random,
                   const std::function<void(const std::string&)>& step) {
  Diagnosis diagnosis;
  diagnosis.plant = plant;
  diagnosis.floor = noise_floor(set);
  const Data data = prepare(plant, set, diagnosis.floor, options, diagnosis.held_out);
  const Study study{plant, data, solver, options, tolerance_parameters(plant)};
  if (step) step("the plant as delivered");
  diagnosis.delivered = score(study, plant);
  if (step) step("re-tuning inside the tolerances");
  const PlantFit retuned = fit_plant(plant, study.tolerances, data.fitted, solver, options.iterations);
  if (!std::isfinite(diagnosis.delivered.misfit) || retuned.error.empty()) {
    diagnosis.status = Status::outside_domain;
    diagnosis.outcome = GapOutcome::insufficient;
    diagnosis.message = "the plant as delivered cannot follow the drives of the records: " + retuned.solution.message;
    return diagnosis;
  }
  diagnosis.retuned = score(study, retuned.plant);
  for (std::size_t i = 0; i < study.tolerances.size(); ++i)
    diagnosis.tolerances.push_back({study.tolerances[i].name, retuned.theta(static_cast<Index>(i)),
                                    std::sqrt(retuned.covariance(static_cast<Index>(i), static_cast<Index>(i)))});
  diagnosis.closure_of_retuning = 1 - (diagnosis.retuned.misfit - 1) / (diagnosis.delivered.misfit - 1);
  if (step) step("where it enters");
  const PlantFit delivered = fit_plant(plant, {}, data.fitted, solver, options.iterations);
  diagnosis.places = better_places(locate(delivered, data.fitted), locate(retuned, data.fitted));
  if (std::max(retuned.misfit, diagnosis.retuned.misfit) - 1 <= kAtFloor)
    judge_parameters(study, retuned, random, diagnosis);
  else
    judge_effects(study, retuned, candidates, random, step, diagnosis);
  return diagnosis;
}

}  // namespace wheelhop
