/// \file
/// Random discrete-time systems for the tests of identification.
#pragma once

#include <memory>

#include "core/base/random.hpp"
#include "core/model/nonlinear.hpp"
#include "variants/nonlinearity/mlp.hpp"

namespace wheelhop::test {

inline Random numbers(std::uint64_t cell) { return Random(20, Stream::parameters, cell); }

/// Dense matrix whose largest eigenvalue has the given modulus.
inline Matrix random_dynamics(Index n, double radius, Random& random) {
  const Matrix M = random.normal(n, n);
  return M * (radius / spectral_radius(M));
}

inline LinearModel random_linear(Index n, Index m, Index p, double radius, Random& random) {
  LinearModel model;
  model.A = random_dynamics(n, radius, random);
  model.B = random.normal(n, m);
  model.C = random.normal(p, n);
  model.D = random.normal(p, m);
  model.y0 = Vector::Zero(p);
  return model;
}

/// A fresh alpha for points of unit variance and no target in particular.
inline void start_anywhere(StaticMap& map, Random& random) {
  Random points = numbers(900);
  map.initialise(points.normal(map.inputs(), 400), points.normal(map.outputs(), 400), random);
}

/// Every block of the model class filled, the map an MLP of three units, of moderate gain so that free runs stay small.
inline NonlinearModel random_nonlinear(Index n, Index m, Index p, Index q, Random& random) {
  NonlinearModel model;
  model.linear = random_linear(n, m, p, 0.7, random);
  model.linear.y0 = random.normal(p, 1);
  model.Bt = 0.3 * random.normal(n, q);
  model.Dt = 0.3 * random.normal(p, q);
  std::shared_ptr<StaticMap> map = make_mlp(n + m, q, {.hidden_units = 3});
  start_anywhere(*map, random);
  map->W = 0.3 * random.normal(q, map->features());
  map->b = 0.3 * random.normal(q, 1);
  map->L = 0.1 * random.normal(q, n + m);
  model.map = map;
  return model;
}

inline double relative_error(ConstMatrixRef value, ConstMatrixRef reference) {
  return (value - reference).norm() / reference.norm();
}

inline bool same_bits(ConstMatrixRef a, ConstMatrixRef b) {
  return a.rows() == b.rows() && a.cols() == b.cols() && (a.array() == b.array()).all();
}

/// Gradient of a scalar function by central differences.
template <class Function>
Vector central_differences(const Function& value, const Vector& at, double step = 1e-5) {
  Vector gradient(at.size());
  for (Index i = 0; i < at.size(); ++i) {
    Vector up = at, down = at;
    up(i) += step;
    down(i) -= step;
    gradient(i) = (value(up) - value(down)) / (2 * step);
  }
  return gradient;
}

/// |a - b| / |b|.
inline double relative_difference(const Matrix& a, const Matrix& b) {
  return (a - b).norm() / std::max(b.norm(), 1e-300);
}

}  // namespace wheelhop::test
