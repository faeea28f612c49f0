// The linear subsystem: RQ factorisation (11), subspace estimate, decomposition (3)-(4), persistency of excitation.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/identify/decomposition.hpp"
#include "core/identify/input_matrices.hpp"
#include "core/identify/realisation.hpp"
#include "core/kernels/hankel.hpp"
#include "tests/support/systems.hpp"
#include "variants/subspace/pi_moesp.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// Block-Hankel matrix of `rows` block rows from sample `first`, `columns` columns, eq. (6).
Matrix hankel(const Matrix& signal, Index first, Index rows, Index columns) {
  Matrix H(signal.rows() * rows, columns);
  for (Index i = 0; i < rows; ++i)
    H.middleRows(signal.rows() * i, signal.rows()) = signal.middleCols(first + i, columns);
  return H;
}

/// The stack of eq. (11) with the constant row on top.
Matrix stack_of_eq_11(const Matrix& u, const Matrix& y, Index future, Index past) {
  const Index columns = u.cols() - future - past + 1, m = u.rows(), p = y.rows();
  Matrix stack(1 + m * (future + past) + p * future, columns);
  stack << Matrix::Ones(1, columns), hankel(u, past, future, columns), hankel(u, 0, past, columns),
      hankel(y, past, future, columns);
  return stack;
}

/// Whether every pole of `found` has one of `truth` within `tolerance`, and the other way round.
bool same_poles(const Matrix& found, const Matrix& truth, double tolerance) {
  const ComplexVector a = eigenvalues(found), b = eigenvalues(truth);
  for (const auto& value : a)
    if ((b.array() - value).abs().minCoeff() > tolerance) return false;
  for (const auto& value : b)
    if ((a.array() - value).abs().minCoeff() > tolerance) return false;
  return a.size() == b.size();
}

}  // namespace

TEST_CASE("eq. (11): R R' is the Gram matrix of the Hankel stack, and R is lower triangular") {
  Random random = numbers(51);
  for (const auto& [future, past, m, p] : {std::tuple<Index, Index, Index, Index>{4, 4, 1, 2}, {3, 5, 2, 1}}) {
    const Matrix u = random.normal(m, 300), y = random.normal(p, 300);
    const HankelRq rq = hankel_rq(u, y, future, past);
    const Matrix stack = stack_of_eq_11(u, y, future, past), gram = stack * stack.transpose();
    REQUIRE(rq.R.rows() == stack.rows());
    CHECK(rq.columns == stack.cols());
    CHECK(relative_error(rq.R * rq.R.transpose(), gram) < 1e-13);
    CHECK(rq.R.triangularView<Eigen::StrictlyUpper>().toDenseMatrix().norm() == 0);
    CHECK(rq.R(0, 0) == Approx(std::sqrt(static_cast<double>(rq.columns))));

    // R32 R22' is the part of Y_future U_past' that the constant and U_future do not explain.
    const Matrix known = stack.topRows(1 + m * future);
    const Matrix past_u = stack.middleRows(1 + m * future, m * past), future_y = stack.bottomRows(p * future);
    const Matrix explained = solve(known * known.transpose(), known * past_u.transpose());
    CHECK(relative_error(rq.R32() * rq.R22().transpose(),
                         future_y * (past_u - explained.transpose() * known).transpose()) < 1e-11);
  }
}

TEST_CASE(
    "eqs. (6)-(11): the Markov parameters of a linear system come back from noise-free data, whatever x0 and y0") {
  Random random = numbers(52);
  for (const auto& [n, m, p] : {std::tuple<Index, Index, Index>{1, 1, 1}, {2, 1, 1}, {4, 1, 3}, {5, 2, 2}, {8, 3, 2}})
    for (const Index given : {Index{0}, n}) {
      CAPTURE(n, m, p, given);
      LinearModel truth = random_linear(n, m, p, 0.9, random);
      truth.y0 = 5 * random.normal(p, 1);
      const Matrix u = random.normal(m, 1500);
      const Vector x0 = 3 * random.normal(n, 1);
      const Matrix y = simulate(truth, u, x0).y;
      const LinearEstimate found = make_pi_moesp({.block_rows = 12})->identify(u, y, given);
      REQUIRE(found.status == Status::ok);
      CHECK(found.order_used == n);
      CHECK(found.order_given == given);
      CHECK(found.gap > 1e3);  // the next singular value is round-off
      CHECK_FALSE(found.stabilised);
      // Round-off times the condition of the instruments' covariance.
      CHECK(relative_error(markov_parameters(found.model, 20), markov_parameters(truth, 20)) < 1e-6);
      CHECK(relative_error(found.model.y0, truth.y0) < 1e-6);
      CHECK(relative_error(simulate(found.model, u, found.x0).y, y) < 1e-6);
      CHECK(same_poles(found.model.A, truth.A, 1e-4));
      CHECK(found.spectral_radius == Approx(0.9).margin(1e-4));
    }
}

TEST_CASE("Remark 1: an output offset and an input offset leave no trace in the Markov parameters") {
  Random random = numbers(53);
  const LinearModel truth = random_linear(4, 1, 2, 0.9, random);
  const Matrix u = random.normal(1, 1500);
  const auto markov = [&](double output_offset, double input_offset) {
    Matrix y = simulate(truth, u, Vector::Zero(4)).y;
    y.array() += output_offset;
    const LinearEstimate found = make_pi_moesp({.block_rows = 10})->identify((u.array() + input_offset).matrix(), y, 4);
    REQUIRE(found.status == Status::ok);
    return markov_parameters(found.model, 15);
  };
  const Matrix expected = markov_parameters(truth, 15);
  CHECK(relative_error(markov(100, 0), expected) < 1e-6);
  CHECK(relative_error(markov(0, 10), expected) < 1e-6);
}

TEST_CASE("Sec. 2.3: past inputs as instruments keep output noise out of the poles as the record grows") {
  Random random = numbers(54);
  const LinearModel truth = random_linear(3, 1, 2, 0.9, random);
  const auto error = [&](Index samples) {
    const Matrix u = random.normal(1, samples);
    const Matrix clean = simulate(truth, u, Vector::Zero(3)).y;
    const Matrix y =
        clean + 0.3 * clean.norm() / std::sqrt(2.0 * static_cast<double>(samples)) * random.normal(2, samples);
    const LinearEstimate found = make_pi_moesp({.block_rows = 10})->identify(u, y, 3);
    return relative_error(markov_parameters(found.model, 20), markov_parameters(truth, 20));
  };
  const double short_record = error(1000), long_record = error(64000);
  CAPTURE(short_record, long_record);
  CHECK(short_record < 0.5);
  CHECK(long_record < short_record / 3);  // 1/sqrt(N) promises 8
}

TEST_CASE("the order is that of the largest gap, and never beyond the largest order tried") {
  const Vector s = (Vector(6) << 100, 50, 20, 0.1, 0.05, 0.04).finished();
  CHECK(order_from_gap(s, 5).order == 3);
  CHECK(order_from_gap(s, 5).gap == Approx(200));
  CHECK(order_from_gap(s, 2).order == 2);
  CHECK(order_from_gap(Vector::Zero(6), 5).order == 0);
  // Round-off that a decomposition returns as exact zeros is no gap.
  CHECK(order_from_gap((Vector(5) << 100, 50, 1e-13, 0, 0).finished(), 4).order == 2);
}

TEST_CASE("B, D, x0 and y0 are least-squares estimates: noise in y leaves a residual without correlation to u") {
  Random random = numbers(55);
  const LinearModel truth = random_linear(3, 2, 2, 0.9, random);
  const Matrix u = random.normal(2, 800);
  const Matrix y = simulate(truth, u, random.normal(3, 1)).y + 0.2 * random.normal(2, 800);
  const InputMatrices found = estimate_input_matrices(truth.A, truth.C, u, y, 1);
  CHECK(found.rank == 3 * 2 + 3 + 2 * 1 + 2);
  CHECK(found.model.D.col(1).norm() == 0);  // only the first input has a direct term
  const Matrix residual = y - simulate(found.model, u, found.x0).y;
  const double scale = residual.norm() * u.norm();
  CHECK((residual * u.row(0).transpose()).norm() < 1e-11 * scale);
  CHECK(residual.rowwise().sum().norm() < 1e-11 * scale);
  CHECK((residual * u.row(1).transpose()).norm() > 1e-4 * scale);  // that D is not free
}

TEST_CASE("B, D, x0 and y0 of a noise-free record are exact, whatever the eigenvalues of A and the input's band") {
  Random random = numbers(57);
  for (int trial = 0; trial < 40; ++trial) {
    const Index n = 1 + random.integer(6), m = 1 + random.integer(3), p = 1 + random.integer(4);
    const Index direct = random.integer(m + 1), samples = 200 + random.integer(3000);
    LinearModel truth = random_linear(n, m, p, 0.3 + 0.65 * random.uniform(), random);
    const int kind = trial % 4;
    if (kind == 1 && n > 1) {  // one Jordan block: no eigenvectors to speak of
      truth.A = 0.8 * Matrix::Identity(n, n);
      truth.A.diagonal(1).setConstant(0.1);
    }
    if (kind == 2) truth.A = random_dynamics(n, 0.9, random).diagonal().asDiagonal();  // real and far apart
    truth.D.rightCols(m - direct).setZero();
    truth.y0 = random.normal(p, 1);
    Matrix u = random.normal(m, samples);
    if (kind == 3)  // little above a tenth of the band
      for (int pass = 0; pass < 2; ++pass)
        for (Index k = 1; k < samples; ++k) u.col(k) = 0.8 * u.col(k - 1) + 0.2 * u.col(k);
    const Vector x0 = random.normal(n, 1);
    const Matrix y = simulate(truth, u, x0).y;
    const InputMatrices found = estimate_input_matrices(truth.A, truth.C, u, y, direct);
    CAPTURE(trial, n, m, p, direct, samples, found.condition);
    REQUIRE(found.rank == n * m + n + p * direct + p);
    CHECK(relative_error(simulate(found.model, u, found.x0).y, y) < 1e-10);
    CHECK((found.model.B - truth.B).norm() < 1e-12 * found.condition * (1 + truth.B.norm()));
    CHECK((found.model.D - truth.D).norm() < 1e-12 * found.condition * (1 + truth.D.norm()));
    CHECK((found.x0 - x0).norm() < 1e-12 * found.condition * (1 + x0.norm()));
  }
}

TEST_CASE("two inputs that are one: the rank of the regression says that B is not determined") {
  Random random = numbers(58);
  const LinearModel truth = random_linear(3, 2, 2, 0.9, random);
  Matrix u = random.normal(2, 600);
  u.row(1) = -2 * u.row(0);
  const InputMatrices found = estimate_input_matrices(truth.A, truth.C, u, simulate(truth, u, Vector::Zero(3)).y, 2);
  CHECK(found.rank == 3 + 3 + 2 + 2);
}

TEST_CASE("eq. (4): the remainder is uncorrelated with constant, input and state, and r33 is its factor") {
  Random random = numbers(56);
  const NonlinearModel model = random_nonlinear(4, 2, 3, 2, random);
  const Matrix u = random.normal(2, 3000);
  const FreeRun run = free_run(model, u, Vector::Zero(4));
  REQUIRE(run.status == Status::ok);
  const Decomposition split = decompose(run.x, u);
  const Index N = u.cols() - 1;
  Matrix rest = run.x.rightCols(N) - split.A * run.x.leftCols(N) - split.B * u.leftCols(N);
  rest.colwise() -= Vector(rest.rowwise().mean());
  const auto correlation = [&](const Matrix& signal) {
    return (rest * signal.transpose()).norm() / (rest.norm() * signal.norm());
  };
  CHECK(correlation(u.leftCols(N)) < 1e-13);
  CHECK(correlation(run.x.leftCols(N)) < 1e-13);
  CHECK(relative_error(split.r33 * split.r33.transpose(), rest * rest.transpose()) < 1e-11);
  CHECK(split.singular_values(0) == Approx(svd(rest).s(0) / std::sqrt(static_cast<double>(N))));
}

TEST_CASE("eq. (4): the rank of r33 is the number of nonlinear directions, and zero nonlinearity leaves no remainder") {
  Random random = numbers(57);
  for (const Index q : {1, 2}) {
    NonlinearModel model = random_nonlinear(4, 1, 3, q, random);
    const Matrix u = random.normal(1, 2000);
    const Decomposition split = decompose(free_run(model, u, Vector::Zero(4)).x, u, 1e-6);
    CHECK(split.rank == q);
    CHECK(split.singular_values(q) < 1e-10 * split.singular_values(0));
    CHECK(split.share > 1e-4);
    // The columns of r33 lie in the image of Bt.
    const LeastSquares inside = least_squares(model.Bt, split.r33);
    CHECK(inside.residual_norm < 1e-10 * split.r33.norm());

    model.map = nullptr;
    CHECK(decompose(free_run(model, u, Vector::Zero(4)).x, u).share < 1e-12);
  }
}

TEST_CASE("eq. (3): for a linear system the decomposition returns its poles and its response") {
  Random random = numbers(58);
  const LinearModel truth = random_linear(4, 2, 2, 0.9, random);
  const Matrix u = random.normal(2, 1000);
  const Decomposition split = decompose(simulate(truth, u, Vector::Zero(4)).x, u);
  LinearModel found = truth;
  found.A = split.A;
  found.B = split.B;
  CHECK(relative_error(markov_parameters(found, 15), markov_parameters(truth, 15)) < 1e-10);
}

TEST_CASE("persistency of excitation: zero 0, constant 1, a sine 2, two sines 4, noise any order") {
  Random random = numbers(59);
  const Index N = 2000, limit = 30;
  Matrix sine(1, N), two(1, N);
  for (Index k = 0; k < N; ++k) {
    sine(0, k) = std::sin(0.3 * static_cast<double>(k));
    two(0, k) = sine(0, k) + 0.5 * std::cos(1.1 * static_cast<double>(k));
  }
  CHECK(persistency_of_excitation(Matrix::Zero(1, N), limit) == 0);
  CHECK(persistency_of_excitation(Matrix::Constant(1, N, 3), limit) == 1);
  CHECK(persistency_of_excitation(sine, limit) == 2);
  CHECK(persistency_of_excitation(two, limit) == 4);
  CHECK(persistency_of_excitation((two.array() + 1).matrix(), limit) == 5);
  CHECK(persistency_of_excitation(random.normal(1, N), limit) == limit);
  CHECK(persistency_of_excitation(random.normal(3, N), limit) == limit);
  // A channel that repeats another excites nothing of its own.
  const Matrix noise = random.normal(1, N);
  CHECK(persistency_of_excitation(noise.replicate(2, 1), limit) == 0);
  // Scale does not matter, and too short a record cannot excite.
  CHECK(persistency_of_excitation(1e-9 * two, limit) == 4);
  CHECK(persistency_of_excitation(noise.leftCols(10), limit) <= 5);
}
