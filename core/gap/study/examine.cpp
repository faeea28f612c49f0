#include "core/gap/study/examine.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <cmath>

#include "core/gap/evidence/prepared.hpp"

namespace wheelhop {

int telling_stage(const Examination& examination) {
  for (const int s : {1, 0})
    if (const StageExamination& stage = examination.stages[static_cast<std::size_t>(s)];
        stage.ran && has_gap(stage.profile))
      return s;
  return -1;
}

Examination examine(const std::array<Plant, 3>& plants, const RecordSet& set, const NoiseFloor& floor,
                    const Plant& bare, const Place& place, const Solver& solver, const ExamineOptions& options,
                    Random& random) {
  Examination out;
  out.sample_time_s = 1 / set.sampling_hz;
  std::vector<FitRecord> fitted;
  std::vector<std::string> fitted_names;
  for (const Measured& measured : merge_repeats(set)) {
    const bool held_out = measured.role == "validation";
    FitRecord record =
        fit_record(plants[0], measured.signal, floor.std / std::sqrt(static_cast<double>(measured.repeats)));
    record.start = measured.start;
    (held_out ? out.records : fitted).push_back(std::move(record));
    (held_out ? out.names : fitted_names).push_back(measured.name);
  }
  out.held_out = !out.records.empty();
  if (!out.held_out) {
    out.records = fitted;
    out.names = fitted_names;
  }
  const Index block = block_samples(set, options.block_s);
  leave_out_end(out.records, block, plants[2].clock_skew);
  const std::vector<FitRecord> whole = out.records;
  for (FitRecord& record : out.records) record.skip = fitted_from(record, block);
  const std::vector<FitRecord> counted = out.records;  // by the fits
  for (FitRecord& record : out.records) record.skip = judged_from(record, block);
  ProfileOptions bands;
  bands.band_edges_hz = band_edges(plants[0], set.sampling_hz / 2);
  if (floor.source == FloorSource::repeats)
    bands.noise_shares = noise_shares(prediction_errors(plants[0], set), bands.band_edges_hz);
  const FitOptions states_alone{.iterations = options.iterations, .linearise = false};
  tbb::parallel_for(std::size_t{0}, plants.size(), [&](std::size_t s) {
    StageExamination& stage = out.stages[s];
    stage.fit = fit_plant(plants[s], {}, counted, solver, states_alone);
    stage.ran = stage.fit.error.size() == out.records.size();
    if (!stage.ran) return;
    stage.motion = trajectories(stage.fit, out.records);
    stage.profile = profile(stage.fit, out.records, stage.motion, bands);
    stage.repeats = repeatability(stage.fit, out.records, floor);
    stage.drift = drift(stage.fit, out.records, block);
    stage.lines = line_split(stage.fit, whole);
    stage.tone = tone_of(stage.fit, out.records);
  });
  const auto reconstruct = [&] {
    if (place.empty()) return;
    const std::vector<FitRecord> first = {whole.front()};
    const PlantFit fit = fit_plant(bare, {}, first, solver, states_alone);
    if (fit.error.empty()) return;
    out.unknown = unknown_signal(fit, first, 0, place);
    out.unknown_motion = trajectories(fit, first).front();
    out.unknown_outputs = first.front().y + fit.error.front();
  };
  const auto find_ceiling = [&] {
    if (options.ceiling.empty() || !out.stages[1].ran) return;
    std::vector<Plant> missing = {bare};
    if (to_json(bare) != to_json(plants[1])) missing.push_back(plants[1]);
    out.ceiling = ceiling_at(missing, fitted.empty() ? whole : fitted, whole, options.ceiling, out.stages[1].fit,
                             {*options.map, *options.map_solver, solver}, bands, random);
  };
  const bool asks_beyond = out.held_out && !fitted.empty() && out.stages[1].ran && out.stages[2].ran;
  PlantFit training;
  tbb::parallel_invoke(find_ceiling, reconstruct, [&] {
    if (asks_beyond) training = fit_plant(plants[2], {}, fitted, solver, states_alone);
  });
  const int before = telling_stage(out);
  if (!asks_beyond || before < 0 || training.error.size() != fitted.size()) return out;
  out.beyond_known = true;
  out.beyond = beyond_envelope(out.stages[static_cast<std::size_t>(before)].fit, out.stages[2].fit, out.records,
                               motion_envelope(trajectories(training, fitted), fitted), out.stages[2].motion, block,
                               {options.draws, floor.power_error});
  return out;
}

}  // namespace wheelhop
