// The families of static maps: what each of them can represent, and how its fit starts.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/identify/map_fit.hpp"
#include "tests/support/pieces.hpp"
#include "tests/support/systems.hpp"
#include "variants/nonlinearity/polynomial.hpp"
#include "variants/nonlinearity/rbf.hpp"
#include "variants/solver/levenberg_marquardt.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

constexpr Index kInputs = 5;

/// A hardening force along one direction, as a spring between two bodies: 5-D points of unit variance.
struct Ridge {
  Matrix xi, f;
  explicit Ridge(std::uint64_t cell, Index samples = 2000) {
    Random random = numbers(cell);
    xi = random.normal(kInputs, samples);
    const Vector t = random.normal(kInputs, 1).normalized();
    f = (xi.transpose() * t).unaryExpr([](double s) { return std::sinh(s) + 0.1 * s * s; }).transpose();
  }
};

/// Relative error of a fitted map on points it has not seen: what the family can follow, so with starts enough that
/// none of them has to be a lucky one.
double error_of(const StaticMap& prototype, std::uint64_t cell, Index starts = 8) {
  Random random = numbers(cell + 1);
  const Ridge seen(cell);
  const MapFit fit =
      fit_static_map(prototype, seen.xi, seen.f, {.starts = starts}, *make_levenberg_marquardt({}), random);
  REQUIRE(fit.status == Status::ok);
  return fit.residual;
}

}  // namespace

TEST_CASE("radial units of a learned direction follow a ridge in five dimensions, isotropic ones do not", "[slow]") {
  for (const std::uint64_t cell : {171, 173, 175}) {
    const double learned = error_of(*make_rbf(kInputs, 1, {}), cell);
    const double isotropic = error_of(*make_rbf(kInputs, 1, {.hidden_units = 12, .directions = 0}), cell, 1);
    CAPTURE(cell, learned, isotropic);
    CHECK(learned < 0.02);
    CHECK(isotropic > 2 * learned);
  }
}

TEST_CASE("a widened map has the old features, faint new ones, and nearly the same f") {
  Random random = numbers(179);
  for (Index outputs = 1; outputs <= 2; ++outputs) {
    const auto map = make_mlp(kInputs, outputs, {.hidden_units = 4});
    const Matrix xi = random.normal(kInputs, 300);
    map->initialise(xi, random.normal(outputs, 300), random);
    map->W = random.normal(outputs, 4);
    map->b = random.normal(outputs, 1);
    map->L = random.normal(outputs, kInputs);
    const auto wider = map->widened(3, random);
    REQUIRE(wider);
    CHECK(wider->features() == 7);
    CHECK(wider->to_json().at("options").at("hidden_units") == 7);
    Matrix before(outputs, 300), after(outputs, 300);
    Vector phi(7);
    for (Index k = 0; k < 300; ++k) {
      map->value(xi.col(k).data(), before.col(k).data(), phi.data());
      wider->value(xi.col(k).data(), after.col(k).data(), phi.data());
    }
    CHECK(relative_error(after, before) < 0.01);
    CHECK(relative_error(after, before) > 0);
    CHECK(wider->W.rightCols(3).cwiseAbs().minCoeff() > 0);
  }
}

TEST_CASE("radial units start spread over the points: centres among them, widths of their spacing") {
  Random random = numbers(177);
  const Ridge ridge(178);
  const auto map = make_rbf(kInputs, 1, {.hidden_units = 6});
  map->initialise(ridge.xi, ridge.f, random);
  const Matrix P = map->alpha.head(kInputs).transpose();
  const Matrix t = P * ridge.xi;
  CHECK(t.norm() / std::sqrt(static_cast<double>(t.cols())) == Approx(1));  // unit variance along the direction
  const Vector centres = map->alpha.segment(kInputs, 6), widths = map->alpha.tail(6).array().exp();
  CHECK(centres.minCoeff() > t.minCoeff());
  CHECK(centres.maxCoeff() < t.maxCoeff());
  CHECK(centres.maxCoeff() - centres.minCoeff() > 2);
  CHECK(widths.minCoeff() > 0.1);
  CHECK(widths.maxCoeff() < 3);
}

TEST_CASE("a polynomial has the terms of its degree, and a cubic of many inputs comes back exactly") {
  CHECK(polynomial_terms(5, {.degree = 3}) == 50);
  CHECK(polynomial_terms(5, {.degree = 5}) == 246);
  CHECK(polynomial_terms(5, {.degree = 5, .odd = true}) == 35 + 126);
  CHECK(polynomial_terms(1, {.degree = 4}) == 3);
  CHECK(make_polynomial(5, 1, {.degree = 3})->features() == 50);
  Random random = numbers(179);
  const Matrix xi = random.normal(3, 600);
  Matrix f(2, 600);
  f.row(0) = xi.row(0).array() * xi.row(1).array() * xi.row(2).array() - xi.row(1).array().cube() + 2;
  f.row(1) = 3 * xi.row(2).array().square() + xi.row(0).array();
  const MapFit fit = fit_weights(*make_polynomial(3, 2, {.degree = 3}), xi, f);
  REQUIRE(fit.status == Status::ok);
  CHECK(fit.residual < 1e-12);
  const MapFit lower = fit_weights(*make_polynomial(3, 2, {.degree = 2}), xi, f);
  CHECK(lower.residual > 0.1);
  CHECK_THROWS_WITH(make_polynomial(30, 1, {.degree = 7}), Catch::Contains("degree 7") && Catch::Contains("lower"));
}

TEST_CASE("a map with more weights than samples is refused with both numbers") {
  Random random = numbers(181);
  for (const Index samples : {1, 5, 8}) {
    const MapFit fit = fit_static_map(*make_rbf(3, 1, {.hidden_units = 4}), random.normal(3, samples),
                                      random.normal(1, samples), {}, *make_levenberg_marquardt({}), random);
    CHECK(fit.status == Status::rank_deficient);
    CHECK_THAT(fit.message, Catch::Contains(std::to_string(samples)) && Catch::Contains("8"));
  }
}

TEST_CASE("basis_of many points is basis of each, for every map") {
  Random random = numbers(180);
  const Matrix xi = random.normal(4, 50);
  for (const auto& [name, make] : pieces_of(nonlinearity_table())) {
    const auto map = make(4, 1);
    map->initialise(xi, random.normal(1, 50), random);
    const Matrix all = map->basis_of(xi);
    Vector phi(map->features());
    for (Index k = 0; k < xi.cols(); ++k) {
      map->basis(xi.col(k).data(), phi.data());
      CAPTURE(name, k);
      CHECK((all.row(k).transpose() - phi).norm() <= 1e-12 * phi.norm());
    }
  }
}
