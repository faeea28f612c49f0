// Dense decompositions on matrices that occur where a model diverged.
#include "core/base/linalg.hpp"

#include <catch2/catch.hpp>

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
      }
  CHECK(svd(Matrix::Zero(3, 2)).s.isZero());
}
