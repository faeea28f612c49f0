#include "core/greybox/fit_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/data/metrics.hpp"
#include "core/data/resample.hpp"
#include "core/plant/dataset.hpp"
#include "core/plant/rotary.hpp"

namespace wheelhop {
namespace {

constexpr Index kLong = 8;    // blocks
constexpr Index kStart = 20;  // of a block
// The size of an undriven motion is sought from here [m or rad], in so many simulations. Judgements; they steer no more
// than the rate at which the integrator's error is looked at.
constexpr double kFirstSize = 1e-3;
constexpr int kSizeRuns = 5;

std::string stored_name(const Sensor& sensor) { return to_string(sensor_place(sensor.name)) + ".stored"; }

/// Samples at either end of a record that are not compared, see `kUnsureEnds`.
Index unsure_ends(const Plant& plant, Index samples) {
  const bool silent = std::all_of(plant.inputs.begin(), plant.inputs.end(), [](const auto& own) { return own.silent; });
  return plant.held() || silent ? 0 : std::min(kUnsureEnds, samples / 10);
}

/// Of each sensor, about its mean.
Vector deviation(ConstMatrixRef y) {
  return (y.colwise() - y.rowwise().mean()).rowwise().norm() / std::sqrt(static_cast<double>(y.cols()));
}

/// A state from which an undriven plant moves about as much as a record shows: the masses stand to either side of rest
/// in turn, so that every mode takes part. None for a driven record, whose drive says how much the plant moves, and
/// where no size is found that the plant's laws allow. Cost: `kSizeRuns` + 1 simulations of the record.
std::optional<InitialState> undriven_start(const Plant& plant, const FitRecord& record) {
  if (record.y.size() == 0 || !never_moves(record.drive)) return {};
  const Simulation still = simulate_measured(plant, record.drive, run_options(plant, record));
  if (still.status != Status::ok) return {};
  const Index n = plant.mass_count();
  const Vector rest = still.states.col(0).head(2 * n), wanted = deviation(record.y);
  Vector direction = Vector::Zero(2 * n);
  for (Index i = 0; i < n; ++i) direction(i) = i % 2 == 0 ? 1 : -1;
  std::optional<InitialState> found;
  double size = kFirstSize;
  for (int run = 0; run < kSizeRuns; ++run) {
    const InitialState start(Vector(rest + size * direction));
    const Simulation moved = simulate_measured(plant, record.drive, run_options(plant, record, start));
    if (moved.status != Status::ok) {
      size /= 4;
      continue;
    }
    found = start;
    // The geometric mean over the sensors, which may have different units.
    const Vector ratio = wanted.cwiseQuotient(deviation(moved.outputs));
    double sum = 0, count = 0;
    for (const double one : ratio)
      if (one > 0 && std::isfinite(one)) sum += std::log(one), ++count;
    if (count > 0) size *= std::exp(sum / count);
  }
  return found;
}

}  // namespace

bool never_moves(ConstMatrixRef drive) { return (drive.colwise() - drive.col(0)).isZero(0); }

std::vector<std::pair<Index, double>> known_states(const Plant& plant, const KnownStart& start, const Vector& rest) {
  std::vector<std::pair<Index, double>> list;
  const Index n = rest.size() / 2;
  if (start.rest)
    for (Index i = 0; i < 2 * n; ++i) list.emplace_back(i, rest(i));
  using Kind = KnownStart::Kind;
  KnownStart::fields(start, [&](const char* key, Kind kind, KnownStart::Order order,
                                const std::map<std::string, double>& values) {
    for (const auto& [name, value] : values) {
      const auto own = std::find_if(plant.masses.begin(), plant.masses.end(),
                                    [&, &wanted = name](const Mass& mass) { return mass.name == wanted; });
      if (own == plant.masses.end()) {
        std::vector<std::string> known;
        for (const Mass& mass : plant.masses) known.push_back(mass.name);
        throw UserError("start of a record: expected a mass of the plant (" + join_names(known) + "), found \"" + name +
                        "\"");
      }
      if (is_rotary(plant, name) != (kind == Kind::turning))
        throw UserError(fmt::format("start of a record: \"{}\" {}, but {} is given", name,
                                    kind == Kind::turning ? "slides: expected displacement_m or velocity_m_per_s"
                                                          : "turns: expected angle_rad or angular_velocity_rad_per_s",
                                    key));
      const Index number = own - plant.masses.begin();
      if (number < n) list.emplace_back(order == KnownStart::Order::rate ? n + number : number, value);
    }
  });
  return list;
}

std::vector<std::string> inner_state_names(const Plant& plant) {
  std::vector<std::string> names = memory_names(plant);
  for (const Sensor& sensor : plant.sensors)
    if (sensor.path.high_pass_hz > 0) names.push_back(stored_name(sensor));
  return names;
}

Vector memories_of(const Plant& plant, const InitialState& state) {
  const std::vector<std::string> names = inner_state_names(plant);
  Vector values = Vector::Zero(static_cast<Index>(names.size()));
  for (const auto& [name, value] : state.memories)
    if (const auto own = std::find(names.begin(), names.end(), name); own != names.end())
      values(own - names.begin()) = value;
  return values;
}

Vector whole_state(const Plant& plant, const InitialState& state) {
  const Index known = state.motion.size() / 2, n = plant.mass_count();
  Vector memories;  // of the laws
  if (!state.memories.empty())
    memories = memories_of(plant, state).head(static_cast<Index>(memory_names(plant).size()));
  Vector whole = Vector::Zero(2 * n + memories.size());
  whole.head(known) = state.motion.head(known);
  whole.segment(n, known) = state.motion.tail(known);
  whole.tail(memories.size()) = memories;
  for (Index i = known; i < n; ++i) {
    const std::string& name = plant.masses[static_cast<std::size_t>(i)].name;
    for (const Element& element : plant.elements) {
      if (element.from != name && element.to != name) continue;
      const Index host = plant.node(element.from == name ? element.to : element.from);
      if (host >= i) continue;  // a drive, the ground, or a mass that is placed later
      whole(i) = whole(host);
      whole(n + i) = whole(n + host);
      break;
    }
  }
  return whole;
}

Vector stored_by_sensors(const Plant& plant, const InitialState& state) {
  Vector stored;
  for (Index i = 0; i < plant.sensor_count(); ++i) {
    const Sensor& sensor = plant.sensors[static_cast<std::size_t>(i)];
    if (!(sensor.path.high_pass_hz > 0)) continue;
    const std::string name = stored_name(sensor);
    const auto own = std::find_if(state.memories.begin(), state.memories.end(),
                                  [&](const auto& memory) { return memory.first == name; });
    if (own == state.memories.end()) continue;
    if (stored.size() == 0) stored = Vector::Constant(plant.sensor_count(), std::numeric_limits<double>::quiet_NaN());
    stored(i) = own->second;
  }
  return stored;
}

SimulateOptions run_options(const Plant& plant, const FitRecord& record, const InitialState& initial_state) {
  SimulateOptions options = sparing_steps(plant, kSubsteps, kMostSubsteps);
  options.decimation = record.ratio;
  options.from_equilibrium = options.or_at_zero = initial_state.motion.size() == 0;
  if (initial_state.motion.size() > 0) options.initial_state = whole_state(plant, initial_state);
  options.stored = stored_by_sensors(plant, initial_state);
  return options;
}

FitRecord fit_record(const Plant& plant, const Signal& signal, ConstVectorRef weight_std) {
  FitRecord record;
  const double sampling_hz = 1 / signal.sample_time_s;
  record.ratio = hold_samples_per_record_sample(plant, sampling_hz);
  const Matrix u = drive_of_record(plant, signal);
  record.drive.resize(u.rows(), u.cols() * record.ratio);
  for (Index i = 0; i < u.rows(); ++i)
    record.drive.row(i) = interpolate(u.row(i), record.ratio,
                                      interpolation_from(plant.inputs[static_cast<std::size_t>(i)].interpolation));
  record.y = signal.y;
  record.skip = signal.skip;
  if (const Index unsure = unsure_ends(plant, signal.y.cols()); unsure > 0) {
    record.y.conservativeResize(Eigen::NoChange, signal.y.cols() - unsure);
    record.skip = std::min(std::max(signal.skip, unsure), record.y.cols() - 1);
  }
  record.weight_std = weight_std;
  record.slow = signal.slow;
  return record;
}

void add_silent_drive(Plant& plant, RecordSet& set) {
  if (!plant.inputs.empty() || plant.masses.empty()) return;
  PlantInput silent;
  silent.name = "none";
  silent.kind = InputKind::force;
  silent.unit = turns(plant, plant.masses.front().name) ? "N m" : "N";
  silent.from = "ground";
  silent.to = plant.masses.front().name;
  silent.held = false;
  silent.silent = true;
  plant.inputs = {silent};
  for (Record& record : set.records) {
    record.signal.inputs = {{silent.name, silent.unit}};
    record.signal.u = Matrix::Zero(1, record.signal.y.cols());
  }
}

Plant with_drive_rate(Plant plant, const RecordSet& set) {
  if (plant.held() || set.records.empty()) return plant;
  const auto sample_at = [&](Index ratio) {
    for (PlantInput& input : plant.inputs) input.hold_hz = static_cast<double>(ratio) * set.sampling_hz;
  };
  const auto read = [&](const Record& record) {
    return fit_record(plant, record.signal, Vector::Ones(plant.sensor_count()));
  };
  sample_at(1);
  std::vector<InitialState> starts;
  for (const Record& record : set.records)
    starts.push_back(undriven_start(plant, read(record)).value_or(InitialState()));
  const auto readings_at = [&](Index ratio, std::vector<Matrix>& readings) {
    readings.clear();
    sample_at(ratio);
    for (std::size_t i = 0; i < set.records.size(); ++i) {
      const Record& record = set.records[i];
      const FitRecord drive = read(record);
      const Simulation run = simulate_measured(plant, drive.drive, run_options(plant, drive, starts[i]));
      if (run.status != Status::ok) return false;
      // The records of a plan hold no readings: their inputs tell how long they are.
      const Index samples = record.signal.u.cols(), unsure = unsure_ends(plant, samples);
      readings.push_back(run.outputs.middleCols(unsure, samples - 2 * unsure));
    }
    return true;
  };
  std::vector<Matrix> coarse, fine;
  bool before = readings_at(1, coarse);
  Index ratio = 1;
  for (; ratio < kMostDriveRatio; ratio *= 2) {
    const bool ran = readings_at(2 * ratio, fine);
    if (before && ran) {
      Vector change = Vector::Zero(plant.sensor_count()), size = change;
      for (std::size_t i = 0; i < fine.size(); ++i) {
        change += (fine[i] - coarse[i]).rowwise().squaredNorm();
        size += fine[i].rowwise().squaredNorm();
      }
      if ((change.array() <= kDriveAccuracy * kDriveAccuracy * size.array()).all()) break;
    }
    before = ran;
    coarse.swap(fine);
  }
  sample_at(ratio);
  return plant;
}

Index fitted_from(const FitRecord& record, Index block) {
  return record.y.cols() >= record.skip + kLong * block ? record.skip + block / kStart : record.skip;
}

Index judged_from(const FitRecord& record, Index block) {
  return record.y.cols() >= record.skip + kLong * block ? record.skip + block : record.skip;
}

}  // namespace wheelhop
