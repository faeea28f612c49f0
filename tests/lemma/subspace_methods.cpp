// What every subspace method owes: the system of noise-free data, consistency, and where theory makes two methods one.
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/pieces.hpp"
#include "tests/support/systems.hpp"
#include "variants/subspace/n4sid.hpp"
#include "variants/subspace/pi_moesp.hpp"
#include "variants/subspace/po_moesp.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// Every method with few block rows, and N4SID with each of its algorithms and equations.
std::vector<Named<SubspacePiece>> methods(Index block_rows) {
  std::vector<Named<SubspacePiece>> all = pieces_of(subspace_table(), {{"block_rows", block_rows}});
  for (const char* algorithm : {"combined", "robust"})
    for (const char* matrices : {"simulation", "projection"})
      all.push_back(
          {std::string("n4sid ") + algorithm + " " + matrices,
           make_n4sid({.hankel = {.block_rows = block_rows}, .algorithm = algorithm, .input_matrices = matrices})});
  return all;
}

/// Largest distance from a pole of the truth to the nearest one found.
double pole_distance(const Matrix& found, const Matrix& truth) {
  const ComplexVector poles = eigenvalues(found);
  double worst = 0;
  for (const auto& pole : eigenvalues(truth)) worst = std::max(worst, (poles.array() - pole).abs().minCoeff());
  return worst;
}

/// Noise with the pole 0.6 a channel, or white, of unit variance.
Matrix noise(Index channels, Index samples, bool coloured, Random& random) {
  Matrix e = random.normal(channels, samples);
  if (coloured)
    for (Index k = 1; k < samples; ++k) e.col(k) = 0.6 * e.col(k - 1) + 0.8 * e.col(k);
  return e;
}

}  // namespace

TEST_CASE("every subspace method: Markov parameters and poles come back from noise-free data, whatever x0 and y0") {
  Random random = numbers(151);
  for (const Index m : {1, 2, 3})
    for (const Index p : {1, 2, 3}) {
      const Index n = 1 + m + p;
      LinearModel truth = random_linear(n, m, p, 0.9, random);
      truth.y0 = 5 * random.normal(p, 1);
      const Matrix u = random.normal(m, 1500);
      const Matrix y = simulate(truth, u, 3 * random.normal(n, 1)).y;
      for (const auto& [name, method] : methods(10))
        for (const Index given : {Index{0}, n}) {
          CAPTURE(name, m, p, given);
          const LinearEstimate found = method->identify(u, y, given);
          CAPTURE(found.message);
          REQUIRE(found.status == Status::ok);
          CHECK(found.order_used == n);
          CHECK(relative_error(markov_parameters(found.model, 20), markov_parameters(truth, 20)) < 1e-5);
          CHECK(pole_distance(found.model.A, truth.A) < 1e-3);
          CHECK(relative_error(simulate(found.model, u, found.x0).y, y) < 1e-5);
          CHECK(found.instruments > 0);
          CHECK(found.instrument_condition >= 1);
        }
    }
}

TEST_CASE("every subspace method: output noise leaves the Markov parameters as the record grows", "[slow]") {
  // Past outputs carry coloured noise into the future outputs: methods that use them need the noise's states in the
  // order. Past inputs do not, and need none.
  Random random = numbers(152);
  const LinearModel truth = random_linear(3, 1, 2, 0.8, random);
  for (const bool coloured : {false, true})
    for (const auto& [name, method] : methods(8)) {
      const Index order = coloured && name != "pi_moesp" ? 3 + 2 : 3;
      const auto error = [&](Index samples) {
        double sum = 0;
        for (int trial = 0; trial < 3; ++trial) {
          const Matrix u = random.normal(1, samples);
          const Matrix clean = simulate(truth, u, Vector::Zero(3)).y;
          const double size = 0.3 * clean.norm() / std::sqrt(static_cast<double>(clean.size()));
          const LinearEstimate found = method->identify(u, clean + size * noise(2, samples, coloured, random), order);
          REQUIRE(found.status == Status::ok);
          sum += relative_error(markov_parameters(found.model, 15), markov_parameters(truth, 15));
        }
        return sum / 3;
      };
      const double few = error(1000), many = error(32000);
      CAPTURE(name, coloured, few, many);
      CHECK(few < 0.6);
      CHECK(many < few / 2.5);  // 1/sqrt(N) promises 5.7
    }
}

TEST_CASE("robust N4SID without a rank decision has the singular values of PO-MOESP: its weighting is the same") {
  Random random = numbers(153);
  const LinearModel truth = random_linear(4, 2, 2, 0.9, random);
  const Matrix u = random.normal(2, 2000);
  const Matrix y = simulate(truth, u, Vector::Zero(4)).y + 0.1 * random.normal(2, 2000);
  const Vector moesp = make_po_moesp({.block_rows = 8})->identify(u, y, 4).singular_values;
  const Vector robust =
      make_n4sid({.hankel = {.block_rows = 8}, .rank_tolerance = 0})->identify(u, y, 4).singular_values;
  CHECK(relative_error(robust, moesp) < 1e-10);
}

TEST_CASE("PO-MOESP and N4SID span one column space on noise-free data: the same poles") {
  Random random = numbers(154);
  const LinearModel truth = random_linear(5, 1, 2, 0.95, random);
  const Matrix u = random.normal(1, 2000), y = simulate(truth, u, random.normal(5, 1)).y;
  const LinearEstimate moesp = make_po_moesp({.block_rows = 12})->identify(u, y, 5),
                       n4sid = make_n4sid({.hankel = {.block_rows = 12}, .algorithm = "combined"})->identify(u, y, 5);
  CHECK(pole_distance(n4sid.model.A, moesp.model.A) < 1e-5);
}

TEST_CASE("a drive far below the sampling rate: every method keeps its poles, the condition of the past is told") {
  Random random = numbers(155);
  LinearModel truth = random_linear(2, 1, 2, 0.9, random);
  truth.A = (Matrix(2, 2) << 0.97, 0.2, -0.2, 0.97).finished() * 0.99;
  Matrix u = random.normal(1, 6000);
  for (int pass = 0; pass < 4; ++pass)  // a low-pass of order 4
    for (Index k = 1; k < u.cols(); ++k) u(0, k) = 0.8 * u(0, k - 1) + 0.2 * u(0, k);
  Matrix y = simulate(truth, u, Vector::Zero(2)).y;
  y += 1e-3 * y.norm() / std::sqrt(static_cast<double>(y.size())) * random.normal(2, 6000);
  for (const auto& [name, method] : methods(15)) {
    const LinearEstimate found = method->identify(u, y, 2);
    CAPTURE(name, found.instrument_condition, found.instruments);
    REQUIRE(found.status == Status::ok);
    CHECK(pole_distance(found.model.A, truth.A) < 0.02);
    CHECK(found.instrument_condition > 100);
  }
}

TEST_CASE("needs() is exact: with one sample less a method says so, with what it asks for it runs") {
  Random random = numbers(156);
  for (const auto& [name, method] : methods(6))
    for (const auto& [m, p] : {std::pair<Index, Index>{1, 1}, {2, 3}}) {
      CAPTURE(name, m, p);
      const RecordNeeds needs = method->needs(m, p);
      CHECK(needs.excitation == 12);
      const LinearModel truth = random_linear(2, m, p, 0.8, random);
      const Matrix u = random.normal(m, needs.samples), y = simulate(truth, u, Vector::Zero(2)).y;
      CHECK(method->identify(u, y, 2).status == Status::ok);
      const LinearEstimate less = method->identify(u.rightCols(needs.samples - 1), y.rightCols(needs.samples - 1), 2);
      CHECK(less.status == Status::rank_deficient);
      CHECK_THAT(less.message, Catch::Contains(std::to_string(needs.samples)));
    }
}
