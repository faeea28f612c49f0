#include "experiments/diagnose/answer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace wheelhop {
namespace {

constexpr double kClear = 0.5;          // misfit - 1 of the answer, from which something else is missing
constexpr double kNextToNothing = 0.1;  // misfit - 1 after re-tuning, of which shares say nothing

/// Whether the held-out records have a gap of which a share can go.
bool known(const Closure& closure) { return std::isfinite(closure.low); }

/// Whole per cent, with one decimal near all of it.
std::string percent(double share) {
  const std::string text = fmt::format("{:.{}f}", 100 * share, share > 0.99 ? 1 : 0);
  return text == "-0" ? "0" : text;
}

std::string percent(const Closure& closure) {
  // Where the gap lies in few stretches of a record, some draws of the bootstrap hold nearly none of it.
  const std::string low = closure.low < 0 ? "below 0" : percent(closure.low);
  return fmt::format("{} % [{}, {}]", percent(closure.value), low, percent(closure.high));
}

/// ", NAME (-1.6 tolerances) most", or nothing.
std::string most_retuned_in_words(const Evidence& evidence) {
  const ToleranceEvidence* most = most_retuned(evidence);
  return most ? fmt::format(", {} ({:+.1f} tolerances) most", most->parameter, most->theta) : "";
}

/// " WHAT could also be NAME, NAME or NAME.", or nothing.
std::string could_also_be(const Verdict& verdict, const std::string& what) {
  std::vector<std::string> texts;
  for (const EffectAt& name : verdict.ambiguous_with) texts.push_back(to_string(name));
  return verdict.ambiguous_with.empty() ? "" : " " + what + " could also be " + listed(texts, "or") + ".";
}

// A judgement: power of noise over what its quiet end tells, up to which that is said. Of first-order noise n_k = 0.98
// n_{k-1} + e_k it is 1.98^2 / (1 - 0.98^2).
constexpr double kColoured = 99;

/// That the gap may be noise, where nothing is named and the noise is known from the quiet end of the spectrum alone.
std::string may_be_noise(const Evidence& evidence) {
  if (evidence.noise.source != to_string(FloorSource::estimated) || !(evidence.retuned.misfit < kColoured)) return "";
  return " The noise is told by the quiet end of the spectrum alone: noise that is stronger at lower frequencies would "
         "look the same. Records that repeat the drive tell.";
}

constexpr double kSeen = 0.5;  // upper end of the closure of an effect that the held-out records reach

}  // namespace

std::string listed(const std::vector<std::string>& items, const std::string& last) {
  std::string text;
  for (std::size_t i = 0; i < items.size(); ++i)
    text += (i == 0 ? "" : i + 1 == items.size() ? " " + last + " " : ", ") + items[i];
  return text;
}

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
    if (!verdict.message.empty()) return text + "; " + verdict.message + "." + may_be_noise(evidence);
    if (!verdict.suspects.empty() && known(best().closure))
      text += fmt::format(". The best suspect, {} at {}, removes {} of what re-tuning leaves", best().effect,
                          best().location, percent(best().closure));
    return text + "." + may_be_noise(evidence);
  }
  if (is<Insufficient>(verdict)) return "Not enough to tell: " + verdict.message + "." + may_be_noise(evidence);
  if (is<Rounding>(verdict))
    return fmt::format("{} {} (P {:.2f}) makes what the plant leaves; no model of the plant removes it.", gap,
                       verdict.named.front(), best().probability);
  std::vector<std::string> names;
  for (const EffectAt& name : verdict.named) {
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
  std::vector<std::string> places = {to_string(verdict.locations.front().location)};
  double sure = verdict.locations.front().probability;
  for (std::size_t i = 1; i < verdict.locations.size(); ++i) {  // those of further effects that are named
    const LocationProbability& other = verdict.locations[i];
    const auto there = [&](const EffectAt& name) { return name.place == other.location; };
    if (std::none_of(verdict.named.begin(), verdict.named.end(), there)) continue;
    places.push_back(to_string(other.location));
    sure = std::min(sure, other.probability);
  }
  std::string text = fmt::format("{} It sits in {} (P {:.2f}); {} {}.", gap, listed(places, "and"), sure,
                                 listed(names, "and"), effect);
  if (const double left = corrected_stage(evidence, verdict).misfit - 1; left > kClear) {
    const std::string from = follow_up.places_left.empty()
                                 ? ""  // one channel does not tell
                                 : fmt::format(", most likely from {}", follow_up.places_left.front().location);
    text += fmt::format(" {:.1f} x the noise is left{}.", std::sqrt(left), from);
  }
  if (is<Instruments>(verdict) && !verdict.message.empty()) text += " " + verdict.message + ".";
  // The instruments are corrected, and what is in doubt is what else is missing.
  const std::size_t effects = verdict.named.size() - evidence.correction.faults.size();
  text += could_also_be(verdict, effects == 2 ? "One of the two" : to_string(verdict.named.back()));
  if (!follow_up.separating.test.empty())
    text += fmt::format(" A record {} would tell the two apart.", follow_up.separating.test);
  return text;
}

}  // namespace wheelhop
