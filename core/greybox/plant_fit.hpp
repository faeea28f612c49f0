/// \file
/// Grey-box fits: parameters of a plant and the initial states of its records by the free run's error, under priors.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "core/greybox/fit_record.hpp"
#include "core/optimise/solver.hpp"

namespace wheelhop {

/// Standard deviations of its prior that a parameter may move.
inline constexpr double kFarthest = 15;
/// Prior of an initial state around rest, in RMS values of the states under the drive.
inline constexpr double kStateSpread = 3;
/// The same of an initial state that a record's `start` tells, around what it tells: a judgement, within which the fit
/// counts it as known.
inline constexpr double kKnownSpread = 1e-3;
/// Tolerances from which a parameter has stopped there.
inline constexpr double kAtEnd = 0.99 * kFarthest;

/// A parameter of the plant that a fit moves: value = start + theta * scale.
struct FitParameter {
  std::string name;      ///< of plant_parameters()
  double scale = 1;      ///< > 0, in the unit of the parameter
  double prior_std = 0;  ///< of theta around zero, which stays within kFarthest of it; 0: none
  double least = -std::numeric_limits<double>::infinity();  ///< value below which a fit does not go
  bool lowered = false;  ///< `least` is where a first fit ends; one that rests there goes on with a lower one
};

/// Every mass and every law parameter with its tolerance as prior: scale = tolerance |value|, prior_std 1, so that
/// theta is the deviation in tolerances. Parameters of value zero have no tolerance and are left out, and so is what
/// follows another one.
std::vector<FitParameter> tolerance_parameters(const Plant& plant);

/// r = (yhat_k - y_k) ./ weight_std over all records, readings not rounded (rounding has no derivative). theta: the
/// parameters in units of their scale, then the initial state of each record: [q; v] in units of `state_scale`, then
/// the inner states of the plant in units of `memory_scale`. Derivatives by `Tangent`, beside one simulation of
/// every record; an initial state is followed in its own record alone, and one of the motion or a law as far as the
/// plant's slowest mode remembers it. Records run side by side. Outside the domain: a simulation that fails, a mass
/// that is not positive, a parameter outside its range, or one with a tolerance across zero.
/// @param plant the start   @param state_scale 2n, > 0   @param memory_scale s, > 0, or empty: inner states start at
/// rest
std::unique_ptr<ResidualProblem> plant_problem(const Plant& plant, const std::vector<FitParameter>& parameters,
                                               const std::vector<FitRecord>& records, ConstVectorRef state_scale,
                                               const Vector& memory_scale = {});

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
                    const std::vector<InitialState>& initial_states, Vector& residual);

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
  Vector memory_scale;                 ///< s, of `typical_inner_states`
  std::vector<InitialState> initial_states;  ///< one a record
  /// By how far theta, and of each record its initial state, lie from the means of their priors, in their scales.
  Vector deviation;
  std::vector<Matrix> error;  ///< yhat - y a record, p x N, in the units of the outputs; empty if a run failed
  double misfit = 0;          ///< mean of r^2 over the scored samples: 1 at the floor
  Matrix visited;             ///< (N + m) x K, some states of the plant and inputs that the records led it to
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
/// states, the latter, memories included, with a prior of three RMS values around rest, and of a thousandth around what
/// a record's start tells; in a record whose drive never moves, of three times
/// the linear estimate of its initial state. Without `from` these start from rest in equilibrium and are fitted first
/// and alone. Status in `solution`: as the solver; outside_domain if the start plant cannot follow the drive at all,
/// `error` is empty then.
PlantFit fit_plant(const Plant& plant, const std::vector<FitParameter>& parameters,
                   const std::vector<FitRecord>& records, const Solver& solver, const FitOptions& options);

/// Adds Jacobian and covariance to a fit made without. False if a simulation failed.
bool linearise(PlantFit& fit, const std::vector<FitParameter>& parameters, const std::vector<FitRecord>& records);

}  // namespace wheelhop
