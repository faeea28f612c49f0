/// \file
/// Interface of the static nonlinearity  f = W phi(xi; alpha) + b + L xi  of the paper's Sec. 2.6, with the linear
/// output weights exposed, so that variable projection serves every piece.
#pragma once

#include <memory>
#include <string>

#include "core/base/json.hpp"
#include "core/base/random.hpp"

namespace wheelhop {

/// A map R^d -> R^q. Parameters theta = [alpha; vec W (column-major); b].
/// L is no parameter: it is set once, so that f is uncorrelated with xi on the training record (the choice of eq. (4)),
/// and what it takes away stands in the model's A, B, C, D. A free L would be redundant with them.
class StaticMap {
 public:
  virtual ~StaticMap() = default;
  virtual std::unique_ptr<StaticMap> clone() const = 0;
  virtual std::string name() const = 0;

  Index inputs() const { return inputs_; }                 ///< d
  Index outputs() const { return W.rows(); }               ///< q
  Index features() const { return W.cols(); }              ///< h
  Index inner_parameters() const { return alpha.size(); }  ///< number of alpha
  Index parameters() const { return alpha.size() + W.size() + b.size(); }

  /// Draws a fresh alpha for a fit of f at the points xi.
  /// @param xi d x N, centred near zero with unit variance   @param f q x N   N >= 1
  virtual void initialise(ConstMatrixRef xi, ConstMatrixRef f, Random& random) = 0;

  /// 1 / variance of a prior on theta() around zero, for a map of unit-variance inputs and outputs; 0: none.
  virtual Vector precision() const { return Vector::Zero(parameters()); }

  /// Least values of theta(); empty: none.
  virtual Vector lower() const { return {}; }

  /// A map of nearly the same f with `more` further features to start from, of output weights near zero; null: the
  /// family has none.
  virtual std::unique_ptr<StaticMap> widened(Index /*more*/, Random& /*random*/) const { return nullptr; }

  /// phi(xi). @param xi d values   @param phi h values out
  virtual void basis(const double* xi, double* phi) const = 0;

  /// Gradients of w'phi, given phi = phi(xi). Asked for by weights because no caller needs h separate Jacobians.
  /// @param w h   @param dxi d values out   @param dalpha (number of alpha) values out
  virtual void slopes(const double* xi, const double* phi, const double* w, double* dxi, double* dalpha) const = 0;

  /// phi of many points at once, N x h; a family overrides it where that is faster than point by point.
  /// @param xi d x N
  virtual Matrix basis_of(ConstMatrixRef xi) const;
  /// d(w'phi)/dalpha of many points, N x (number of alpha). @param phi N x h, basis_of(xi)   @param w h
  virtual Matrix alpha_slopes(ConstMatrixRef xi, ConstMatrixRef phi, ConstVectorRef w) const;

  /// `{"name", "options", "alpha", "W", "b", "L"}`, as a map stands in a model file.
  Json to_json() const;
  /// alpha, W, b and L of such an object, exactly as to_json() wrote them. UserError where they do not fit the map.
  void read_parameters(const JsonCursor& cursor);

  Vector theta() const;
  void set_theta(ConstVectorRef theta);
  /// f(xi). @param xi d   @param f q out
  void value(const double* xi, double* f, double* phi_scratch) const;

  Vector alpha;  ///< inner, nonlinear parameters
  Matrix W;      ///< q x h output weights
  Vector b;      ///< q
  Matrix L;      ///< q x d, fixed linear part

 protected:
  /// The effective options the map was made with, as read by its family's table.
  virtual Json options() const = 0;

  StaticMap(Index inputs, Index outputs, Index features, Index inner)
      : alpha(Vector::Zero(inner)),
        W(Matrix::Zero(outputs, features)),
        b(Vector::Zero(outputs)),
        L(Matrix::Zero(outputs, inputs)),
        inputs_(inputs) {}
  StaticMap(const StaticMap&) = default;

 private:
  Index inputs_;
};

}  // namespace wheelhop
