#include "core/gap/judge.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "core/gap/unknown.hpp"

namespace wheelhop {
namespace {

constexpr double kClearly = 0.05;    // of the share that states explain, by which those of another place explain more,
constexpr double kRemainder = 0.25;  // or of what a place leaves unexplained, below which another one leaves less
constexpr double kRead = 0.3;        // of that share, what a law of an element makes of its own travel at least
constexpr double kNearly = 1.5;    // leftover over that of the best place, up to which the motion decides between them
constexpr double kDoubt = 0.5;     // most probability of a place that does not explain all
constexpr double kRounded = 0.15;  // share of the floor that rounding makes, from which the converter is named
constexpr double kRoundingSeen = 0.95;  // probability of a lattice that was seen in the readings

/// Probabilities of places, or of pairs of them, by what unknown signals there leave, as rivals over blocks of time.
template <typename PlaceOrPair>
Vector by_leftover(const std::vector<PlaceOrPair>& list, Index blocks) {
  Vector leftovers(static_cast<Index>(list.size()));
  for (std::size_t i = 0; i < list.size(); ++i) leftovers(static_cast<Index>(i)) = std::max(list[i].leftover, 1e-3);
  return rival_probabilities(leftovers, blocks, kLimit);
}

void locate_by_leftover(Diagnosis& diagnosis) {
  diagnosis.locations.clear();
  const Vector p = by_leftover(diagnosis.places, diagnosis.retuned.blocks.size());
  for (Index i = 0; i < p.size(); ++i)
    diagnosis.locations.push_back({diagnosis.places[static_cast<std::size_t>(i)].location, p(i)});
}

/// A force between the ground and a mass is one on the mass.
std::string own_name(const std::string& location) {
  return location.starts_with(kGuide) ? location.substr(std::strlen(kGuide)) : location;
}

/// Two unknown signals, where one does not explain all channels.
void name_two_places(Diagnosis& diagnosis) {
  const Vector p = by_leftover(diagnosis.place_pairs, diagnosis.retuned.blocks.size());
  std::map<std::string, double> sums;
  for (std::size_t i = 0; i < diagnosis.place_pairs.size(); ++i)
    for (const std::string& location : diagnosis.place_pairs[i].locations)
      sums[own_name(location)] += p(static_cast<Index>(i));
  diagnosis.locations = ranked(sums);
  diagnosis.named.clear();
  for (const std::string& location : diagnosis.place_pairs.front().locations) {
    const auto own = std::find_if(diagnosis.locations.begin(), diagnosis.locations.end(),
                                  [&](const auto& other) { return other.location == own_name(location); });
    const auto place = diagnosis.locations.begin() + static_cast<std::ptrdiff_t>(diagnosis.named.size());
    std::rotate(place, own, own + 1);
    diagnosis.named.push_back("unknown@" + own_name(location));
  }
}

/// The names of all that enters as a signal at a place does.
std::vector<std::string> entries_of(const Place& place) {
  std::vector<std::string> entries = place.same;
  entries.insert(entries.begin(), place.location);
  return entries;
}

}  // namespace

void name_unknown(const GapCase& c, Diagnosis& diagnosis) {
  diagnosis.outcome = GapOutcome::located_not_in_catalogue;
  diagnosis.ambiguous_with.clear();
  // What fits a part of the gap without being its cause is no correction: it may do harm under another drive.
  correct_nothing(c, diagnosis);
  // What fits by chance says nothing of the place; the leftovers do.
  locate_by_leftover(diagnosis);
  if (diagnosis.locations.empty()) {
    diagnosis.outcome = GapOutcome::insufficient;
    diagnosis.message = "a gap is left that no effect explains, and one channel does not tell where it enters";
    diagnosis.named.clear();
    return;
  }
  if (diagnosis.places_needed == 2) {
    name_two_places(diagnosis);
    return;
  }
  std::string& location = diagnosis.locations.front().location;
  const PlantFit& fit = c.retuned.fit;
  const std::vector<std::string> alike = entries_of(diagnosis.places.front());
  const auto guide =
      std::find_if(alike.begin(), alike.end(), [](const std::string& entry) { return entry.starts_with(kGuide); });
  const auto explained = [&](const std::string& at, const std::string& entry) {
    return explained_by_states(fit, c.study.data.fitted, at, entry);
  };
  if (guide != alike.end() && explained(location, "") == 0) {
    location = *guide;  // a force from outside acts on a mass
    diagnosis.outcome = GapOutcome::exogenous;
  } else if (!location.starts_with("sensor:")) {
    // The records hardly tell these places apart, but a law at one of them reads what moves there; what one end of an
    // element alone feels reads that element's motion and acts on a mass.
    const double own = explained(location, location);
    double most = own;
    const auto weigh = [&](const std::string& at, const std::string& entry) {
      const double share = explained(at, entry);
      if (!(share > most) || !(share > own + kClearly || 1 - share < kRemainder * (1 - own))) return;
      diagnosis.locations.front().location = entry;
      most = share;
    };
    const std::string first = location;
    for (const Place& place : diagnosis.places)
      if (place.leftover <= kNearly * diagnosis.places.front().leftover)
        for (const std::string& entry : entries_of(place)) weigh(place.location, entry);
    // What the travel of an element hardly explains is not its law; something on the mass moves by itself there.
    const auto is_element = [&](const std::string& name) {
      const auto& elements = fit.plant.elements;
      return std::any_of(elements.begin(), elements.end(), [&](const Element& e) { return e.name == name; });
    };
    if (guide != alike.end() && is_element(location) && most < kRead) location = *guide;
    if (first.starts_with(kGuide))
      for (const Element& element : fit.plant.elements)
        if (kGuide + element.from == first || kGuide + element.to == first) weigh(first, element.name);
  }
  location = own_name(location);
  const auto again = [&](const LocationProbability& other) { return other.location == location; };
  const auto others = diagnosis.locations.begin() + 1;
  diagnosis.locations.erase(std::remove_if(others, diagnosis.locations.end(), again), diagnosis.locations.end());
  diagnosis.named = {(diagnosis.outcome == GapOutcome::exogenous ? "exogenous_force@" : "unknown@") + location};
  if (diagnosis.places_needed == 1) return;
  for (LocationProbability& place : diagnosis.locations) place.probability = std::min(place.probability, kDoubt);
  diagnosis.message = diagnosis.place_pairs.empty()
                          ? "one unknown signal does not explain all channels, so the place is in doubt"
                          : "neither one unknown signal nor two explain all channels, so the place is in doubt";
}

bool name_rounding(const GapCase& c, Diagnosis& diagnosis) {
  const FitRecord& record = c.study.data.fitted.front();
  Operation operation;
  if (!operation_of(c.retuned.fit.plant, c.study.data.fitted, c.retuned.fit.initial_states, operation)) return false;
  const std::vector<EffectCandidate> candidates = c.study.candidates(c.retuned.fit.plant, operation);
  for (Index j = 0; j < record.quantum.size(); ++j) {
    const double rounding = record.quantum(j) / std::sqrt(12.0);
    if (!(rounding * rounding > kRounded * diagnosis.floor.std(j) * diagnosis.floor.std(j))) continue;
    const std::string location = "sensor:" + c.study.nominal.sensors[static_cast<std::size_t>(j)].name;
    const auto offered = [&](const EffectCandidate& candidate) {
      return candidate.effect == "quantisation" && candidate.location == location;
    };
    if (std::none_of(candidates.begin(), candidates.end(), offered)) continue;
    diagnosis.outcome = GapOutcome::effect;
    correct_nothing(c, diagnosis);  // no model of the plant takes it away
    diagnosis.ambiguous_with.clear();
    diagnosis.named = {"quantisation@" + location};
    diagnosis.locations = {{location, kRoundingSeen}};
    diagnosis.suspects = {{"quantisation",
                           location,
                           "rounding",
                           kRoundingSeen,
                           c.retuned.stage.misfit,
                           {},
                           {{location + ".quantum", record.quantum(j), 0}}}};
    return true;
  }
  return false;
}

}  // namespace wheelhop
