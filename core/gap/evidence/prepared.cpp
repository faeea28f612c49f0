#include "core/gap/evidence/prepared.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/status.hpp"
#include "core/data/metrics.hpp"
#include "core/gap/evidence/closure.hpp"
#include "core/gap/evidence/profile.hpp"

namespace wheelhop {
namespace {

constexpr Index kNoiseBands = 40;  // of GapData::noise_shares
// Judgements: blocks in the longest record, so that its scatter tells an interval; readings for each unknown.
constexpr Index kFewestBlocks = 4;
constexpr Index kReadings = 3;
constexpr double kDecayed = 0.8;  // a judgement: RMS of the second half of a free decay over that of the first, at most

/// True if the readings of some channel are smaller in the second half of a record than in the first.
bool decays(ConstMatrixRef y) {
  const auto motion = [](ConstMatrixRef part) { return rms(part.colwise() - part.rowwise().mean()); };
  const Index half = y.cols() / 2;
  if (half == 0) return false;
  const Vector first = motion(y.leftCols(half)), second = motion(y.rightCols(half));
  return (second.array() < kDecayed * first.array()).any();
}

}  // namespace

GapStage stage_of(const GapData& data, const PlantFit& run) {
  GapStage stage;
  const Index p = run.plant.sensor_count();
  Vector error_power = Vector::Zero(p), power = error_power;
  double squares = 0, count = 0, judged = 0;
  std::vector<double> blocks;
  for (std::size_t i = 0; i < run.error.size(); ++i) {
    const FitRecord& record = data.held_out[i];
    const Index kept = record.y.cols() - judged_from(record, data.block);
    const Matrix error = run.error[i].rightCols(kept);
    error_power += error.rowwise().squaredNorm();
    power += record.y.rightCols(kept).rowwise().squaredNorm();
    const Matrix r = record.weight_std.cwiseInverse().asDiagonal() * error;
    squares += r.squaredNorm();
    count += static_cast<double>(r.size());
    judged += static_cast<double>(kept);
    const Vector own = block_misfits(r, data.block);
    blocks.insert(blocks.end(), own.begin(), own.end());
  }
  stage.blocks = Eigen::Map<Vector>(blocks.data(), static_cast<Index>(blocks.size()));
  stage.misfit = squares / count;
  for (Index i = 0; i < p; ++i) {
    stage.rmse.push_back(std::sqrt(error_power(i) / judged));
    stage.nrmse.push_back(std::sqrt(error_power(i) / power(i)));
  }
  return stage;
}

Index block_samples(const RecordSet& set, double block_s) {
  Index longest = 0;
  for (const Record& record : set.records) longest = std::max(longest, record.signal.samples() - record.signal.skip);
  return std::clamp<Index>(std::llround(block_s * set.sampling_hz), 1, std::max<Index>(longest / kFewestBlocks, 1));
}

GapData gap_data(const Plant& plant, const RecordSet& set, const NoiseFloor& floor, double block_s) {
  GapData data;
  data.block = block_samples(set, block_s);
  bool moved = false;
  for (const Measured& measured : merge_repeats(set)) {
    if (measured.role == "estimation")
      moved = moved || !never_moves(measured.signal.u) ||
              decays(measured.signal.y.rightCols(measured.signal.y.cols() - measured.signal.skip));
    FitRecord record = fit_record(plant, measured.signal, floor.std / std::sqrt(static_cast<double>(measured.repeats)));
    record.quantum = measured.quantum;
    record.start = measured.start;
    record.continues = measured.continues;
    known_states(plant, record.start, Vector::Zero(2 * plant.mass_count()));  // refuses other names than the plant's
    // Its own initial state and the plant's parameters.
    const Index unknown = static_cast<Index>(tolerance_parameters(plant).size()) + 2 * plant.mass_count();
    const Index readings = record.y.rows() * (record.y.cols() - record.skip);
    if (readings < kReadings * unknown)
      throw UserError(
          fmt::format("{}: expected at least {} readings, {} for each parameter and initial state of the "
                      "plant, found {}",
                      measured.name, kReadings * unknown, kReadings, readings));
    record.skip = fitted_from(record, data.block);
    data.samples += static_cast<double>(record.y.rows() * (record.y.cols() - record.skip));
    (measured.role == "validation" ? data.held_out : data.fitted).push_back(std::move(record));
  }
  if (data.fitted.empty()) throw UserError("expected a record with the role \"estimation\"");
  if (!moved)
    throw UserError(
        "the drive is constant in every record of the role \"estimation\", and the readings do not decay: expected a "
        "drive that moves the plant (is its channel the right one?), or a free decay");
  data.apart = !data.held_out.empty();
  std::vector<double> edges_hz;
  for (Index b = 0; b <= kNoiseBands; ++b)
    edges_hz.push_back(0.5 * set.sampling_hz * static_cast<double>(b) / static_cast<double>(kNoiseBands));
  data.noise_shares = noise_shares(prediction_errors(plant, set), edges_hz);
  if (!data.apart) data.held_out = data.fitted;
  return data;
}

void leave_out_end(std::vector<FitRecord>& records, Index block, double skew) {
  if (!(skew > 0)) return;
  for (FitRecord& record : records) {
    const auto last = static_cast<Index>(static_cast<double>(record.y.cols()) / (1 + skew)) - kUnsureEnds;
    const Index kept = std::min(std::max(last, record.skip + kFewestBlocks * block), record.y.cols());
    record.y.conservativeResize(Eigen::NoChange, kept);
  }
}

void leave_out_end(GapData& data, double skew) {
  if (!(skew > 0)) return;
  leave_out_end(data.fitted, data.block, skew);
  leave_out_end(data.held_out, data.block, skew);
  data.samples = 0;
  for (const auto* records : {&data.fitted, &data.held_out})
    for (const FitRecord& record : *records)
      if (data.apart || records == &data.fitted)
        data.samples += static_cast<double>(record.y.rows() * (record.y.cols() - record.skip));
}

double dispersion_of(const GapData& data, const PlantFit& fitted, const PlantFit& held_out) {
  double squares = 0, count = 0, colour = 1;
  const auto add = [&](const std::vector<FitRecord>& records, const PlantFit& fit) {
    for (std::size_t i = 0; i < fit.error.size(); ++i) {
      const Index kept = records[i].y.cols() - records[i].skip;
      const Matrix r = records[i].weight_std.cwiseInverse().asDiagonal() * fit.error[i].rightCols(kept);
      squares += r.squaredNorm();
      count += static_cast<double>(r.size());
      colour = std::max(colour, colour_of(r));
    }
  };
  add(data.fitted, fitted);
  if (data.apart) add(data.held_out, held_out);
  return 1 + std::max(squares / count - 1, 0.0) * colour;
}

void disperse(GapData& data, double dispersion) {
  for (auto* records : {&data.fitted, &data.held_out})
    for (FitRecord& record : *records) record.dispersion = dispersion;
}

}  // namespace wheelhop
