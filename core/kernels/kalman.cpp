#include "core/kernels/kalman.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <utility>

namespace wheelhop {

KalmanFilter design_kalman_filter(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef Q, ConstMatrixRef R) {
  KalmanFilter filter;
  DareSolution dare = solve_dare(A, C, Q, R);
  filter.status = dare.status;
  filter.message = dare.message;
  filter.spectral_radius = dare.radius_bound;
  if (dare.status != Status::ok) return filter;
  filter.A = A;
  filter.C = C;
  filter.P = dare.P;
  filter.S = C * dare.P * C.transpose() + R;
  filter.S_inverse = filter.S.ldlt().solve(Matrix::Identity(C.rows(), C.rows()));
  filter.K = A * dare.P * C.transpose() * filter.S_inverse;
  filter.spectral_radius = spectral_radius(A - filter.K * C);
  return filter;
}

FilterRun run_filter(const KalmanFilter& filter, ConstMatrixRef z, ConstVectorRef x0) {
  const Index samples = z.cols();
  FilterRun run{Matrix(filter.A.rows(), samples), Matrix(z.rows(), samples), 0, 0};
  Vector x = x0, next(x0.size()), e(z.rows());
  double quadratic = 0;
  for (Index k = 0; k < samples; ++k) {
    run.x.col(k) = x;
    e = z.col(k);
    e.noalias() -= filter.C * x;
    run.e.col(k) = e;
    quadratic += e.dot(filter.S_inverse.lazyProduct(e));
    next.noalias() = filter.A * x;
    next.noalias() += filter.K * e;
    x.swap(next);
  }
  const double log_determinant = filter.S.ldlt().vectorD().array().log().sum();
  run.quadratic = quadratic;
  run.log_likelihood =
      -0.5 * (quadratic + static_cast<double>(samples) *
                              (log_determinant + static_cast<double>(z.rows()) * std::log(2 * std::numbers::pi)));
  return run;
}

Matrix fixed_lag_states(const KalmanFilter& filter, FilterRun run, Index lag) {
  const Index samples = run.x.cols();
  const Matrix closed = (filter.A - filter.K * filter.C).transpose();
  Matrix weight = filter.C.transpose() * filter.S_inverse;
  Matrix& x = run.x;
  for (Index j = 0; j <= lag && j < samples; ++j) {
    x.leftCols(samples - j).noalias() += (filter.P * weight) * run.e.rightCols(samples - j);
    weight = closed * weight;
  }
  return std::move(x);
}

Matrix smoothed_states(const KalmanFilter& filter, FilterRun run) {
  const Matrix closed = (filter.A - filter.K * filter.C).transpose();
  const Matrix drive = filter.C.transpose() * filter.S_inverse;
  Vector r = Vector::Zero(run.x.rows()), previous(run.x.rows());
  for (Index k = run.x.cols() - 1; k >= 0; --k) {
    previous.noalias() = closed * r;
    previous.noalias() += drive * run.e.col(k);
    r.swap(previous);
    run.x.col(k).noalias() += filter.P * r;
  }
  return std::move(run.x);
}

}  // namespace wheelhop
