#include "core/gap/investigate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/gap/evidence/instrument_faults.hpp"
#include "core/gap/verdict/posterior.hpp"
#include "core/gap/where/locate.hpp"
#include "core/gap/where/unknown.hpp"
#include "core/gap/which/parameter_label.hpp"
#include "core/plant/rotary.hpp"

namespace wheelhop {
namespace {

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
    list.push_back({shown_name(study.nominal, parameter.name), label.effect, label.location, fit.theta(i),
                    std::sqrt(fit.covariance(i, i)), z(i),
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
      return candidate.label().effect == "quantisation" && candidate.location == sensor_place(channel);
    });
    const double rounding = record.quantum(j) / std::sqrt(12.0);
    if (record.quantum(j) > 0 && offered)
      list.push_back({channel, record.quantum(j), rounding * rounding / (floor.std(j) * floor.std(j))});
  }
  return list;
}

/// Candidates none of whose parameters is one of the plant's own already: it is fitted inside its tolerance, and may be
/// set free of that.
CandidateList without_fitted(const CandidateList& candidates, const std::vector<FitParameter>& own) {
  return [&candidates, own](const Plant& plant, const Operation& operation) {
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
  evidence.dispersion = data.fitted.front().dispersion;
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

/// True of a parameter at the end of its tolerance that the form of an answer's effects explains: it belongs to an
/// element where one of them acts, and not to its springs if that one stores nothing, nor to its damper if it is
/// elastic.
bool bent_by_form(const CandidateEvidence& answer, const ToleranceEvidence& parameter) {
  const bool of_damper = parameter.effect == "damping_error";
  return std::any_of(answer.effects.begin(), answer.effects.end(), [&](const EffectEvidence& effect) {
    return effect.location == parameter.location && !(of_damper ? effect.elastic : effect.dissipative);
  });
}

/// True if more candidates are worth their time: where an answer has no name and no single effect explains the gap, or
/// where an answer's effects leave more than `leaves_much` of the gap, on all records or on the held-out ones, or bend
/// a parameter as far as it goes that their forms do not, or where a gap of `large_gap` beside a corrected instrument
/// has no such effect.
bool explains_little(const Evidence& evidence, const Verdict& verdict, const SearchEffort& effort) {
  const double share = effort.leaves_much;
  const double gap = evidence.retuned_chi2 - evidence.samples;
  const auto leaves = [&](const CandidateEvidence& own) { return own.chi2 - evidence.samples > share * gap; };
  if (is_unnamed(verdict)) return std::all_of(evidence.singles.begin(), evidence.singles.end(), leaves);
  if (is<Instruments>(verdict) && gap_left(evidence) > effort.large_gap)
    return std::all_of(evidence.singles.begin(), evidence.singles.end(), leaves);
  const auto* effects = std::get_if<Effects>(&verdict.answer);
  if (!effects) return false;
  const CandidateEvidence& answer = candidate_of(evidence, *effects);
  bool bent = false;
  for (std::size_t i = 0; i < answer.theta.size(); ++i)
    bent = bent || (std::abs(answer.theta[i]) > kAtEnd && !bent_by_form(answer, evidence.tolerances[i]));
  return bent || leaves(answer) || answer.closure.value < 1 - share;
}

/// Tolerances by which a fit moved the parameter that it moved most. @param count of the parameters with a tolerance
double farthest(const PlantFit& fit, std::size_t count) {
  const Index own = std::min(static_cast<Index>(count), fit.theta.size());
  return own > 0 ? fit.theta.head(own).cwiseAbs().maxCoeff() : 0;
}

/// True if a list has a set of effects in the same forms.
bool has(const std::vector<std::vector<EffectCandidate>>& list, const Hypothesis& hypothesis) {
  return std::any_of(list.begin(), list.end(),
                     [&](const std::vector<EffectCandidate>& own) { return same_forms(own, hypothesis.effects); });
}

/// The list in which the effects of an answer stand.
Candidates& candidates_of(Investigation& found, const Effects& effects) {
  return effects.count == 1 ? found.singles : found.sets.of(effects.count);
}

/// What they tell, in the evidence.
CandidateEvidence& evidence_of(Investigation& found, const Effects& effects) {
  Evidence& evidence = found.evidence;
  auto& list = effects.count == 1 ? evidence.singles : effects.count == 2 ? evidence.pairs : evidence.larger;
  return list[effects.candidate];
}

/// The hypothesis behind an answer that is a plant; null for one that is none.
Hypothesis* answer_of(Investigation& found) {
  if (const auto* effects = std::get_if<Effects>(&found.verdict.answer))
    return effects->parameter ? &found.beside.fits[*effects->parameter]
                              : &candidates_of(found, *effects).fit_of(effects->candidate);
  if (const auto* parameters = std::get_if<Parameters>(&found.verdict.answer)) {
    Hypothesis& own = found.freed.fits[parameters->freed];
    return own.fit.error.empty() ? nullptr : &own;
  }
  return nullptr;
}

/// Pairs beside the best singles, and the verdict of all that is known.
void judge(const Setting& setting, const Changes& changes, Investigation& found) {
  Evidence& evidence = found.evidence;
  evidence.singles = found.singles.evidence;
  evidence.pairs.clear();
  found.sets.pairs = find_pairs(*found.search, changes, std::move(found.sets.pairs), evidence, found.singles);
  evidence.pairs = found.sets.pairs.evidence;
  found.verdict = decide(evidence, setting.options.thresholds);
}

/// The pair that leaves least of those whose fit is not in `grown`, if it does not leave far more than the best one;
/// the number of candidates for none.
std::size_t runner_up(const Investigation& found, const std::vector<std::vector<EffectCandidate>>& grown) {
  const std::vector<CandidateEvidence>& pairs = found.sets.pairs.evidence;
  const double floor = found.evidence.samples;
  std::size_t best = pairs.size(), least = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (pairs[i].chi2 < pairs[least].chi2) least = i;
    if (!has(grown, found.sets.pairs.fit_of(i)) && (best == pairs.size() || pairs[i].chi2 < pairs[best].chi2)) best = i;
  }
  const double far = found.search->effort.far_behind;
  return best < pairs.size() && pairs[best].chi2 - floor < far * (pairs[least].chi2 - floor) ? best : pairs.size();
}

/// Names of effects of which a finer form may matter: of those that are named or told beside the names, where their
/// coarser forms leave more than chance and several effects together do not leave far less. Forms of an answer that
/// explains little may all be too coarse, and the finer form of another effect be what is missing.
std::vector<EffectAt> to_refine(const Investigation& found, bool little) {
  if (little) return worth_refining(*found.search, found.singles);
  const Evidence& evidence = found.evidence;
  const Thresholds& thresholds = found.search->thresholds;
  std::vector<EffectAt> names = found.verdict.named;
  names.insert(names.end(), found.verdict.ambiguous_with.begin(), found.verdict.ambiguous_with.end());
  const double by_chance = thresholds.notice * chance_of(evidence);
  double most = std::numeric_limits<double>::infinity();
  if (const auto* effects = std::get_if<Effects>(&found.verdict.answer); effects && effects->count > 1)
    most = std::max(by_chance, candidate_of(evidence, *effects).chi2 - evidence.samples) / thresholds.of_rest;
  std::erase_if(names, [&](const EffectAt& name) {
    // Singles stand in ascending order of chi2.
    const auto least = std::find_if(evidence.singles.begin(), evidence.singles.end(),
                                    [&](const CandidateEvidence& own) { return own.last().name() == name; });
    if (least == evidence.singles.end()) return false;
    const double left = least->chi2 - evidence.samples;
    return left <= by_chance || left > most;
  });
  return names;
}

/// A third effect beside two, and so on, as long as one more is needed; where much is left in the end, once beside
/// another pair as well.
void judge_larger(const Setting& setting, Investigation& found) {
  Evidence& evidence = found.evidence;
  const Thresholds& thresholds = setting.options.thresholds;
  std::vector<std::vector<EffectCandidate>> grown;  // or tried in vain
  for (int k = 0; k < setting.options.effort.growths; ++k) {
    Effects next = found.verdict.largest;
    if (next.count < 2) return;
    const auto* effects = std::get_if<Effects>(&found.verdict.answer);
    const bool pending = effects == nullptr || effects->count < next.count;
    const bool again = has(grown, candidates_of(found, next).fit_of(next.candidate));
    const double left = candidate_of(evidence, next).chi2 / evidence.samples - 1;
    if ((pending || again) && !(left > thresholds.much_left)) return;
    if (again) next = {2, runner_up(found, grown), false};
    if (next.candidate == candidates_of(found, next).evidence.size()) return;  // no other pair
    grown.push_back(candidates_of(found, next).fit_of(next.candidate).effects);
    grow(*found.search, evidence, next.count, next.candidate, pending, found.sets);
    evidence.pairs = found.sets.pairs.evidence;
    evidence.larger = found.sets.larger.evidence;
    found.verdict = decide(evidence, thresholds);
  }
}

/// Parameters that are wrong beside an answer of effects.
void free_parameters_beside(const Setting& setting, Investigation& found) {
  const auto* effects = std::get_if<Effects>(&found.verdict.answer);
  if (!effects) return;
  CandidateEvidence& own = evidence_of(found, *effects);
  if (setting.step) setting.step("parameters beside " + to_string(own.last().name()));
  found.beside.fits = free_beside(*found.search, found.evidence.tolerances, *answer_of(found), own);
  found.verdict = decide(found.evidence, setting.options.thresholds);
}

}  // namespace

std::string cannot_follow(const Plant& plant, const GapData& data, const Hypothesis& delivered,
                          const Hypothesis& retuned) {
  if (delivered.stage.blocks.size() > 0 && retuned.stage.blocks.size() > 0) {
    const auto [one, other] = exchanged_channels(delivered.fit, data.fitted);
    return one.empty() ? ""
                       : fmt::format(
                             "the plant fits the records with the channels {} and {} exchanged: are their "
                             "cables, columns or names?",
                             one, other);
  }
  std::string largest;
  for (std::size_t i = 0; i < plant.inputs.size(); ++i) {
    const double size = data.fitted.front().drive.row(static_cast<Index>(i)).cwiseAbs().maxCoeff();
    largest += fmt::format("{}{} {:.3g} {}", i == 0 ? "" : ", ", plant.inputs[i].name, size, plant.inputs[i].unit);
  }
  return fmt::format(
      "the plant {} cannot follow the drives of the records, which reach {}: is that the unit of the file?",
      delivered.stage.blocks.size() == 0 ? "as delivered" : "as re-tuned", largest);
}

std::unique_ptr<Investigation> investigate(const Setting& setting, Base base, const GapStage& delivered,
                                           std::vector<InstrumentFault> faults, CorrectionEvidence correction) {
  const DiagnoseOptions& options = setting.options;
  const auto step = [&](const std::string& what) {
    if (setting.step) setting.step(what);
  };
  auto found = std::make_unique<Investigation>();
  found->base = std::move(base);
  const Plant& plant = found->base.plant;
  const Hypothesis& retuned = found->base.retuned;
  const std::vector<FitParameter> tolerances = tolerance_parameters(plant);
  found->candidates = without_fitted(setting.candidates, tolerances);
  found->study.emplace(plant, setting.data, setting.solvers, found->candidates, tolerances, options.iterations);
  found->search.emplace(*found->study, options.thresholds, options.effort, setting.bootstrap, found->base.delivered,
                        retuned, setting.step);
  const Search& search = *found->search;
  step("where it enters");
  Evidence& evidence = found->evidence;
  evidence = evidence_of_stages(*found->study, setting.floor, found->base.delivered, retuned, std::move(faults));
  evidence.delivered = delivered;
  evidence.correction = std::move(correction);
  if (!evidence.cannot_follow.empty()) {
    found->verdict = decide(evidence, options.thresholds);
    return found;
  }
  step("every effect at every place");
  Changes changes;
  found->singles = find_singles(search, setting.floor.colour, changes);
  evidence.singles = found->singles.evidence;
  found->freed = free_parameters(search, parameters_to_free(search, evidence));
  evidence.freed = found->freed.evidence;
  evidence.lattices = lattices_of(*found->study, retuned, setting.floor);
  judge(setting, changes, *found);
  const auto little = [&] { return explains_little(evidence, found->verdict, options.effort); };
  // What is missing may have bent the plant to where the effect that is missing seems to change nothing: around the
  // plant as delivered it does.
  const PlantFit* home = &found->base.delivered.fit;
  const bool bent = stopped(retuned.fit, static_cast<Index>(tolerances.size()));
  const auto far_from_noise = [&] {
    const auto* effects = std::get_if<Effects>(&found->verdict.answer);
    return effects && candidate_of(evidence, *effects).misfit > options.effort.beyond_noise;
  };
  if ((little() || far_from_noise()) && add_by_force(search, evidence.places, found->singles))
    judge(setting, changes, *found);
  const auto hangs_on_a_mass = [&] {
    const Place& location = answer_of(*found)->effects.back().location;
    return std::any_of(home->plant.masses.begin(), home->plant.masses.end(),
                       [&](const Mass& mass) { return location == part_place(mass.name); });
  };
  // A small gap is seen by the linear screen; parameters that are bent and explain all leave a mode nothing to do.
  if (gap_left(evidence) > options.effort.large_gap && (little() || (far_from_noise() && hangs_on_a_mass())) &&
      add_at_masses(search, evidence.places, found->singles))
    judge(setting, changes, *found);
  if (little() && add_less_expected(search, setting.floor.colour, bent ? home : nullptr, found->singles))
    judge(setting, changes, *found);
  if (!bent && farthest(retuned.fit, tolerances.size()) > options.thresholds.out_of_tolerance &&
      (little() ? add_less_expected(search, setting.floor.colour, home, found->singles)
                : add_best_expected(search, setting.floor.colour, *home, found->singles)))
    judge(setting, changes, *found);
  if (is<Effects>(found->verdict) && add_rivals(search, *answer_of(*found), found->singles))
    judge(setting, changes, *found);
  if (refine_singles(search, to_refine(*found, little()), found->singles)) judge(setting, changes, *found);
  if (is_place(found->verdict)) {
    evidence.motion = motion_shares(retuned.fit, setting.data.fitted, evidence.places, options.thresholds.elsewhere);
    found->verdict = decide(evidence, options.thresholds);
  }
  judge_larger(setting, *found);
  free_parameters_beside(setting, *found);
  found->answer = answer_of(*found);
  return found;
}

double dispersion_needed(const Investigation& found, const Setting& setting) {
  const auto count = static_cast<Index>(found.study->tolerances.size());
  const auto far = [&](const Hypothesis& own) {
    return count > 0 && own.fit.theta.size() >= count &&
           own.fit.theta.head(count).cwiseAbs().maxCoeff() > setting.options.thresholds.not_home;
  };
  if (!found.evidence.cannot_follow.empty() || !explains_little(found.evidence, found.verdict, setting.options.effort))
    return 1;
  const Hypothesis* best = &found.base.retuned;
  for (const auto* list : {&found.singles.fits, &found.sets.pairs.fits, &found.sets.larger.fits, &found.freed.fits})
    for (const Hypothesis& own : *list)
      if (own.chi2 < best->chi2) best = &own;
  if (!(best->fit.misfit > setting.options.effort.beyond_noise) || !(far(found.base.retuned) || far(*best))) return 1;
  return dispersion_of(setting.data, best->fit, best->held_out);
}

}  // namespace wheelhop
