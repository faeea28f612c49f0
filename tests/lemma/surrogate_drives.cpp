// Other drives of a record's kind, and whether a model holds on them.
#include "core/identify/surrogate_drives.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// Two swept sines, a quarter of a period apart.
Matrix sweep(Index samples) {
  Matrix u(2, samples);
  for (Index k = 0; k < samples; ++k) {
    const double phase = 3e-5 * static_cast<double>(k) * static_cast<double>(k);
    u(0, k) = std::sin(phase);
    u(1, k) = 3 * std::cos(phase);
  }
  return u;
}

double longest_step(ConstMatrixRef u) {
  return (u.rightCols(u.cols() - 1) - u.leftCols(u.cols() - 1)).colwise().norm().maxCoeff();
}

}  // namespace

TEST_CASE("surrogate drives keep the range of the drive and jump nowhere") {
  Random random = numbers(620);
  for (const Index samples : {16, 100, 2000, 20000})
    for (const Matrix& u : {Matrix(random.normal(2, samples)), sweep(samples)}) {
      const auto drives = surrogate_drives(u);
      REQUIRE(drives.size() == 3);
      const Index read = drives[0].u.cols();
      CHECK(same_bits(drives[0].u.rowwise().reverse(), u.middleCols(drives[0].start + 1 - read, read)));
      for (const SurrogateDrive& drive : drives) {
        CAPTURE(samples, drive.start);
        CHECK((drive.u.rowwise().maxCoeff().array() <= u.rowwise().maxCoeff().array()).all());
        CHECK((drive.u.rowwise().minCoeff().array() >= u.rowwise().minCoeff().array()).all());
        CHECK(drive.u.cols() > std::min<Index>(samples, 16384) - 8);
        CHECK_FALSE(same_bits(drive.u, u.leftCols(drive.u.cols())));
        CHECK(drive.start >= 0);
        CHECK(drive.start < u.cols());
      }
    }
  // A fade of 62 samples adds at most the range of the inputs over its length to a step.
  const Matrix u = sweep(2000);
  for (const SurrogateDrive& drive : surrogate_drives(u))
    CHECK(longest_step(drive.u) < longest_step(u) + std::hypot(2, 6) / 60);
  CHECK(surrogate_drives(Matrix::Ones(1, 15)).empty());
  // A record that begins with a long rest: the motion after it is what is read.
  Matrix late = Matrix::Zero(1, 40000);
  late.rightCols(18000) = random.normal(1, 18000);
  for (const SurrogateDrive& drive : surrogate_drives(late)) CHECK(drive.u.squaredNorm() > 8192);  // half of it
}

TEST_CASE("drives are the same bytes at every call and other than the record") {
  const Matrix u = sweep(1000);
  const auto once = surrogate_drives(u), again = surrogate_drives(u);
  for (std::size_t i = 0; i < once.size(); ++i) CHECK(same_bits(once[i].u, again[i].u));
  CHECK_FALSE(same_bits(once[1].u, once[2].u));
}

TEST_CASE("a plant holds on other drives, whatever the units and offsets of its outputs") {
  Random random = numbers(621);
  for (int draw = 0; draw < 10; ++draw) {
    NonlinearModel model = random_nonlinear(3, 1, 2, 1, random);
    const Matrix u = random.normal(1, 2000);
    const Vector x0 = Vector::Zero(3);
    const double found = excursion(model, x0, u, free_run(model, u, x0).y);
    CHECK(found < 0.4);
    for (Matrix* rows : {&model.linear.C, &model.linear.D, &model.Dt}) *rows *= 1e-4;
    model.linear.y0 = model.linear.y0 * 1e-4 + Vector::Constant(2, 7);
    CHECK(excursion(model, x0, u, free_run(model, u, x0).y) == Approx(found).margin(1e-6));
  }
}

TEST_CASE("a model that drifts away on other drives is seen, though it follows its record") {
  // A pole at 1.001: a drive that turns in time keeps the state where it is, the same drive backwards does not.
  LinearModel model{Matrix::Constant(1, 1, 1.001), Matrix::Ones(1, 1), Matrix::Ones(1, 1), Matrix::Zero(1, 1),
                    Vector::Zero(1)};
  Matrix u = Matrix::Constant(1, 3000, 0.01);
  u.rightCols(1500).setConstant(-0.0181);
  const Vector rest = Vector::Zero(1);
  const auto found = [&] { return excursion(without_map(model), rest, u, simulate(model, u, rest).y); };
  CHECK(found() > 1);
  model.A *= 0.9;
  CHECK(found() < 0.5);
}
