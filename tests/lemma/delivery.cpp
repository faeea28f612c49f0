// The model that is delivered is no worse than its parts, on samples that it was not fitted to.
#include "core/identify/delivery.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <list>

#include "core/data/metrics.hpp"
#include "core/identify/free_run_problem.hpp"
#include "core/identify/initial_state.hpp"
#include "core/identify/surrogate_drives.hpp"
#include "tests/support/drawn_plants.hpp"
#include "variants/inversion/sdi.hpp"
#include "variants/solver/levenberg_marquardt.hpp"
#include "variants/subspace/pi_moesp.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

struct Setup {
  std::unique_ptr<SubspaceEstimator> subspace = make_pi_moesp({});
  std::unique_ptr<InputReconstructor> inversion = make_sdi({});
  std::unique_ptr<Solver> solver = make_levenberg_marquardt({});
  Pieces pieces{
      *subspace, *inversion, [](Index in, Index out) { return make_mlp(in, out, {.hidden_units = 3}); }, *solver, {}};
};

Signal record_of(Matrix u, Matrix y) {
  Signal record;
  record.sample_time_s = 0.01;
  for (Index i = 0; i < u.rows(); ++i) record.inputs.push_back({"u" + std::to_string(i), ""});
  for (Index i = 0; i < y.rows(); ++i) record.outputs.push_back({"y" + std::to_string(i), ""});
  record.u = std::move(u);
  record.y = std::move(y);
  return record;
}

DeliveryOptions quick(Index nonlinearities) {
  DeliveryOptions options;
  options.pipeline.nonlinearities = nonlinearities;
  options.pipeline.passes = 2;
  options.pipeline.map_starts = 1;
  options.pipeline.map_iterations = 20;
  options.pipeline.refine_rounds = 1;
  options.pipeline.refine_iterations = 15;
  options.search = LinearSearchOptions{.max_order = 6, .max_delay = 4, .iterations = 10};
  options.choose_direct_term = true;
  options.starts = 1;
  return options;
}

/// NRMSE about the mean of the delivered model on a record from rest, after the first 200 samples.
Vector validated(const Delivery& result, ConstMatrixRef u, ConstMatrixRef y) {
  const Channels& channels = result.channels;
  const Matrix scaled = channels.u_scale.cwiseInverse().asDiagonal() * (u.colwise() - channels.u_offset);
  const Matrix acting = delayed(scaled, channels.delay);
  const Matrix late = (channels.y_scale.cwiseInverse().asDiagonal() * y).rightCols(acting.cols());
  const FreeRun run = free_run(result.model, acting, estimate_initial_state(result.model, acting, late, 400));
  const Index kept = acting.cols() - 200;
  const Matrix moving = late.colwise() - Vector(late.rowwise().mean());
  return rms((run.y - late).rightCols(kept)).cwiseQuotient(rms(moving.rightCols(kept)));
}

}  // namespace

TEST_CASE("a linear plant is delivered as its linear model, at the noise") {
  const Setup setup;
  for (std::uint64_t draw = 0; draw < 4; ++draw) {
    Random random = numbers(700 + draw);
    const DelayedPlant plant =
        drawn_plant({.pairs = 1, .outputs = 2, .period = 6 + 30 * random.uniform(), .longest_delay = 3}, random);
    const Matrix u = random.normal(1, 2000), fresh = random.normal(1, 1000);
    const Matrix clean = respond(plant, u);
    const Matrix noise = 0.01 * rms(clean).asDiagonal() * random.normal(2, 2000);
    Random guesses = numbers(710);
    const Delivery result = deliver({record_of(u, clean + noise)}, quick(1), setup.pieces, guesses);
    CAPTURE(draw, result.message, result.reason);
    REQUIRE(result.status == Status::ok);
    CHECK(result.candidates[result.chosen].name == "linear");
    CHECK(result.unexplained.maxCoeff() < 0.1);
    CHECK(validated(result, fresh, respond(plant, fresh)).maxCoeff() < 0.0046);  // of 1.1 times the noise
  }
}

TEST_CASE("a record that was cut off gives the model of the whole one") {
  const Setup setup;
  for (std::uint64_t draw = 0; draw < 4; ++draw) {
    Random random = numbers(4130 + draw);
    const DelayedPlant plant =
        drawn_plant({.pairs = 1, .outputs = 1, .period = 40 + 30 * random.uniform(), .longest_delay = 0}, random);
    const Matrix u = random.normal(1, 2000), fresh = random.normal(1, 1000);
    const Matrix clean = respond(plant, u);
    Matrix y = clean + 0.01 * rms(clean).asDiagonal() * random.normal(1, 2000);
    cut_off({Vector(-1.2 * rms(clean)), Vector(1.0 * rms(clean))}, y);
    const auto error = [&](bool look) {
      DeliveryOptions options = quick(0);
      options.pipeline.order = 2;
      options.cut_off_outputs = look;
      Random guesses = numbers(4140);
      Delivery result = deliver({record_of(u, y)}, options, setup.pieces, guesses);
      CAPTURE(draw, result.message);
      REQUIRE(result.status == Status::ok);
      CHECK(result.limits.any() == look);
      if (look) CHECK(result.limits.high(0) == y.maxCoeff());
      result.model.limits = {};
      return validated(result, fresh, respond(plant, fresh)).maxCoeff();
    };
    CAPTURE(draw);
    CHECK(error(true) < 0.01);
    CHECK(error(false) > 0.02);
  }
}

TEST_CASE("what is delivered is held out no worse than the linear model and the best that does not fall behind it") {
  const Setup setup;
  for (std::uint64_t draw = 0; draw < 4; ++draw) {
    Random random = numbers(720 + draw);
    NonlinearModel truth = random_nonlinear(3, 1, 3, 1, random);
    truth.Bt *= 3;
    const Matrix u = random.normal(1, 1200);
    Matrix y = free_run(truth, u, Vector::Zero(3)).y;
    y += 0.01 * random.normal(3, 1200);
    DeliveryOptions options = quick(1);
    options.pipeline.order = 3;
    Random guesses = numbers(730);
    const Delivery result = deliver({record_of(u, y)}, options, setup.pieces, guesses);
    CAPTURE(draw, result.message, result.reason);
    REQUIRE(result.status == Status::ok);
    const Candidate& chosen = result.candidates[result.chosen];
    const Vector& linear = result.candidates.front().held_out_nrmse;
    CHECK((chosen.held_out_nrmse.array() <= 1.02 * linear.array()).all());
    for (const Candidate& other : result.candidates)
      if (!other.stopped && (other.held_out_nrmse.array() <= linear.array()).all())
        CHECK(chosen.held_out_nrmse.array().log().mean() <= other.held_out_nrmse.array().log().mean() + std::log(1.02));
    CHECK(result.x0.size() == 1);
  }
}

TEST_CASE("a short record: the best of several starts is compared, and what is delivered holds on other drives") {
  const Setup setup;
  int better = 0;
  for (std::uint64_t draw = 0; draw < 4; ++draw) {
    Random random = numbers(800 + draw);
    const NonlinearModel truth = random_nonlinear(2, 1, 1, 1, random);
    const Matrix u = random.normal(1, 300);
    const Matrix y = free_run(truth, u, Vector::Zero(2)).y + 0.01 * random.normal(1, 300);
    DeliveryOptions options = quick(1);
    options.pipeline.order = 2;
    options.pipeline.direction = "input";
    options.choose_direct_term = false;
    double scores[2];
    for (const Index starts : {1, 4}) {
      options.starts = starts;
      Random guesses = numbers(810);
      const Delivery result = deliver({record_of(u, y)}, options, setup.pieces, guesses);
      CAPTURE(draw, starts, result.message, result.reason);
      REQUIRE(result.status == Status::ok);
      const Candidate& chosen = result.candidates[result.chosen];
      const double allowed = std::max(0.5, 2 * result.candidates.front().excursion);
      CHECK(chosen.excursion <= allowed);
      CHECK(excursion(result.model, result.x0[0], u / result.channels.u_scale(0), y / result.channels.y_scale(0)) <=
            allowed);
      CHECK(result.states.known());
      CHECK(result.candidates.size() <= 3);  // linear, and one of each kind
      scores[starts > 1] = chosen.held_out_nrmse.array().log().mean();
    }
    CHECK(starts_for(300, 2) == 16);
    CHECK(starts_for(1000, 2) == 9);
    CHECK(starts_for(300, 20) == 1);
    CHECK(starts_for(100000, 2) == 1);
    CHECK(scores[1] <= scores[0]);  // the first start is the same
    better += scores[1] < scores[0];
  }
  CHECK(better > 0);
}

TEST_CASE("of several fits the one nearest to the others is taken, never the odd one, and none that fits worse") {
  Random random = numbers(820);
  for (int draw = 0; draw < 5; ++draw) {
    const NonlinearModel truth = without_map(random_linear(3, 1, 2, 0.9, random));
    const Matrix u = random.normal(1, 500);
    const std::vector<Signal> records{
        record_of(u, free_run(truth, u, Vector::Zero(3)).y + 0.1 * random.normal(2, 500))};
    const Vector deviation = rms(records[0].y);
    std::vector<Candidate> members;
    const auto add = [&](double gain, double start) {
      Candidate own;
      own.model = truth;
      own.model.linear.B *= gain;
      own.model.linear.D *= gain;
      own.x0 = {Vector::Constant(3, start)};
      members.push_back(std::move(own));
    };
    for (const double gain : {1.02, 1.001, 0.999, 1.0}) add(gain, 0);
    const auto taken = nearest_to_the_others(members, records, 0, deviation);
    REQUIRE(taken);
    CHECK(*taken == 3);                       // in the middle of the others
    for (int i = 0; i < 5; ++i) add(1.5, 0);  // these do not fit the record, so that their votes do not count
    CHECK(nearest_to_the_others(members, records, 0, deviation) == taken);
    members.resize(2);
    CHECK_FALSE(nearest_to_the_others(members, records, 0, deviation));
  }
}

TEST_CASE("a long record that leaves more than noise gets a wider map, if that is better held out") {
  const Setup setup;
  Random random = numbers(830);
  NonlinearModel truth = random_nonlinear(2, 1, 1, 1, random);
  std::shared_ptr<StaticMap> map = truth.map->clone();
  map->W *= 5;
  truth.map = map;
  Matrix u = random.normal(1, 8000);  // slow, so that what a model leaves moves slowly as well
  for (Index k = 1; k < u.cols(); ++k) u(0, k) = 0.95 * u(0, k - 1) + 0.3 * u(0, k);
  const Matrix y = free_run(truth, u, Vector::Zero(2)).y;
  const Pieces narrow{setup.pieces.subspace,
                      setup.pieces.inversion,
                      [](Index in, Index out) { return make_mlp(in, out, {.hidden_units = 1}); },
                      setup.pieces.solver,
                      {}};
  DeliveryOptions options = quick(1);
  options.pipeline.order = 2;
  options.pipeline.direction = "input";
  options.choose_direct_term = false;
  Random guesses = numbers(831);
  const Delivery result = deliver({record_of(u, y)}, options, narrow, guesses);
  CAPTURE(result.message, result.reason);
  REQUIRE(result.status == Status::ok);
  std::vector<std::string> names;
  for (const Candidate& candidate : result.candidates) names.push_back(candidate.name);
  CHECK(std::count(names.begin(), names.end(), "refined with 2 features") == 1);
  CHECK(result.model.map->features() > 1);
  const Candidate& chosen = result.candidates[result.chosen];
  for (const Candidate& other : result.candidates)
    if (other.name == "refined") CHECK(chosen.held_out_nrmse(0) < 0.97 * other.held_out_nrmse(0));
}

TEST_CASE("without nonlinearities the linear model is delivered") {
  const Setup setup;
  Random random = numbers(740);
  const DelayedPlant plant = drawn_plant({.pairs = 1, .period = 15}, random);
  const Matrix u = random.normal(1, 1500);
  Random guesses = numbers(741);
  const Delivery result = deliver({record_of(u, respond(plant, u))}, quick(0), setup.pieces, guesses);
  REQUIRE(result.status == Status::ok);
  CHECK_FALSE(result.model.map);
  CHECK(result.candidates[result.chosen].held_out_nrmse.maxCoeff() < 1e-4);
}

TEST_CASE("offsets ten times the motion change nothing") {
  const Setup setup;
  for (std::uint64_t draw = 0; draw < 3; ++draw) {
    Random random = numbers(750 + draw);
    const DelayedPlant plant =
        drawn_plant({.pairs = 1, .inputs = 2, .outputs = 2, .period = 10 + 20 * random.uniform()}, random);
    const Matrix u = random.normal(2, 2000), fresh = random.normal(2, 1000);
    const Matrix clean = respond(plant, u);
    const Matrix noise = 0.01 * rms(clean).asDiagonal() * random.normal(2, 2000);
    Vector drive_offset(2), output_offset(2);
    drive_offset << 10, -20;
    output_offset = 15 * rms(clean);
    Random guesses = numbers(760);
    const Delivery result = deliver({record_of(u.colwise() + drive_offset, (clean + noise).colwise() + output_offset)},
                                    quick(0), setup.pieces, guesses);
    CAPTURE(draw, result.message, result.reason);
    REQUIRE(result.status == Status::ok);
    const Vector error =
        validated(result, fresh.colwise() + drive_offset, respond(plant, fresh).colwise() + output_offset);
    CHECK(error.maxCoeff() < 0.0046);
  }
}

TEST_CASE("all records are fitted: each moves one of two inputs, the model follows both") {
  const Setup setup;
  for (std::uint64_t draw = 0; draw < 3; ++draw) {
    Random random = numbers(770 + draw);
    const DelayedPlant plant =
        drawn_plant({.pairs = 1, .inputs = 2, .outputs = 2, .period = 10 + 20 * random.uniform()}, random);
    std::vector<Signal> records;
    for (Index moved = 0; moved < 2; ++moved) {
      Matrix u = Matrix::Zero(2, 1500);
      u.row(moved) = random.normal(1, 1500);
      const Matrix clean = respond(plant, u);
      const Matrix noise = 0.01 * rms(clean).asDiagonal() * random.normal(2, 1500);
      records.push_back(record_of(u, clean + noise));
    }
    Random guesses = numbers(780);
    DeliveryOptions options = quick(0);
    options.pipeline.order = 2;
    options.pipeline.refine_iterations = 40;
    options.search->max_delay = 0;
    const Delivery result = deliver(records, options, setup.pieces, guesses);
    CAPTURE(draw, result.message, result.reason);
    REQUIRE(result.status == Status::ok);
    CHECK(result.x0.size() == 2);
    const Matrix fresh = random.normal(2, 1000);
    CHECK(validated(result, fresh, respond(plant, fresh)).maxCoeff() < 0.01);
  }
}

TEST_CASE("a refinement over several records finds the model and the initial state of each") {
  const Setup setup;
  for (std::uint64_t draw = 0; draw < 3; ++draw) {
    Random random = numbers(790 + draw);
    const NonlinearModel truth = random_nonlinear(2, 1, 2, 1, random);
    std::list<Matrix> signals;  // what the records borrow
    std::vector<FittedRecord> records;
    for (const Index samples : {300, 200, 250}) {
      const Vector start = random.normal(2, 1);
      const Matrix& u = signals.emplace_back(random.normal(1, samples));
      const Matrix& y = signals.emplace_back(free_run(truth, u, start).y);
      records.push_back({u, y, samples == 200 ? 7 : 0, start + 0.1 * random.normal(2, 1)});
    }
    NonlinearModel near = truth;
    near.linear.B *= 1.05;
    near.linear.A *= 0.98;
    const auto squares = [&](const NonlinearModel& model) {
      double sum = 0;
      for (const FittedRecord& record : records)
        sum +=
            (free_run(model, record.u, record.x0).y - record.y).rightCols(record.y.cols() - record.skip).squaredNorm();
      return sum;
    };
    const double before = squares(near);
    const Refinement refined = refine(near, records, Vector::Ones(2), *setup.solver, 80);
    CAPTURE(draw, before, refined.solution.message);
    CHECK(squares(refined.model) < 1e-5 * before);
    CHECK(squares(refined.model) == Approx(2 * refined.solution.cost).margin(1e-6 * before));
  }
}
