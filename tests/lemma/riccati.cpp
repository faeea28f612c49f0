// The Riccati equation and the Kalman filter of Sec. 2.5.
#include <catch2/catch.hpp>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/kernels/kalman.hpp"
#include "core/kernels/kernel_sets.hpp"
#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

struct Problem {
  Matrix A, C, Q, R;
};

Matrix random_covariance(Index n, Random& random) {
  const Matrix root = random.normal(n, n);
  return root * root.transpose() / static_cast<double>(n) + 0.1 * Matrix::Identity(n, n);
}

Problem random_problem(Index n, Index p, double radius, Random& random) {
  return {random_dynamics(n, radius, random), random.normal(p, n), random_covariance(n, random),
          random_covariance(p, random)};
}

/// Right side of the Riccati equation, written once more and in another form (with an explicit gain).
Matrix riccati_step(const Problem& problem, const Matrix& P) {
  const auto& [A, C, Q, R] = problem;
  const Matrix S = C * P * C.transpose() + R;
  const Matrix K = A * P * C.transpose() * solve(S, Matrix::Identity(S.rows(), S.cols()));
  const Matrix closed = A - K * C;
  return closed * P * closed.transpose() + K * R * K.transpose() + Q;  // Joseph's form
}

/// States of x_{k+1} = A x_k + w_k and the noisy readings.
struct Record {
  Matrix x, z;
};

Record noisy_record(const Problem& problem, const Matrix& P0, Index samples, Random& random) {
  const auto& [A, C, Q, R] = problem;
  const Matrix root_Q = symmetric_sqrt(Q), root_R = symmetric_sqrt(R);
  Record record{Matrix(A.rows(), samples), Matrix(C.rows(), samples)};
  Vector x = symmetric_sqrt(P0) * random.normal(A.rows(), 1);
  for (Index k = 0; k < samples; ++k) {
    record.x.col(k) = x;
    record.z.col(k) = C * x + root_R * random.normal(C.rows(), 1);
    x = A * x + root_Q * random.normal(A.rows(), 1);
  }
  return record;
}

/// E[x_0 ... x_{N-1} | z] by one dense least-squares problem: prior P0 about x0, then all w and v.
Matrix batch_states(const Problem& problem, const Matrix& P0, const Vector& x0, const Matrix& z) {
  const auto& [A, C, Q, R] = problem;
  const Index n = A.rows(), p = C.rows(), N = z.cols();
  const auto whitener = [](const Matrix& S) { return solve(cholesky_lower(S), Matrix::Identity(S.rows(), S.cols())); };
  const Matrix wP = whitener(P0), wQ = whitener(Q), wR = whitener(R);
  Matrix M = Matrix::Zero(n * N + p * N, n * N);
  Vector b = Vector::Zero(M.rows());
  M.topLeftCorner(n, n) = wP;
  b.head(n) = wP * x0;
  for (Index k = 1; k < N; ++k) {
    M.block(n * k, n * k, n, n) = wQ;
    M.block(n * k, n * (k - 1), n, n) = -wQ * A;
  }
  for (Index k = 0; k < N; ++k) {
    M.block(n * N + p * k, n * k, p, n) = wR * C;
    b.segment(n * N + p * k, p) = wR * z.col(k);
  }
  return least_squares(M, b).x.reshaped(n, N);
}

}  // namespace

TEST_CASE("the Riccati solution is symmetric, semidefinite, stabilising and leaves no residual, for n = 2 to 40") {
  Random random = numbers(31);
  for (const Index n : {2, 3, 5, 8, 13, 20, 40})
    for (const double radius : {0.5, 0.99, 1.2}) {
      CAPTURE(n, radius);
      const Problem problem = random_problem(n, std::max<Index>(1, n / 3), radius, random);
      const DareSolution solution = solve_dare(problem.A, problem.C, problem.Q, problem.R);
      REQUIRE(solution.status == Status::ok);
      const Matrix& P = solution.P;
      CHECK((P - P.transpose()).norm() == 0);
      CHECK(symmetric_eigen(P).values(0) > -1e-12 * P.norm());
      const KalmanFilter filter = design_kalman_filter(problem.A, problem.C, problem.Q, problem.R);
      CHECK(filter.spectral_radius < 1);
      CHECK(solution.radius_bound >= filter.spectral_radius * (1 - 1e-12));
      CHECK(solution.radius_bound < 1.1 * filter.spectral_radius);
      // Round-off grows with the size of P's entries (large where an unstable mode is hardly seen).
      CHECK(relative_error(riccati_step(problem, P), P) < 1e-9);
      CHECK(solution.relative_residual < 1e-9);
      CHECK((P - problem.Q).norm() > 0);
      CHECK(symmetric_eigen(P - problem.Q).values(0) > -1e-10 * P.norm());  // P >= Q
    }
}

TEST_CASE("the Riccati solution is the limit of the Riccati recursion from any start") {
  Random random = numbers(32);
  for (const Index n : {2, 6, 12}) {
    const Problem problem = random_problem(n, 2, 0.95, random);
    const DareSolution solution = solve_dare(problem.A, problem.C, problem.Q, problem.R);
    REQUIRE(solution.status == Status::ok);
    for (const double start : {0.0, 10.0}) {
      Matrix P = start * Matrix::Identity(n, n);
      for (int k = 0; k < 5000; ++k) P = riccati_step(problem, P);
      CHECK(relative_error(solution.P, P) < 1e-9);
    }
  }
}

TEST_CASE("systems that do not touch have the Riccati solutions that they have alone") {
  // Sizes below and above the one from which the doubling works in blocks (128).
  Random random = numbers(38);
  for (const Index copies : {1, 3, 12, 40}) {
    const Index n = 5, p = 2;
    Problem whole{Matrix::Zero(n * copies, n * copies), Matrix::Zero(p * copies, n * copies),
                  Matrix::Zero(n * copies, n * copies), Matrix::Zero(p * copies, p * copies)};
    Matrix alone = Matrix::Zero(n * copies, n * copies);
    for (Index k = 0; k < copies; ++k) {
      const Problem part = random_problem(n, p, 0.95, random);
      whole.A.block(n * k, n * k, n, n) = part.A;
      whole.C.block(p * k, n * k, p, n) = part.C;
      whole.Q.block(n * k, n * k, n, n) = part.Q;
      whole.R.block(p * k, p * k, p, p) = part.R;
      alone.block(n * k, n * k, n, n) = solve_dare(part.A, part.C, part.Q, part.R).P;
    }
    // States in other coordinates, so that no zero is left. An orthogonal change keeps round-off as it is.
    const Matrix turn = Eigen::HouseholderQR<Matrix>(random.normal(n * copies, n * copies)).householderQ();
    const DareSolution solution = solve_dare(turn * whole.A * turn.transpose(), whole.C * turn.transpose(),
                                             turn * whole.Q * turn.transpose(), whole.R);
    REQUIRE(solution.status == Status::ok);
    CHECK(relative_error(turn.transpose() * solution.P * turn, alone) < 1e-11);
  }
}

TEST_CASE("states in other units have the same Riccati solution in those units") {
  Random random = numbers(36);
  for (const Index n : {3, 6, 12}) {
    const Problem problem = random_problem(n, 2, 0.9, random);
    const Matrix P = solve_dare(problem.A, problem.C, problem.Q, problem.R).P;
    Vector unit(n);
    for (Index i = 0; i < n; ++i) unit(i) = std::pow(10, 12 * random.uniform() - 6);
    const Matrix D = unit.asDiagonal(), inverse = unit.cwiseInverse().asDiagonal();
    const DareSolution scaled = solve_dare(D * problem.A * inverse, problem.C * inverse, D * problem.Q * D, problem.R);
    REQUIRE(scaled.status == Status::ok);
    CHECK(relative_error(inverse * scaled.P * inverse, P) < 1e-10);
  }
}

#ifdef __x86_64__
TEST_CASE("a doubling by lanes is that of its formulas, and the same bits on every instruction set") {
  Random random = numbers(39);
  for (const Index n : {1, 3, 7, 8, 9, 16, 17, 40, 127, 128}) {
    const Index stride = (n + 7) / 8 * 8, whole = stride * stride;
    const Matrix A = random_dynamics(n, 0.9, random), G = random_covariance(n, random),
                 H = random_covariance(n, random);
    constexpr int most = 3;
    Matrix a = A, g = G, h = H;
    for (int k = 0; k < most; ++k) {
      const Matrix inverse = solve(Matrix::Identity(n, n) + g * h, Matrix::Identity(n, n));
      const Matrix next = a * inverse * a, more = a * inverse * g * a.transpose();
      h += (a.transpose() * h * inverse * a).eval();
      g += more;
      a = next;
    }
    const double power = (solve(Matrix::Identity(n, n) + g * h, a)).norm();
    std::vector<Doubling*> sets;
    if (kernel_set() >= KernelSet::avx2) sets.push_back(doubling_avx2);
    if (kernel_set() >= KernelSet::avx512) sets.push_back(doubling_avx512);
    Vector first;
    for (Doubling* const doubling : sets) {
      Vector memory = Vector::Zero(3 * whole + doubling_work(stride) + 8);
      const auto past = reinterpret_cast<std::uintptr_t>(memory.data()) / sizeof(double) % 8;
      double* const start = memory.data() + (8 - past) % 8;
      const auto part = [&](Index k) {
        return Eigen::Map<Matrix>(start + k * whole, stride, stride).topLeftCorner(n, n);
      };
      part(0) = A;
      part(1) = G;
      part(2) = H;
      const DoublingEnd end = doubling(start, start + whole, start + 2 * whole, start + 3 * whole, n, stride, most, 0);
      CAPTURE(n, end.power, power);
      CHECK(end.doublings == most);
      CHECK(end.finite);
      CHECK(end.power == Approx(power).epsilon(1e-9));
      CHECK(relative_error(part(1), g) < 1e-12);
      CHECK(relative_error(part(2), h) < 1e-12);
      const Vector result = Eigen::Map<Vector>(start, 3 * whole);
      if (first.size() == 0) first = result;
      CHECK((result.tail(2 * whole) - first.tail(2 * whole)).norm() == 0);
    }
  }
}
#endif

TEST_CASE("the Lyapunov solution is the sum of its series, and a mode on the circle or outside is told") {
  Random random = numbers(37);
  for (const Index n : {1, 4, 9}) {
    const Matrix A = random_dynamics(n, 0.9, random), Q = random_covariance(n, random);
    const LyapunovSolution solution = solve_lyapunov(A, Q);
    REQUIRE(solution.status == Status::ok);
    Matrix sum = Q, term = Q;
    for (int k = 0; k < 600; ++k) sum += term = (A * term * A.transpose()).eval();
    CHECK(relative_error(solution.P, sum) < 1e-12);
    CHECK(solution.relative_residual < 1e-14);
    CHECK(solution.radius_bound >= spectral_radius(A) * (1 - 1e-12));
    CHECK(solve_lyapunov(A / spectral_radius(A), Q).status != Status::ok);
    CHECK(solve_lyapunov(1.2 / spectral_radius(A) * A, Q).status != Status::ok);
  }
  CHECK(solve_lyapunov(Matrix::Constant(1, 1, NAN), Matrix::Ones(1, 1)).status == Status::not_finite);
}

TEST_CASE("a closed loop within reach of the circle is solved, one on it is told after a bounded number of doublings") {
  for (const double distance : {1e-2, 1e-4, 3e-6}) {
    // No process noise: the closed loop of a stable mode is the mode itself.
    const Matrix a = Matrix::Constant(1, 1, 1 - distance), one = Matrix::Ones(1, 1), zero = Matrix::Zero(1, 1);
    const DareSolution solution = solve_dare(a, one, zero, one);
    CHECK(solution.status == Status::ok);
    CHECK(solution.radius_bound == Approx(1 - distance).epsilon(0.05 * distance));
  }
  Matrix rotation(2, 2);
  rotation << 0.6, 0.8, -0.8, 0.6;
  const DareSolution circle = solve_dare(rotation, Matrix::Ones(1, 2), Matrix::Zero(2, 2), Matrix::Ones(1, 1));
  CHECK(circle.status == Status::not_stabilisable);
  CHECK(circle.doublings <= 30);
  CHECK(std::isfinite(circle.relative_residual));
}

TEST_CASE("a scalar Riccati equation has the root of its quadratic") {
  // p = a^2 p r / (p + r) + q, hence p^2 + (r - a^2 r - q) p - q r = 0.
  for (const double a : {0.3, 0.95, 1.0, 1.7}) {
    const double q = 0.4, r = 2.5, half = 0.5 * (r - a * a * r - q);
    const auto one = [](double value) { return Matrix::Constant(1, 1, value); };
    const DareSolution solution = solve_dare(one(a), one(1), one(q), one(r));
    REQUIRE(solution.status == Status::ok);
    CHECK(solution.P(0, 0) == Approx(-half + std::sqrt(half * half + q * r)).epsilon(1e-12));
  }
}

TEST_CASE("an unstable mode that no output sees, and one on the circle, have no stabilising solution") {
  Random random = numbers(33);
  for (const double hidden : {1.0, 1.3}) {
    Problem problem = random_problem(4, 2, 0.8, random);
    problem.A.row(3).setZero();
    problem.A.col(3).setZero();
    problem.A(3, 3) = hidden;
    problem.C.col(3).setZero();
    // In other coordinates, so that no zero of the matrices gives it away.
    const Matrix T = random.normal(4, 4), inverse = solve(T, Matrix::Identity(4, 4));
    const DareSolution solution = solve_dare(T * problem.A * inverse, problem.C * inverse, problem.Q, problem.R);
    CHECK(solution.status != Status::ok);
    CHECK_FALSE(solution.message.empty());
  }
}

TEST_CASE("a number that is not finite in any argument of the Riccati equation is reported, not passed on") {
  Random random = numbers(34);
  const Problem sound = random_problem(4, 2, 0.8, random);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    for (const auto member : {&Problem::A, &Problem::C, &Problem::Q, &Problem::R}) {
      Problem broken = sound;
      (broken.*member)(0, 1) = (broken.*member)(1, 0) = bad;
      const DareSolution solution = solve_dare(broken.A, broken.C, broken.Q, broken.R);
      CHECK(solution.status != Status::ok);
      CHECK(design_kalman_filter(broken.A, broken.C, broken.Q, broken.R).status != Status::ok);
    }
}

TEST_CASE("shapes that do not fit together are refused by the Riccati solver") {
  const Matrix I2 = Matrix::Identity(2, 2), I3 = Matrix::Identity(3, 3);
  CHECK_THROWS_AS(solve_dare(I2, I3, I2, I3), std::invalid_argument);
  CHECK_THROWS_AS(solve_dare(I2, I2, I3, I2), std::invalid_argument);
  CHECK_THROWS_AS(solve_dare(I2, I2, I2, I3), std::invalid_argument);
}

TEST_CASE("Sec. 2.5: the innovations are white with covariance S") {
  Random random = numbers(35);
  const Problem problem = random_problem(4, 2, 0.9, random);
  const KalmanFilter filter = design_kalman_filter(problem.A, problem.C, problem.Q, problem.R);
  REQUIRE(filter.status == Status::ok);
  CHECK(filter.spectral_radius < 1);
  const Index N = 20000;
  const Record record = noisy_record(problem, filter.P, N, random);
  const FilterRun run = run_filter(filter, record.z, Vector::Zero(4));
  const Matrix white = solve(cholesky_lower(filter.S), run.e);  // unit covariance if the claim holds
  // Five standard errors: sqrt(2/N) for a variance, sqrt(1/N) for the others.
  const double bound = 5 / std::sqrt(static_cast<double>(N));
  const Matrix covariance = white * white.transpose() / static_cast<double>(N);
  CHECK((covariance - Matrix::Identity(2, 2)).cwiseAbs().maxCoeff() < 1.5 * bound);
  for (const Index lag : {1, 2, 3, 10}) {
    const Matrix correlation = white.leftCols(N - lag) * white.rightCols(N - lag).transpose() / static_cast<double>(N);
    CHECK(correlation.cwiseAbs().maxCoeff() < bound);
  }
  // P is the covariance of the prediction error.
  const Matrix error = record.x - run.x;
  CHECK(relative_error(error * error.transpose() / static_cast<double>(N), filter.P) < 0.1);
}

TEST_CASE("the log-likelihood is that of the joint normal density of the record") {
  Random random = numbers(36);
  const Problem problem = random_problem(3, 2, 0.9, random);
  const KalmanFilter filter = design_kalman_filter(problem.A, problem.C, problem.Q, problem.R);
  const Index N = 6, p = 2;
  const Matrix z = random.normal(p, N);
  // Joint covariance of z_0 ... z_{N-1} with x_0 ~ (0, P): E z_j z_k' = C A^(j-k) X_k C' + R at j = k.
  Matrix joint(p * N, p * N), X = filter.P;
  for (Index k = 0; k < N; ++k) {
    Matrix cross = X;
    for (Index j = k; j < N; ++j) {
      joint.block(p * j, p * k, p, p) = problem.C * cross * problem.C.transpose();
      if (j == k) joint.block(p * j, p * k, p, p) += problem.R;
      joint.block(p * k, p * j, p, p) = joint.block(p * j, p * k, p, p).transpose().eval();
      cross = problem.A * cross;
    }
    X = problem.A * X * problem.A.transpose() + problem.Q;
  }
  const Vector flat = z.reshaped();
  const double quadratic = flat.dot(solve(joint, flat).col(0));
  const double log_determinant = 2 * cholesky_lower(joint).diagonal().array().log().sum();
  const double expected = -0.5 * (quadratic + log_determinant + static_cast<double>(p * N) * std::log(2 * M_PI));
  CHECK(run_filter(filter, z, Vector::Zero(3)).log_likelihood == Approx(expected).epsilon(1e-10));
}

TEST_CASE("filtered, fixed-lag and smoothed states agree with one dense least-squares problem on a short record") {
  Random random = numbers(37);
  const Problem problem = random_problem(3, 2, 0.95, random);
  const KalmanFilter filter = design_kalman_filter(problem.A, problem.C, problem.Q, problem.R);
  REQUIRE(filter.status == Status::ok);
  const Index N = 15;
  const Vector x0 = random.normal(3, 1);
  const Matrix z = noisy_record(problem, filter.P, N, random).z;
  const FilterRun run = run_filter(filter, z, x0);
  const auto batch = [&](Index samples) { return batch_states(problem, filter.P, x0, z.leftCols(samples)); };

  const Matrix smoothed = batch(N);
  CHECK(relative_error(smoothed_states(filter, run), smoothed) < 1e-10);
  CHECK(relative_error(fixed_lag_states(filter, run, N), smoothed) < 1e-10);
  for (const Index lag : {0, 1, 4}) {
    const Matrix x = fixed_lag_states(filter, run, lag);
    for (Index k = 0; k < N; ++k) {
      CAPTURE(lag, k);
      CHECK(relative_error(x.col(k), batch(std::min(N, k + lag + 1)).col(k)) < 1e-10);
    }
  }
}

TEST_CASE("a longer look-ahead never estimates the state worse") {
  Random random = numbers(38);
  const Problem problem = random_problem(4, 1, 0.95, random);
  const KalmanFilter filter = design_kalman_filter(problem.A, problem.C, problem.Q, problem.R);
  const Record record = noisy_record(problem, filter.P, 20000, random);
  const FilterRun run = run_filter(filter, record.z, Vector::Zero(4));
  double previous = (run.x - record.x).norm();
  for (const Index lag : {0, 1, 2, 5, 20}) {
    const double error = (fixed_lag_states(filter, run, lag) - record.x).norm();
    CHECK(error < previous * 1.002);  // the true errors decrease; their estimates fluctuate by about 1/sqrt(N)
    previous = error;
  }
}
