#include "core/gap/verdict/faults.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace wheelhop {

std::string fault_message(const std::vector<InstrumentFault>& faults) {
  std::string list;
  bool units = false;
  for (const InstrumentFault& fault : faults) {
    if (!list.empty()) list += ", ";
    const Place& place = fault.location;
    units = units || fault.effect == "gain_error";
    if (fault.effect == "clock_skew")
      list += fmt::format("the records run {:+.0f} ppm against the drive", 1e6 * fault.value);
    else if (fault.effect == "bias")
      list += fmt::format("{} lies {:.3g} from where the plant rests", place.name, fault.value);
    else if (place.kind == PlaceKind::sensor)
      list += fmt::format("{} reads {:.3g} times what the plant makes of the drive", place.name, fault.value);
    else if (!place.name.empty())
      list += fmt::format("{} acts {:.3g} times as the plant has it", place.name, fault.value);
    else
      list += fmt::format("every channel reads {:.3g} times what the plant makes of the drive", fault.value);
  }
  return units ? list + ": check unit and sign, and whether the plant holds all that acts there" : list;
}

bool faults_explain(double chi2_without, double chi2_with, double samples, double colour, bool turned,
                    const Thresholds& thresholds) {
  const double share = turned ? thresholds.turned : thresholds.second;
  return chi2_without - chi2_with > std::max(share * (chi2_without - samples), thresholds.notice * colour);
}

Verdict with_correction(const Evidence& evidence, const Thresholds& thresholds, Verdict verdict) {
  const CorrectionEvidence& correction = evidence.correction;
  if (correction.faults.empty()) return verdict;
  const bool named = is<Effects>(verdict) || is<Parameters>(verdict) || is<Rounding>(verdict);
  std::vector<Suspect> faults;
  std::vector<LocationProbability> locations;
  std::vector<EffectAt> names;
  for (const EffectEvidence& fault : correction.faults) {
    faults.push_back({fault.effect, fault.location, fault.form, thresholds.surest, evidence.retuned.misfit,
                      correction.closure, fault.parameters});
    if (std::none_of(locations.begin(), locations.end(),
                     [&](const LocationProbability& own) { return own.location == fault.location; }))
      locations.push_back({fault.location, thresholds.limit});
    names.push_back(fault.name());
  }
  verdict.suspects.insert(verdict.suspects.begin(), faults.begin(), faults.end());
  std::erase_if(verdict.locations, [&](const LocationProbability& own) {
    return std::any_of(locations.begin(), locations.end(),
                       [&](const LocationProbability& other) { return other.location == own.location; });
  });
  verdict.locations.insert(verdict.locations.begin(), locations.begin(), locations.end());
  if (!named) {
    verdict.answer = Instruments{};
    verdict.named.clear();
    verdict.ambiguous_with.clear();
  }
  verdict.named.insert(verdict.named.begin(), names.begin(), names.end());
  verdict.row = "5, " + verdict.row;
  verdict.why = "gross faults of instruments; beside them: " + verdict.why;
  return verdict;
}

}  // namespace wheelhop
