#include "core/optimise/bounded_step.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <vector>

namespace wheelhop {
namespace {

constexpr double kRidge = 1e-12;  // of the diagonal: columns of one direction share their weight
constexpr int kRounds = 50;       // a handful settles it

bool held(double gradient, double theta, double lower, double upper) {
  return (theta <= lower && gradient > 0) || (theta >= upper && gradient < 0);
}

/// From s: what leads out of a bound is held, what a step would carry across one is set on it, the rest solved anew.
Vector newton_point(const Matrix& H, ConstVectorRef gradient, const Vector& s, const Vector& lower,
                    const Vector& upper) {
  const Vector slope = gradient + H * s;
  Vector next = s;
  std::vector<Index> free;
  for (Index i = 0; i < s.size(); ++i)
    if (!held(slope(i), s(i), lower(i), upper(i))) free.push_back(i);
  while (!free.empty()) {
    for (const Index i : free) next(i) = 0;
    const Vector moved = gradient + H * next;  // by what is held
    const Vector wanted = -Eigen::LDLT<Matrix>(H(free, free)).solve(moved(free));
    std::vector<Index> inside;
    for (std::size_t k = 0; k < free.size(); ++k) {
      const Index i = free[k];
      next(i) = std::clamp(wanted(static_cast<Index>(k)), lower(i), upper(i));
      if (next(i) == wanted(static_cast<Index>(k))) inside.push_back(i);
    }
    if (inside.size() == free.size()) break;
    free = std::move(inside);
  }
  return next;
}

}  // namespace

Vector clamped(ConstVectorRef theta, const Box& box) {
  return box.lower.size() == 0 ? Vector(theta) : Vector(theta.cwiseMax(box.lower).cwiseMin(box.upper));
}

Vector projected_gradient(ConstVectorRef gradient, ConstVectorRef theta, const Box& box) {
  Vector kept = gradient;
  for (Index i = 0; i < box.lower.size(); ++i)
    if (held(gradient(i), theta(i), box.lower(i), box.upper(i))) kept(i) = 0;
  return kept;
}

Vector bounded_step(const Matrix& H, ConstVectorRef gradient, ConstVectorRef theta, const Box& box) {
  if (box.lower.size() == 0) return -Eigen::LDLT<Matrix, Eigen::Lower>(H).solve(gradient);
  const Matrix whole = H.selfadjointView<Eigen::Lower>();
  const Vector lower = box.lower - theta, upper = box.upper - theta;
  Vector step = Vector::Zero(theta.size());
  double least = 0;
  for (int i = 0; i < kRounds; ++i) {
    const Vector next = newton_point(whole, gradient, step, lower, upper);
    const double value = next.dot(gradient) + 0.5 * next.dot(whole * next);
    if (!(value < least)) break;
    least = value;
    step = next;
  }
  return step;
}

Vector bounded_least_squares(ConstMatrixRef A, ConstVectorRef b, const Box& box) {
  Matrix H = Matrix::Zero(A.cols(), A.cols());
  H.selfadjointView<Eigen::Lower>().rankUpdate(A.transpose());
  H.diagonal() *= 1 + kRidge;
  H.diagonal().array() += std::numeric_limits<double>::min();
  const Vector x = clamped(Vector::Zero(A.cols()), box);
  const Vector gradient = H.selfadjointView<Eigen::Lower>() * x - A.transpose() * b;
  return clamped(x + bounded_step(H, gradient, x, box), box);
}

}  // namespace wheelhop
