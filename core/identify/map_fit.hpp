/// \file
/// Step 4: the static map from state and input to the auxiliary input, by variable projection (Golub & Pereyra 1973;
/// Kaufman 1975; for neural networks Sjoberg & Viberg 1997, as the paper cites it).
#pragma once

#include <memory>
#include <vector>

#include "core/base/random.hpp"
#include "core/kernels/streamed_qr.hpp"
#include "core/model/static_map.hpp"
#include "core/optimise/solver.hpp"

namespace wheelhop {

struct MapFitOptions {
  Index starts = 3;
  Budget budget = {60};  ///< of each start
  Index samples = 3000;  ///< at most so many: the map is low-dimensional, the record is not
};

struct MapFit {
  Status status = Status::failed;
  std::string message;
  std::shared_ptr<StaticMap> map;  ///< nonlinear part, its slope on xi is zero on the data
  Matrix linear;                   ///< q x d, linear part in xi, to be folded into the linear system
  double residual = 0;             ///< RMS of f - fhat over RMS of f
};

/// Which samples a fit of at most `limit` reads: every k-th, and the `limit` / 4 whose f is largest. A hardening
/// element bends in its rare extremes, which even spacing would thin out with the rest. @param f q x N
std::vector<Index> chosen_samples(ConstMatrixRef f, Index limit);

/// min over alpha of  min over W, b, L of  ||f - W phi(xi; alpha) - b - L xi||, then split as
/// f = (part uncorrelated with xi: the map) + linear xi, which is the choice of eq. (4).
/// @param prototype decides family and size
/// @param xi d x N, unit variance a row   @param f q x N
MapFit fit_static_map(const StaticMap& prototype, ConstMatrixRef xi, ConstMatrixRef f, const MapFitOptions& options,
                      const Solver& solver, Random& random);

/// The same with alpha as it stands in a map: W, b and the linear part alone, from samples that arrive block by block,
/// in memory that does not grow with their number. The triangular factor of [1 xi phi f] says all of them that least
/// squares asks. Cost O(N (d + h + q)^2).
class WeightFit {
 public:
  /// @param map borrowed
  explicit WeightFit(const StaticMap& map);
  /// @param xi d x N   @param f q x N
  void add(ConstMatrixRef xi, ConstMatrixRef f);
  /// @param sign the weights of sign * f
  MapFit finish(double sign = 1);

 private:
  const StaticMap& map_;
  StreamedQr stream_;
  Matrix factor_;  // of what was added, once it was asked for
};

/// WeightFit of all samples at once.
MapFit fit_weights(const StaticMap& map, ConstMatrixRef xi, ConstMatrixRef f);

/// The reduced problem in alpha (residual after projecting out the linear weights), exposed for its gradient's test.
std::unique_ptr<ResidualProblem> map_problem(const StaticMap& prototype, ConstMatrixRef xi, ConstMatrixRef f);

}  // namespace wheelhop
