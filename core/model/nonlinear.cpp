#include "core/model/nonlinear.hpp"

namespace wheelhop {

NonlinearModel without_map(const LinearModel& model) {
  return {model, Matrix(model.order(), 0), Matrix(model.output_count(), 0), nullptr};
}

FreeRun free_run(const NonlinearModel& model, ConstMatrixRef u, ConstVectorRef x0) {
  const Index n = model.order(), m = u.rows(), samples = u.cols(), q = model.auxiliary_count();
  FreeRun run;
  run.x = Matrix::Zero(n, samples);
  run.f = Matrix::Zero(q, samples);
  Matrix dynamics(n, n + q);  // x_{k+1} = dynamics [x; f] + forced
  dynamics << model.linear.A, model.Bt;
  const Matrix forced = model.linear.B * u;
  Vector x = x0, next(n), xi(n + m), phi(model.map ? model.map->features() : 0);
  for (Index k = 0; k < samples; ++k) {
    if (!(x.array().abs() <= kStateGuard).all()) {  // also false for NaN
      run.status = Status::outside_domain;
      run.stopped_at = k;
      break;
    }
    run.x.col(k) = x;
    double* const f = run.f.data() + k * q;
    if (model.map) {
      xi.head(n) = x;
      xi.tail(m) = u.col(k);
      model.map->value(xi.data(), f, phi.data());
    }
    next = forced.col(k);  // too small for the general products to pay
    for (Index j = 0; j < n; ++j) next += x(j) * dynamics.col(j);
    for (Index j = 0; j < q; ++j) next += f[j] * dynamics.col(n + j);
    x.swap(next);
  }
  const Index valid = run.stopped_at < 0 ? samples : run.stopped_at;
  run.y = Matrix::Zero(model.linear.output_count(), samples);
  auto y = run.y.leftCols(valid);
  y.noalias() = model.linear.C * run.x.leftCols(valid);
  y.noalias() += model.linear.D * u.leftCols(valid);
  if (model.map) y.noalias() += model.Dt * run.f.leftCols(valid);
  y.colwise() += model.linear.y0;
  return run;
}

void fold_linear_part(NonlinearModel& model, ConstMatrixRef L) {
  const Index n = model.order();
  LinearModel& linear = model.linear;
  linear.A += model.Bt * L.leftCols(n);
  linear.B += model.Bt * L.rightCols(L.cols() - n);
  linear.C += model.Dt * L.leftCols(n);
  linear.D += model.Dt * L.rightCols(L.cols() - n);
}

}  // namespace wheelhop
