#include "core/identify/direction.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include "core/data/spectra.hpp"

namespace wheelhop {
namespace {

class DirectionProblem final : public ResidualProblem {
 public:
  DirectionProblem(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef z, double sample_time_s,
                   const DirectionOptions& options)
      : n_(A.rows()), p_(C.rows()), q_(options.count), rows_(options.direct_term ? n_ + p_ : n_) {
    const ComplexMatrix spectrum = hann_spectrum(z);
    const double bin_hz = 1 / (sample_time_s * static_cast<double>(z.cols()));
    const Index bins = std::min<Index>(spectrum.cols(), static_cast<Index>(options.cutoff_hz / bin_hz) + 1);
    z_ = spectrum.leftCols(bins);
    total_ = z_.norm();
    if (total_ > 0) z_ /= total_;
    const ComplexMatrix Ac = A.cast<std::complex<double>>(), Cc = C.cast<std::complex<double>>();
    M_.reserve(static_cast<std::size_t>(bins));
    for (Index k = 0; k < bins; ++k) {
      const double angle = 2 * std::numbers::pi * bin_hz * static_cast<double>(k) * sample_time_s;
      ComplexMatrix pencil = -Ac;
      pencil.diagonal().array() += std::polar(1.0, angle);
      ComplexMatrix M(p_, rows_);
      M.leftCols(n_) = solve_complex(ComplexMatrix(pencil.transpose()), ComplexMatrix(Cc.transpose())).transpose();
      if (options.direct_term) M.rightCols(p_).setIdentity();
      M_.push_back(std::move(M));
    }
  }

  Index parameters() const override { return rows_ * q_; }
  Index residuals() const override { return 2 * p_ * z_.cols(); }
  double total() const { return total_; }
  Index rows() const { return rows_; }

  bool residual(ConstVectorRef theta, VectorRef r) const override { return evaluate(theta, r, nullptr); }
  bool jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override { return evaluate(theta, r, &J); }

 private:
  bool evaluate(ConstVectorRef theta, VectorRef r, MatrixRef* J) const {
    const Matrix directions = theta.reshaped(rows_, q_);
    ComplexMatrix Q(p_, q_), R(q_, q_), PM(p_, rows_), QM(q_, rows_);
    ComplexVector f(q_), Qz(q_), rest(p_);
    for (Index k = 0; k < z_.cols(); ++k) {  // thousands of p x q problems: nothing may allocate in here
      const ComplexMatrix& M = M_[static_cast<std::size_t>(k)];
      Q.noalias() = M.lazyProduct(directions);
      orthonormalise(Q, R);
      Qz.noalias() = Q.adjoint().lazyProduct(z_.col(k));
      rest = z_.col(k);
      rest.noalias() -= Q.lazyProduct(Qz);
      r.segment(2 * p_ * k, p_) = rest.real();
      r.segment(2 * p_ * k + p_, p_) = rest.imag();
      if (J == nullptr) continue;
      QM.noalias() = Q.adjoint().lazyProduct(M);
      PM = M;  // (I - G G^+) M
      PM.noalias() -= Q.lazyProduct(QM);
      f = Qz;
      R.triangularView<Eigen::Upper>().solveInPlace(f);
      for (Index j = 0; j < q_; ++j) {
        J->block(2 * p_ * k, j * rows_, p_, rows_) = -(PM * f(j)).real();
        J->block(2 * p_ * k + p_, j * rows_, p_, rows_) = -(PM * f(j)).imag();
      }
    }
    return r.allFinite();
  }

  /// Q R = G in place, by modified Gram-Schmidt done twice (Bjorck 1967).
  static void orthonormalise(ComplexMatrix& Q, ComplexMatrix& R) {
    R.setZero();
    for (Index j = 0; j < Q.cols(); ++j) {
      for (int sweep = 0; sweep < 2; ++sweep)
        for (Index i = 0; i < j; ++i) {
          const std::complex<double> common = Q.col(i).dot(Q.col(j));
          R(i, j) += common;
          Q.col(j) -= common * Q.col(i);
        }
      R(j, j) = Q.col(j).norm();
      Q.col(j) /= R(j, j);
    }
  }

  Index n_, p_, q_, rows_;
  ComplexMatrix z_;  // p x bins, unit total norm
  double total_ = 0;
  std::vector<ComplexMatrix> M_;
};

}  // namespace

std::unique_ptr<ResidualProblem> direction_problem(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef z,
                                                   double sample_time_s, const DirectionOptions& options) {
  return std::make_unique<DirectionProblem>(A, C, z, sample_time_s, options);
}

Direction estimate_direction(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef z, double sample_time_s,
                             const DirectionOptions& options, const Solver& solver, Random& random) {
  const Index n = A.rows(), p = C.rows(), q = options.count;
  Direction best;
  if (q >= p) {
    best.status = Status::rank_deficient;
    best.message = "eq. (17) needs fewer nonlinearities than outputs: any direction tracks the residual exactly";
    return best;
  }
  const DirectionProblem problem(A, C, z, sample_time_s, options);
  if (!(problem.total() > 0)) {
    best.message = all_finite(z) ? "the linear residual is zero: there is no nonlinearity to locate"
                                 : "the linear residual is not finite";
    return best;
  }
  std::vector<double> costs;
  Vector winner;
  double least = std::numeric_limits<double>::infinity();
  for (Index start = 0; start < options.starts; ++start) {
    const Matrix guess = random.normal(problem.rows(), q);
    const Solution solution = solver.minimise(problem, guess.reshaped(), options.iterations);
    if (solution.status != Status::ok && solution.status != Status::iteration_limit) continue;
    if (!solution.theta.allFinite()) continue;
    costs.push_back(solution.cost);
    if (solution.cost < least) {
      least = solution.cost;
      winner = solution.theta;
    }
  }
  if (costs.empty()) {
    best.message = "no start of the separable least squares gave a finite residual";
    return best;
  }
  best.residual = std::sqrt(2 * least);
  for (const double cost : costs)
    if (std::sqrt(2 * cost) <= 1.01 * best.residual + 1e-12) ++best.agreeing;
  const Matrix orthonormal = thin_qr(winner.reshaped(problem.rows(), q).cast<std::complex<double>>()).Q.real();
  best.Bt = orthonormal.topRows(n);
  best.Dt = options.direct_term ? Matrix(orthonormal.bottomRows(p)) : Matrix::Zero(p, q);
  Vector r(problem.residuals());
  static_cast<void>(problem.residual(winner, r));
  const Matrix by_channel = r.reshaped(p, r.size() / p);
  const double z_rms = z.norm() / std::sqrt(static_cast<double>(z.cols()));
  best.channel_residual = by_channel.rowwise().norm() * z_rms;
  best.status = Status::ok;
  return best;
}

}  // namespace wheelhop
