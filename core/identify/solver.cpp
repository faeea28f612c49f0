#include "core/identify/solver.hpp"

namespace wheelhop {

bool ResidualProblem::cost(ConstVectorRef theta, double& cost) const {
  Vector r(residuals());
  if (!residual(theta, r)) return false;
  cost = 0.5 * r.squaredNorm();
  return true;
}

bool ResidualProblem::normal_equations(ConstVectorRef theta, double& cost, Vector& gradient,
                                       Matrix& gauss_newton) const {
  Vector r(residuals());
  Matrix J(residuals(), parameters());
  if (!jacobian(theta, r, J)) return false;
  cost = 0.5 * r.squaredNorm();
  gradient.noalias() = J.transpose() * r;
  gauss_newton.setZero(parameters(), parameters());
  gauss_newton.selfadjointView<Eigen::Lower>().rankUpdate(J.transpose());
  return true;
}

}  // namespace wheelhop
