#include "experiments/diagnose/view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/plant/rotary.hpp"
#include "experiments/diagnose/answer.hpp"

namespace wheelhop {
namespace {

// Judgements of what is worth a line.
constexpr double kAsLittle = 1.5;   // leftover over that of the best pair of places, up to which one is told
constexpr double kHardlyAny = 0.1;  // misfit - 1, of which shares say nothing
constexpr std::size_t kSpikes = 5;  // bad samples that are told one by one

/// Three significant digits; "-" of what is not known.
std::string digits(double value) {
  if (!std::isfinite(value)) return "-";
  const std::string text = fmt::format("{:.3g}", value + 0.0), rounded = fmt::format("{:.0f}", std::stod(text));
  return text.find("e+") != std::string::npos && rounded.size() < 8 ? rounded : text;
}

std::string share_text(double share) {
  if (!std::isfinite(share)) return "-";
  const std::string text = fmt::format("{:.{}f}", 100 * share, share > 0.99 && share < 1 ? 1 : 0);
  return (text == "-0" ? "0" : text) + " %";
}

/// "coulomb friction at suspension".
std::string in_words(const EffectAt& named) {
  std::string effect = named.effect.text();
  std::replace(effect.begin(), effect.end(), '_', ' ');
  return fmt::format("{} at {}", effect, named.place);
}

std::string heading_of(const Diagnosis& diagnosis) {
  if (is<NoGap>(diagnosis.verdict)) return "Simulation and rig agree";
  std::vector<std::string> names;
  for (const EffectAt& name : diagnosis.verdict.named) names.push_back(in_words(name));
  return "Why simulation and rig disagree: " + (names.empty() ? "no cause named" : listed(names, "and"));
}

std::string note_of(const Placebo& placebo) {
  if (!placebo.why_not.empty()) return "Placebo: none, " + placebo.why_not + ".";
  std::string names;
  for (const auto& [name, count] : placebo.names)
    names += fmt::format("{}{} {}", names.empty() ? "" : ", ", in_words(name), count);
  if (placebo.nothing > 0) names += fmt::format("{}none {}", names.empty() ? "" : ", ", placebo.nothing);
  return fmt::format(
      "Placebo: {} of {} diagnoses of simulated records, in which this answer is true, give it again. Named: {}.",
      placebo.same, placebo.runs, names);
}

/// "CHANNEL was read at 50 Hz (every 4 samples, repeated in between) and is compared like that.", one a channel.
std::vector<std::string> slow_notes(const std::vector<SlowOutput>& slow) {
  std::vector<std::string> notes, told;
  for (const SlowOutput& own : slow) {
    if (std::find(told.begin(), told.end(), own.channel) != told.end()) continue;
    told.push_back(own.channel);
    notes.push_back(fmt::format(
        "{} was read at {:.4g} Hz ({} samples a reading, {} in between), and is compared like that.", own.channel,
        own.rate_hz, digits(own.samples), own.between == "lines" ? "straight lines" : "the last one repeated"));
  }
  return notes;
}

/// A stage's profile, null where it did not run.
const GapProfile* profile_of(const Examination* examination, std::size_t stage) {
  return examination && examination->stages[stage].ran ? &examination->stages[stage].profile : nullptr;
}

ViewTable how_far_table(const Plant& plant, const Diagnosis& diagnosis, const Examination* examination) {
  const Evidence& evidence = diagnosis.evidence;
  const std::array<GapStage, 3> stages = {evidence.delivered, retuned_of(evidence),
                                          corrected_stage(evidence, diagnosis.verdict)};
  ViewTable table{"how_far",
                  fmt::format("How far the simulation is from the records {}{}. Misfit: mean squared error over the "
                              "noise's ({}), 1 is the floor. A channel: RMS error over its RMS.",
                              evidence.held_out ? "that were held out" : "that were fitted, which is too kind",
                              evidence.judged_from_s > 0 ? fmt::format(" from {:g} s on", evidence.judged_from_s) : "",
                              to_string(diagnosis.floor.source)),
                  {"", "As delivered", "Re-tuned", "With the answer", "Noise"},
                  {{"Misfit, all channels"}}};
  const GapProfile* delivered = profile_of(examination, 0);
  for (const GapStage& stage : stages) table.rows[0].push_back(digits(stage.nrmse.empty() ? kUnknown : stage.misfit));
  table.rows[0].push_back("1");
  for (std::size_t i = 0; i < plant.sensors.size(); ++i) {
    std::vector<std::string> row = {plant.sensors[i].name};
    for (const GapStage& stage : stages)
      row.push_back(i < stage.nrmse.size() ? digits(100 * stage.nrmse[i]) + " %" : "-");
    row.push_back(delivered ? digits(100 * delivered->floor_nrmse(static_cast<Index>(i))) + " %" : "-");
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// What re-tuning removes, beside the answer, a static map and any signal at one place.
ViewTable ceiling_table(const Diagnosis& diagnosis, const Ceiling& ceiling) {
  const Evidence& evidence = diagnosis.evidence;
  const double whole = evidence.delivered.misfit - 1, left = retuned_of(evidence).misfit - 1;
  const bool more = left > kHardlyAny;
  ViewTable table{"ceiling",
                  ceiling.why_not.empty()
                      ? "How far the gap shrinks. A static map is what a neural network of the place's motion can be; "
                        "what any signal removes beyond it has memory or comes from outside."
                      : "How far the gap shrinks. There is no ceiling of a static map: " + ceiling.why_not + ".",
                  {"", "Of the gap as delivered"},
                  {}};
  if (ceiling.location.empty()) return table;
  if (more) table.columns.push_back("Of what re-tuning leaves");
  const auto add = [&](const std::string& what, double remains) {
    table.rows.push_back({what, share_text(1 - remains / whole)});
    if (more) table.rows.back().push_back(share_text(1 - remains / left));
  };
  add("Re-tuning inside the tolerances alone", left);
  const GapStage corrected = corrected_stage(evidence, diagnosis.verdict);
  if (corrected.blocks.size() > 0 && !is_place(diagnosis.verdict)) add("With the answer", corrected.misfit - 1);
  if (!ceiling.why_not.empty()) return table;
  add(fmt::format("With a static map of travel and rate at {}, at best", ceiling.location),
      left * (1 - ceiling.static_map));
  add(fmt::format("With any signal at {}", ceiling.location), left * (1 - ceiling.signal));
  return table;
}

/// What a parameter is called beside its element and law: "force_n", or "scheduled.force_n" of its slope.
std::string last_part(const std::string& name) {
  const std::size_t slope = name.find(".scheduled.");
  return name.substr((slope == std::string::npos ? name.rfind('.') : slope) + 1);
}

/// "force_n = 41.2 [38, 44]" by 90 % intervals, one after the other.
std::string parameters_text(const std::vector<FittedParameter>& parameters) {
  constexpr double z90 = 1.6448536269514722;
  std::string text;
  for (const FittedParameter& own : parameters) {
    text += fmt::format("{}{} = {:.4g}", text.empty() ? "" : "; ", last_part(own.name), own.value);
    if (own.std > 0) text += fmt::format(" [{:.4g}, {:.4g}]", own.value - z90 * own.std, own.value + z90 * own.std);
  }
  return text;
}

ViewTable effects_table(const Diagnosis& diagnosis) {
  const std::vector<Suspect>& suspects = diagnosis.verdict.suspects;
  const bool shared = std::any_of(suspects.begin(), suspects.end(),
                                  [&](const Suspect& suspect) { return !std::isnan(share_of(diagnosis, suspect)); });
  ViewTable table{"effects",
                  std::string("Which effect: every suspect that was fitted in full, best first. Misfit: mean squared "
                              "error over the noise's on held-out records. 90 % intervals in brackets.") +
                      (shared ? " Share: what each effect named contributes to what all remove together (Shapley's "
                                "value)."
                              : ""),
                  {"Effect", "Probability", "Misfit", "Removes"},
                  {}};
  if (shared) table.columns.push_back("Share");
  table.columns.push_back("Parameters");
  for (const Suspect& suspect : suspects) {
    table.rows.push_back({in_words(suspect.name()), fmt::format("{:.2f}", suspect.probability), digits(suspect.misfit),
                          share_text(suspect.closure.value)});
    if (shared) table.rows.back().push_back(share_text(share_of(diagnosis, suspect)));
    table.rows.back().push_back(parameters_text(suspect.parameters));
  }
  return table;
}

ViewTable places_table(const Evidence& evidence) {
  ViewTable table{"places",
                  "Where it enters: what one unknown signal would leave, by the place at which it enters; 1: it "
                  "explains all.",
                  {"Place", "Leaves", "Enters alike"},
                  {}};
  for (const PlaceLeftover& place : evidence.places) {
    std::string same;
    for (const Place& other : place.same) same += (same.empty() ? "" : ", ") + to_string(other);
    table.rows.push_back({to_string(place.location), digits(place.leftover), same});
  }
  return table;
}

/// Where no single place explains all channels: the pairs of places that leave about as little as the best of them.
ViewTable place_pairs_table(const Evidence& evidence) {
  const char* const says = evidence.places_needed == 2   ? ". Two at once do:"
                           : evidence.places_needed == 1 ? ", unless a force there jumps. Two at once do:"
                                                         : ", nor do two:";
  ViewTable table{"two_places",
                  fmt::format("No single place explains all channels{} what an unknown signal at each of them would "
                              "leave; 1 is the noise.",
                              says),
                  {"Places", "Leaves"},
                  {}};
  for (const PairLeftover& pair : evidence.place_pairs) {
    if (pair.leftover > kAsLittle * evidence.place_pairs.front().leftover) break;
    table.rows.push_back({fmt::format("{} and {}", pair.locations[0], pair.locations[1]), digits(pair.leftover)});
  }
  return table;
}

ViewTable bands_table(const Examination& examination) {
  ViewTable table{"bands",
                  "In which bands the gap lies, of the gap as delivered.",
                  {"Band", "As delivered", "Re-tuned", "With the answer"},
                  {}};
  double whole = 0;  // as delivered, in the bands in which there is any
  for (const BandShare& band : examination.stages[0].profile.bands) whole += std::max(band.excess, 0.0);
  if (!(whole > 0)) return table;
  for (std::size_t b = 0; b < examination.stages[0].profile.bands.size(); ++b) {
    const BandShare& band = examination.stages[0].profile.bands[b];
    table.rows.push_back({fmt::format("{:.3g} to {:.3g} Hz", band.from_hz, band.to_hz)});
    for (const StageExamination& stage : examination.stages)
      table.rows.back().push_back(
          share_text(stage.ran ? std::max(stage.profile.bands[b].excess, 0.0) / whole : kUnknown));
  }
  return table;
}

std::string drift_text(const Drift& drift) {
  if (!drift.significant)
    return fmt::format("no: the first third of the record and the last do not differ beyond chance (p {})",
                       digits(drift.p));
  const std::string what = drift.channel.empty() ? "its " + drift.kind : "the " + drift.kind + " of " + drift.channel;
  return fmt::format("yes: {} goes from {} to {} between the first third and the last (p {})", what,
                     digits(drift.first), digits(drift.last), digits(drift.p));
}

std::string beyond_text(const BeyondEnvelope& beyond) {
  std::string text = fmt::format("{} of the time; ", share_text(beyond.time_share));
  if (!std::isfinite(beyond.outside.value)) {
    text += "nothing is above the noise there";
    return text + (beyond.flagged ? " but what the answer adds: do not trust it there" : "");
  }
  text += fmt::format("there the answer removes {}, inside {}", share_text(beyond.outside.value),
                      share_text(beyond.inside.value));
  return text + (beyond.flagged ? ": do not trust it there" : "");
}

std::string origin_of(const Tone& tone) {
  if (tone.multiple == 0) return "which no drive has: hum, or something that turns";
  return fmt::format("{} times the tone of the drive: a law that is not linear makes it", tone.multiple);
}

ViewTable kind_table(const Plant& plant, const Examination& examination) {
  const int stage = telling_stage(examination);
  ViewTable table{
      "kind",
      stage == 0 ? "What kind of gap, of the gap as delivered." : "What kind of gap, of what re-tuning leaves.",
      {"", ""},
      {}};
  if (stage < 0) return table;
  const StageExamination& own = examination.stages[static_cast<std::size_t>(stage)];
  const auto add = [&](const char* what, std::string text) { table.rows.push_back({what, std::move(text)}); };
  if (own.repeats.known)
    add("Comes again with the drive",
        share_text(own.repeats.share) + " of a record's squared error; the rest differs between repeats");
  if (own.drift.known) add("Drifts", drift_text(own.drift));
  if (own.lines.known)
    add("Linear, odd, even", fmt::format("{} linear{}, {} even (period {} s)", share_text(own.lines.linear),
                                         own.lines.odd_apart ? ", " + share_text(own.lines.odd) + " odd" : " or odd",
                                         share_text(own.lines.even), digits(own.lines.period_s)));
  else
    add("Linear, odd, even", "cannot be told: " + own.lines.why_not);
  if (own.tone.seen && has_gap(own.profile))
    add("One tone", fmt::format("{} of the error of {} at {:.4g} Hz, {}", share_text(own.tone.share), own.tone.channel,
                                own.tone.frequency_hz, origin_of(own.tone)));
  for (const RegionShare& region : standing_out(own.profile)) {
    std::string variable = region.variable;
    std::replace(variable.begin(), variable.end(), '.', ' ');
    add("Stands out", fmt::format("{} of it in {} of the time, at {} {} to {} {}", share_text(region.share),
                                  share_text(region.time_share), variable, digits(region.from), digits(region.to),
                                  motion_unit(plant, region.variable)));
  }
  if (const UnknownSignal& unknown = examination.unknown; unknown.status == Status::ok)
    add("Signal that is missing",
        fmt::format("at {}: {} {} RMS, about {} {} of it noise", unknown.location, digits(unknown.rms), unknown.unit,
                    digits(unknown.noise_rms), unknown.unit));
  if (examination.beyond_known && examination.beyond.time_share > 0)
    add("Beyond the fitted motions", beyond_text(examination.beyond));
  return table;
}

ViewTable retuning_table(const Evidence& evidence) {
  ViewTable table{"retuning",
                  "Parameters after re-tuning, in tolerances off the plant as delivered.",
                  {"Parameter", "Off", "Standard deviation"},
                  {}};
  for (const ToleranceEvidence& own : evidence.tolerances)
    table.rows.push_back({own.parameter, fmt::format("{:.1f}", own.theta + 0.0), fmt::format("{:.1f}", own.std)});
  return table;
}

ViewTable checks_table(const FollowUp& follow_up) {
  ViewTable table{"checks", "Checks of the answer.", {"Check", "Outcome", "Detail"}, {}};
  for (const Check& check : follow_up.checks)
    table.rows.push_back({check.name, check.passed ? "passed" : "not passed", check.detail});
  return table;
}

ViewTable spikes_table(const std::vector<Spike>& spikes) {
  ViewTable table{"bridged",
                  fmt::format("Bad samples, bridged and not judged: {}{}.", spikes.size(),
                              spikes.size() > kSpikes ? ", of which these are the first; all are in the result file "
                                                        "(bridged_samples)"
                                                      : ""),
                  {"Channel", "File", "Time", "Value", "Taken instead"},
                  {}};
  for (std::size_t i = 0; i < std::min(kSpikes, spikes.size()); ++i)
    table.rows.push_back({spikes[i].channel, spikes[i].file, fmt::format("{:.6g} s", spikes[i].time_s),
                          fmt::format("{:.4g}", spikes[i].value), fmt::format("{:.4g}", spikes[i].instead)});
  return table;
}

/// Columns of a terminal that text takes: characters of UTF-8, not bytes.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](unsigned char c) { return (c & 0xC0U) != 0x80; }));
}

/// Texts to the left, numbers to the right.
void print(const ViewTable& table) {
  std::vector<std::size_t> width(table.columns.size());
  std::vector<bool> right(table.columns.size(), true);
  for (std::size_t c = 0; c < width.size(); ++c) {
    width[c] = width_of(table.columns[c]);
    for (const auto& row : table.rows) {
      width[c] = std::max(width[c], width_of(row[c]));
      right[c] =
          right[c] && c > 0 && !row[c].empty() && row[c].find_first_not_of("-+.0123456789e%s ") == std::string::npos;
    }
  }
  const auto line = [&](const std::vector<std::string>& cells) {
    std::string text;
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const std::string space(width[c] - width_of(cells[c]), ' ');
      text += "  " + (right[c] ? space + cells[c] : cells[c] + space);
    }
    fmt::print("{}\n", text.substr(0, text.find_last_not_of(' ') + 1));
  };
  fmt::print("\n{}\n", table.caption);
  if (std::any_of(table.columns.begin(), table.columns.end(), [](const std::string& head) { return !head.empty(); }))
    line(table.columns);
  for (const auto& row : table.rows) line(row);
}

}  // namespace

View view_of(const Plant& plant, const Diagnosis& diagnosis, const Examination* examination, const Placebo* placebo) {
  const Evidence& evidence = diagnosis.evidence;
  View view{heading_of(diagnosis), answer(evidence, diagnosis.verdict, diagnosis.follow_up), {}, {}};
  if (!evidence.held_out)
    view.notes.push_back(
        "No record has the role \"validation\": every figure is of the records that were fitted, too kind.");
  for (std::string& note : slow_notes(diagnosis.slow)) view.notes.push_back(std::move(note));
  if (placebo != nullptr) view.notes.push_back(note_of(*placebo));
  const auto add = [&](ViewTable table) {
    if (!table.rows.empty()) view.tables.push_back(std::move(table));
  };
  add(spikes_table(diagnosis.spikes));
  add(how_far_table(plant, diagnosis, examination));
  if (examination) add(ceiling_table(diagnosis, examination->ceiling));
  add(effects_table(diagnosis));
  add(places_table(evidence));
  add(place_pairs_table(evidence));
  if (examination) add(bands_table(*examination));
  if (examination) add(kind_table(plant, *examination));
  add(checks_table(diagnosis.follow_up));
  add(retuning_table(evidence));
  return view;
}

Json to_json(const View& view) {
  Json tables = Json::array();
  for (const ViewTable& table : view.tables)
    tables.push_back({{"id", table.id}, {"caption", table.caption}, {"columns", table.columns}, {"rows", table.rows}});
  return {{"heading", view.heading}, {"notes", view.notes}, {"tables", std::move(tables)}};
}

void print(const View& view) {
  fmt::print("{}\n", view.answer);
  for (const std::string& note : view.notes) fmt::print("{}\n", note);
  for (const ViewTable& table : view.tables) print(table);
}

}  // namespace wheelhop
