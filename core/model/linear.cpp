#include "core/model/linear.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace wheelhop {

namespace {

constexpr Index kSimulated = 256;  // samples whose states stay in the first cache; no result depends on it

/// Calls receive(first, x, y) for one block of samples after the other.
template <class Receive>
void simulate_in_blocks(const LinearModel& model, ConstMatrixRef u, ConstVectorRef x0, const Receive& receive) {
  const Index n = model.order(), p = model.output_count(), longest = std::min(kSimulated, u.cols());
  Matrix forced(n, longest), states(n, longest), outputs(p, longest);
  Vector x = x0, next(n);
  for (Index first = 0; first < u.cols(); first += kSimulated) {
    const Index count = std::min(kSimulated, u.cols() - first);
    const auto inputs = u.middleCols(first, count);
    forced.leftCols(count).noalias() = model.B * inputs;
    for (Index k = 0; k < count; ++k) {
      states.col(k) = x;
      next.noalias() = model.A * x;
      x = next + forced.col(k);
    }
    auto y = outputs.leftCols(count);
    y.noalias() = model.C * states.leftCols(count);
    y.noalias() += model.D * inputs;
    y.colwise() += model.y0;
    receive(first, states.leftCols(count), y);
  }
}

}  // namespace

Response simulate(const LinearModel& model, ConstMatrixRef u, ConstVectorRef x0) {
  Response run{Matrix(model.order(), u.cols()), Matrix(model.output_count(), u.cols())};
  simulate_in_blocks(model, u, x0, [&](Index first, ConstMatrixRef x, ConstMatrixRef y) {
    run.x.middleCols(first, x.cols()) = x;
    run.y.middleCols(first, y.cols()) = y;
  });
  return run;
}

Matrix simulated_outputs(const LinearModel& model, ConstMatrixRef u, ConstVectorRef x0) {
  Matrix outputs(model.output_count(), u.cols());
  simulate_in_blocks(model, u, x0,
                     [&](Index first, ConstMatrixRef, ConstMatrixRef y) { outputs.middleCols(first, y.cols()) = y; });
  return outputs;
}

Matrix markov_parameters(const LinearModel& model, Index count) {
  const Index m = model.input_count();
  Matrix parameters(model.output_count(), m * count);
  Matrix x = model.B;
  for (Index k = 0; k < count; ++k) {
    if (k == 0) {
      parameters.leftCols(m) = model.D;
      continue;
    }
    parameters.middleCols(m * k, m) = model.C * x;
    x = model.A * x;
  }
  return parameters;
}

LinearModel similarity_transform(const LinearModel& model, ConstMatrixRef T) {
  const Matrix transposed = T.transpose();
  LinearModel result = model;
  // C T^-1 = (T^-T C^T)^T
  result.A = solve(transposed, (T * model.A).transpose()).transpose();
  result.B = T * model.B;
  result.C = solve(transposed, model.C.transpose()).transpose();
  return result;
}

Matrix stabilised(ConstMatrixRef A, double limit) {
  const Spectrum spectrum = eigen_decomposition(A);
  if (spectrum.values.cwiseAbs().maxCoeff() < 1) return A;
  ComplexVector values = spectrum.values;
  for (auto& value : values) {
    const double modulus = std::abs(value);
    if (modulus >= 1) value *= std::min(1 / modulus, limit) / modulus;
  }
  const ComplexMatrix& V = spectrum.vectors;
  const ComplexMatrix reflected = V * values.asDiagonal();
  return V.transpose().partialPivLu().solve(reflected.transpose()).transpose().real();
}

}  // namespace wheelhop
