/// \file
/// N4SID: the states as the intersection of past and future, from oblique projections (Van Overschee & De Moor 1996,
/// "Subspace identification for linear systems", ch. 4). All of it is made from the triangular factor of hankel_rq():
/// the projection of Y_future on the past along U_future is O = R32 Rww^+ [W_past], the projections on all known rows
/// are leading columns of the factor.
#pragma once

#include <memory>
#include <string>

#include "core/identify/hankel_estimator.hpp"

namespace wheelhop {

struct N4sidOptions {
  HankelOptions hankel = {};
  std::string algorithm = "robust";
  std::string input_matrices = "simulation";
  double rank_tolerance = 1e-6;
  template <class V>
  void fields(V&& visit) {
    hankel.fields(visit);
    visit("algorithm", algorithm, Choices{{"combined", "robust"}},
          "combined: fig. 4.6, singular values of the oblique projection itself, B and D from the regression's "
          "coefficients; robust: fig. 4.8, the projection beyond U_future, B and D from its data");
    visit("input_matrices", input_matrices, Choices{{"simulation", "projection"}},
          "where B and D come from: least squares on the simulated outputs, as with every method here, or the source's "
          "own equations");
    visit("rank_tolerance", rank_tolerance, Range{0, 1}, "-",
          "directions of the past below it times the largest are left out of the pseudo-inverse: a drive of 10 Hz at "
          "200 Hz leaves it a condition of 1e8. A value near 0.1 also leaves out most of what the force of a "
          "nonlinearity adds to past outputs");
  }
};

std::unique_ptr<SubspaceEstimator> make_n4sid(const N4sidOptions& options);

}  // namespace wheelhop
