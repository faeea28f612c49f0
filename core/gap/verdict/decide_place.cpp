#include <algorithm>
#include <cmath>

#include "core/gap/verdict/decide.hpp"
#include "core/gap/verdict/posterior.hpp"

namespace wheelhop {
namespace {

/// Probabilities of places, or of pairs of them, by what unknown signals there leave, as rivals over blocks of time.
template <typename PlaceOrPair>
Vector by_leftover(const std::vector<PlaceOrPair>& list, Index blocks, double limit) {
  Vector left(static_cast<Index>(list.size()));
  for (std::size_t i = 0; i < list.size(); ++i) left(static_cast<Index>(i)) = std::max(list[i].leftover, kNothingLeft);
  return probabilities_by_leftover(left, blocks, limit);
}

/// Two unknown signals, where one does not explain all channels.
Verdict two_places(const Evidence& evidence, const Thresholds& thresholds, Verdict verdict) {
  const Vector p = by_leftover(evidence.place_pairs, evidence.retuned.blocks.size(), thresholds.limit);
  std::vector<std::pair<Place, double>> speaking;
  for (std::size_t i = 0; i < evidence.place_pairs.size(); ++i)
    for (const Place& location : evidence.place_pairs[i].locations)
      speaking.emplace_back(without_guide(location), p(static_cast<Index>(i)));
  verdict.locations = locations_of(speaking, thresholds.limit);
  verdict.named.clear();
  for (const Place& location : evidence.place_pairs.front().locations) {
    const auto own = std::find_if(verdict.locations.begin(), verdict.locations.end(),
                                  [&](const auto& other) { return other.location == without_guide(location); });
    const auto place = verdict.locations.begin() + static_cast<std::ptrdiff_t>(verdict.named.size());
    std::rotate(place, own, own + 1);
    verdict.named.push_back({"unknown", without_guide(location)});
  }
  verdict.answer = AtTwoPlaces{};
  verdict.row = "4b";
  verdict.why = "two unknown signals explain all channels, one does not";
  return verdict;
}

/// The entry whose motion explains most of the unknown signal, clearly more than the place's own motion.
Place entry_of_motion(const Evidence& evidence, const Thresholds& thresholds, const Place& place, const Place& guide) {
  const auto own_share = [&] {
    for (const MotionShare& motion : evidence.motion)
      if (motion.at == place && motion.entry == place) return motion.share;
    return kUnknown;
  }();
  Place location = place;
  double most = own_share;
  const auto weigh = [&](const MotionShare& motion) {
    const double share = motion.share;
    // A small share does not outweigh that an unknown signal there leaves far more.
    if (share < thresholds.read && leftover_ratio(evidence.places, motion.entry) > thresholds.elsewhere) return;
    if (!(share > most) ||
        !(share > own_share + thresholds.clearly || 1 - share < thresholds.remainder * (1 - own_share)))
      return;
    location = motion.entry;
    most = share;
  };
  for (const MotionShare& motion : evidence.motion)
    if (!motion.entry.empty() && !motion.attached) weigh(motion);
  // What the travel of an element hardly explains is not its law; something on the mass moves by itself there, unless
  // the mass's motion explains clearly less: a law that changes with time goes with the travel in part.
  const auto is_element = [&](const Place& where) {
    return where.kind == PlaceKind::part &&
           std::find(evidence.elements.begin(), evidence.elements.end(), where.name) != evidence.elements.end();
  };
  const auto of_guide = std::find_if(evidence.motion.begin(), evidence.motion.end(), [&](const MotionShare& motion) {
    return motion.at == place && motion.entry == guide;
  });
  const double on_mass = of_guide != evidence.motion.end() ? of_guide->share : most;
  if (!guide.empty() && is_element(location) && most < thresholds.read && !(most > on_mass + thresholds.clearly))
    location = guide;
  for (const MotionShare& motion : evidence.motion)
    if (motion.attached) weigh(motion);
  return location;
}

}  // namespace

Verdict decide_place(const Evidence& evidence, const Thresholds& thresholds, Verdict verdict) {
  verdict.answer = AtPlace{};
  verdict.row = "4d";
  verdict.why = "an unknown signal at the place explains most";
  verdict.ambiguous_with.clear();
  // What fits by chance says nothing of the place; the leftovers do.
  verdict.locations.clear();
  verdict.named.clear();
  const Vector p = by_leftover(evidence.places, evidence.retuned.blocks.size(), thresholds.limit);
  for (Index i = 0; i < p.size(); ++i)
    verdict.locations.push_back({evidence.places[static_cast<std::size_t>(i)].location, p(i)});
  if (verdict.locations.empty()) {
    verdict.answer = Insufficient{};
    verdict.row = "4a";
    verdict.why = "a gap without a name or a place";
    verdict.message = "a gap is left that no effect explains, and one channel does not tell where it enters";
    return verdict;
  }
  if (evidence.places_needed == 2) return two_places(evidence, thresholds, std::move(verdict));
  const PlaceLeftover& best = evidence.places.front();
  Place guide;
  for (const Place& entry : entries_of(best))
    if (guide.empty() && entry.kind == PlaceKind::guide) guide = entry;
  const bool nothing_moves_it = std::any_of(evidence.motion.begin(), evidence.motion.end(), [&](const auto& motion) {
    return motion.at == best.location && motion.entry.empty() && motion.share == 0;
  });
  Place& location = verdict.locations.front().location;
  if (!guide.empty() && nothing_moves_it) {
    location = guide;  // a force from outside acts on a mass
    verdict.answer = Exogenous{};
    verdict.row = "4c";
    verdict.why = "a force on a mass that nothing that moves explains";
    for (const Place& entry : entries_of(best))
      if (entry.kind == PlaceKind::actuator) verdict.message = "noise of a measured drive would look the same";
  } else if (location.kind != PlaceKind::sensor) {
    location = entry_of_motion(evidence, thresholds, best.location, guide);
  }
  location = without_guide(location);
  const auto again = [&](const LocationProbability& other) { return other.location == location; };
  const auto others = verdict.locations.begin() + 1;
  verdict.locations.erase(std::remove_if(others, verdict.locations.end(), again), verdict.locations.end());
  verdict.named = {{is<Exogenous>(verdict) ? "exogenous_force" : "unknown", location}};
  if (evidence.places_needed == 1) return verdict;
  for (LocationProbability& place : verdict.locations)
    place.probability = std::min(place.probability, thresholds.doubt);
  verdict.message = evidence.place_pairs.empty()
                        ? "one unknown signal does not explain all channels, so the place is in doubt"
                        : "neither one unknown signal nor two explain all channels, so the place is in doubt";
  return verdict;
}

}  // namespace wheelhop
