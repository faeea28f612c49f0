#include "core/gap/diagnose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/gap/checks.hpp"
#include "core/gap/evidence/instrument_faults.hpp"
#include "core/gap/verdict/posterior.hpp"
#include "core/gap/where/locate.hpp"
#include "core/gap/where/unknown.hpp"
#include "core/gap/which/correction.hpp"
#include "core/gap/which/parameter_label.hpp"
#include "core/gap/which/shares.hpp"

namespace wheelhop {
namespace {

/// Why the plant cannot be compared with the records; empty if it can.
std::string cannot_follow(const Plant& plant, const GapData& data, const Hypothesis& delivered,
                          const Hypothesis& retuned) {
  if (delivered.stage.blocks.size() > 0 && retuned.stage.blocks.size() > 0) return "";
  std::string largest;
  for (std::size_t i = 0; i < plant.inputs.size(); ++i) {
    const double size = data.fitted.front().drive.row(static_cast<Index>(i)).cwiseAbs().maxCoeff();
    largest += fmt::format("{}{} {:.3g} {}", i == 0 ? "" : ", ", plant.inputs[i].name, size, plant.inputs[i].unit);
  }
  return fmt::format(
      "the plant {} cannot follow the drives of the records, which reach {}: is that the unit of the file?",
      delivered.stage.blocks.size() == 0 ? "as delivered" : "as re-tuned", largest);
}

/// Where every parameter lies after re-tuning.
std::vector<ToleranceEvidence> tolerances_of(const Study& study, const Hypothesis& retuned) {
  std::vector<ToleranceEvidence> list;
  const PlantFit& fit = retuned.fit;
  const auto count = static_cast<Index>(study.tolerances.size());
  if (fit.theta.size() < count || fit.covariance.rows() < count) return list;
  const Vector z = leave_prior_out_z(fit.theta.head(count), fit.covariance);
  for (Index i = 0; i < count; ++i) {
    const FitParameter& parameter = study.tolerances[static_cast<std::size_t>(i)];
    const ParameterLabel label = label_of(study.nominal, parameter.name);
    const double effect = fit.jacobian.cols() > i ? fit.jacobian.col(i).norm() * std::abs(fit.theta(i)) : 0;
    list.push_back({parameter.name, label.effect, label.location, fit.theta(i), std::sqrt(fit.covariance(i, i)), z(i),
                    effect / std::sqrt(static_cast<double>(std::max<Index>(fit.residual.size(), 1)))});
  }
  return list;
}

/// Converters that the catalogue knows, and how much of the floor their rounding makes.
std::vector<LatticeEvidence> lattices_of(const Study& study, const Hypothesis& retuned, const NoiseFloor& floor) {
  std::vector<LatticeEvidence> list;
  const FitRecord& record = study.data.fitted.front();
  Operation operation;
  if (record.quantum.size() == 0 || record.quantum.maxCoeff() <= 0 ||
      !operation_of(retuned.fit.plant, study.data.fitted, retuned.fit.initial_states, operation))
    return list;
  const std::vector<EffectCandidate> candidates = study.candidates(retuned.fit.plant, operation);
  for (Index j = 0; j < record.quantum.size(); ++j) {
    const std::string& channel = study.nominal.sensors[static_cast<std::size_t>(j)].name;
    const bool offered = std::any_of(candidates.begin(), candidates.end(), [&](const EffectCandidate& candidate) {
      return candidate.effect == "quantisation" && candidate.location == "sensor:" + channel;
    });
    const double rounding = record.quantum(j) / std::sqrt(12.0);
    if (record.quantum(j) > 0 && offered)
      list.push_back({channel, record.quantum(j), rounding * rounding / (floor.std(j) * floor.std(j))});
  }
  return list;
}

/// Of the clock among gross faults; 0 without that.
double clock_skew_of(const std::vector<InstrumentFault>& faults) {
  for (const InstrumentFault& fault : faults)
    if (fault.effect == "clock_skew") return fault.value;
  return 0;
}

/// Candidates none of whose parameters is one of the plant's own already: it is fitted inside its tolerance, and may be
/// set free of that.
CandidateList without_fitted(const CandidateList& candidates, const std::vector<FitParameter>& own) {
  return [&candidates, &own](const Plant& plant, const Operation& operation) {
    std::vector<EffectCandidate> list = candidates(plant, operation);
    std::erase_if(list, [&](const EffectCandidate& candidate) {
      return std::any_of(candidate.parameters.begin(), candidate.parameters.end(), [&](const FitParameter& parameter) {
        return std::any_of(own.begin(), own.end(),
                           [&](const FitParameter& other) { return other.name == parameter.name; });
      });
    });
    return list;
  };
}

/// What the stages, the noise and the places tell; candidates are yet to come.
/// @param faults gross ones that are not corrected
Evidence evidence_of_stages(const Study& study, const NoiseFloor& floor, const Hypothesis& delivered,
                            const Hypothesis& retuned, std::vector<InstrumentFault> faults) {
  const GapData& data = study.data;
  Evidence evidence;
  evidence.noise = {{floor.std.begin(), floor.std.end()}, to_string(floor.source), floor.power_error, floor.colour};
  evidence.held_out = data.apart;
  const double sampling_hz = study.nominal.hold_hz() / static_cast<double>(data.held_out.front().ratio);
  evidence.judged_from_s = static_cast<double>(judged_from(data.held_out.front(), data.block)) / sampling_hz;
  evidence.samples = data.samples;
  evidence.channels = study.nominal.sensors.size();
  for (const Element& element : study.nominal.elements) evidence.elements.push_back(element.name);
  evidence.delivered = delivered.stage;
  evidence.retuned = retuned.stage;
  evidence.cannot_follow = cannot_follow(study.nominal, data, delivered, retuned);
  if (!evidence.cannot_follow.empty()) return evidence;
  evidence.delivered_chi2 = delivered.chi2;
  evidence.retuned_chi2 = retuned.chi2;
  evidence.retuned_prior_chi2 = retuned.prior_chi2;
  evidence.retuned_misfit = retuned.fit.misfit;
  evidence.tolerances = tolerances_of(study, retuned);
  const auto count = static_cast<Index>(evidence.tolerances.size());
  evidence.retuned_stopped = stopped(retuned.fit, count);
  evidence.tolerance_covariance = retuned.fit.covariance.topLeftCorner(count, count);
  evidence.gross_faults = std::move(faults);
  // Around a gross fault that is not corrected re-tuning bends the plant out of all shape, and signals at its places
  // tell nothing.
  Located located =
      locate_needed(evidence.gross_faults.empty() ? retuned.fit : delivered.fit, data.fitted, data.noise_shares);
  evidence.places = std::move(located.places);
  evidence.place_pairs = std::move(located.pairs);
  evidence.places_needed = located.needed;
  return evidence;
}

/// True if more candidates are worth their time: where an answer has no name and no single effect explains the gap, or
/// where an answer's effects leave more than a share of the gap, on all records or on the held-out ones, or bend a
/// parameter as far as it goes.
bool explains_little(const Evidence& evidence, const Verdict& verdict, double share) {
  const double gap = evidence.retuned_chi2 - evidence.samples;
  const auto leaves = [&](const CandidateEvidence& own) { return own.chi2 - evidence.samples > share * gap; };
  if (is_unnamed(verdict)) return std::all_of(evidence.singles.begin(), evidence.singles.end(), leaves);
  const auto* effects = std::get_if<Effects>(&verdict.answer);
  if (!effects) return false;
  const CandidateEvidence& answer = candidate_of(evidence, *effects);
  const bool bent =
      std::any_of(answer.theta.begin(), answer.theta.end(), [](double own) { return std::abs(own) > kAtEnd; });
  return bent || leaves(answer) || answer.closure.value < 1 - share;
}

/// The hypothesis behind an answer that is a plant; null for one that is none.
Hypothesis* hypothesis_of(const Verdict& verdict, Candidates& singles, Candidates& pairs, FreedParameters& freed) {
  if (const auto* effects = std::get_if<Effects>(&verdict.answer))
    return &(effects->pair ? pairs : singles).fits[effects->candidate];
  if (const auto* parameters = std::get_if<Parameters>(&verdict.answer)) {
    Hypothesis& own = freed.fits[parameters->freed];
    return own.fit.error.empty() ? nullptr : &own;
  }
  return nullptr;
}

/// What the verdict, one of effects, asks for. @param answer linearised
FollowUp follow_up(const Search& search, const Hypothesis& answer, const Diagnosis& diagnosis,
                   const Candidates& singles, const Candidates& pairs) {
  FollowUp out;
  const Study& study = search.study;
  const Verdict& verdict = diagnosis.verdict;
  out.places_left = locate(answer.fit, study.data.fitted, study.data.noise_shares);
  out.checks =
      checks_of(study, search.retuned, answer, diagnosis.evidence, verdict, out.places_left, diagnosis.thresholds);
  if (search.step && !verdict.ambiguous_with.empty())
    search.step("a test that would tell " + verdict.named.back() + " and " + verdict.ambiguous_with.front());
  out.separating = separating_test_of(study, verdict);
  const Effects& effects = std::get<Effects>(verdict.answer);
  if (!effects.pair || effects.parameter) return out;
  std::vector<Hypothesis> known = singles.fits;
  known.insert(known.end(), pairs.alone.begin(), pairs.alone.end());
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
  diagnosis.plant = diagnosis.retuned_plant = plant;
  diagnosis.spikes = set.spikes;
  diagnosis.floor = noise_floor(prediction_errors(plant, set));
  GapData data = gap_data(plant, set, diagnosis.floor, options.block_s);
  const Study plain{plant, data, solvers, candidates, tolerance_parameters(plant), options.iterations};
  const Bootstrap bootstrap{options.draws, diagnosis.floor.power_error, seed};
  Base base{plant, {}, {}};
  if (step) step("the plant as delivered");
  base.delivered = fit_hypothesis(plain, plant, {});
  std::vector<InstrumentFault> faults = gross_faults(base.delivered.fit, data.fitted);
  if (const double skew = clock_skew_of(faults); skew > 0) {
    leave_out_end(data, skew);
    base.delivered = fit_hypothesis(plain, plant, {});
  }
  if (step) step("re-tuning inside the tolerances");
  base.retuned = fit_hypothesis(plain, plant, plain.tolerances);
  diagnosis.retuned_plant = base.retuned.fit.plant;
  const GapStage as_delivered = base.delivered.stage;
  CorrectionEvidence correction;
  if (cannot_follow(plant, data, base.delivered, base.retuned).empty()) {
    if (step && !faults.empty()) step("gross faults of instruments");
    if (std::optional<Base> better =
            corrected(plain, base, faults, diagnosis.floor.colour, bootstrap, options.thresholds, correction)) {
      base = std::move(*better);
      faults.clear();
    }
  }
  const std::vector<FitParameter> tolerances = tolerance_parameters(base.plant);
  const CandidateList others = without_fitted(candidates, tolerances);
  const Study study{base.plant, data, solvers, others, tolerances, options.iterations};
  const Hypothesis &delivered = base.delivered, &retuned = base.retuned;
  if (step) step("where it enters");
  Evidence& evidence = diagnosis.evidence;
  evidence = evidence_of_stages(study, diagnosis.floor, delivered, retuned, std::move(faults));
  evidence.delivered = as_delivered;
  evidence.correction = std::move(correction);
  if (!evidence.cannot_follow.empty()) {
    diagnosis.status = Status::outside_domain;
    diagnosis.verdict = decide(evidence, options.thresholds);
    diagnosis.retuned_plant = plant;
    return diagnosis;
  }
  const Search search{study, options.thresholds, options.effort, bootstrap, delivered, retuned, step};
  if (step) step("every effect at every place");
  Changes changes;
  Candidates singles = find_singles(search, diagnosis.floor.colour, changes);
  evidence.singles = singles.evidence;
  FreedParameters freed = free_parameters(search, parameters_to_free(search, evidence));
  evidence.freed = freed.evidence;
  evidence.lattices = lattices_of(study, retuned, diagnosis.floor);
  Candidates pairs;
  const auto judge = [&] {
    evidence.singles = singles.evidence;
    evidence.pairs.clear();
    pairs = find_pairs(search, changes, evidence, singles);
    evidence.pairs = pairs.evidence;
    diagnosis.verdict = decide(evidence, options.thresholds);
  };
  judge();
  const auto little = [&] { return explains_little(evidence, diagnosis.verdict, options.effort.leaves_much); };
  if (little() && add_less_expected(search, diagnosis.floor.colour, singles)) judge();
  // Forms of an answer that explains little may all be too coarse, and the finer form of another one be what is missing.
  std::vector<std::string> finer = diagnosis.verdict.named;
  finer.insert(finer.end(), diagnosis.verdict.ambiguous_with.begin(), diagnosis.verdict.ambiguous_with.end());
  if (little()) finer = not_far_behind(search, singles);
  if (refine_singles(search, finer, singles)) judge();
  if (is_place(diagnosis.verdict)) {
    evidence.motion = motion_shares(retuned.fit, data.fitted, evidence.places, options.thresholds.elsewhere);
    diagnosis.verdict = decide(evidence, options.thresholds);
  }
  Hypothesis* answer = hypothesis_of(diagnosis.verdict, singles, pairs, freed);
  Candidates beside;  // the answer with parameters set free
  if (const auto* effects = std::get_if<Effects>(&diagnosis.verdict.answer)) {
    CandidateEvidence& own = (effects->pair ? evidence.pairs : evidence.singles)[effects->candidate];
    if (step) step("parameters beside " + own.last().name());
    beside.fits = free_beside(search, evidence.tolerances, *answer, own);
    diagnosis.verdict = decide(evidence, options.thresholds);
    answer = hypothesis_of(diagnosis.verdict, singles, pairs, freed);
    if (const auto* now = std::get_if<Effects>(&diagnosis.verdict.answer); now && now->parameter)
      answer = &beside.fits.front();
  }
  diagnosis.plant = answer ? answer->fit.plant : retuned.fit.plant;
  if (!evidence.correction.faults.empty())
    evidence.correction.closure_with_answer = closure(evidence.correction.retuned_without.blocks,
                                                      corrected_stage(evidence, diagnosis.verdict).blocks, bootstrap);
  if (is<Effects>(diagnosis.verdict)) diagnosis.follow_up = follow_up(search, *answer, diagnosis, singles, pairs);
  if (is<Instruments>(diagnosis.verdict)) diagnosis.follow_up.places_left = evidence.places;
  return diagnosis;
}

}  // namespace wheelhop
