#include "core/gap/diagnose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/gap/judge.hpp"
#include "core/gap/probe.hpp"

namespace wheelhop {

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

bool is_rounding(const Diagnosis& diagnosis) {
  return diagnosis.outcome == GapOutcome::effect && diagnosis.closure.value == kNothingAdded.value &&
         std::isnan(diagnosis.closure.low);
}

double share_of(const Diagnosis& diagnosis, const Suspect& suspect) {
  // One that was also fitted alone stands further down a second time.
  const auto first = std::find_if(diagnosis.suspects.begin(), diagnosis.suspects.end(), [&](const Suspect& other) {
    return other.effect == suspect.effect && other.location == suspect.location;
  });
  const auto& named = diagnosis.named;
  const auto found = std::find(named.begin(), named.end(), suspect.effect + "@" + suspect.location);
  const Index i = found - named.begin();
  return &*first == &suspect && i < diagnosis.shares.size() ? diagnosis.shares(i)
                                                            : std::numeric_limits<double>::quiet_NaN();
}

namespace {

constexpr double kHalved = 0.5;  // of what the best place leaves, what two places may leave of it to be told

/// True of an accelerometer that feels a force at a place directly.
bool feels(const Plant& plant, const std::string& sensor, const std::string& location) {
  std::string from, to;
  if (!ends_of(plant, location, from, to)) return false;
  return std::any_of(plant.sensors.begin(), plant.sensors.end(), [&](const Sensor& own) {
    return "sensor:" + own.name == sensor && own.kind == SensorKind::acceleration && (own.to == from || own.to == to);
  });
}

/// Where unknown signals would enter the re-tuned plant: at one place, or at two where one does not explain all.
void find_places(const PlantFit& fit, const GapData& data, Diagnosis& diagnosis) {
  diagnosis.places = locate(fit, data.fitted, data.noise_shares);
  if (diagnosis.places.empty()) return;
  const Place& best = diagnosis.places.front();
  if (explains_all(best.leftover, fit.misfit)) {
    diagnosis.places_needed = 1;
    return;
  }
  diagnosis.place_pairs = locate_two(fit, data.fitted, diagnosis.places, data.noise_shares);
  if (diagnosis.place_pairs.empty()) return;
  const PlacePair& pair = diagnosis.place_pairs.front();
  if (!explains_all(pair.leftover, fit.misfit) || pair.leftover - 1 > kHalved * (best.leftover - 1)) return;
  // Of a force that jumps within a sample the accelerometers upon it show what no force held over samples does.
  const auto of_best = [&](const std::string& location) {
    return location == best.location || feels(fit.plant, location, best.location);
  };
  diagnosis.places_needed = of_best(pair.locations[0]) && of_best(pair.locations[1]) ? 1 : 2;
}

}  // namespace

Diagnosis diagnose(const Plant& plant, const RecordSet& set, const CandidateList& candidates, const GapSolvers& solvers,
                   const DiagnoseOptions& options, Random& random,
                   const std::function<void(const std::string&)>& step) {
  Diagnosis diagnosis;
  diagnosis.plant = diagnosis.retuned_plant = plant;
  diagnosis.floor = noise_floor(set);
  const GapData data = gap_data(plant, set, diagnosis.floor, options.block_s);
  diagnosis.held_out = data.apart;
  diagnosis.judged_from_s = static_cast<double>(judged_from(data.held_out.front(), data.block)) / set.sampling_hz;
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
    std::string largest;
    for (std::size_t i = 0; i < plant.inputs.size(); ++i) {
      const double size = data.fitted.front().drive.row(static_cast<Index>(i)).cwiseAbs().maxCoeff();
      largest += fmt::format("{}{} {:.3g} {}", i == 0 ? "" : ", ", plant.inputs[i].name, size, plant.inputs[i].unit);
    }
    diagnosis.message = fmt::format(
        "the plant {} cannot follow the drives of the records, which reach {}: is that the unit of the file?",
        delivered.stage.blocks.size() == 0 ? "as delivered" : "as re-tuned", largest);
    return diagnosis;
  }
  diagnosis.retuned_plant = retuned.fit.plant;
  diagnosis.tolerances = fitted_parameters(retuned.fit, study.tolerances, 0);
  for (std::size_t i = 0; i < study.tolerances.size(); ++i) {
    diagnosis.tolerances[i].value = retuned.fit.theta(static_cast<Index>(i));
    diagnosis.tolerances[i].std /= study.tolerances[i].scale;
  }
  if (const Vector& moved = retuned.fit.theta; moved.size() > 0 && retuned.fit.jacobian.size() > 0)
    (retuned.fit.jacobian.leftCols(moved.size()).colwise().norm().transpose().array() * moved.array().abs())
        .maxCoeff(&diagnosis.most_retuned);
  if (diagnosis.delivered.misfit > 1)
    diagnosis.closure_of_retuning = 1 - (diagnosis.retuned.misfit - 1) / (diagnosis.delivered.misfit - 1);
  if (step) step("where it enters");
  const std::vector<WrongScale> wrong = wrong_scales(delivered.fit, data.fitted);
  // Around a channel in another unit re-tuning bends the plant out of all shape, and signals at its places tell
  // nothing.
  find_places(one_scale(wrong, plant.sensors.size()) ? delivered.fit : retuned.fit, data, diagnosis);
  judge({study, options, delivered, retuned, wrong, random, step, diagnosis.floor.power_error}, diagnosis);
  if (diagnosis.outcome == GapOutcome::located_not_in_catalogue || diagnosis.outcome == GapOutcome::exogenous ||
      diagnosis.outcome == GapOutcome::insufficient) {
    const std::string scales = scale_message(wrong, plant.sensors.size());
    if (!scales.empty()) diagnosis.message = scales + (diagnosis.message.empty() ? "" : "; " + diagnosis.message);
  }
  return diagnosis;
}

}  // namespace wheelhop
