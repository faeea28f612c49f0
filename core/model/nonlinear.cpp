#include "core/model/nonlinear.hpp"

#include <algorithm>

namespace wheelhop {
namespace {

constexpr Index kRunBlock = 256;  // samples whose motion stays in the first cache; no result depends on it

}  // namespace

NonlinearModel without_map(const LinearModel& model, const OutputLimits& limits) {
  return {model, Matrix(model.order(), 0), Matrix(model.output_count(), 0), nullptr, limits};
}

Index free_run_in_blocks(const NonlinearModel& model, ConstMatrixRef u, ConstVectorRef x0,
                         const std::function<void(const FreeRunBlock&)>& receive) {
  const Index n = model.order(), m = u.rows(), p = model.linear.output_count(), q = model.auxiliary_count();
  const Index longest = std::min(kRunBlock, u.cols());
  Matrix forced(n, longest), states(n, longest), outputs(p, longest), auxiliary = Matrix::Zero(q, longest);
  Matrix dynamics(n, n + q);  // x_{k+1} = dynamics [x; f] + forced
  dynamics << model.linear.A, model.Bt;
  Vector x = x0, next(n), xi(n + m), phi(model.map ? model.map->features() : 0);
  for (Index first = 0; first < u.cols(); first += kRunBlock) {
    const Index wanted = std::min(kRunBlock, u.cols() - first);
    const auto inputs = u.middleCols(first, wanted);
    forced.leftCols(wanted).noalias() = model.linear.B * inputs;
    Index count = 0;
    for (; count < wanted; ++count) {
      if (!(x.array().abs() <= kStateGuard).all()) break;  // also for NaN
      states.col(count) = x;
      double* const f = auxiliary.data() + count * q;
      if (model.map) {
        xi.head(n) = x;
        xi.tail(m) = inputs.col(count);
        model.map->value(xi.data(), f, phi.data());
      }
      next = forced.col(count);  // too small for the general products to pay
      for (Index j = 0; j < n; ++j) next += x(j) * dynamics.col(j);
      for (Index j = 0; j < q; ++j) next += f[j] * dynamics.col(n + j);
      x.swap(next);
    }
    auto y = outputs.leftCols(count);
    y.noalias() = model.linear.C * states.leftCols(count);
    y.noalias() += model.linear.D * inputs.leftCols(count);
    if (model.map) y.noalias() += model.Dt * auxiliary.leftCols(count);
    y.colwise() += model.linear.y0;
    cut_off(model.limits, y);
    if (count > 0) receive({first, states.leftCols(count), y, auxiliary.leftCols(count)});
    if (count < wanted) return first + count;
  }
  return -1;
}

FreeRun free_run(const NonlinearModel& model, ConstMatrixRef u, ConstVectorRef x0) {
  FreeRun run;
  run.x = Matrix::Zero(model.order(), u.cols());
  run.y = Matrix::Zero(model.linear.output_count(), u.cols());
  run.f = Matrix::Zero(model.auxiliary_count(), u.cols());
  run.stopped_at = free_run_in_blocks(model, u, x0, [&](const FreeRunBlock& block) {
    run.x.middleCols(block.first, block.x.cols()) = block.x;
    run.y.middleCols(block.first, block.y.cols()) = block.y;
    run.f.middleCols(block.first, block.f.cols()) = block.f;
  });
  if (run.stopped_at >= 0) run.status = Status::outside_domain;
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
