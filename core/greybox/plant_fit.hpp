/// \file
/// Grey-box fits: parameters of a plant and the initial states of its records by the free run's error, under priors.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "core/data/records.hpp"
#include "core/optimise/solver.hpp"
#include "core/plant/plant.hpp"
#include "core/plant/simulate.hpp"

namespace wheelhop {

/// Standard deviations of its prior that a parameter may move.
inline constexpr double kFarthest = 15;
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
/// Prior of an initial state around rest, in RMS values of the states under the drive.
inline constexpr double kStateSpread = 3;
/// Tolerances from which a parameter has stopped there.
inline constexpr double kAtEnd = 0.99 * kFarthest;

/// A parameter of the plant that a fit moves: value = start + theta * scale.
struct FitParameter {
  std::string name;      ///< of plant_parameters()
  double scale = 1;      ///< > 0, in the unit of the parameter
  double prior_std = 0;  ///< of theta around zero, which stays within kFarthest of it; 0: none
  double least = -std::numeric_limits<double>::infinity();  ///< value below which a fit does not go
};

/// Every mass and every law parameter with its tolerance as prior: scale = tolerance |value|, prior_std 1, so that
/// theta is the deviation in tolerances. Parameters of value zero have no tolerance and are left out.
std::vector<FitParameter> tolerance_parameters(const Plant& plant);

/// A record made ready for thousands of simulations.
struct FitRecord {
  Matrix drive;       ///< m x N * ratio, at the plant's hold rate
  Matrix y;           ///< p x N
  Index ratio = 1;    ///< hold samples a sample
  Index skip = 0;     ///< leading samples that are not scored
  Vector weight_std;  ///< p, what the residual of this record is divided by; > 0
  Vector quantum;     ///< p, step of the lattice seen in the readings, 0: none; empty: not looked for
  /// Variance that a fit expects of residuals in units of `weight_std`, the same in all records of a fit; 1: noise
  /// alone. Where every model leaves more, priors count by as much more: without it parameters bend around what no
  /// model of the class can do. McCullagh & Nelder, Generalized Linear Models, 1989, section 4.5.
  double dispersion = 1;
};

/// An initial state for a plant that may have masses beyond those of the state, at the end of its list: each of them
/// starts where and as fast as the mass it hangs on. @param state [q; v] of the first masses @return [q; v] of all
Vector whole_state(const Plant& plant, const Vector& state);

/// How a record is simulated, of which the first 2n numbers of the state are known; from rest in equilibrium where they
/// are not.
SimulateOptions run_options(const Plant& plant, const FitRecord& record, const Vector& initial_state = {});

/// @param weight_std p, the record's noise floor (for a mean of R repeats that of one over sqrt(R))
/// UserError as drive_of_record and hold_samples_per_record_sample.
FitRecord fit_record(const Plant& plant, const Signal& signal, ConstVectorRef weight_std);

/// True if all drives are constant, as in a record of a free decay. @param drive m x N, N >= 1
bool never_moves(ConstMatrixRef drive);

/// The plant with the rate at which drives that are not held are sampled for simulations of these records: a power of
/// two times that of the records, the lowest at which doubling it changes no reading by more than `kDriveAccuracy`, and
/// at most `kMostDriveRatio`. Between the samples of a record drives follow their `interpolation`. A plant whose drives
/// are held is returned as it is. Cost: a simulation of the records for each rate that is tried.
Plant with_drive_rate(Plant plant, const RecordSet& set);

/// First sample of a record that a fit counts. Memories of laws start at rest where the record does although the rig
/// was moving, and an accelerometer sees it: a damper without its memory costs the first sample more than the rest of a
/// small gap. A twentieth of a block of a long record is left out, no more, since the rest has to tell the initial
/// state.
/// @param block samples; of a record of fewer than eight blocks all count
Index fitted_from(const FitRecord& record, Index block);

/// First sample of a record that says how well a plant does: the first block of a long record does not. Memories of
/// laws and the masses of an effect start at rest there although the rig was moving, and no fit finds their states.
/// @param block samples; of a record of fewer than eight blocks all count
Index judged_from(const FitRecord& record, Index block);

/// r = (yhat_k - y_k) ./ weight_std over all records, readings not rounded (rounding has no derivative). theta: the
/// parameters in units of their scale, then the initial state [q; v] of each record in units of `state_scale`.
/// Derivatives by `Tangent`, beside one simulation of every record; an initial state is followed in its own record
/// alone, and as far as the plant's slowest mode remembers it. Records run side by side. Outside the domain: a
/// simulation that fails, a mass that is not positive, a parameter outside its range, or one with a tolerance across
/// zero.
/// @param plant the start   @param state_scale 2n, > 0
std::unique_ptr<ResidualProblem> plant_problem(const Plant& plant, const std::vector<FitParameter>& parameters,
                                               const std::vector<FitRecord>& records, ConstVectorRef state_scale);

/// Takes a column of a Jacobian: its number, and its values p x scored samples.
using PutColumn = std::function<void(Index column, const Matrix& values)>;

/// Residuals of plant_problem for one record, at the plant itself, and the columns of their Jacobian one after the
/// other, parameters first, for who need not keep all of them. A column may come a second time, which counts.
/// False where a simulation fails.
bool record_derivatives(const Plant& plant, const std::vector<FitParameter>& parameters, const FitRecord& record,
                        ConstVectorRef state_scale, ConstVectorRef initial_state, Vector& residual,
                        const PutColumn& put);

/// The residuals of plant_problem for a plant and given initial states. False where a simulation fails.
bool plant_residual(const Plant& plant, const std::vector<FitRecord>& records,
                    const std::vector<Vector>& initial_states, Vector& residual);

struct PlantFit {
  Solution solution;                   ///< cost includes the priors'
  Plant plant;                         ///< with the fitted parameters
  Vector theta;                        ///< of the parameters, in scales
  Vector residual;                     ///< r of plant_problem at the solution, without the priors'
  Vector precision;                    ///< of the priors times the dispersion, one a column of the Jacobian
  double dispersion = 1;               ///< of the records
  Matrix jacobian;                     ///< derivatives of r: of parameters, then of the own initial state of a record,
                                       ///< stored as `layout` says. Of a linearised fit
  BlockAngular layout;                 ///< columns are the parameters, then the initial states of each record. Likewise
  Matrix covariance;                   ///< of theta: dispersion (J'J + precision)^-1, initial states marginalised.
                                       ///< Likewise
  Vector state_scale, states_at_rest;  ///< 2n, and 2n a record in these: RMS under the drive, and rest in equilibrium
  std::vector<Vector> initial_states;  ///< 2n a record
  std::vector<Matrix> error;           ///< yhat - y a record, p x N, in the units of the outputs; empty if a run failed
  double misfit = 0;                   ///< mean of r^2 over the scored samples: 1 at the floor
  Matrix visited;                      ///< (N + m) x K, some states of the plant and inputs that the records led it to
};

struct FitOptions {
  Index iterations = 12;
  /// A fit of the same records whose parameters are the first of this one's: its initial states are what this fit
  /// starts from, and its Jacobian if it is linearised, so that a first step costs one simulation a new parameter.
  const PlantFit* from = nullptr;
  bool linearise = true;  ///< Jacobian and covariance at the solution
  Vector theta = {};      ///< start of the parameters, in scales; empty: zero
  bool alone = false;     ///< no other fit runs beside this one: it takes all threads for its own Jacobians
};

/// Minimises sum r^2 + dispersion (sum (theta / prior_std)^2 + that of the initial states) over parameters and initial
/// states, the latter with a prior of three RMS values around rest; in a record whose drive never moves, of three times
/// the linear estimate of its initial state. Without `from` these start from rest in equilibrium and are fitted first
/// and alone. Status in `solution`: as the solver; outside_domain if the start plant cannot follow the drive at all,
/// `error` is empty then.
PlantFit fit_plant(const Plant& plant, const std::vector<FitParameter>& parameters,
                   const std::vector<FitRecord>& records, const Solver& solver, const FitOptions& options);

/// Adds Jacobian and covariance to a fit made without. False if a simulation failed.
bool linearise(PlantFit& fit, const std::vector<FitParameter>& parameters, const std::vector<FitRecord>& records);

}  // namespace wheelhop
