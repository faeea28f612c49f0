/// \file
/// A simpler map in place of a refined one. A map with free units bends in directions that the data hardly excite and
/// errs as soon as another record goes further; one element between two bodies needs a single direction only.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "core/identify/free_run_problem.hpp"

namespace wheelhop {

/// Which powers a polynomial has.
struct RidgeForm {
  Index degree = 0;        ///< the highest, >= 3
  bool odd = false;        ///< odd powers alone
  bool hardening = false;  ///< no power with a weight of the other sign
};

/// Highest powers tried; below 3: none.
struct RidgeDegrees {
  Index any = 0;        ///< with weights of any sign
  Index hardening = 0;  ///< odd, with weights of one sign
};

/// Makes an untrained polynomial of one direction, f = W phi(alpha'xi): features of ascending degree from 2, or the odd
/// ones from 3, alpha of as many values as xi.
using RidgeFactory = std::function<std::unique_ptr<StaticMap>(Index inputs, const RidgeForm& form)>;

struct ActiveDirection {
  Vector t;          ///< d, max |t'xi| = 1 over the points
  double share = 0;  ///< of the gradient's variance along t; 1: f is linear but for a function of t'xi
};

/// Eigenvalues and eigenvectors of the sum of cov(df_i/dxi) over the outputs of a map: the directions in which it
/// bends, the last one most (outer product of gradients: Samarov 1993; Constantine 2015). The constant part of a
/// gradient belongs to the linear system and does not count.
/// @param xi d x N
SymmetricEigen active_subspace(const StaticMap& map, ConstMatrixRef xi);

/// The leading one of these directions. @param xi d x N
ActiveDirection active_direction(const StaticMap& map, ConstMatrixRef xi);

/// Polynomials of one direction in place of the model's map, each refined jointly: all powers, then the
/// odd ones alone, then fewer of them. A power stays if it lowers the cost by more than chance would. Last, odd
/// powers with weights of one sign, if that adds no more than a thousandth to the cost: an element that only stiffens,
/// as a spring towards its stop. Powers that cancel inside the training record do not beyond it.
/// Empty if f has not one output or not one direction, and if no polynomial beats the model's own map at its present
/// cost, its parameters counted.
/// Cost: four refinements of fewer parameters than the model's, which converge in about ten iterations each.
/// @param iterations cap of each refinement   @param degrees any < 3, or no make_ridge: empty; others as in refine()
std::optional<Refinement> fit_ridge(const NonlinearModel& model, ConstVectorRef x0, ConstMatrixRef u, ConstMatrixRef y,
                                    ConstVectorRef weight_std, Index skip, const Solver& solver, Index iterations,
                                    const RidgeFactory& make_ridge, const RidgeDegrees& degrees);

}  // namespace wheelhop
