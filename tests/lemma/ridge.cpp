// A polynomial of one direction in place of a map of free units: when it is taken, how many powers, what it is worth.
#include "core/identify/ridge.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/data/metrics.hpp"
#include "core/identify/map_fit.hpp"
#include "tests/support/systems.hpp"
#include "variants/nonlinearity/ridge_polynomial.hpp"
#include "variants/solver/levenberg_marquardt.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

constexpr Index kOrder = 2, kSamples = 3000;

const RidgeFactory kRidge = [](Index inputs, const RidgeForm& form) {
  return make_ridge_polynomial(inputs, 1, {.degree = form.degree, .odd = form.odd, .hardening = form.hardening});
};

/// A resonant system with the given force of its first state; xi = [x; u].
NonlinearModel oscillator(std::shared_ptr<StaticMap> map) {
  NonlinearModel model;
  model.linear.A = (Matrix(2, 2) << 0.85, 0.35, -0.35, 0.85).finished();
  model.linear.B = (Matrix(2, 1) << 0.1, 0.3).finished();
  model.linear.C = Matrix::Identity(2, 2);
  model.linear.D = (Matrix(2, 1) << 0, 0.2).finished();
  model.linear.y0 = Vector::Zero(2);
  model.Bt = (Matrix(2, 1) << 0.05, -0.3).finished();
  model.Dt = (Matrix(2, 1) << 0, -1).finished();
  model.map = std::move(map);
  return model;
}

/// f = T_3(s) / 2 + even T_4(s), s along the first state.
std::shared_ptr<StaticMap> spring(double even) {
  const bool odd = even == 0;
  std::shared_ptr<StaticMap> map = make_ridge_polynomial(kOrder + 1, 1, {.degree = odd ? 3 : 4, .odd = odd});
  map->alpha << 0.3, 0, 0;
  if (odd)
    map->W << 0.5;
  else
    map->W << 0, 0.5, even;
  return map;
}

struct RidgeRecord {
  Matrix u, y;
  FreeRun run;
  NonlinearModel start;  ///< the truth but for its map: tanh units fitted to a noisy f
  double noise = 0.01;
  Vector x0 = Vector::Zero(kOrder);

  RidgeRecord(const NonlinearModel& truth, std::uint64_t cell) {
    Random random = numbers(cell);
    u = random.normal(1, kSamples);
    run = free_run(truth, u, x0);
    REQUIRE(run.status == Status::ok);
    y = run.y + noise * random.normal(2, kSamples);
    Matrix xi(kOrder + 1, kSamples);
    xi << run.x.leftCols(kSamples), u;
    const Matrix f = run.f.leftCols(kSamples) + 0.02 * random.normal(1, kSamples);
    const MapFit fit =
        fit_static_map(*make_mlp(kOrder + 1, 1, {.hidden_units = 4}), xi, f, {}, *make_levenberg_marquardt({}), random);
    REQUIRE(fit.status == Status::ok);
    start = truth;
    start.map = fit.map;
    fold_linear_part(start, fit.linear);
  }

  std::optional<Refinement> ridge(const RidgeDegrees& degrees = {.any = 9}) const {
    return fit_ridge(start, x0, u, y, Vector::Ones(2), 0, *make_levenberg_marquardt({}), 30, kRidge, degrees);
  }
};

Matrix error_beyond(const NonlinearModel& model, const NonlinearModel& truth) {
  Random random = numbers(310);
  const Matrix u = 1.3 * random.normal(1, kSamples);
  const Vector rest = Vector::Zero(kOrder);
  const FreeRun told = free_run(truth, u, rest), guessed = free_run(model, u, rest);
  REQUIRE(told.status == Status::ok);
  REQUIRE(guessed.status == Status::ok);
  return guessed.y - told.y;
}

}  // namespace

TEST_CASE("ridge polynomial: T_k(cos a) = cos(k a), or s^k, in ascending degree, beyond 1.5 its tangent") {
  for (const bool odd : {false, true})
    for (const bool hardening : {false, true}) {
      const auto map = make_ridge_polynomial(2, 1, {.degree = 7, .odd = odd, .hardening = hardening});
      map->alpha << 1, 0.5;
      REQUIRE(map->features() == (odd ? 3 : 6));
      const auto phi = [&](double s) {
        const Vector xi = (Vector(2) << s - 0.2, 0.4).finished();
        Vector values(map->features());
        map->basis(xi.data(), values.data());
        return values;
      };
      const double angle = 0.7;
      const Vector at = phi(std::cos(angle));
      for (Index i = 0; i < at.size(); ++i) {
        const double k = static_cast<double>(odd ? 2 * i + 3 : i + 2);
        CHECK(at(i) == Approx(hardening ? std::pow(std::cos(angle), k) : std::cos(k * angle)));
      }
      for (const double side : {-1.0, 1.0}) {
        const double step = 1e-4;
        const Vector slope = (phi(side * 1.5) - phi(side * (1.5 - step))) / step;
        const Vector beyond = phi(side * 2.5) - phi(side * 1.5), further = phi(side * 3.5) - phi(side * 2.5);
        CHECK(relative_difference(beyond, further) < 1e-12);
        CHECK(relative_difference(slope, beyond) < 1e-2);
      }
    }
}

TEST_CASE("active direction: that of a ridge function whatever its linear part, two directions share the variance") {
  Random random = numbers(301);
  const Matrix xi = random.normal(3, 400);
  const auto map = make_mlp(3, 1, {.hidden_units = 2});
  map->alpha << 0.6, -0.8, 0, 0.3, -1.2, 1.6, 0, 1;
  map->W << 1, 0.5;
  map->L << 3, 2, 1;
  const ActiveDirection one = active_direction(*map, xi);
  CHECK(one.share == Approx(1).epsilon(1e-12));
  CHECK(std::abs(one.t.normalized().dot(map->alpha.head(3))) == Approx(1).epsilon(1e-12));
  CHECK((xi.transpose() * one.t).cwiseAbs().maxCoeff() == Approx(1));
  map->alpha.segment(4, 3) << 0.8, 0.6, 0;
  map->W << 1, 1;
  CHECK(active_direction(*map, xi).share < 0.9);
}

TEST_CASE("a cubic spring behind tanh units is found as one odd cubic, to the noise, and extrapolates") {
  const NonlinearModel truth = oscillator(spring(0));
  const RidgeRecord record(truth, 302);
  const auto found = record.ridge();
  REQUIRE(found.has_value());
  CHECK(found->model.map->to_json().at("options") == Json{{"degree", 3}, {"odd", true}, {"hardening", false}});
  CHECK(2 * found->solution.cost < 1.05 * record.noise * record.noise * static_cast<double>(record.y.size()));
  const double left = error_beyond(found->model, truth).norm();
  CHECK(left < 0.2 * record.noise * std::sqrt(2.0 * kSamples));
  CHECK(left < 0.5 * error_beyond(record.start, truth).norm());
}

TEST_CASE("an even power that the record calls for is kept, and those above it are not") {
  const RidgeRecord record(oscillator(spring(0.05)), 303);
  const auto found = record.ridge();
  REQUIRE(found.has_value());
  CHECK(found->model.map->to_json().at("options") == Json{{"degree", 4}, {"odd", false}, {"hardening", false}});
}

TEST_CASE(
    "a spring that stiffens towards a stop is found with weights of one sign, which hold farther, others keep "
    "both signs") {
  const RidgeDegrees both{.any = 9, .hardening = 15};
  for (const double way : {1.0, -1.0}) {
    const std::shared_ptr<StaticMap> stop =
        make_ridge_polynomial(kOrder + 1, 1, {.degree = 15, .odd = true, .hardening = true});
    stop->alpha << 0.4, 0, 0;
    stop->W << 0.8, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2;
    stop->W *= way;
    const NonlinearModel truth = oscillator(stop);
    const RidgeRecord record(truth, 306);
    const auto stiffening = record.ridge(both), any = record.ridge({.any = 9});
    REQUIRE(stiffening.has_value());
    REQUIRE(any.has_value());
    CHECK(stiffening->model.map->to_json().at("options").at("hardening") == true);
    CHECK(stiffening->model.map->W.minCoeff() >= 0);
    CHECK(stiffening->solution.cost < 1.001 * any->solution.cost);
    CHECK(error_beyond(stiffening->model, truth).norm() < 0.7 * error_beyond(any->model, truth).norm());
  }
  const auto turning = make_ridge_polynomial(kOrder + 1, 1, {.degree = 5, .odd = true});
  turning->alpha << 0.3, 0, 0;
  turning->W << 0.4, -0.1;
  const auto kept = RidgeRecord(oscillator(std::shared_ptr<StaticMap>(turning->clone())), 307).ridge(both);
  REQUIRE(kept.has_value());
  CHECK(kept->model.map->to_json().at("options").at("hardening") == false);
}

TEST_CASE("no polynomial is offered for two directions, two outputs, no factory, or where the units do better",
          "[slow]") {
  std::shared_ptr<StaticMap> two = make_mlp(kOrder + 1, 1, {.hidden_units = 2});
  two->alpha << 0.8, 0, 0, 0.1, 0, 0.8, 0, -0.1;
  two->W << -0.5, 0.5;
  RidgeRecord record(oscillator(two), 304);
  record.start = oscillator(two);
  CHECK_FALSE(record.ridge());

  std::shared_ptr<StaticMap> step = make_mlp(kOrder + 1, 1, {.hidden_units = 1});
  step->alpha << 12, 0, 0, 1;
  step->W << 0.4;
  RidgeRecord sharp(oscillator(step), 305);
  sharp.start = oscillator(step);
  CHECK_FALSE(sharp.ridge());

  const RidgeRecord cubic(oscillator(spring(0)), 302);
  CHECK_FALSE(cubic.ridge({.any = 2}));
  CHECK_FALSE(fit_ridge(cubic.start, cubic.x0, cubic.u, cubic.y, Vector::Ones(2), 0, *make_levenberg_marquardt({}), 30,
                        {}, {.any = 9}));
  NonlinearModel wide = cubic.start;
  wide.Bt = Matrix::Zero(2, 2);
  CHECK_FALSE(fit_ridge(wide, cubic.x0, cubic.u, cubic.y, Vector::Ones(2), 0, *make_levenberg_marquardt({}), 30, kRidge,
                        {.any = 9}));
}
