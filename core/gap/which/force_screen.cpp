#include "core/gap/which/force_screen.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include "core/data/slow_channels.hpp"
#include "core/gap/where/forced.hpp"
#include "core/gap/where/probe.hpp"
#include "core/greybox/operation.hpp"
#include "core/greybox/trajectory.hpp"

namespace wheelhop {
namespace {

constexpr Index kSamples = 20000;  // of the records that are asked: a judgement, a bound on the time
// Judgements: lengths of the pieces in which a plant is fitted, one after the other, in shares of a block. A solution
// in short pieces is where the fit in longer ones begins.
constexpr Index kPieces[] = {1, 4, 16}, kPiecesOfBlock = 4;
constexpr Index kRounds = 2;  // a judgement: a fit in pieces may take so many times a study's iterations

/// The first records of a study, which tell a law as well as many do, and what a fit of all has of them.
struct FirstRecords {
  std::vector<FitRecord> records;
  PlantFit fit;
};

FirstRecords first_records(const Study& study, const PlantFit& fit) {
  FirstRecords first{{}, fit};
  first.fit.error.clear();
  first.fit.initial_states.clear();
  Index length = 0;
  for (std::size_t i = 0; i < study.data.fitted.size() && (i == 0 || length < kSamples); ++i) {
    first.records.push_back(study.data.fitted[i]);
    first.fit.error.push_back(fit.error[i]);
    first.fit.initial_states.push_back(fit.initial_states[i]);
    length += first.records.back().y.cols();
  }
  return first;
}

/// The candidates with laws at a place of a plant, sized by the motion there.
std::vector<EffectCandidate> candidates_at(const Study& study, const Plant& plant, Operation operation,
                                           const Place& location, const std::vector<Matrix>& motion) {
  for (std::size_t e = 0; e < plant.elements.size(); ++e)
    if (location_of(plant.elements[e]) == location) size_by_motion(motion, operation.elements[e]);
  for (std::size_t i = 0; i < plant.masses.size(); ++i)
    if (location == guide_place(plant.masses[i].name)) size_by_motion(motion, operation.guides[i]);
  std::vector<EffectCandidate> candidates = study.candidates(plant, operation);
  std::erase_if(candidates, [&](const EffectCandidate& candidate) {
    return candidate.location != location || !candidate.refines.empty() || candidate.parameters.empty() ||
           element_at(candidate.plant, location) == nullptr;
  });
  return candidates;
}

/// Records in pieces, and where the motion begins in each.
struct Pieces {
  std::vector<FitRecord> records;
  std::vector<std::size_t> of;  ///< number of the record that each is a piece of
  std::vector<Index> begin;     ///< its first sample there
  PlantFit states;
};

/// @param state_at of record i at sample k, 2n
template <class StateAt>
Pieces pieces_of(const std::vector<FitRecord>& records, const PlantFit& base, Index samples, const StateAt& state_at) {
  Pieces out;
  out.states.state_scale = base.state_scale;
  const Index states = base.state_scale.size();
  for (std::size_t i = 0; i < records.size(); ++i) {
    const FitRecord& whole = records[i];
    const Index count = std::max<Index>((whole.y.cols() - whole.skip) / samples, 1);
    for (Index k = 0; k < count; ++k) {
      const Index begin = whole.skip + k * samples, end = k + 1 < count ? begin + samples : whole.y.cols();
      FitRecord piece = whole;
      piece.drive = whole.drive.middleCols(begin * whole.ratio, (end - begin) * whole.ratio);
      piece.y = whole.y.middleCols(begin, end - begin);
      piece.skip = 0;
      if (begin > 0) piece.start = {};
      piece.slow = part_of(whole.slow, begin, end - begin);
      out.records.push_back(std::move(piece));
      out.of.push_back(i);
      out.begin.push_back(begin);
      out.states.initial_states.push_back(state_at(i, begin));
    }
  }
  out.states.states_at_rest.resize(states * static_cast<Index>(out.of.size()));
  for (std::size_t k = 0; k < out.of.size(); ++k)
    out.states.states_at_rest.segment(states * static_cast<Index>(k), states) =
        base.states_at_rest.segment(states * static_cast<Index>(out.of[k]), states);
  return out;
}

/// The whole plant with a candidate fitted to the records in pieces of growing length, each of which begins where the
/// solution of the shorter ones says. @param theta in: where to begin; out: the solution of the longest
/// @return initial states of the records
std::vector<InitialState> fit_in_pieces(const Study& study, const EffectCandidate& candidate,
                                        const std::vector<FitParameter>& parameters, const PlantFit& base,
                                        const std::vector<FitRecord>& records, const std::vector<Trajectory>& motion,
                                        Vector& theta) {
  const Index n = base.plant.mass_count();
  Pieces pieces;
  for (const Index length : kPieces) {
    const Index samples = std::max<Index>(length * study.data.block / kPiecesOfBlock, 1);
    pieces = pieces_of(records, base, samples, [&](std::size_t i, Index sample) {
      for (std::size_t k = 0; k < pieces.of.size(); ++k)
        if (pieces.of[k] == i && pieces.begin[k] == sample) return pieces.states.initial_states[k];
      Vector state(2 * n);
      state << motion[i].position.col(sample), motion[i].velocity.col(sample);
      return InitialState(std::move(state));
    });
    const PlantFit fit = fit_plant(
        candidate.plant, parameters, pieces.records, study.solvers.thorough,
        {.iterations = kRounds * study.iterations, .from = &pieces.states, .linearise = false, .theta = theta});
    if (fit.error.empty()) break;
    theta = fit.theta;
    pieces.states.initial_states = fit.initial_states;
  }
  std::vector<InitialState> first(records.size());
  for (std::size_t k = 0; k < pieces.of.size(); ++k)
    if (first[pieces.of[k]].motion.size() == 0) first[pieces.of[k]] = pieces.states.initial_states[k];
  return first;
}

}  // namespace

ForceScreened screen_by_force(const Study& study, const PlantFit& home, const PlantFit& retuned, const Place& location,
                              const ForceScreenOptions& options) {
  ForceScreened out;
  ForcePlace place;
  Operation operation;
  const auto [records, base] = first_records(study, home);
  if (!force_place_of(base.plant, location, place) ||
      !operation_of(base.plant, records, base.initial_states, operation))
    return out;
  const ForceReconstruction asked = reconstruct_force(base, records, location);
  if (!asked.why_not.empty() || asked.forces.empty()) return out;
  ForceThere known_force;
  known_force.motion = motion_at_place(asked.forced);
  known_force.sampling_hz = base.plant.hold_hz() / static_cast<double>(records.front().ratio);
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Matrix& motion = known_force.motion[i];
    if (motion.cols() == 0 || !all_finite(motion)) return out;
    const Index skip = records[i].skip, size = std::min(asked.forces[i].size(), motion.cols());
    const Index fade = fade_samples(size - skip);
    known_force.samples.emplace_back(skip + fade, std::max<Index>(size - skip - 2 * fade, 0));
  }
  const Element* const own = element_at(base.plant, location);
  known_force.force = known_force.stacked([&](std::size_t i) { return asked.forces[i]; });
  if (Vector known; own != nullptr) {
    if (!known_force.along(*own, known)) return out;
    known_force.force += known;
  }
  out = screen_by_known_force(study, base.plant, known_force, location,
                              candidates_at(study, base.plant, std::move(operation), location, known_force.motion),
                              Vector::Zero(retuned.theta.size()), options);

  // In free run over a whole record a nonlinear plant soon goes its own way, and no fit leads back: in pieces first.
  const std::vector<Trajectory> states = trajectories(asked.forced.fit, asked.forced.records);
  for (std::size_t i = 0; i < records.size(); ++i)
    if (states[i].position.cols() < records[i].y.cols()) return {};
  tbb::parallel_for(std::size_t{0}, out.screened.size(), [&](std::size_t k) {
    Screened& fitted = out.screened[k];
    EffectCandidate& candidate = out.candidates[fitted.candidate];
    const auto count = static_cast<Index>(study.tolerances.size());
    std::vector<FitParameter> parameters = study.tolerances;
    parameters.insert(parameters.end(), candidate.parameters.begin(), candidate.parameters.end());
    Vector theta = Vector::Zero(static_cast<Index>(parameters.size()));
    theta.head(count) = fitted.retuning.head(count);
    fitted.initial_states = fit_in_pieces(study, candidate, parameters, base, records, states, theta);
    for (std::size_t i = 0; i < candidate.parameters.size(); ++i) {
      const FitParameter& own_parameter = candidate.parameters[i];
      set_parameter(candidate.plant, own_parameter.name,
                    get_parameter(candidate.plant, own_parameter.name) +
                        theta(count + static_cast<Index>(i)) * own_parameter.scale);
    }
    fitted.retuning.head(count) = theta.head(count);
    fitted.retuning -= retuned.theta;
  });
  return out;
}

ForceScreened screen_rivals(const Study& study, const PlantFit& answer, const PlantFit& retuned, const Place& location,
                            const std::function<bool(const EffectCandidate&)>& asked,
                            const ForceScreenOptions& options) {
  ForceScreened out;
  Operation operation;
  const auto [records, base] = first_records(study, answer);
  const Element* const element = element_at(base.plant, location);
  // A rival stands in place of the answer's effects: in the plant without them, tuned as the answer has it.
  Plant nominal = study.nominal;
  for (const FitParameter& tolerance : study.tolerances)
    set_parameter(nominal, tolerance.name, get_parameter(base.plant, tolerance.name));
  if (element == nullptr || base.plant.mass_count() != nominal.mass_count() ||
      !operation_of(base.plant, records, base.initial_states, operation))
    return out;
  operation.elements.resize(nominal.elements.size());
  ForceThere there;
  there.sampling_hz = base.plant.hold_hz() / static_cast<double>(records.front().ratio);
  const auto number = static_cast<Index>(element - base.plant.elements.data());
  const std::vector<Trajectory> states = trajectories(base, records);
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Index count = states[i].travel.cols();
    Matrix motion(2, count);
    motion << states[i].travel.row(number), states[i].rate.row(number);
    if (!(count > records[i].skip) || !all_finite(motion)) return out;
    there.samples.emplace_back(records[i].skip, count - records[i].skip);
    there.motion.push_back(std::move(motion));
  }
  std::vector<EffectCandidate> candidates = candidates_at(study, nominal, std::move(operation), location, there.motion);
  std::erase_if(candidates, [&](const EffectCandidate& candidate) { return !asked(candidate); });
  if (candidates.empty() || !there.along(*element, there.force)) return out;
  const Index count = static_cast<Index>(study.tolerances.size());
  out =
      screen_by_known_force(study, nominal, there, location, std::move(candidates), answer.theta.head(count), options);
  for (Screened& one : out.screened) {
    one.retuning -= retuned.theta;
    one.initial_states = answer.initial_states;
  }
  return out;
}

}  // namespace wheelhop
