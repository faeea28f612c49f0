/// \file
/// Records as grey-box fits read them: the drive at the plant's rate, what is compared, and how it is simulated.
#pragma once

#include "core/data/records.hpp"
#include "core/plant/plant.hpp"
#include "core/plant/simulate.hpp"

namespace wheelhop {

/// Steps of the integrator in a hold interval, at most: a candidate with a stiffer law has a bad parameter.
inline constexpr Index kSubsteps = 4;
/// Where a law with memory yields too fast for those: too long steps leave it bounded, but not its derivatives.
inline constexpr Index kMostSubsteps = 16;
/// Largest change of a reading, relative to its root mean square, when the samples of a drive that is not held are
/// doubled: a judgement, well below the noise of usual sensors (80 dB).
inline constexpr double kDriveAccuracy = 1e-4;
/// Samples at either end of a record that are not compared where the drive is not held, at most a tenth of the record:
/// there the drive between its samples also depends on what came before or after. Half the reach of the windowed sinc
/// in `interpolate`: a judgement.
inline constexpr Index kUnsureEnds = 16;
/// Most samples of such a drive in one sample of a record: a judgement, a bound on the time.
inline constexpr Index kMostDriveRatio = 32;

/// Gives a plant without inputs and its records a drive that does nothing: a force of zero on the first mass, `silent`.
/// Nothing to do for a plant with inputs.
void add_silent_drive(Plant& plant, RecordSet& set);

/// A record made ready for thousands of simulations.
struct FitRecord {
  Matrix drive;                        ///< m x N * ratio, at the plant's hold rate
  Matrix y;                            ///< p x N
  Index ratio = 1;                     ///< hold samples a sample
  Index skip = 0;                      ///< leading samples that are not scored
  Vector weight_std;                   ///< p, what the residual of this record is divided by; > 0
  Vector quantum;                      ///< p, step of the lattice seen in the readings, 0: none; empty: not looked for
  KnownStart start = {};               ///< a fit finds the rest of the initial state
  std::vector<SlowChannel> slow = {};  ///< as of the signal
  bool continues = false;  ///< begins where the record before it in a list ends, as a piece of the same file
  /// Variance that a fit expects of residuals in units of `weight_std`, the same in all records of a fit; 1: noise
  /// alone. Where every model leaves more, priors count by as much more: without it parameters bend around what no
  /// model of the class can do. McCullagh & Nelder, Generalized Linear Models, 1989, section 4.5.
  double dispersion = 1;
};

/// The numbers of [q; v] that a record's start tells, with their values. @param rest [q; v] in equilibrium
/// UserError that names the plant's masses if it tells of another one, or if it gives one that turns in metres, or one
/// that slides in radians.
std::vector<std::pair<Index, double>> known_states(const Plant& plant, const KnownStart& start, const Vector& rest);

/// Where a record begins, as far as it is known.
struct InitialState {
  InitialState() = default;
  InitialState(Vector of_motion) : motion(std::move(of_motion)) {}  // NOLINT: a motion is a state, memories at rest

  Vector motion;  ///< [q; v] of the plant's first masses; empty: at rest in equilibrium
  /// Inner states by their names, so that a plant with other laws beside them finds its own. Laws that are not listed
  /// are at rest, and couplings have stored the first reading.
  std::vector<std::pair<std::string, double>> memories = {};
};

/// Names of the inner states of a plant: `memory_names`, then what the AC coupling of each sensor has stored,
/// "sensor:travel.stored".
std::vector<std::string> inner_state_names(const Plant& plant);
/// The values of a plant's inner states in an initial state, in their order; 0 of those that are not listed.
Vector memories_of(const Plant& plant, const InitialState& state);

/// An initial state for a plant that may have masses beyond those of the state, at the end of its list: each of them
/// starts where and as fast as the mass it hangs on.
/// @return [q; v] of all masses, and [q; v; z] of the laws where the state lists inner states
Vector whole_state(const Plant& plant, const InitialState& state);

/// What the AC coupling of each sensor has stored in an initial state, p, as `apply_sensor_paths` takes it; empty where
/// none is listed.
Vector stored_by_sensors(const Plant& plant, const InitialState& state);

/// How a record is simulated from an initial state.
SimulateOptions run_options(const Plant& plant, const FitRecord& record, const InitialState& initial_state = {});

/// @param weight_std p, the record's noise floor (for a mean of R repeats that of one over sqrt(R))
/// UserError as drive_of_record and hold_samples_per_record_sample.
FitRecord fit_record(const Plant& plant, const Signal& signal, ConstVectorRef weight_std);

/// True if all drives are constant, as in a record of a free decay. @param drive m x N, N >= 1
bool never_moves(ConstMatrixRef drive);

/// The plant with the rate at which drives that are not held are sampled for simulations of these records: a power of
/// two times that of the records, the lowest at which doubling it changes no reading by more than `kDriveAccuracy`, and
/// at most `kMostDriveRatio`. Between the samples of a record drives follow their `interpolation`. A plant that nothing
/// drives, as in a free decay, moves from a displaced state about as much as its records show: its steps need the same
/// accuracy. A plant whose drives are held is returned as it is. Cost: a simulation of the records for each rate that
/// is tried.
Plant with_drive_rate(Plant plant, const RecordSet& set);

/// First sample of a record that a fit counts. The masses that an effect adds, and the lags of drives and sensors,
/// start as if the rig had been at rest although it was moving, and no fit finds their states: an accelerometer may see
/// that in the first samples more than the rest of a small gap. A twentieth of a block of a long record is left out, no
/// more, since the rest has to tell the initial state.
/// @param block samples; of a record of fewer than eight blocks all count
Index fitted_from(const FitRecord& record, Index block);

/// First sample of a record that says how well a plant does: the first block of a long record does not, for the same
/// reason.
/// @param block samples; of a record of fewer than eight blocks all count
Index judged_from(const FitRecord& record, Index block);

}  // namespace wheelhop
