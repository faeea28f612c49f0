#include "core/identify/initial_state.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include "core/identify/input_matrices.hpp"
#include "core/model/sensitivities.hpp"

namespace wheelhop {
namespace {

/// Starts that are followed to their minimum. Judgement: two minima, of a state and its mirror image, and one more.
constexpr std::size_t kDescents = 3;
constexpr int kIterations = 30;

/// Coordinates z of the state, x0 = origin + axes z, and the least-squares problem in them: errors ./ std, and z itself
/// with the weight `prior`.
struct StartProblem {
  const NonlinearModel& model;
  ConstMatrixRef u, y;  // up to the last sample that counts
  Index skip;
  Vector origin;
  Matrix axes;
  Vector std;
  double prior;  // 1, or 0 without statistics

  Vector state(const Vector& z) const { return origin + axes * z; }

  double cost(const Vector& z) const {
    double sum = prior * z.squaredNorm();
    const Index stopped = free_run_in_blocks(model, u, state(z), [&](const FreeRunBlock& block) {
      const Index drop = std::max<Index>(skip - block.first, 0), count = block.y.cols() - drop;
      if (count <= 0) return;
      const auto errors = block.y.rightCols(count) - y.middleCols(block.first + drop, count);
      sum += (std.cwiseInverse().asDiagonal() * errors).squaredNorm();
    });
    return stopped < 0 && std::isfinite(sum) ? sum : std::numeric_limits<double>::infinity();
  }

  /// Gauss-Newton matrix and half the gradient. @return false where the run leaves the state guard
  bool slopes(const Vector& z, Matrix& H, Vector& g) const {
    const ParameterLayout at = layout_of(model);
    const SensitivityRow row(at);
    H = prior * Matrix::Identity(at.n, at.n);
    g = prior * z;
    return free_run_sensitivities(model, u, state(z), [&](Index first, Index samples, const std::vector<Matrix>& rows) {
      const Index drop = std::max<Index>(skip - first, 0), count = samples - drop;
      if (count <= 0) return;
      for (Index i = 0; i < at.p; ++i) {
        const auto own = rows[static_cast<std::size_t>(i)].middleCols(drop, count);
        const Matrix by_z = axes.transpose() * own.middleRows(at.x0(), at.n) / std(i);
        g.noalias() += by_z * (own.row(row.output) - y.row(i).segment(first + drop, count)).transpose() / std(i);
        H.noalias() += by_z * by_z.transpose();
      }
    });
  }

  /// Gauss-Newton with damping. @return the cost that was reached
  double descend(Vector& z) const {
    double cost = this->cost(z), damping = 1e-3;
    Matrix H;
    Vector g;
    for (int iteration = 0; iteration < kIterations && std::isfinite(cost); ++iteration) {
      if (!slopes(z, H, g)) break;
      const double before = cost;
      for (int attempt = 0; attempt < 10; ++attempt, damping *= 10) {
        Matrix damped = H;
        damped.diagonal() *= 1 + damping;
        const Vector trial = z - damped.ldlt().solve(g);
        const double trial_cost = this->cost(trial);
        if (!(trial_cost < cost)) continue;
        z = trial;
        cost = trial_cost;
        damping *= 0.1;
        break;
      }
      if (!(cost < before * (1 - 1e-10))) break;
    }
    return cost;
  }
};

}  // namespace

StateStatistics state_statistics(const NonlinearModel& model, const std::vector<StartedRecord>& records) {
  const Index n = model.order(), p = model.linear.output_count();
  Vector sum = Vector::Zero(n), error_squares = Vector::Zero(p);
  Matrix squares = Matrix::Zero(n, n);
  double samples = 0;
  for (const StartedRecord& record : records)
    if (free_run_in_blocks(model, record.u, record.x0, [&](const FreeRunBlock& block) {
          const Index drop = std::max<Index>(record.skip - block.first, 0), count = block.y.cols() - drop;
          if (count <= 0) return;
          const auto x = block.x.rightCols(count);
          sum += x.rowwise().sum();
          squares.noalias() += x * x.transpose();
          error_squares +=
              (block.y.rightCols(count) - record.y.middleCols(block.first + drop, count)).rowwise().squaredNorm();
          samples += static_cast<double>(count);
        }) >= 0)
      return {};
  const Vector mean = sum / samples;
  return {mean, squares / samples - mean * mean.transpose(), (error_squares / samples).cwiseSqrt()};
}

Index initial_state_span(const LinearModel& model, Index samples) {
  double slowest = 0;  // samples to turn through a radian or to fall by e, whichever is shorter
  for (const std::complex<double>& pole : eigenvalues(model.A)) {
    const double rate = std::abs(std::log(pole));
    if (std::isfinite(rate) && rate > 0) slowest = std::max(slowest, 1 / rate);
  }
  constexpr double three_periods = 6 * 3.14159265358979323846;
  const auto span = static_cast<Index>(std::min(three_periods * slowest, static_cast<double>(samples)));
  return std::max<Index>(std::min(std::max<Index>(span, 100), samples / 4), 1);
}

Vector estimate_initial_state(const NonlinearModel& model, ConstMatrixRef u, ConstMatrixRef y, Index samples,
                              Index skip, const StateStatistics& known) {
  skip = std::min(skip, u.cols() - 1);
  const Index end = std::min(skip + samples, u.cols()), n = model.order(), p = y.rows();
  const auto u_part = u.leftCols(end), y_part = y.leftCols(end);
  if (!known.known()) {
    const Vector linear = estimate_initial_state(model.linear, u, y, samples, skip);
    if (!model.map) return linear;
    const StartProblem problem{model,           u_part, y_part, skip, Vector::Zero(n), Matrix::Identity(n, n),
                               Vector::Ones(p), 0};
    Vector z = linear;
    if (!std::isfinite(problem.cost(z))) z.setZero();
    problem.descend(z);
    return z;
  }
  const SymmetricEigen principal = symmetric_eigen(known.covariance);
  const Matrix axes = principal.vectors * principal.values.cwiseMax(0).cwiseSqrt().asDiagonal();
  // Errors below a billionth of the outputs are round-off.
  const StartProblem problem{model, u_part, y_part, skip, known.mean, axes, known.residual_std.cwiseMax(1e-9), 1};
  struct Start {
    Vector z;
    double cost;
  };
  std::vector<Start> starts;
  const auto add = [&](Vector z) {
    const double cost = problem.cost(z);
    starts.push_back({std::move(z), cost});
  };
  add(Vector::Zero(n));
  for (Index i = 0; i < n && model.map; ++i)  // a linear model has one minimum
    for (const double sign : {1.0, -1.0}) add(sign * Vector::Unit(n, i));
  std::stable_sort(starts.begin(), starts.end(), [](const Start& a, const Start& b) { return a.cost < b.cost; });
  starts.resize(std::min(starts.size(), kDescents));
  for (Start& start : starts) start.cost = problem.descend(start.z);
  return problem.state(std::min_element(starts.begin(), starts.end(), [](const Start& a, const Start& b) {
                         return a.cost < b.cost;
                       })->z);
}

}  // namespace wheelhop
