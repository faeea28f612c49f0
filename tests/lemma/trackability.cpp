// Lemma 3 and Corollary 3.1: which sequences an auxiliary input can produce at the output.
#include <catch2/catch.hpp>

#include "core/model/linear.hpp"
#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// H-tilde of eq. (16) from the Markov parameters of (A, Bt, C, Dt), `samples` block rows.
Matrix h_tilde(const LinearModel& system, Index samples) {
  const Index p = system.output_count(), q = system.input_count();
  const Matrix markov = markov_parameters(system, samples);
  Matrix H = Matrix::Zero(p * samples, q * samples);
  for (Index i = 0; i < samples; ++i)
    for (Index j = 0; j <= i; ++j) H.block(p * i, q * j, p, q) = markov.middleCols(q * (i - j), q);
  return H;
}

/// Distance of a sequence (p x samples) from the image of H, relative to its norm.
double untracked(ConstMatrixRef H, ConstMatrixRef sequence) {
  const Vector stacked = sequence.reshaped();
  return least_squares(H, stacked, 1e-13).residual_norm / stacked.norm();
}

/// Square system without direct term, of relative degree 1 in the first and 2 in the second output.
LinearModel with_relative_degree_1_2(Random& random) {
  LinearModel system = random_linear(5, 2, 2, 0.8, random);
  system.D.setZero();
  const Matrix& B = system.B;
  const Vector c = system.C.row(1).transpose();
  system.C.row(1) -= (B * solve(B.transpose() * B, B.transpose() * c)).transpose();  // c_2 B = 0
  return system;
}

}  // namespace

TEST_CASE("eq. (16): H-tilde times the stacked input is the response from rest") {
  Random random = numbers(1);
  for (const bool direct : {false, true}) {
    LinearModel system = random_linear(4, 2, 3, 0.9, random);
    if (!direct) system.D.setZero();
    const Matrix f = random.normal(2, 15);
    const Matrix y = simulate(system, f, Vector::Zero(4)).y;
    const Vector by_matrix = h_tilde(system, 15) * f.reshaped();
    // Round-off of sums of 15 products.
    CHECK(relative_error(by_matrix, y.reshaped()) < 1e-13);
    if (!direct) CHECK(y.col(0).norm() == 0);
  }
}

TEST_CASE("Lemma 3: the response to any f is trackable, and leaves the image of H-tilde when it is disturbed off it") {
  Random random = numbers(2);
  for (const bool direct : {false, true}) {
    CAPTURE(direct);
    LinearModel system = random_linear(5, 1, 2, 0.8, random);
    if (!direct) system.D.setZero();
    const Index samples = 14;
    const Matrix H = h_tilde(system, samples);
    const Matrix y = simulate(system, random.normal(1, samples), Vector::Zero(5)).y;
    CHECK(untracked(H, y) < 1e-10);  // round-off times the condition of H

    const Matrix disturbance = random.normal(2, samples);
    const double outside = untracked(H, disturbance);
    CHECK(outside > 0.3);  // half of all directions are missing from the image
    // Adding it moves the sequence off the image by exactly its own component outside.
    const double expected = outside * disturbance.norm() / (y + disturbance).norm();
    CHECK(untracked(H, y + disturbance) == Approx(expected).epsilon(1e-6));
  }
}

TEST_CASE("Lemma 3: the input that tracks a trackable sequence reproduces it in simulation") {
  Random random = numbers(3);
  const LinearModel system = random_linear(4, 2, 3, 0.8, random);
  const Matrix y = simulate(system, random.normal(2, 12), Vector::Zero(4)).y;
  const Matrix f = least_squares(h_tilde(system, 12), y.reshaped()).x.reshaped(2, 12);
  CHECK(relative_error(simulate(system, f, Vector::Zero(4)).y, y) < 1e-10);
}

TEST_CASE("Corollary 3.1: with relative degree r any sequence with r_j leading zeros in channel j is trackable") {
  Random random = numbers(4);
  for (int repeat = 0; repeat < 5; ++repeat) {
    const LinearModel system = with_relative_degree_1_2(random);
    const Index samples = 12;
    const Matrix H = h_tilde(system, samples);
    Matrix sequence = random.normal(2, samples);
    sequence(0, 0) = sequence(1, 0) = sequence(1, 1) = 0;
    CHECK(untracked(H, sequence) < 1e-7);  // round-off times the condition of H, which unstable zeros raise
  }
}

TEST_CASE("Corollary 3.1: a sequence that is not zero in one of the first r_j samples is not trackable") {
  Random random = numbers(5);
  const LinearModel system = with_relative_degree_1_2(random);
  const Matrix H = h_tilde(system, 12);
  Matrix admissible = random.normal(2, 12);
  admissible(0, 0) = admissible(1, 0) = admissible(1, 1) = 0;
  for (const auto& [channel, sample] : {std::pair<Index, Index>{0, 0}, {1, 0}, {1, 1}}) {
    Matrix violating = admissible;
    violating(channel, sample) = 1;
    // Those rows of H are zero: the whole violation is left over.
    CHECK(untracked(H, violating) == Approx(1 / violating.norm()).epsilon(1e-6));
  }
}

TEST_CASE("Sec. 2.4: with as many inputs as outputs and r = 1 any input matrix tracks, so it cannot be told from f") {
  Random random = numbers(6);
  LinearModel system = random_linear(5, 2, 2, 0.8, random);
  system.D.setZero();
  const Matrix y = simulate(system, random.normal(2, 12), Vector::Zero(5)).y;
  LinearModel other = system;
  other.B = random.normal(5, 2);
  CHECK(untracked(h_tilde(other, 12), y) < 1e-7);
  // One input fewer, and the wrong matrix no longer tracks.
  LinearModel narrow = system;
  narrow.B = system.B.leftCols(1);
  narrow.D = system.D.leftCols(1);
  const Matrix y_narrow = simulate(narrow, random.normal(1, 12), Vector::Zero(5)).y;
  CHECK(untracked(h_tilde(narrow, 12), y_narrow) < 1e-9);
  narrow.B = random.normal(5, 1);
  CHECK(untracked(h_tilde(narrow, 12), y_narrow) > 0.05);
}
