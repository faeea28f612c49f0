/// \file
/// What the outputs of a plant tell under given drives, before anything is measured: how they move, in units of the
/// noise, with every parameter, initial state and effect, and what is left of an effect once parameters have followed.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/gap/which/effect.hpp"

namespace wheelhop {

/// What is put behind a plant's own inputs and sensors.
struct Added {
  std::vector<PlantInput> inputs = {};
  std::vector<Sensor> sensors = {};
};
Plant extended(Plant plant, const Added& added);

/// Columns [tolerance parameters, initial states of each record, effects at typical size].
struct Responses {
  Status status = Status::ok;
  std::string message;
  Vector precision;       ///< of the priors, one a parameter and initial state
  Index parameters = 0;   ///< how many of the columns are tolerance parameters
  std::vector<char> ran;  ///< a candidate; 0 where it leaves its domain under the drive
  Index samples = 0;      ///< scored, a sensor
};

/// Indices of two candidates, the larger one first.
using CandidatePair = std::array<std::uint32_t, 2>;

/// Products of the columns over the scored samples, in noise units: of one sensor, or summed over some. Of candidates
/// among themselves only those asked for, since all of them for every sensor would grow with the cube of the plant.
struct Products {
  Matrix tangents;  ///< J'[J, C], tangents x (tangents + candidates): J parameters and initial states, C candidates
  Vector squares;   ///< c_i'c_i of each candidate
  Vector pairs;     ///< c_a'c_b of the pairs asked for, in their order

  /// Adds `factor` times those of other sensors: of the same columns and the same pairs.
  void add(const Products& other, double factor = 1);
};

/// What is asked of the responses of a plant.
struct ResponseRequest {
  Index first_sensor = 0;                 ///< the sensors before it are not read
  std::vector<CandidatePair> pairs = {};  ///< of which the products are wanted
  double bytes = 1e9;                     ///< that columns and products may take; never changes a result
};

/// Takes the products of one sensor.
using SensorProducts = std::function<void(const Responses& known, Index sensor, const Products& products)>;

/// Free run of the plant from equilibrium: y of the records is filled.
/// @param state_rms 2n, how far each state moves; kept above zero   @param start 2n a record
/// Status as `simulate`; the message names the law and the time.
Status nominal_outputs(const Plant& plant, std::vector<FitRecord>& records, Vector& state_rms,
                       std::vector<Vector>& start, std::string& message);

/// The plant itself is the truth: the residual of fit problems is zero, their Jacobian and the change that each
/// candidate makes are what the drives can show. `take` is called for every sensor in its order.
/// @param added to the plant and to the plants of all candidates
/// @param records drives and `weight_std` (p, noise of the mean of the repeats); y is not read
/// Status: outside_domain if the plant itself cannot follow the drives; `take` is not called then. Cost: one simulation
/// of every record for each parameter, initial state and candidate, shared out over the threads, and all of that again
/// as often as the columns of all sensors need the bytes. Memory: at least the columns of one record and sensor.
Responses responses(const Plant& plant, const std::vector<EffectCandidate>& candidates, const Added& added,
                    std::vector<FitRecord> records, const ResponseRequest& request, const SensorProducts& take);

struct Visibility {
  Vector size;              ///< a candidate: RMS of what is left, in noise units; NaN where it did not run
  Vector cosine;            ///< of each pair asked for, between what is left of the two; 0 where nothing is left
  Vector parameter_std;     ///< posterior, in tolerances: 1 is no better than before the test
  Matrix parameter_cosine;  ///< correlation of the posterior
};

/// Products of effects in the metric (I + J P^-1 J')^-1, J the parameters and initial states with prior precision P:
/// <a, b> = a'b - a'J (J'J + P)^-1 J'b. What parameters can do inside their tolerances does not count.
/// @param products summed over the sensors that are read, and times R for the mean of R times as many repeats
/// @param pairs those of `products`   @param divisor number of sensors that RMS values are taken over, so that a
/// further sensor adds
Visibility visibility(const Responses& responses, const Products& products, const std::vector<CandidatePair>& pairs,
                      Index divisor);

}  // namespace wheelhop
