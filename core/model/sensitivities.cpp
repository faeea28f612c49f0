#include "core/model/sensitivities.hpp"

#include <vector>

namespace wheelhop {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
constexpr Index kBlock = 128;  // samples a block: the Jacobian block stays in the second-level cache

/// target += factor * row, over `count` contiguous doubles.
inline void add_scaled(double* __restrict target, double factor, const double* __restrict row, Index count) {
  for (Index j = 0; j < count; ++j) target[j] += factor * row[j];
}

template <int Rows>
inline void combine_fixed(double* __restrict target, const double* c, const double* __restrict rows, Index count) {
  for (Index j = 0; j < count; ++j) {
    double sum = 0;
    for (int i = 0; i < Rows; ++i) sum += c[i] * rows[i * count + j];
    target[j] = sum;
  }
}

/// target = sum_i c_i row_i over rows of `count` contiguous doubles. One pass over memory for the usual orders: this
/// loop and the one of the normal equations are where a refinement spends its time.
void combine(double* __restrict target, const double* c, const double* __restrict rows, Index n, Index count) {
  switch (n) {
    case 1: return combine_fixed<1>(target, c, rows, count);
    case 2: return combine_fixed<2>(target, c, rows, count);
    case 3: return combine_fixed<3>(target, c, rows, count);
    case 4: return combine_fixed<4>(target, c, rows, count);
    case 5: return combine_fixed<5>(target, c, rows, count);
    case 6: return combine_fixed<6>(target, c, rows, count);
    default: break;
  }
  std::fill(target, target + count, 0.0);
  for (Index i = 0; i < n; ++i) add_scaled(target, c[i], rows + i * count, count);
}

}  // namespace

ParameterLayout layout_of(const NonlinearModel& model) {
  return {model.order(), model.linear.input_count(), model.linear.output_count(), model.auxiliary_count(),
          model.map ? model.map->parameters() : 0};
}

Vector pack(const NonlinearModel& model, ConstVectorRef x0) {
  const LinearModel& linear = model.linear;
  Vector all(layout_of(model).size());
  all << linear.A.reshaped(), linear.B.reshaped(), model.Bt.reshaped(), x0, (model.map ? model.map->theta() : Vector()),
      linear.C.reshaped(), linear.D.reshaped(), model.Dt.reshaped(), linear.y0;
  return all;
}

void unpack(ConstVectorRef parameters, NonlinearModel& model, Vector& x0) {
  const ParameterLayout at = layout_of(model);
  LinearModel& linear = model.linear;
  linear.A.reshaped() = parameters.segment(at.A(), linear.A.size());
  linear.B.reshaped() = parameters.segment(at.B(), linear.B.size());
  model.Bt.reshaped() = parameters.segment(at.Bt(), model.Bt.size());
  linear.C.reshaped() = parameters.segment(at.C(), linear.C.size());
  linear.D.reshaped() = parameters.segment(at.D(), linear.D.size());
  model.Dt.reshaped() = parameters.segment(at.Dt(), model.Dt.size());
  linear.y0 = parameters.segment(at.y0(), at.p);
  x0 = parameters.segment(at.x0(), at.n);
  if (model.map) {
    std::shared_ptr<StaticMap> map = model.map->clone();
    map->set_theta(parameters.segment(at.theta(), at.map));
    model.map = std::move(map);
  }
}

bool free_run_sensitivities(const NonlinearModel& model, ConstMatrixRef u, ConstVectorRef x0,
                            const SensitivityBlock& receive) {
  const ParameterLayout at = layout_of(model);
  const SensitivityRow row(at);
  const Index n = at.n, m = at.m, p = at.p, q = at.q, terms = n + q;
  const Index width = (at.dynamic() + 3) / 4 * 4;  // no remainder after the vector loops
  const Index h = model.map ? model.map->features() : 0, inner = model.map ? model.map->inner_parameters() : 0;
  const LinearModel& linear = model.linear;

  // Rows [S; F]: S = dx/d(dynamic parameters), F = df/d(dynamic parameters) at fixed x.
  RowMajor now = RowMajor::Zero(terms, width), next = now;
  for (Index i = 0; i < n; ++i) now(i, at.x0() + i) = 1;
  // [x; y]' = fixed [x; u; f; 1] and [S; dy]' = moving [S; F]: the moving one follows df/dx.
  Matrix fixed = Matrix::Zero(n + p, at.regressors());
  RowMajor moving(n + p, terms);
  fixed.leftCols(n) << linear.A, linear.C;
  fixed.middleCols(n, m) << linear.B, linear.D;
  fixed.middleCols(n + m, q) << model.Bt, model.Dt;
  fixed.bottomRightCorner(p, 1) = linear.y0;
  moving << fixed.leftCols(n), fixed.middleCols(n + m, q);
  const RowMajor W = model.map ? model.map->W : Matrix(q, 0);
  Vector regressors = Vector::Ones(at.regressors()), response(n + p), phi(h), df_dxi(n + m);
  regressors.head(n) = x0;
  regressors.segment(n + m, q).setZero();
  std::vector<Matrix> rows(static_cast<std::size_t>(p), Matrix::Zero(row.size, kBlock));

  for (Index first = 0; first < u.cols(); first += kBlock) {
    const Index count = std::min(kBlock, u.cols() - first);
    for (Index k = 0; k < count; ++k) {
      if (!(regressors.head(n).array().abs() <= kStateGuard).all()) return false;
      regressors.segment(n, m) = u.col(first + k);
      if (model.map) {
        const StaticMap& map = *model.map;
        map.value(regressors.data(), regressors.data() + n + m, phi.data());
        for (Index i = 0; i < n + p; ++i)
          for (Index j = 0; j < n; ++j) moving(i, j) = fixed(i, j);
        for (Index i = 0; i < q; ++i) {
          double* theta = &now(n + i, at.theta());
          map.slopes(regressors.data(), phi.data(), W.data() + i * h, df_dxi.data(), theta);
          for (Index j = 0; j < h; ++j) theta[inner + j * q + i] = phi(j);
          theta[inner + q * h + i] = 1;
          for (Index l = 0; l < n + p; ++l)
            for (Index j = 0; j < n; ++j) moving(l, j) += moving(l, n + i) * (df_dxi(j) + map.L(i, j));
        }
      }
      response.setZero();
      for (Index j = 0; j < at.regressors(); ++j)
        for (Index i = 0; i < n + p; ++i) response(i) += fixed(i, j) * regressors(j);
      for (Index i = 0; i < p; ++i) {
        double* column = rows[static_cast<std::size_t>(i)].data() + k * row.size;
        combine(column, &moving(n + i, 0), now.data(), terms, width);
        std::copy_n(regressors.data(), at.regressors(), column + row.regressors);
        column[row.output] = response(n + i);
        if (!model.limits.any()) continue;
        const double shown = std::clamp(response(n + i), model.limits.low(i), model.limits.high(i));
        if (shown == response(n + i)) continue;
        std::fill_n(column, row.size, 0.0);
        column[row.output] = shown;
      }
      for (Index i = 0; i < n; ++i) {
        double* state = &next(i, 0);
        combine(state, &moving(i, 0), now.data(), terms, width);
        for (Index j = 0; j < n; ++j) state[at.A() + j * n + i] += regressors(j);
        for (Index j = 0; j < m; ++j) state[at.B() + j * n + i] += regressors(n + j);
        for (Index j = 0; j < q; ++j) state[at.Bt() + j * n + i] += regressors(n + m + j);
      }
      now.swap(next);
      regressors.head(n) = response.head(n);
    }
    receive(first, count, rows);
    drop_faded(now.middleCols(at.x0(), n));
  }
  return true;
}

}  // namespace wheelhop
