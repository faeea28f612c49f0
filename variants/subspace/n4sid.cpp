#include "variants/subspace/n4sid.hpp"

#include <fmt/format.h>

#include "core/identify/input_matrices.hpp"
#include "core/model/linear.hpp"

namespace wheelhop {
namespace {

/// Extended observability matrix of s block rows.
Matrix observability(const Matrix& A, const Matrix& C, Index s) {
  Matrix gamma(C.rows() * s, A.cols());
  Matrix row = C;
  for (Index i = 0; i < s; ++i, row = row * A) gamma.middleRows(C.rows() * i, C.rows()) = row;
  return gamma;
}

Matrix pseudo_inverse(const Matrix& gamma) {
  return least_squares(gamma, Matrix::Identity(gamma.rows(), gamma.rows())).x;
}

/// Block column j of the Toeplitz matrix of s block rows of Markov parameters, as a matrix that multiplies [D; B]:
/// zero above row block j, D in it, C A^i B below.
Matrix toeplitz_column(const Matrix& gamma, Index p, Index s, Index j) {
  const Index n = gamma.cols();
  Matrix column = Matrix::Zero(p * s, p + n);
  column.block(p * j, 0, p, p).setIdentity();
  const Index below = s - j - 1;
  column.block(p * (j + 1), p, p * below, n) = gamma.topRows(p * below);
  return column;
}

class N4sid final : public HankelEstimator {
 public:
  explicit N4sid(const N4sidOptions& options) : HankelEstimator(options.hankel, true), options_(options) {}
  std::string name() const override { return "n4sid"; }

 protected:
  ColumnSpace column_space(const HankelRq& rq) const override {
    const Past past(rq, options_.rank_tolerance);
    ColumnSpace space;
    space.instruments = past.used;
    space.instrument_condition = past.condition;
    const Matrix along = rq.R32() * past.V;  // R32 without what the past's left-out directions carry
    if (options_.algorithm == "robust") {
      space.weighted = along;
    } else {  // R32 Rww^+ [R_w1 Rww]: the past's part within [1; U_future] too
      const Matrix coefficients = along * past.s.cwiseInverse().asDiagonal() * past.U.transpose();
      Matrix oblique(rq.outputs(), rq.known() + rq.instruments());
      oblique << coefficients * rq.R.block(rq.known(), 0, rq.instruments(), rq.known()), along * past.V.transpose();
      space.weighted = std::move(oblique);
    }
    return space;
  }

  /// States from projections: with Z_i = Y_f / [W_p; U_f] and Z_(i+1) one block row on,
  ///   [Gamma_(i-1)^+ Z_(i+1); Y_i] = [A; C] Gamma_i^+ Z_i + K [1; U_f] + rest.
  std::string recover(const HankelRq& rq, ConstMatrixRef gamma, ConstMatrixRef u, ConstMatrixRef y,
                      LinearEstimate& estimate) const override {
    const Index n = gamma.cols(), p = rq.p, known = rq.known();
    const States states(rq, Past(rq, options_.rank_tolerance));
    const Matrix right = states.next(gamma, p);
    Matrix regressors(n + known, right.cols());
    regressors << states.now(gamma), states.known;
    const Matrix fit = least_squares(regressors.transpose(), right.transpose()).x.transpose();
    const Matrix A = fit.topLeftCorner(n, n), C = fit.bottomLeftCorner(p, n);
    LinearModel& model = estimate.model;
    model.A = stabilised(A);
    model.C = C;
    estimate.stabilised = model.A != A;
    if (options_.input_matrices == "simulation") return simulated_outputs(model.A, C, u, y, estimate);
    const Matrix again = observability(model.A, C, rq.future);
    const Matrix offset = options_.algorithm == "robust"
                              ? Matrix(states.next(again, p) - stacked(model.A, C) * states.now(again))
                              : Matrix(fit.middleCols(n, known) * states.known);
    const std::string undetermined = solve_for_inputs(rq, again, states, offset, estimate);
    estimate_start(u, y, estimate.model, estimate.x0);
    return undetermined;
  }

 private:
  /// The past beyond [1; U_future], Rww = U s V' of the directions that are used.
  struct Past {
    Past(const HankelRq& rq, double tolerance) {
      Svd whole = svd(rq.Rww());
      used = used_directions(whole.s, tolerance);
      U = whole.U.leftCols(used);
      s = whole.s.head(used);
      V = whole.V.leftCols(used);
      condition = s(0) / s(used - 1);
    }
    Index used;
    Matrix U, V;
    Vector s;
    double condition;
  };

  /// Everything in coordinates of the factor's rows: [1; U_f], the past that is used, Y_i.
  struct States {
    States(const HankelRq& rq, const Past& past) {
      const Index a = rq.known(), w = past.used, p = rq.p, outputs = a + rq.instruments();
      const auto future = rq.R.middleRows(outputs, rq.outputs());
      z = Matrix::Zero(rq.outputs(), a + w + p);
      z.leftCols(a) = future.leftCols(a);
      z.middleCols(a, w) = rq.R32() * past.V;
      z_next = z.bottomRows(rq.outputs() - p);
      z_next.rightCols(p) = future.block(p, outputs, rq.outputs() - p, p);
      y = z.topRows(p);
      y.rightCols(p) = future.block(0, outputs, p, p);
      known = Matrix::Zero(a, z.cols());
      known.leftCols(a) = rq.R.topLeftCorner(a, a);
    }
    Matrix now(const Matrix& gamma) const { return pseudo_inverse(gamma) * z; }
    /// [x_(i+1); y_i]
    Matrix next(const Matrix& gamma, Index p) const {
      return stacked(pseudo_inverse(gamma.topRows(gamma.rows() - p)) * z_next, y);
    }
    Matrix z, z_next, y, known;
  };

  static Matrix stacked(const Matrix& top, const Matrix& bottom) {
    Matrix both(top.rows() + bottom.rows(), top.cols());
    both << top, bottom;
    return both;
  }

  /// B and D from  offset = sum_j N_j [D; B] u_j + constant,  N_j from the Toeplitz matrices (eqs. 4.52 to 4.57).
  static std::string solve_for_inputs(const HankelRq& rq, const Matrix& gamma, const States& states,
                                      const Matrix& offset, LinearEstimate& estimate) {
    const Index n = gamma.cols(), p = rq.p, m = rq.m, s = rq.future, rows = n + p;
    const Matrix inverse = pseudo_inverse(gamma), shorter = pseudo_inverse(gamma.topRows(p * (s - 1)));
    const Matrix dynamics = stacked(estimate.model.A, estimate.model.C) * inverse;
    // The first coordinate is that of the constant row: without it, the constant is free.
    const Index columns = states.known.cols() - 1;
    Matrix regressors = Matrix::Zero(rows * columns, rows * m);
    for (Index j = 0; j < s; ++j) {
      Matrix N = -dynamics * toeplitz_column(gamma, p, s, j);
      if (j == 0) {
        N.topRightCorner(n, n) += Matrix::Identity(n, n);
        N.bottomLeftCorner(p, p) += Matrix::Identity(p, p);
      } else {
        N.topRows(n) += shorter * toeplitz_column(gamma, p, s - 1, j - 1);
      }
      for (Index c = 0; c < columns; ++c)
        for (Index i = 0; i < m; ++i)
          regressors.block(rows * c, rows * i, rows, rows) += states.known(1 + m * j + i, c + 1) * N;
    }
    const LeastSquares found = least_squares(regressors, Matrix(offset.rightCols(columns)).reshaped());
    const Matrix matrices = found.x.reshaped(rows, m);  // [D; B]
    estimate.model.D = matrices.topRows(p);
    estimate.model.B = matrices.bottomRows(n);
    estimate.condition = found.condition;
    if (found.rank == rows * m) return "";
    return fmt::format("the record determines {} of the {} numbers in B and D: are inputs collinear?", found.rank,
                       rows * m);
  }

  N4sidOptions options_;
};

}  // namespace

std::unique_ptr<SubspaceEstimator> make_n4sid(const N4sidOptions& options) { return std::make_unique<N4sid>(options); }

}  // namespace wheelhop
