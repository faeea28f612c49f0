#include "experiments/diagnose/json.hpp"

#include <algorithm>
#include <cmath>

#include "experiments/run/provenance.hpp"

namespace wheelhop {
namespace {

const std::string& channel_name(const Plant& plant, Index i) { return plant.sensors[static_cast<std::size_t>(i)].name; }

template <class Values>
Json by_channel(const Plant& plant, const Values& values) {
  Json out = Json::object();
  Index i = 0;
  for (const double value : values) out[channel_name(plant, i++)] = value;
  return out;
}

Json interval(const Closure& closure) { return {closure.low, closure.high}; }

Json stage_json(const Plant& plant, const GapStage& stage) {
  std::vector<double> vaf;
  for (const double nrmse : stage.nrmse) vaf.push_back(100 * (1 - nrmse * nrmse));
  return {{"nrmse", by_channel(plant, stage.nrmse)}, {"vaf_percent", by_channel(plant, vaf)}, {"misfit", stage.misfit}};
}

Json parameters_json(const std::vector<FittedParameter>& parameters) {
  constexpr double z90 = 1.6448536269514722;
  Json out = Json::array();
  for (const FittedParameter& parameter : parameters)
    out.push_back({{"name", parameter.name},
                   {"value", parameter.value},
                   {"ci90", parameter.std > 0
                                ? Json({parameter.value - z90 * parameter.std, parameter.value + z90 * parameter.std})
                                : Json()}});
  return out;
}

const char* verdict(const Diagnosis& diagnosis) {
  if (is<NoGap>(diagnosis.verdict)) return "no_gap";
  return is<Insufficient>(diagnosis.verdict) ? "insufficient" : "gap";
}

/// What kind of gap; null where the records do not tell.
Json kind_json(const Plant& plant, const StageExamination& stage) {
  Json kind = {{"repeatable", Json()}, {"drift", Json()}};
  if (stage.repeats.known)
    kind["repeatable"] = {{"share", stage.repeats.share}, {"channels", by_channel(plant, stage.repeats.channel)}};
  if (const Drift& drift = stage.drift; drift.known)
    kind["drift"] = {{"significant", drift.significant}, {"p", drift.p},         {"kind", drift.kind},
                     {"channel", drift.channel},         {"first", drift.first}, {"last", drift.last}};
  const LineSplit& lines = stage.lines;
  if (lines.known)
    kind["lines"] = {{"linear", lines.linear},
                     {"odd", lines.odd_apart ? Json(lines.odd) : Json()},
                     {"even", lines.even},
                     {"period_s", lines.period_s},
                     {"periods", lines.periods}};
  else
    kind["lines"] = {{"absent", lines.why_not}};
  return kind;
}

/// Bands, regions, time and kind of one stage, written into `out`.
void add_profile(const Plant& plant, const Examination& examination, const StageExamination& stage, Json& out) {
  const GapProfile& profile = stage.profile;
  out["bands"] = out["regions"] = out["time"] = Json::array();
  for (const BandShare& band : profile.bands)
    out["bands"].push_back({{"from_hz", band.from_hz},
                            {"to_hz", band.to_hz},
                            {"share", band.share},
                            {"excess", band.excess},
                            {"channels", by_channel(plant, band.channel_share)}});
  for (const RegionShare& region : standing_out(profile))
    out["regions"].push_back({{"variable", region.variable},
                              {"from", region.from},
                              {"to", region.to},
                              {"share", region.share},
                              {"time_share", region.time_share}});
  for (const TimeShare& slice : profile.time)
    out["time"].push_back({{"record", examination.names[static_cast<std::size_t>(slice.record)]},
                           {"from_s", slice.from_s},
                           {"to_s", slice.to_s},
                           {"share", slice.share},
                           {"excess", slice.excess}});
  out["kind"] = kind_json(plant, stage);
}

/// What an unknown signal at a location would leave; null where the records cannot tell.
Json leftover_at(const Diagnosis& diagnosis, const Place& location) {
  for (const PlaceLeftover& place : diagnosis.evidence.places)
    if (place.location == location || std::find(place.same.begin(), place.same.end(), location) != place.same.end())
      return place.leftover;
  return {};
}

Json places_json(const std::vector<PlaceLeftover>& places) {
  Json list = Json::array();
  for (const PlaceLeftover& place : places)
    list.push_back({{"location", place.location}, {"same_entry", place.same}, {"leftover_chi2", place.leftover}});
  return list;
}

Json where_json(const Plant& plant, const Diagnosis& diagnosis, const Examination* examination) {
  Json where = {
      {"location", diagnosis.verdict.locations.empty() ? Json() : Json(diagnosis.verdict.locations.front().location)},
      {"locations", Json::array()},
      {"places_needed", diagnosis.evidence.places_needed},
      {"two_places", Json::array()},
      {"channels", Json::array()},
      {"bands", Json::array()},
      {"regions", Json::array()},
      {"time", Json::array()}};
  for (const LocationProbability& place : diagnosis.verdict.locations)
    where["locations"].push_back({{"location", place.location},
                                  {"probability", place.probability},
                                  {"leftover_chi2", leftover_at(diagnosis, place.location)}});
  where["without_catalogue"] = places_json(diagnosis.evidence.places);
  where["left_with_answer"] = places_json(diagnosis.follow_up.places_left);
  for (const PairLeftover& pair : diagnosis.evidence.place_pairs)
    where["two_places"].push_back({{"locations", pair.locations}, {"leftover_chi2", pair.leftover}});
  for (std::size_t i = 0; i < diagnosis.evidence.delivered.nrmse.size(); ++i)
    where["channels"].push_back({{"channel", plant.sensors[i].name}, {"nrmse", diagnosis.evidence.delivered.nrmse[i]}});
  if (examination == nullptr) return where;
  const auto& [delivered, retuned, corrected] = examination->stages;
  if (delivered.ran) {
    for (Index i = 0; i < plant.sensor_count(); ++i) {
      where["channels"][static_cast<std::size_t>(i)]["floor_nrmse"] = delivered.profile.floor_nrmse(i);
      where["channels"][static_cast<std::size_t>(i)]["misfit"] = delivered.profile.channel_misfit(i);
    }
    add_profile(plant, *examination, delivered, where);
  }
  if (const UnknownSignal& unknown = examination->unknown; unknown.status == Status::ok)
    where["unknown_signal"] = {{"location", unknown.location},
                               {"unit", unknown.unit},
                               {"rms", unknown.rms},
                               {"noise_rms", unknown.noise_rms},
                               {"band_hz", unknown.band_hz}};
  if (retuned.ran) add_profile(plant, *examination, retuned, where["after_retuning"]);
  if (corrected.ran) add_profile(plant, *examination, corrected, where["after_effect"]);
  return where;
}

Json how_far_json(const Plant& plant, const Diagnosis& diagnosis, const Examination* examination) {
  Json far = {{"as_delivered", stage_json(plant, diagnosis.evidence.delivered)},
              {"retuned", stage_json(plant, retuned_of(diagnosis.evidence))},
              {"with_effect", stage_json(plant, corrected_stage(diagnosis.evidence, diagnosis.verdict))},
              {"floor",
               {{"std", by_channel(plant, diagnosis.floor.std)},
                {"source", to_string(diagnosis.floor.source)},
                {"repeats", diagnosis.floor.repeats}}},
              {"held_out", diagnosis.evidence.held_out},
              {"judged_from_s", diagnosis.evidence.judged_from_s},
              {"closure", closure_of(diagnosis.evidence, diagnosis.verdict).value},
              {"closure_ci90", interval(closure_of(diagnosis.evidence, diagnosis.verdict))},
              {"closure_of_retuning", closure_of_retuning(diagnosis.evidence)},
              {"per_channel", Json::array()},
              {"per_band", Json::array()},
              {"beyond_envelope", Json()}};
  if (examination == nullptr) return far;
  const auto per_stage = [&](const auto& value) {
    Json out = Json::object();
    for (std::size_t s = 0; s < kStageNames.size(); ++s)
      out[kStageNames[s]] = examination->stages[s].ran ? Json(value(examination->stages[s].profile)) : Json();
    return out;
  };
  for (Index i = 0; i < plant.sensor_count(); ++i)
    far["per_channel"].push_back({{"channel", channel_name(plant, i)},
                                  {"misfit", per_stage([&](const GapProfile& p) { return p.channel_misfit(i); })}});
  if (const StageExamination& delivered = examination->stages[0]; delivered.ran) {
    far["floor"]["nrmse"] = by_channel(plant, delivered.profile.floor_nrmse);
    for (std::size_t b = 0; b < delivered.profile.bands.size(); ++b)
      far["per_band"].push_back({{"from_hz", delivered.profile.bands[b].from_hz},
                                 {"to_hz", delivered.profile.bands[b].to_hz},
                                 {"excess", per_stage([&](const GapProfile& p) { return p.bands[b].excess; })}});
  }
  if (const Ceiling& ceiling = examination->ceiling; !ceiling.location.empty()) {
    far["ceiling"] = {{"location", ceiling.location}};
    if (ceiling.why_not.empty())
      far["ceiling"].update({{"signal", ceiling.signal}, {"static_map", ceiling.static_map}});
    else
      far["ceiling"]["absent"] = ceiling.why_not;
  }
  if (!examination->beyond_known) return far;
  const BeyondEnvelope& beyond = examination->beyond;
  Json excursions = Json::array();
  for (const Excursion& excursion : beyond.excursions)
    excursions.push_back({{"variable", excursion.variable}, {"beyond", excursion.beyond}});
  far["beyond_envelope"] = {{"closure", beyond.outside.value},
                            {"closure_ci90", interval(beyond.outside)},
                            {"closure_inside", beyond.inside.value},
                            {"time_share", beyond.time_share},
                            {"excursions", excursions},
                            {"flagged", beyond.flagged}};
  return far;
}

/// Things that have fields, as an array of objects.
template <class Thing>
Json list_json(std::vector<Thing> things) {
  Json out = Json::array();
  for (Thing& thing : things) {
    out.push_back(Json::object());
    thing.fields([&](const char* name, const auto& value) { out.back()[name] = value; });
  }
  return out;
}

Json search_json(SearchEffort effort) {
  Json out = Json::object();
  effort.fields([&](const char* name, const auto& value) { out[name] = value; });
  return out;
}

/// Null where there is no rival, or nothing of the menu tells it from the answer.
Json separating_json(const SeparatingTest& separating) {
  if (separating.test.empty()) return {};
  return {{"test", separating.test}, {"cosine", separating.cosine}, {"cosine_here", separating.planned_cosine}};
}

}  // namespace

Json placebo_json(const Placebo& placebo) {
  if (!placebo.why_not.empty()) return {{"absent", placebo.why_not}};
  Json names = Json::object();
  for (const auto& [name, count] : placebo.names) names[to_string(name)] = count;
  if (placebo.nothing > 0) names["none"] = placebo.nothing;
  return {{"runs", placebo.runs}, {"same", placebo.same}, {"names", names}};
}

Json diagnosis_json(const Plant& plant, const Diagnosis& diagnosis, const Examination* examination, const View& view,
                    const std::string& corrected) {
  Json effects = Json::array(), tolerances = Json::array();
  for (const Suspect& suspect : diagnosis.verdict.suspects) {
    const double share = share_of(diagnosis, suspect);
    effects.push_back({{"effect", suspect.effect},
                       {"location", suspect.location},
                       {"form", suspect.form},
                       {"probability", suspect.probability},
                       {"misfit", suspect.misfit},
                       {"closure", suspect.closure.value},
                       {"share", std::isnan(share) ? Json() : Json(share)},
                       {"parameters", parameters_json(suspect.parameters)}});
  }
  Json checks = Json::array();
  for (const Check& check : diagnosis.follow_up.checks)
    checks.push_back({{"check", check.name}, {"passed", check.passed}, {"detail", check.detail}});
  for (const ToleranceEvidence& own : diagnosis.evidence.tolerances)
    tolerances.push_back({{"name", own.parameter}, {"tolerances_off", own.theta}, {"std", own.std}, {"z", own.z}});
  return {{"schema", "wheelhop.diagnosis/1"},
          {"verdict", verdict(diagnosis)},
          {"answer", view.answer},
          {"status", std::string(to_string(diagnosis.status))},
          {"message", diagnosis.verdict.message},
          {"where", where_json(plant, diagnosis, examination)},
          {"which",
           {{"effects", effects},
            {"named", diagnosis.verdict.named},
            {"outcome", outcome_of(diagnosis.verdict)},
            {"ambiguous_with", diagnosis.verdict.ambiguous_with},
            {"separating_test", separating_json(diagnosis.follow_up.separating)}}},
          {"how_far", how_far_json(plant, diagnosis, examination)},
          {"checks", checks},
          {"decided_by", {{"row", diagnosis.verdict.row}, {"because", diagnosis.verdict.why}}},
          {"evidence", to_json(diagnosis.evidence)},
          {"thresholds", to_json(diagnosis.thresholds)},
          {"search", search_json(diagnosis.effort)},
          {"bridged_samples", list_json(diagnosis.spikes)},
          {"slow_channels", list_json(diagnosis.slow)},
          {"retuning", tolerances},
          {"view", to_json(view)},
          {"corrected_plant", corrected},
          {"provenance", provenance()}};
}

}  // namespace wheelhop
