/// \file
/// What lies between a command and the plant, and between the plant and a record: drive paths and sensor paths. All of
/// it is optional in a plant file, as keys of the inputs and sensors; absent keys are ideal.
///
/// Input: `"gain": 1, "offset": 0, "delay_s": 0, "lag": {...}, "rate_limit": none, "saturation": none,
/// "saturation_sharpness": none`;
///   the plant feels saturate(limit(lag(gain u(t (1 + clock_skew) - delay_s) + offset))), offset, rate limit and
///   saturation in the input's unit (the limit per second). A saturation L of sharpness n is u / (1 + |u / L|^n)^(1/n):
///   soft near the end of stroke, and the hard limit for n without bound.
///   `"sampling_phase": 0` in [0, 1]: at a sampling instant the plant still feels the drive this share of a hold
///   interval earlier. A delay or lag behind the hold does that, since the step of the drive then falls between two
///   samples, and so do converters that are not in step; accelerometers on what the drive moves see it at once.
/// Sensor: `"gain": 1, "crosstalk": {CHANNEL: factor}, "delay_s": 0, "lag": {...}, "high_pass_hz": 0, "bias": 0,
/// "drift_per_s": 0, "drift_settling_per_s": 0, "rate_limit": none, "saturation": none, "saturation_sharpness": none,
/// "quantum": 0`;
///   the record holds round(clip(limit(high_pass(lag(z(t - delay_s))) + bias + drift_per_s (1 - exp(-k t)) / k))),
///   z = gain y + sum factor y_CHANNEL, t from the record's first sample, k the settling rate: a warm-up of time
///   constant 1 / k, and drift_per_s t for k = 0. The high-pass is that of AC coupling, s / (s + 2 pi high_pass_hz), at
///   rest at the first sample unless a fit finds what it had stored; bias and drift enter behind it. Before the first
///   sample the reading was that of the first sample. The rate limit [unit/s] is that of an amplifier, and bounds what
///   it reads between the samples of a record too; the saturation L [unit] is the end of the measuring range: a reading
///   beyond it is L or -L. Noise enters a measurement before the end of the range and the rounding, which both belong
///   to the converter.
/// `lag`: `{"time_constant_s": tau}` is 1 / (1 + tau s); `{"cutoff_hz": f, "damping_ratio": 0.7}` is
///   w^2 / (s^2 + 2 zeta w s + w^2), w = 2 pi f.
/// Plant: `"clock_skew": e`, the drive's clock runs 1 + e times as fast as that of the record.
#pragma once

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/base/json.hpp"

namespace wheelhop {

struct Lag {
  double time_constant_s = 0;                                  ///< 0: none
  double cutoff_hz = std::numeric_limits<double>::infinity();  ///< infinite: none
  double damping_ratio = 0.7;
  bool operator==(const Lag&) const = default;
};

struct DrivePath {
  double gain = 1;
  double offset = 0;
  double delay_s = 0;
  Lag lag = {};
  double rate_limit = std::numeric_limits<double>::infinity();
  double saturation = std::numeric_limits<double>::infinity();
  double saturation_sharpness = std::numeric_limits<double>::infinity();
  double sampling_phase = 0;
  bool operator==(const DrivePath&) const = default;
};

/// Least corner of AC coupling: a judgement, a time constant of two days, in which no record sees anything. A fit ends
/// there, so that the coupling and what it had stored stay in the plant; a file may say 0, which is none.
inline constexpr double slowest_coupling_hz = 1e-6;

struct SensorPath {
  double gain = 1;
  double bias = 0;
  double drift_per_s = 0;
  double drift_settling_per_s = 0;
  double delay_s = 0;
  double high_pass_hz = 0;  ///< corner of AC coupling; 0: none
  double quantum = 0;       ///< step of the converter; 0: none
  Lag lag = {};
  double rate_limit = std::numeric_limits<double>::infinity();  ///< of the amplifier, unit/s; infinite: none
  double saturation = std::numeric_limits<double>::infinity();  ///< end of the measuring range; infinite: none
  double saturation_sharpness = std::numeric_limits<double>::infinity();  ///< of that end, as a drive's
  std::vector<std::pair<std::string, double>> crosstalk = {};  ///< by channel: what of its ideal reading is added
};

/// Calls visit(key, unit, value, ideal, range) for every number of a lag or path, but not for crosstalk. `unit` is
/// that of the channel.
template <class AnyLag, class Visit>
void visit_lag(AnyLag& lag, Visit visit) {
  visit("lag.time_constant_s", "s", lag.time_constant_s, Lag{}.time_constant_s, Range{.low = 1e-7});
  visit("lag.cutoff_hz", "Hz", lag.cutoff_hz, Lag{}.cutoff_hz, Range{.low = 1e-3});
  visit("lag.damping_ratio", "-", lag.damping_ratio, Lag{}.damping_ratio, Range{.low = 0.05, .high = 20});
}
template <class AnyPath, class Visit>
void visit_drive_path(AnyPath& path, const std::string& unit, Visit visit) {
  const DrivePath ideal;
  visit("gain", "-", path.gain, ideal.gain, Range{});
  visit("offset", unit, path.offset, ideal.offset, Range{});
  visit("delay_s", "s", path.delay_s, ideal.delay_s, Range{.low = -10, .high = 10});
  visit_lag(path.lag, visit);
  visit("rate_limit", unit + "/s", path.rate_limit, ideal.rate_limit, Range{.low = 1e-12});
  visit("saturation", unit, path.saturation, ideal.saturation, Range{.low = 1e-12});
  visit("saturation_sharpness", "-", path.saturation_sharpness, ideal.saturation_sharpness, Range{.low = 1});
  visit("sampling_phase", "-", path.sampling_phase, ideal.sampling_phase, Range{.low = 0, .high = 1});
}
template <class AnyPath, class Visit>
void visit_sensor_path(AnyPath& path, const std::string& unit, Visit visit) {
  const SensorPath ideal;
  visit("gain", "-", path.gain, ideal.gain, Range{});
  visit("bias", unit, path.bias, ideal.bias, Range{});
  visit("drift_per_s", unit + "/s", path.drift_per_s, ideal.drift_per_s, Range{});
  visit("drift_settling_per_s", "1/s", path.drift_settling_per_s, ideal.drift_settling_per_s, Range{.low = 0});
  visit("delay_s", "s", path.delay_s, ideal.delay_s, Range{.low = -10, .high = 10});
  visit_lag(path.lag, visit);
  visit("high_pass_hz", "Hz", path.high_pass_hz, ideal.high_pass_hz, Range{.low = slowest_coupling_hz});
  visit("rate_limit", unit + "/s", path.rate_limit, ideal.rate_limit, Range{.low = 1e-12});
  visit("saturation", unit, path.saturation, ideal.saturation, Range{.low = 1e-12});
  visit("saturation_sharpness", "-", path.saturation_sharpness, ideal.saturation_sharpness, Range{.low = 1});
  visit("quantum", unit, path.quantum, ideal.quantum, Range{.low = 0});
}

struct Plant;

/// Reads the keys of a path that stand in the object of an input or sensor; `cursor.done()` is the caller's. UserError
/// on a number outside its range, and on a lag of both kinds or of none. Channels of a crosstalk are checked by
/// `check_crosstalk`, once all sensors are known.
DrivePath parse_drive_path(const JsonCursor& cursor);
SensorPath parse_sensor_path(const JsonCursor& cursor);
void check_crosstalk(const JsonCursor& sensors, const Plant& plant);
/// Adds the keys that differ from the ideal.
void write_path(Json& out, const DrivePath& path);
void write_path(Json& out, const SensorPath& path);

/// The drive as the plant feels it. @param drive m x N commands at the plant's hold rate. @param first_sample column
/// at which the record's time starts, for the clock skew. Before and behind the record the command is held.
/// A fractional delay is a windowed sinc of 16 samples either side (Blackman-Harris): exact for whole samples, within
/// 1e-4 of the amplitude below 0.37 of the hold rate. Lags start at rest at their first value and follow the command
/// between its samples to fourth order in frequency over hold rate.
Matrix apply_drive_paths(const Plant& plant, ConstMatrixRef drive, Index first_sample);
/// True if two plants of the same inputs feel the same of every drive.
bool same_drive_paths(const Plant& a, const Plant& b);
/// What the plant feels at the sampling instants, where that differs from what it feels over the interval behind them:
/// m x N, or empty. @param felt of apply_drive_paths
Matrix drive_at_samples(const Plant& plant, ConstMatrixRef felt);

/// Samples of a drive, at the hold rate, on which the first `count` that the plant feels depend: a clock that runs fast
/// reads further on, and a delay interpolates.
Index drive_samples_read(const Plant& plant, Index count);

/// Readings as a record holds them. @param ideal p x N at `rate_hz`, the first column at the record's first sample.
/// @param stored p, in the units of the sensors: what the AC coupling of each subtracts at that sample, as it has
/// stored it before; it is forgotten with exp(-2 pi high_pass_hz t). Not a number, or empty: the reading itself, as at
/// rest.
Matrix apply_sensor_paths(const Plant& plant, ConstMatrixRef ideal, double rate_hz, const Vector& stored = {});
/// What the converters make of readings, the end of the range and the rounding alone, and the plant without these:
/// noise enters a measurement before its converter.
/// @param readings p x N, in place
void convert_readings(const Plant& plant, Matrix& readings);
Plant unconverted(Plant plant);
/// The plant whose converters do not round: a lattice has no slope.
Plant unquantised(Plant plant);
/// True if a sensor delays, filters or limits its rate, so that its readings are needed at the hold rate. AC coupling
/// alone is slow against any sampling.
bool any_sensor_lags(const Plant& plant);

/// u(t_k (1 + skew) - delay) on the grid of u, t = 0 at column `first_sample`; delay in samples.
Vector resample_on_grid(ConstVectorRef u, double delay_samples, double skew, Index first_sample);
/// The samples of a filtered signal. @param rate_hz of u
Vector apply_lag(const Lag& lag, ConstVectorRef u, double rate_hz);

}  // namespace wheelhop
