#include "core/gap/judge.hpp"

#include <algorithm>

namespace wheelhop {
namespace {

constexpr double kExplains = 0.6;      // closure below which no family of the catalogue fits, and
constexpr double kSurelyNot = 0.8;     // one that lies below this with all of its interval, or
constexpr double kNotInPath = 0.9;     // below this, where the forms are few: a bias is a bias on every rig
constexpr double kExplainsWell = 0.9;  // closure from which only a far better place speaks against it
constexpr double kFarElsewhere = 4;    // leftover over that of the best place, where the effect explains the gap well
constexpr double kHeldSlope = 1.2;     // what a share that stays unexplained takes from kHeld

/// A sensor, an actuator or the clock: no force of the plant.
bool is_path(const std::string& location) {
  return location.starts_with("sensor:") || location == "actuator" || location.starts_with("actuator:") ||
         location == "timebase";
}

}  // namespace

void doubt_answer(const GapCase& c, const Hypothesis& answer, const std::vector<Rival>& rivals, Diagnosis& diagnosis) {
  const double remains = answer.chi2 - c.floor_chi2();
  const double explained = (c.retuned.chi2 - answer.chi2) / std::max(c.retuned.chi2 - c.floor_chi2(), 1.0);
  const double held = kHeld - kHeldSlope * std::max(kHeld - explained, 0.0);
  for (Suspect& suspect : diagnosis.suspects) suspect.probability *= std::max(held, 0.0);
  const EffectCandidate& last = answer.effects.back();
  const bool alone = diagnosis.outcome != GapOutcome::several;
  // What explains the gap, or a part of it, from a place at which no signal would explain the rest is a mask.
  const bool misplaced =
      alone && remains > kNotice * diagnosis.floor.colour &&
      leftover_ratio(diagnosis.places, last.location) > (explained < kExplainsWell ? kElsewhere : kFarElsewhere);
  const std::string odd = alone ? undefined_size(last, answer.fit.plant) : "";
  // Held-out records that never reach the effect have no gap that could be closed.
  const bool reached = c.retuned.stage.misfit > 1 + kTooSmall;
  const double too_little = is_path(last.location) ? kNotInPath : kSurelyNot;
  const bool unexplained =
      explained < kExplains || (reached && explained < kExplainsWell && diagnosis.closure.high < too_little);
  if (!unexplained && !misplaced && odd.empty()) return;
  const std::vector<LocationProbability> by_rivals = diagnosis.locations;
  // Noise rounds differently each time: a converter that is simulated without it explains a part of its error alone.
  const bool rounding = rivals.front().effect == "quantisation" && name_rounding(c, diagnosis);
  if (!rounding) name_unknown(c, diagnosis);
  if (misplaced)
    for (Suspect& suspect : diagnosis.suspects) suspect.probability *= 1 - kHeld;
  if (odd.empty()) return;
  diagnosis.message = "it acts as " + last.effect + " would with " + odd;
  diagnosis.suspects.front().probability *= 1 - kHeld;
  if (explained > kExplainsWell) {  // a law there does it, whatever its name
    diagnosis.outcome = GapOutcome::located_not_in_catalogue;
    diagnosis.locations = by_rivals;
    diagnosis.named = {"unknown@" + last.location};
  }
}

}  // namespace wheelhop
