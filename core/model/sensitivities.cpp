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
  const Index n = at.n, m = at.m, p = at.p, q = at.q, P = at.size(), d = n + m;
  const Index dynamic = at.dynamic();
  const Index h = model.map ? model.map->features() : 0, inner = model.map ? model.map->inner_parameters() : 0;
  const LinearModel& linear = model.linear;

  RowMajor S = RowMajor::Zero(n, dynamic), S_next(n, dynamic);  // dx/d(dynamic parameters)
  for (Index i = 0; i < n; ++i) S(i, at.x0() + i) = 1;
  RowMajor F = RowMajor::Zero(q, at.map);  // df/dtheta at fixed x
  Vector phi(h), df_dxi(d), f = Vector::Zero(q), x = x0, x_next(n), xi(d);
  Matrix df_dx = Matrix::Zero(q, n);
  Vector w(h);
  RowMajor A_total = linear.A, C_total = linear.C;
  Matrix y_block(p, kBlock), J_block(P, p * kBlock);

  for (Index first = 0; first < u.cols(); first += kBlock) {
    const Index count = std::min(kBlock, u.cols() - first);
    for (Index k = 0; k < count; ++k) {
      if (!(x.array().abs() <= kStateGuard).all()) return false;
      const auto u_k = u.col(first + k);
      if (model.map) {
        const StaticMap& map = *model.map;
        xi << x, u_k;
        map.basis(xi.data(), phi.data());
        f.noalias() = map.W * phi + map.b + map.L * xi;
        for (Index i = 0; i < q; ++i) {
          double* theta = F.data() + i * at.map;
          w = map.W.row(i);
          map.slopes(xi.data(), phi.data(), w.data(), df_dxi.data(), theta);
          df_dx.row(i) = df_dxi.head(n).transpose() + map.L.row(i).head(n);
          for (Index j = 0; j < h; ++j) theta[inner + j * q + i] = phi(j);
          theta[inner + q * h + i] = 1;
        }
        A_total.noalias() = linear.A + model.Bt * df_dx;
        C_total.noalias() = linear.C + model.Dt * df_dx;
      }

      y_block.col(k).noalias() = linear.C * x + linear.D * u_k + model.Dt * f + linear.y0;
      for (Index i = 0; i < p; ++i) {
        double* row = J_block.data() + (k * p + i) * P;
        combine(row, C_total.data() + i * n, S.data(), n, dynamic);
        std::fill(row + dynamic, row + P, 0.0);
        for (Index j = 0; j < q; ++j) add_scaled(row + at.theta(), model.Dt(i, j), F.data() + j * at.map, at.map);
        for (Index j = 0; j < n; ++j) row[at.C() + j * p + i] += x(j);
        for (Index j = 0; j < m; ++j) row[at.D() + j * p + i] += u_k(j);
        for (Index j = 0; j < q; ++j) row[at.Dt() + j * p + i] += f(j);
        row[at.y0() + i] += 1;
      }

      for (Index i = 0; i < n; ++i) {
        double* row = S_next.data() + i * dynamic;
        combine(row, A_total.data() + i * n, S.data(), n, dynamic);
        for (Index j = 0; j < q; ++j) add_scaled(row + at.theta(), model.Bt(i, j), F.data() + j * at.map, at.map);
        for (Index j = 0; j < n; ++j) row[at.A() + j * n + i] += x(j);
        for (Index j = 0; j < m; ++j) row[at.B() + j * n + i] += u_k(j);
        for (Index j = 0; j < q; ++j) row[at.Bt() + j * n + i] += f(j);
      }
      S.swap(S_next);
      x_next.noalias() = linear.A * x + linear.B * u_k + model.Bt * f;
      x.swap(x_next);
    }
    receive(first, y_block.leftCols(count), J_block.leftCols(p * count));
  }
  return true;
}

}  // namespace wheelhop
