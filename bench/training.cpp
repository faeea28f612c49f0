// Training of a network of ten units on 10,000 samples: time until its error is below a target, over twenty starts.
#include <fmt/format.h>

#include <cmath>

#include "bench/against.hpp"
#include "bench/report.hpp"
#include "core/base/random.hpp"
#include "core/identify/map_fit.hpp"
#include "variants/nonlinearity/mlp.hpp"
#include "variants/solver/levenberg_marquardt.hpp"
#ifdef WHEELHOP_HAS_CERES
#include <ceres/cost_function.h>
#include <ceres/iteration_callback.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#endif

namespace wheelhop::bench {
namespace {

constexpr Index kInputs = 5, kUnits = 10, kSamples = 10000, kStarts = 20, kIterations = 200;
constexpr double kNoise = 0.05;  // of the target's RMS, below every error asked for

struct Points {
  Matrix xi, f;
};

/// Ten units of another network make the target: RMS 1 without the noise.
const Points& points() {
  static const Points made = [] {
    Random random(21, Stream::parameters);
    Points p{random.normal(kInputs, kSamples), Matrix(1, kSamples)};
    const Matrix alpha = 1.2 * random.normal(kUnits, kInputs), shift = random.normal(kUnits, 1),
                 weights = random.normal(1, kUnits);
    p.f = weights * ((alpha * p.xi).colwise() + Vector(shift)).array().tanh().matrix();
    p.f.array() -= p.f.mean();
    p.f /= p.f.norm() / std::sqrt(static_cast<double>(kSamples));
    p.f += kNoise * random.normal(1, kSamples);
    return p;
  }();
  return made;
}

double cost_at(double target) { return 0.5 * static_cast<double>(kSamples) * target * target; }

struct Arrived {};

/// Ends a search as soon as one of its points is good enough.
class Until final : public ResidualProblem {
 public:
  Until(const ResidualProblem& problem, double enough) : problem_(problem), enough_(enough) {}
  Index parameters() const override { return problem_.parameters(); }
  Index residuals() const override { return problem_.residuals(); }
  Box box() const override { return problem_.box(); }
  bool residual(ConstVectorRef theta, VectorRef r) const override {
    return problem_.residual(theta, r) && looked_at(0.5 * r.squaredNorm());
  }
  bool jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override {
    return problem_.jacobian(theta, r, J) && looked_at(0.5 * r.squaredNorm());
  }
  bool normal_equations(ConstVectorRef theta, double& cost, Vector& gradient, Matrix& H) const override {
    return problem_.normal_equations(theta, cost, gradient, H) && looked_at(cost);
  }
  bool cost(ConstVectorRef theta, double& value) const override {
    return problem_.cost(theta, value) && looked_at(value);
  }

 private:
  bool looked_at(double cost) const {
    if (cost <= enough_) throw Arrived{};
    return true;
  }
  const ResidualProblem& problem_;
  const double enough_;
};

/// A network with the inner weights that start number `start` begins with, the same for both.
std::unique_ptr<StaticMap> first_network(Index start) {
  auto map = make_mlp(kInputs, 1, {.hidden_units = kUnits});
  Random random(22, Stream::parameters, static_cast<std::uint64_t>(start));
  map->initialise(points().xi, points().f, random);
  return map;
}

/// Variable projection: the units' inner weights are searched for, the outer ones and a linear part follow.
void ours(benchmark::State& state, double target) {
  const Points& p = points();
  const auto solver = make_levenberg_marquardt({});
  for (auto _ : state) {
    Index arrived = 0;
    for (Index start = 0; start < kStarts; ++start) {
      const auto map = first_network(start);
      const auto problem = map_problem(*map, p.xi, p.f);
      try {
        solver->minimise(Until(*problem, cost_at(target)), map->alpha, kIterations);
      } catch (const Arrived&) {
        ++arrived;
      }
    }
    state.counters["arrived"] = static_cast<double>(arrived);
  }
}

#ifdef WHEELHOP_HAS_CERES
/// All weights and a linear part in one block, with their derivatives: [w_1; c_1; ...; w_10; c_10], the weights and
/// offset of the sum, then the linear part.
class Network final : public ceres::CostFunction {
 public:
  static constexpr int kInner = kUnits * (kInputs + 1), kOuter = kUnits + 1 + kInputs;
  explicit Network(const Points& p) : p_(p) {
    set_num_residuals(static_cast<int>(kSamples));
    mutable_parameter_block_sizes()->push_back(kInner + kOuter);
  }
  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::Matrix<double, kInputs + 1, kUnits>> inner(parameters[0]);
    const Eigen::Map<const Vector> outer(parameters[0] + kInner, kOuter);
    Matrix regressors(kOuter, kSamples);
    regressors.topRows(kUnits) =
        ((inner.topRows<kInputs>().transpose() * p_.xi).colwise() + inner.row(kInputs).transpose()).array().tanh();
    regressors.row(kUnits).setOnes();
    regressors.bottomRows(kInputs) = p_.xi;
    Eigen::Map<Eigen::RowVectorXd>(residuals, kSamples) = outer.transpose() * regressors - p_.f;
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Map<Matrix> J(jacobians[0], kInner + kOuter, kSamples);  // a column a residual
    J.bottomRows(kOuter) = regressors;
    for (Index i = 0; i < kUnits; ++i) {
      const Eigen::RowVectorXd slope = outer(i) * (1 - regressors.row(i).array().square());
      J.middleRows(i * (kInputs + 1), kInputs) = p_.xi * slope.asDiagonal();
      J.row(i * (kInputs + 1) + kInputs) = slope;
    }
    return true;
  }

  /// Inner weights as given, the outer ones by least squares.
  Vector start(const StaticMap& map) const {
    Matrix regressors(kSamples, kOuter);
    regressors << map.basis_of(p_.xi), Vector::Ones(kSamples), p_.xi.transpose();
    Vector theta(kInner + kOuter);
    theta << map.alpha, least_squares(regressors, p_.f.transpose()).x;
    return theta;
  }

 private:
  const Points& p_;
};

class Enough final : public ceres::IterationCallback {
 public:
  explicit Enough(double cost) : cost_(cost) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    return summary.cost <= cost_ ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const double cost_;
};

void with_ceres(benchmark::State& state, double target) {
  const Points& p = points();
  for (auto _ : state) {
    Index arrived = 0;
    for (Index start = 0; start < kStarts; ++start) {
      auto* const network = new Network(p);  // the problem owns it
      Vector theta = network->start(*first_network(start));
      ceres::Problem problem;
      problem.AddResidualBlock(network, nullptr, theta.data());
      Enough enough(cost_at(target));
      ceres::Solver::Options options;
      options.callbacks.push_back(&enough);
      options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
      options.max_num_iterations = kIterations;
      options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-14;
      options.num_threads = 1;
      options.logging_type = ceres::SILENT;
      ceres::Solver::Summary summary;
      ceres::Solve(options, &problem, &summary);
      arrived += summary.final_cost <= cost_at(target);
    }
    state.counters["arrived"] = static_cast<double>(arrived);
  }
}
#endif

}  // namespace

void add_training() {
  for (const double target : {0.12, 0.10, 0.08}) {
    const std::string of = fmt::format("to RMSE {:.2f}", target);
    add_work(
        "MLP 5-10-1, 20 starts", kOurs, of, [target](benchmark::State& state) { ours(state, target); }, 3);
#ifdef WHEELHOP_HAS_CERES
    add_work(
        "MLP 5-10-1, 20 starts", "Ceres, one analytic block", of,
        [target](benchmark::State& state) { with_ceres(state, target); }, 3);
#endif
  }
}

}  // namespace wheelhop::bench
