#include "experiments/diagnose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/base/files.hpp"
#include "experiments/provenance.hpp"
#include "variants/solver/levenberg_marquardt.hpp"
#include "variants/table.hpp"

namespace wheelhop {
namespace {

Json by_channel(const Plant& plant, const std::vector<double>& values) {
  Json out = Json::object();
  for (std::size_t i = 0; i < values.size(); ++i) out[plant.sensors[i].name] = values[i];
  return out;
}

Json stage_json(const Plant& plant, const GapStage& stage) {
  return {{"nrmse", by_channel(plant, stage.nrmse)}, {"misfit", stage.misfit}};
}

Json interval(const Closure& closure) { return {closure.low, closure.high}; }

Json parameters_json(const std::vector<FittedParameter>& parameters) {
  constexpr double z90 = 1.6448536269514722;
  Json out = Json::array();
  for (const FittedParameter& parameter : parameters)
    out.push_back({{"name", parameter.name},
                   {"value", parameter.value},
                   {"ci90", {parameter.value - z90 * parameter.std, parameter.value + z90 * parameter.std}}});
  return out;
}

const char* verdict(const Diagnosis& diagnosis) {
  if (diagnosis.outcome == GapOutcome::none) return "no_gap";
  return diagnosis.outcome == GapOutcome::insufficient ? "insufficient" : "gap";
}

Json to_json(const Plant& plant, const Diagnosis& diagnosis, const std::string& corrected) {
  Json locations = Json::array(), effects = Json::array(), tolerances = Json::array(), floor = Json::object();
  for (const LocationProbability& place : diagnosis.locations)
    locations.push_back({{"location", place.location}, {"probability", place.probability}, {"misfit", place.misfit}});
  for (const Suspect& suspect : diagnosis.suspects)
    effects.push_back({{"effect", suspect.effect},
                       {"location", suspect.location},
                       {"form", suspect.form},
                       {"probability", suspect.probability},
                       {"misfit", suspect.misfit},
                       {"closure", suspect.closure.value},
                       {"parameters", parameters_json(suspect.parameters)}});
  for (const FittedParameter& parameter : diagnosis.tolerances)
    tolerances.push_back({{"name", parameter.name}, {"tolerances_off", parameter.value}, {"std", parameter.std}});
  for (Index i = 0; i < diagnosis.floor.std.size(); ++i)
    floor[plant.sensors[static_cast<std::size_t>(i)].name] = diagnosis.floor.std(i);
  Json places = Json::array();
  for (const Place& place : diagnosis.places)
    places.push_back({{"location", place.location}, {"same_entry", place.same}, {"leftover_chi2", place.leftover}});
  Json channels = Json::array();
  for (std::size_t i = 0; i < diagnosis.delivered.nrmse.size(); ++i)
    channels.push_back({{"channel", plant.sensors[i].name}, {"nrmse", diagnosis.delivered.nrmse[i]}});
  return {{"schema", "wheelhop.diagnosis/1"},
          {"verdict", verdict(diagnosis)},
          {"status", std::string(to_string(diagnosis.status))},
          {"message", diagnosis.message},
          {"where",
           {{"location", diagnosis.locations.empty() ? Json() : Json(diagnosis.locations.front().location)},
            {"locations", locations},
            {"without_catalogue", places},
            {"channels", channels}}},
          {"which",
           {{"effects", effects},
            {"named", diagnosis.named},
            {"outcome", to_string(diagnosis.outcome)},
            {"ambiguous_with", diagnosis.ambiguous_with}}},
          {"how_far",
           {{"as_delivered", stage_json(plant, diagnosis.delivered)},
            {"retuned", stage_json(plant, diagnosis.retuned)},
            {"with_effect", stage_json(plant, diagnosis.corrected)},
            {"floor", {{"std", floor}, {"source", to_string(diagnosis.floor.source)}}},
            {"held_out", diagnosis.held_out},
            {"closure", diagnosis.closure.value},
            {"closure_ci90", interval(diagnosis.closure)},
            {"closure_of_retuning", diagnosis.closure_of_retuning}}},
          {"retuning", tolerances},
          {"corrected_plant", corrected},
          {"provenance", provenance()}};
}

std::string percent(const Closure& closure) {
  return fmt::format("{:.0f} % [{:.0f}, {:.0f}]", 100 * closure.value, 100 * closure.low, 100 * closure.high);
}

std::string answer(const Diagnosis& diagnosis) {
  const double times = std::sqrt(std::max(diagnosis.delivered.misfit - 1, 0.0));
  const std::string gap = fmt::format("The gap is {:.1f} x the noise.", times);
  const auto best = [&]() -> const Suspect& { return diagnosis.suspects.front(); };
  switch (diagnosis.outcome) {
    case GapOutcome::none:
      return times < 1 ? "No gap: what the plant leaves is noise, every parameter inside its tolerance."
                       : gap + " Parameters that differ inside their tolerances explain it; nothing is missing.";
    case GapOutcome::parameter:
      return fmt::format("{} {} at {} explains it (P {:.2f}) and removes {} of it.", gap, best().effect,
                         best().location, best().probability, percent(diagnosis.closure));
    case GapOutcome::located_not_in_catalogue:
      return fmt::format(
          "{} No effect of the catalogue explains it; it seems to enter at {} (P {:.2f}). The best suspect, {} at {}, "
          "removes {} of what re-tuning leaves.",
          gap, diagnosis.locations.front().location, diagnosis.locations.front().probability, best().effect,
          best().location, percent(best().closure));
    case GapOutcome::insufficient: return "Not enough to tell: " + diagnosis.message + ".";
    default: break;
  }
  std::string names;
  for (const std::string& name : diagnosis.named) names += (names.empty() ? "" : " and ") + name;
  std::string text = fmt::format("{} It sits in {} (P {:.2f}); {} (P {:.2f}) removes {} of what re-tuning leaves.", gap,
                                 diagnosis.locations.front().location, diagnosis.locations.front().probability, names,
                                 best().probability, percent(diagnosis.closure));
  for (const std::string& other : diagnosis.ambiguous_with) text += " It could also be " + other + ".";
  return text;
}

void print(const Diagnosis& diagnosis) {
  fmt::print("{}\n", answer(diagnosis));
  if (!diagnosis.held_out)
    fmt::print("No record has the role \"validation\": every figure is of the records that were fitted, too kind.\n");
  fmt::print("\nmean squared error over the noise's, 1 is the floor ({}; {})\n", to_string(diagnosis.floor.source),
             diagnosis.held_out ? "held-out records" : "fitted records");
  fmt::print("  as delivered {:10.3f}\n  re-tuned     {:10.3f}   inside the tolerances; removes {:.0f} %\n",
             diagnosis.delivered.misfit, diagnosis.retuned.misfit, 100 * diagnosis.closure_of_retuning);
  for (const Suspect& suspect : diagnosis.suspects) {
    fmt::print("  with {:<38} {:10.3f}   P {:.2f}", suspect.effect + " at " + suspect.location, suspect.misfit,
               suspect.probability);
    for (const FittedParameter& parameter : suspect.parameters)
      fmt::print("  {} = {:.4g} +- {:.2g}", parameter.name.substr(parameter.name.rfind('.') + 1), parameter.value,
                 parameter.std);
    fmt::print("\n");
  }
  fmt::print("\nwhat one unknown signal would leave, by the place where it enters (1: it explains all)\n");
  for (const Place& place : diagnosis.places) {
    fmt::print("  {:<38} {:10.3f}", place.location, place.leftover);
    for (const std::string& same : place.same) fmt::print("{}{}", &same == &place.same.front() ? "   or " : ", ", same);
    fmt::print("\n");
  }
  fmt::print("\nparameters after re-tuning, in tolerances off\n");
  for (const FittedParameter& parameter : diagnosis.tolerances)
    fmt::print("  {:<55} {:6.1f} +- {:.1f}\n", parameter.name, parameter.value, parameter.std);
}

}  // namespace

CandidateSource catalogue_without(std::vector<std::string> left_out) {
  return [left_out = std::move(left_out)](const Plant& plant) {
    std::vector<EffectCandidate> candidates = effect_candidates(plant);
    std::erase_if(candidates, [&](const EffectCandidate& candidate) {
      return std::find(left_out.begin(), left_out.end(), candidate.effect) != left_out.end();
    });
    return candidates;
  };
}

Diagnosis diagnose_records(const Plant& plant, const RecordSet& set, const CandidateSource& candidates,
                           const std::function<void(const std::string&)>& step) {
  const auto solver = make_levenberg_marquardt({.relative_decrease = 1e-4});
  Random random(1, Stream::initial_guess);
  return diagnose(plant, set, candidates, *solver, {}, random, step);
}

std::filesystem::path write_diagnosis(const Plant& plant, const Diagnosis& diagnosis, const std::filesystem::path& out,
                                      const Json& more) {
  std::filesystem::path corrected = out;
  corrected.replace_extension(".plant.json");
  write_json(corrected, to_json(diagnosis.plant));
  Json answer = to_json(plant, diagnosis, corrected.filename().string());
  answer.update(more);
  write_json(out, answer);
  return corrected;
}

int run_diagnose(const DiagnoseRequest& request) {
  const Plant plant = load_plant(request.plant);
  const RecordSet set = load_records(request.records, plant.input_channels(), plant.output_channels());
  require_writable_folder(request.out.parent_path());
  const auto step = [&](const std::string& what) {
    if (!request.quiet) std::fprintf(stderr, "diagnose: %s\n", what.c_str());
  };
  const Diagnosis diagnosis = diagnose_records(plant, set, effect_candidates, step);
  const std::filesystem::path corrected = write_diagnosis(plant, diagnosis, request.out);
  if (diagnosis.status != Status::ok) {
    std::fprintf(stderr, "wheelhop: %s\n", diagnosis.message.c_str());
    return 1;
  }
  print(diagnosis);
  fmt::print("\nwritten: {}, {}\n", request.out.string(), corrected.string());
  return 0;
}

}  // namespace wheelhop
