// Dense decompositions on matrices that occur where a model diverged.
#include "core/base/linalg.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/random.hpp"

using namespace wheelhop;

TEST_CASE("singular values and vectors make the matrix again, over any range of its rows and columns") {
  for (const double decades : {0.0, 8.0, 14.0, 30.0, 90.0})
    for (int kind = 0; kind < 4; ++kind)
      for (std::uint64_t trial = 0; trial < 6; ++trial) {
        Random random(51, Stream::parameters, trial, static_cast<std::uint64_t>(kind));
        const Index n = 3 + random.integer(80);
        Matrix M = random.normal(n, n);
        if (kind > 0)
          for (Index i = 0; i < n; ++i) M.row(i).tail(n - 1 - i).setZero();
        if (kind == 2)
          M.col(0) *= std::pow(10, decades);
        else
          for (Index i = 0; i < n; ++i) {
            const double share = kind == 3 ? static_cast<double>(i) / static_cast<double>(n) : random.uniform();
            M.row(i) *= std::pow(10, decades * share);
          }
        CAPTURE(decades, kind, n);
        const Svd d = svd(M);
        CHECK((d.U * d.s.asDiagonal() * d.V.transpose() - M).norm() < 1e-12 * M.norm());
        CHECK((d.U.transpose() * d.U - Matrix::Identity(n, n)).norm() < 1e-11);
        CHECK((d.V.transpose() * d.V - Matrix::Identity(n, n)).norm() < 1e-11);
        CHECK(std::is_sorted(d.s.begin(), d.s.end(), std::greater<>()));
        const Vector alone = singular_values(M);
        CHECK(std::is_sorted(alone.begin(), alone.end(), std::greater<>()));
        CHECK((alone - d.s).cwiseAbs().maxCoeff() < 1e-13 * d.s(0));
        const Matrix wide = M.topRows(2 + n / 2);
        CHECK((singular_values(wide) - svd(wide).s).cwiseAbs().maxCoeff() < 1e-13 * d.s(0));
      }
  CHECK(svd(Matrix::Zero(3, 2)).s.isZero());
  CHECK(singular_values(Matrix::Zero(3, 2)) == Vector::Zero(2));
  CHECK(singular_values(Matrix(0, 2)).size() == 0);
  CHECK(singular_values(Matrix::Constant(2, 2, std::nan(""))).hasNaN());
}

TEST_CASE("leading left singular vectors are those of the whole decomposition, as far as their gap tells them apart") {
  for (std::uint64_t trial = 0; trial < 40; ++trial) {
    Random random(52, Stream::parameters, trial);
    const Index rows = 5 + random.integer(90), columns = 5 + random.integer(120), least = std::min(rows, columns);
    const Index count = 1 + random.integer(std::min<Index>(least - 1, 8));
    // Values that fall by decades and then lie on a floor; every third time without any gap.
    Vector values(least);
    for (Index i = 0; i < least; ++i)
      values(i) = trial % 3 == 0
                      ? 1 + random.uniform()
                      : std::pow(10, -0.8 * static_cast<double>(std::min(i, count))) * (1 + 0.1 * random.uniform());
    std::sort(values.begin(), values.end(), std::greater<>());
    const Svd frame = svd(random.normal(rows, columns));
    const Matrix M = frame.U * values.asDiagonal() * frame.V.transpose();
    const Matrix U = leading_left_vectors(M, count);
    CAPTURE(trial, rows, columns, count);
    REQUIRE(U.cols() == count);
    CHECK((U.transpose() * U - Matrix::Identity(count, count)).norm() < 1e-12);
    // Wedin: round-off of the largest over the gap to the others.
    for (Index i = 0; i < count; ++i) {
      const double above = i > 0 ? values(i - 1) - values(i) : values(0),
                   gap = std::min(above, values(i) - values(i + 1));
      const double off = (U.col(i) - frame.U.col(i) * frame.U.col(i).dot(U.col(i))).norm();
      CHECK(off < 1e-13 * values(0) / gap);
    }
  }
}
