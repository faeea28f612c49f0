#include "experiments/diagnose/answer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace wheelhop {
namespace {

constexpr double kClear = 0.5;          // misfit - 1 of the answer, from which something else is missing
constexpr double kAsLittle = 1.5;       // leftover over that of the best pair of places, up to which one is told
constexpr double kNextToNothing = 0.1;  // misfit - 1 after re-tuning, of which shares say nothing

/// Whether the held-out records have a gap of which a share can go.
bool known(const Closure& closure) { return std::isfinite(closure.low); }

/// Whole per cent, with one decimal near all of it.
std::string percent(double share) {
  const std::string text = fmt::format("{:.{}f}", 100 * share, share > 0.99 ? 1 : 0);
  return text == "-0" ? "0" : text;
}

std::string percent(const Closure& closure) {
  return fmt::format("{} % [{}, {}]", percent(closure.value), percent(closure.low), percent(closure.high));
}

/// ", NAME (-1.6 tolerances) most", or nothing.
std::string most_retuned_in_words(const Evidence& evidence) {
  const ToleranceEvidence* most = most_retuned(evidence);
  return most ? fmt::format(", {} ({:+.1f} tolerances) most", most->parameter, most->theta) : "";
}

/// "A, B and C". @param last "and" or "or"
std::string listed(const std::vector<std::string>& items, const std::string& last) {
  std::string text;
  for (std::size_t i = 0; i < items.size(); ++i)
    text += (i == 0 ? "" : i + 1 == items.size() ? " " + last + " " : ", ") + items[i];
  return text;
}

/// " WHAT could also be NAME, NAME or NAME.", or nothing.
std::string could_also_be(const Verdict& verdict, const std::string& what) {
  return verdict.ambiguous_with.empty() ? ""
                                        : " " + what + " could also be " + listed(verdict.ambiguous_with, "or") + ".";
}

constexpr double kSeen = 0.5;  // upper end of the closure of an effect that the held-out records reach

}  // namespace

std::string answer(const Evidence& evidence, const Verdict& verdict, const FollowUp& follow_up) {
  const double times = std::sqrt(std::max(evidence.delivered.misfit - 1, 0.0));
  const std::string gap = fmt::format("The gap is {:.1f} x the noise.", times);
  const auto best = [&]() -> const Suspect& { return verdict.suspects.front(); };
  const Closure closure = closure_of(evidence, verdict);
  if (is<NoGap>(verdict))
    return times < 1 ? "No gap: what the plant leaves is noise, every parameter inside its tolerance."
                     : gap + " Parameters that differ inside their tolerances explain it" +
                           most_retuned_in_words(evidence) + "; nothing is missing.";
  if (is<Parameters>(verdict) && verdict.named.size() == 1 && is_parameter_error(best().effect))
    return fmt::format(
        "{} {} at {} explains it (P {:.2f}){}{}.{}", gap, best().effect, best().location, best().probability,
        known(closure) ? " and removes " + percent(closure) + " of it" : "; the validation records do not show it",
        verdict.message.empty() ? "" : ": " + verdict.message,
        std::get<Parameters>(verdict.answer).either ? "" : could_also_be(verdict, "It"));
  if (is_place(verdict)) {
    std::string text = gap + (is<Exogenous>(verdict) ? " No state of the plant explains it: a force from outside"
                                                     : " No effect of the catalogue explains it; it");
    if (verdict.named.size() == 2)
      text += fmt::format(" seems to enter at two places at once, {} (P {:.2f}) and {} (P {:.2f})",
                          verdict.locations[0].location, verdict.locations[0].probability,
                          verdict.locations[1].location, verdict.locations[1].probability);
    else if (!verdict.locations.empty())
      text += fmt::format(" seems to enter at {} (P {:.2f})", verdict.locations.front().location,
                          verdict.locations.front().probability);
    if (!verdict.message.empty()) return text + "; " + verdict.message + ".";
    if (!verdict.suspects.empty() && known(best().closure))
      text += fmt::format(". The best suspect, {} at {}, removes {} of what re-tuning leaves", best().effect,
                          best().location, percent(best().closure));
    return text + ".";
  }
  if (is<Insufficient>(verdict)) return "Not enough to tell: " + verdict.message + ".";
  if (is<Rounding>(verdict))
    return fmt::format("{} {} (P {:.2f}) makes what the plant leaves; no model of the plant removes it.", gap,
                       verdict.named.front(), best().probability);
  std::vector<std::string> names;
  for (const std::string& name : verdict.named) {
    const auto own = std::find_if(verdict.suspects.begin(), verdict.suspects.end(),
                                  [&](const Suspect& suspect) { return suspect.name() == name; });
    names.push_back(
        fmt::format("{} (P {:.2f})", name, own != verdict.suspects.end() ? own->probability : best().probability));
  }
  std::string shares;  // the closure's parts
  for (Index i = 0; i < follow_up.shares.size(); ++i)
    shares += fmt::format("{} {:.0f} % by {}", i == 0 ? ":" : ",", 100 * follow_up.shares(i),
                          verdict.named[static_cast<std::size_t>(i) + evidence.correction.faults.size()]);
  // An answer that closes little was found in the fitted records: those held out hold little of its effect.
  const std::string ending = verdict.named.size() > 1 ? " " : "s ";
  const ToleranceEvidence* bent = most_retuned(evidence);
  const double left_of_delivered =
      (corrected_stage(evidence, verdict).misfit - 1) / std::max(evidence.delivered.misfit - 1, kNextToNothing);
  const std::string effect =
      evidence.correction.faults.empty() && evidence.retuned.misfit - 1 < kNextToNothing && bent != nullptr
          ? fmt::format("remove{}{} % of it, for which re-tuning alone puts {} {:+.1f} tolerances off", ending,
                        percent(1 - std::max(left_of_delivered, 0.0)), bent->parameter, bent->theta)
      : !known(closure) || closure.high < kSeen
          ? "explain" + ending +
                "it where the drive reaches it; the validation records hardly do, so that they do not show how far"
          : "remove" + ending + percent(closure) + " of what re-tuning leaves" + shares;
  std::vector<std::string> places = {verdict.locations.front().location};
  double sure = verdict.locations.front().probability;
  for (std::size_t i = 1; i < verdict.locations.size(); ++i) {  // those of further effects that are named
    const LocationProbability& other = verdict.locations[i];
    const auto there = [&](const std::string& name) { return name.ends_with("@" + other.location); };
    if (std::none_of(verdict.named.begin(), verdict.named.end(), there)) continue;
    places.push_back(other.location);
    sure = std::min(sure, other.probability);
  }
  std::string text = fmt::format("{} It sits in {} (P {:.2f}); {} {}.", gap, listed(places, "and"), sure,
                                 listed(names, "and"), effect);
  if (const double left = corrected_stage(evidence, verdict).misfit - 1;
      left > kClear && !follow_up.places_left.empty())
    text += fmt::format(" {:.1f} x the noise is left, most likely from {}.", std::sqrt(left),
                        follow_up.places_left.front().location);
  if (is<Instruments>(verdict) && !verdict.message.empty()) text += " " + verdict.message + ".";
  // The instruments are corrected, and what is in doubt is what else is missing.
  const std::size_t effects = verdict.named.size() - evidence.correction.faults.size();
  text += could_also_be(verdict, effects == 2 ? "One of the two" : verdict.named.back());
  if (!follow_up.separating.test.empty())
    text += fmt::format(" A record {} would tell the two apart.", follow_up.separating.test);
  return text;
}

namespace {

/// Where no single place explains all channels: the pairs of places that leave about as little as the best of them.
void print_place_pairs(const Diagnosis& diagnosis) {
  if (diagnosis.evidence.place_pairs.empty()) return;
  fmt::print("no single place explains all channels{} (1: all is explained)\n",
             diagnosis.evidence.places_needed == 2   ? "; two at once do"
             : diagnosis.evidence.places_needed == 1 ? ", unless a force there jumps; two at once"
                                                     : ", nor do two");
  for (const PairLeftover& pair : diagnosis.evidence.place_pairs) {
    if (pair.leftover > kAsLittle * diagnosis.evidence.place_pairs.front().leftover) break;
    fmt::print("  {:<38} {:10.3f}\n", pair.locations[0] + " and " + pair.locations[1], pair.leftover);
  }
}

/// Bad samples with their times; of many the first ones.
void print_bridged(const std::vector<Spike>& spikes) {
  constexpr std::size_t told = 5;
  if (spikes.empty()) return;
  fmt::print("bad samples, bridged and not judged: {}\n", spikes.size());
  for (std::size_t i = 0; i < std::min(told, spikes.size()); ++i)
    fmt::print("  {} of {} at {:.6g} s: {:.4g} for {:.4g}\n", spikes[i].channel, spikes[i].file, spikes[i].time_s,
               spikes[i].value, spikes[i].instead);
  if (spikes.size() > told) fmt::print("  and {} more in the result file (bridged_samples)\n", spikes.size() - told);
}

/// The confusion row of the answer.
void print_placebo(const Placebo& placebo) {
  if (!placebo.why_not.empty()) {
    fmt::print("placebo: none, {}\n", placebo.why_not);
    return;
  }
  fmt::print("placebo: {} of {} diagnoses of simulated records, in which this answer is true, give it again; named:",
             placebo.same, placebo.runs);
  for (const auto& [name, count] : placebo.names) fmt::print(" {} {}", name, count);
  fmt::print("\n");
}

}  // namespace

void print(const Diagnosis& diagnosis, const Placebo* placebo) {
  fmt::print("{}\n", answer(diagnosis.evidence, diagnosis.verdict, diagnosis.follow_up));
  if (placebo != nullptr) print_placebo(*placebo);
  print_bridged(diagnosis.spikes);
  if (!diagnosis.evidence.held_out)
    fmt::print("No record has the role \"validation\": every figure is of the records that were fitted, too kind.\n");
  const std::string from =
      diagnosis.evidence.judged_from_s > 0 ? fmt::format(" from {:g} s on", diagnosis.evidence.judged_from_s) : "";
  fmt::print("\nmean squared error over the noise's, 1 is the floor ({}; {}{})\n", to_string(diagnosis.floor.source),
             diagnosis.evidence.held_out ? "held-out records" : "fitted records", from);
  fmt::print("  as delivered {:10.3f}\n  re-tuned     {:10.3f}   inside the tolerances{}\n",
             diagnosis.evidence.delivered.misfit, retuned_of(diagnosis.evidence).misfit,
             diagnosis.evidence.delivered.misfit - 1 > kNextToNothing
                 ? fmt::format("; removes {:.0f} %",
                               std::round(100 * closure_of_retuning(diagnosis.evidence)) + 0.0)  // no "-0"
                 : "");
  for (const Suspect& suspect : diagnosis.verdict.suspects) {
    fmt::print("  with {:<38} {:10.3f}   P {:.2f}", suspect.effect + " at " + suspect.location, suspect.misfit,
               suspect.probability);
    if (const double share = share_of(diagnosis, suspect); !std::isnan(share))
      fmt::print("  share {:.0f} %", 100 * share);
    for (const FittedParameter& parameter : suspect.parameters) {
      fmt::print("  {} = {:.4g}", parameter.name.substr(parameter.name.rfind('.') + 1), parameter.value);
      if (parameter.std > 0) fmt::print(" +- {:.2g}", parameter.std);  // of the answer alone
    }
    fmt::print("\n");
  }
  fmt::print("\nwhat one unknown signal would leave, by the place where it enters (1: it explains all)\n");
  for (const PlaceLeftover& place : diagnosis.evidence.places) {
    fmt::print("  {:<38} {:10.3f}", place.location, place.leftover);
    for (const std::string& same : place.same) fmt::print("{}{}", &same == &place.same.front() ? "   or " : ", ", same);
    fmt::print("\n");
  }
  print_place_pairs(diagnosis);
  fmt::print("\nparameters after re-tuning, in tolerances off\n");
  for (const ToleranceEvidence& own : diagnosis.evidence.tolerances)
    fmt::print("  {:<55} {:6.1f} +- {:.1f}\n", own.parameter, own.theta, own.std);
}

void print_ceiling(const Diagnosis& diagnosis, const Ceiling& ceiling) {
  if (ceiling.location.empty()) return;
  const double whole = diagnosis.evidence.delivered.misfit - 1, left = retuned_of(diagnosis.evidence).misfit - 1;
  fmt::print("\nhow far the gap shrinks, in per cent{:>43}{:>28}\n", "of it as delivered",
             left > kNextToNothing ? "of what re-tuning leaves" : "");
  const bool outside = is_place(diagnosis.verdict);
  const auto line = [&](const std::string& what, double remains) {
    fmt::print("  {:<58}{:20.1f}", what, 100 * (1 - remains / whole));
    fmt::print("{:>28}\n", left > kNextToNothing ? fmt::format("{:.1f}", 100 * (1 - remains / left)) : "");
  };
  line("re-tuning inside the tolerances alone", left);
  const GapStage corrected = corrected_stage(diagnosis.evidence, diagnosis.verdict);
  if (corrected.blocks.size() > 0 && !outside) line("with the answer", corrected.misfit - 1);
  if (!ceiling.why_not.empty()) {
    fmt::print("  no ceiling of a static map: {}\n", ceiling.why_not);
    return;
  }
  line(fmt::format("with a static map of travel and rate at {}, at best", ceiling.location),
       left * (1 - ceiling.static_map));
  line(fmt::format("with any signal at {}", ceiling.location), left * (1 - ceiling.signal));
}

namespace {

void print_kind(const StageExamination& stage) {
  if (stage.repeats.known)
    fmt::print("  {:.0f} % of a record's squared error comes again with the drive\n", 100 * stage.repeats.share);
  if (stage.drift.significant)
    fmt::print("  it drifts from the first third of the record to the last: {}{}{} from {:.3g} to {:.3g}\n",
               stage.drift.kind, stage.drift.channel.empty() ? "" : " of ", stage.drift.channel, stage.drift.first,
               stage.drift.last);
  if (stage.lines.known)
    fmt::print("  by the lines of the drive: {:.0f} % linear{}, {:.0f} % odd, {:.0f} % even\n",
               100 * stage.lines.linear, stage.lines.odd_apart ? "" : " or odd", 100 * stage.lines.odd,
               100 * stage.lines.even);
}

}  // namespace

void print_examination(const Examination& examination) {
  const int telling = telling_stage(examination);
  if (telling < 0) return;
  double whole = 0;  // as delivered, in the bands in which there is any
  for (const BandShare& band : examination.stages[0].profile.bands) whole += std::max(band.excess, 0.0);
  if (whole > 0) {
    fmt::print("\nwhere the gap lies, in per cent of the gap as delivered\n{:>33}{:>12}{:>15}\n", "as delivered",
               "re-tuned", "with answer");
    for (std::size_t b = 0; b < examination.stages[0].profile.bands.size(); ++b) {
      const BandShare& band = examination.stages[0].profile.bands[b];
      fmt::print("  {:>6.3g} to {:<6.3g} Hz", band.from_hz, band.to_hz);
      for (const StageExamination& stage : examination.stages)
        fmt::print("{:12.1f}", stage.ran ? 100 * std::max(stage.profile.bands[b].excess, 0.0) / whole : NAN);
      fmt::print("\n");
    }
  }
  const StageExamination& stage = examination.stages[static_cast<std::size_t>(telling)];
  fmt::print("\nwhat kind of gap ({})\n", telling == 0 ? "as delivered" : "re-tuned");
  for (const RegionShare& region : standing_out(stage.profile))
    fmt::print("  {:.0f} % of it in {:.0f} % of the time: {} from {:.3g} to {:.3g}\n", 100 * region.share,
               100 * region.time_share, region.variable, region.from, region.to);
  print_kind(stage);
  if (const UnknownSignal& unknown = examination.unknown; unknown.status == Status::ok)
    fmt::print("  the unknown signal at {}: {:.3g} {} RMS, about {:.2g} {} of it noise\n", unknown.location,
               unknown.rms, unknown.unit, unknown.noise_rms, unknown.unit);
  const BeyondEnvelope& beyond = examination.beyond;
  if (!examination.beyond_known || beyond.time_share == 0) return;
  fmt::print("  beyond the travels and rates of the fitted records ({:.1f} % of the time) ", 100 * beyond.time_share);
  if (std::isnan(beyond.outside.value))
    fmt::print("nothing is above the noise{}\n",
               beyond.flagged ? " but what the answer adds: do not trust it there" : "");
  else
    fmt::print("the answer removes {:.0f} %{}\n", 100 * beyond.outside.value,
               beyond.flagged ? ": do not trust it there" : "");
}

}  // namespace wheelhop
