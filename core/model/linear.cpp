#include "core/model/linear.hpp"

#include <Eigen/LU>

namespace wheelhop {

Response simulate(const LinearModel& model, ConstMatrixRef u, ConstVectorRef x0) {
  const Index samples = u.cols();
  Response run{Matrix(model.order(), samples), Matrix(model.output_count(), samples)};
  const Matrix forced = model.B * u;
  Vector x = x0, next(model.order());
  for (Index k = 0; k < samples; ++k) {
    run.x.col(k) = x;
    next.noalias() = model.A * x;
    x = next + forced.col(k);
  }
  run.y.noalias() = model.C * run.x;
  run.y.noalias() += model.D * u;
  run.y.colwise() += model.y0;
  return run;
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
