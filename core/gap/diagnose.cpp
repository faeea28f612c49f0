#include "core/gap/diagnose.hpp"

#include <algorithm>
#include <optional>

#include "core/data/slow_channels.hpp"
#include "core/gap/checks.hpp"
#include "core/gap/evidence/instrument_faults.hpp"
#include "core/gap/investigate.hpp"
#include "core/gap/where/locate.hpp"
#include "core/gap/which/shares.hpp"

namespace wheelhop {
namespace {

/// Of the clock among gross faults; 0 without that.
double clock_skew_of(const std::vector<InstrumentFault>& faults) {
  for (const InstrumentFault& fault : faults)
    if (fault.effect == "clock_skew") return fault.value;
  return 0;
}

/// Share of a floor that a lower one has to come to before the records are prepared once more: a judgement.
constexpr double kLowerFloor = 0.9;

/// What a diagnosis is asked with.
struct Common {
  const Plant& plant;
  const RecordSet& set;
  const CandidateList& candidates;
  const GapSolvers& solvers;
  const DiagnoseOptions& options;
  std::uint64_t seed = 0;
  const Step& step;
};

/// The records over a floor, and the plant's fits without any effect.
struct Opening {
  NoiseFloor floor;
  GapData data;
  GapStage delivered;
  Plant retuned_plant;  ///< without the gross faults that the base holds
  Base base;
  std::vector<InstrumentFault> faults;  ///< gross ones that are not corrected
  CorrectionEvidence correction;
};

Opening opened(const Common& common, NoiseFloor floor) {
  const auto& [plant, set, candidates, solvers, options, seed, step] = common;
  Opening out;
  out.floor = std::move(floor);
  out.data = gap_data(plant, set, out.floor, options.block_s);
  const Study plain{plant, out.data, solvers, candidates, tolerance_parameters(plant), options.iterations};
  const Bootstrap bootstrap{options.draws, out.floor.power_error, seed};
  out.base.plant = plant;
  if (step) step("the plant as delivered");
  out.base.delivered = fit_hypothesis(plain, plant, {});
  out.faults = gross_faults(out.base.delivered.fit, out.data.fitted);
  if (const double skew = clock_skew_of(out.faults); skew > 0) {
    leave_out_end(out.data, skew);
    out.base.delivered = fit_hypothesis(plain, plant, {});
  }
  if (step) step("re-tuning inside the tolerances");
  out.base.retuned = fit_hypothesis(plain, plant, plain.tolerances);
  out.retuned_plant = out.base.retuned.fit.plant;
  out.delivered = out.base.delivered.stage;
  if (!cannot_follow(plant, out.data, out.base.delivered, out.base.retuned).empty()) return out;
  if (step) step("gross faults of instruments");
  if (out.faults.empty() && far_off(out.base.retuned) &&
      stopped(out.base.retuned.fit, out.base.retuned.fit.theta.size()))
    out.faults = wrong_sign(plain, out.base, out.floor.colour, options.thresholds);
  if (std::optional<Base> better =
          corrected(plain, out.base, out.faults, out.floor.colour, bootstrap, options.thresholds, out.correction)) {
    out.base = std::move(*better);
    out.faults.clear();
  }
  return out;
}

/// What the verdict, one of effects, asks for. @param answer linearised
FollowUp follow_up(const Investigation& found, Hypothesis& answer, const Thresholds& thresholds) {
  FollowUp out;
  const Study& study = *found.study;
  const Search& search = *found.search;
  const Verdict& verdict = found.verdict;
  out.places_left = locate(answer.fit, study.data.fitted, study.data.noise_shares);
  out.checks = checks_of(study, search.retuned, answer, found.evidence, verdict, out.places_left, thresholds);
  if (search.step && !verdict.ambiguous_with.empty())
    search.step("a test that would tell " + to_string(verdict.named.back()) + " and " +
                to_string(verdict.ambiguous_with.front()));
  out.separating = separating_test_of(study, verdict);
  const Effects& effects = std::get<Effects>(verdict.answer);
  if (effects.count < 2 || effects.parameter) return out;
  std::vector<Hypothesis> known = found.singles.fits;
  known.insert(known.end(), found.sets.pairs.alone.begin(), found.sets.pairs.alone.end());
  out.shares = effect_shares(study, search.retuned, answer, known);
  return out;
}

}  // namespace

double share_of(const Diagnosis& diagnosis, const Suspect& suspect) {
  // One that was also fitted alone stands further down a second time.
  const auto& suspects = diagnosis.verdict.suspects;
  const auto first = std::find_if(suspects.begin(), suspects.end(),
                                  [&](const Suspect& other) { return other.name() == suspect.name(); });
  const auto& named = diagnosis.verdict.named;
  const auto faults = static_cast<Index>(diagnosis.evidence.correction.faults.size());  // named first, and not shared
  const Index i = std::find(named.begin(), named.end(), suspect.name()) - named.begin() - faults;
  return &*first == &suspect && i >= 0 && i < diagnosis.follow_up.shares.size() ? diagnosis.follow_up.shares(i)
                                                                                : kUnknown;
}

Diagnosis diagnose(const Plant& plant, const RecordSet& set, const CandidateList& candidates, const GapSolvers& solvers,
                   const DiagnoseOptions& options, std::uint64_t seed, const Step& step) {
  Diagnosis diagnosis;
  diagnosis.thresholds = options.thresholds;
  diagnosis.effort = options.effort;
  diagnosis.spikes = set.spikes;
  diagnosis.slow = slow_outputs(set);
  const Common common{plant, set, candidates, solvers, options, seed, step};
  Opening opening = opened(common, noise_floor(prediction_errors(plant, set)));
  // Repeats whose drives differ tell the floor by what the plant leaves of them, and a wrong plant leaves more.
  if (opening.floor.source == FloorSource::repeats && opening.base.retuned.stage.blocks.size() > 0) {
    NoiseFloor lower = noise_floor(prediction_errors(opening.base.retuned.fit.plant, set));
    if ((lower.std.array() < kLowerFloor * opening.floor.std.array()).any()) opening = opened(common, std::move(lower));
  }
  diagnosis.floor = opening.floor;
  diagnosis.plant = plant;
  diagnosis.retuned_plant = opening.retuned_plant;
  GapData& data = opening.data;
  Base& base = opening.base;
  std::vector<InstrumentFault>& faults = opening.faults;
  CorrectionEvidence& correction = opening.correction;
  const GapStage as_delivered = opening.delivered;
  const Bootstrap bootstrap{options.draws, diagnosis.floor.power_error, seed};
  const Setting setting{data, solvers, candidates, options, diagnosis.floor, bootstrap, step};
  std::unique_ptr<Investigation> found = investigate(setting, base, as_delivered, faults, correction);
  if (const double dispersion = dispersion_needed(*found, setting); dispersion > 1) {
    // What no model of the class does is larger than the noise: once more, with parameters held at home as firmly as
    // the tolerances say against residuals of that size.
    if (step) step("re-tuning, with the errors that all models leave counted as noise");
    disperse(data, dispersion);
    const Study again{base.plant, data, solvers, candidates, tolerance_parameters(base.plant), options.iterations};
    base.retuned = fit_hypothesis(again, base.plant, again.tolerances);
    if (base.retuned.stage.blocks.size() > 0) {
      if (correction.faults.empty()) diagnosis.retuned_plant = base.retuned.fit.plant;
      found = investigate(setting, std::move(base), as_delivered, std::move(faults), std::move(correction));
    }
  }
  diagnosis.evidence = found->evidence;
  diagnosis.verdict = found->verdict;
  Evidence& evidence = diagnosis.evidence;
  if (!evidence.cannot_follow.empty()) {
    diagnosis.status = Status::outside_domain;
    diagnosis.retuned_plant = plant;
    return diagnosis;
  }
  diagnosis.plant = found->answer ? found->answer->fit.plant : found->base.retuned.fit.plant;
  if (!evidence.correction.faults.empty())
    evidence.correction.closure_with_answer = closure(evidence.correction.retuned_without.blocks,
                                                      corrected_stage(evidence, diagnosis.verdict).blocks, bootstrap);
  if (is<Effects>(diagnosis.verdict)) diagnosis.follow_up = follow_up(*found, *found->answer, options.thresholds);
  if (is<Instruments>(diagnosis.verdict)) diagnosis.follow_up.places_left = evidence.places;
  return diagnosis;
}

}  // namespace wheelhop
