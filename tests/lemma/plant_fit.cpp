// Grey-box fits of plants: parameters come home, priors hold what the data do not tell, the misfit is 1 at the floor.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "core/greybox/plant_fit.hpp"
#include "core/plant/dataset.hpp"
#include "core/plant/road.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/solver/levenberg_marquardt.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

constexpr double kSamplingHz = 200;

/// Noise through a slow filter, held at the plant's rate.
Matrix some_drive(const Plant& plant, Index samples, double rms_value, Random& random) {
  Matrix drive(plant.input_count(), samples);
  Vector state = Vector::Zero(plant.input_count());
  for (Index k = 0; k < samples; ++k) {
    state = 0.98 * state + 0.2 * random.normal(plant.input_count(), 1);
    drive.col(k) = rms_value * state;
  }
  return drive;
}

struct Measurement {
  FitRecord record;
  Matrix clean;
};

Measurement measure(const Plant& truth, double seconds, double level, double noise, std::uint64_t cell,
                    double sampling_hz = kSamplingHz) {
  Random random = numbers(cell);
  const Index ratio = hold_samples_per_record_sample(truth, sampling_hz);
  const Index samples = static_cast<Index>(seconds * sampling_hz);
  Measurement result;
  result.record.drive = some_drive(truth, samples * ratio, level, random);
  const GeneratedRecord generated = generate_record(truth, result.record.drive, sampling_hz);
  REQUIRE(generated.status == Status::ok);
  result.clean = generated.signal.y;
  result.record.ratio = ratio;
  result.record.weight_std = noise * (result.clean.rowwise().norm() / std::sqrt(static_cast<double>(samples)));
  result.record.y = result.clean + result.record.weight_std.asDiagonal() * random.normal(result.clean.rows(), samples);
  return result;
}

/// Each moved parameter lies at its true value within its error, which is a share of its scale: the data tell it, not
/// the start.
void check_found(const PlantFit& fit, const std::vector<FitParameter>& moved, const Plant& truth, double share) {
  for (std::size_t i = 0; i < moved.size(); ++i) {
    const auto row = static_cast<Index>(i);
    const double deviation = get_parameter(fit.plant, moved[i].name) - get_parameter(truth, moved[i].name);
    const double std = std::sqrt(fit.covariance(row, row)) * moved[i].scale;
    CAPTURE(moved[i].name, deviation, std);
    CHECK(std::abs(deviation) < 4 * std);
    CHECK(std < share * moved[i].scale);
  }
}

}  // namespace

TEST_CASE("parameters moved inside their tolerances are found again, and the misfit is 1 at the noise floor") {
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  set_parameter(truth, "suspension.viscous_damper.damping_ns_per_m", 850 * 1.1);
  set_parameter(truth, "tyre.linear_spring.stiffness_n_per_m", 200000 * 0.95);
  const std::vector<FitParameter> moved = {{"suspension.viscous_damper.damping_ns_per_m", 850 * 0.15, 0},
                                           {"tyre.linear_spring.stiffness_n_per_m", 20000, 0}};
  const Measurement m = measure(truth, 10, 0.004, 0.01, 510);
  const PlantFit fit = fit_plant(nominal, moved, {m.record}, *make_levenberg_marquardt({}), {20});
  INFO(fit.solution.message);
  REQUIRE(fit.solution.status != Status::outside_domain);
  CHECK(fit.misfit == Approx(1).epsilon(0.05));
  check_found(fit, moved, truth, 0.1);
  REQUIRE(fit.error.size() == 1);
  const Matrix model_error = fit.error[0] + m.record.y - m.clean;
  CHECK(model_error.norm() < 0.1 * (m.record.y - m.clean).norm());
}

TEST_CASE(
    "slopes with a voltage are found again, of a damper and of a friction, in records of steps and of constants") {
  const std::string damping = "suspension.viscous_damper.scheduled.damping_ns_per_m";
  const std::string friction = "suspension.coulomb_friction.scheduled.force_n";
  Plant nominal = plant_from(semi_active_text);
  nominal.elements[0].laws.push_back(
      {find_law("coulomb_friction"), {30, 0, 0.05, 0.005}, 0.3, {"voltage", {{0, 10.0}}, 0.3}});
  Plant truth = nominal;
  set_parameter(truth, damping, 330);
  set_parameter(truth, friction, 18);
  const std::vector<FitParameter> moved = {{damping, 75, 0}, {friction, 3, 0}};
  for (const bool steps : {true, false}) {
    CAPTURE(steps);
    std::vector<FitRecord> records;
    for (int i = 0; i < 2; ++i) {
      Measurement m = measure(truth, 4, 0.004, 0.01, 520 + static_cast<std::uint64_t>(i));
      const double low = i == 0 ? 0 : 4;
      for (Index k = 0; k < m.record.drive.cols(); ++k) m.record.drive(1, k) = steps && (k / 700) % 2 ? 4 - low : low;
      const Simulation run = simulate_measured(truth, m.record.drive, run_options(truth, m.record));
      REQUIRE(run.status == Status::ok);
      Random random = numbers(530 + static_cast<std::uint64_t>(i));
      m.record.y = run.outputs + m.record.weight_std.asDiagonal() * random.normal(3, run.outputs.cols());
      records.push_back(m.record);
    }
    const PlantFit fit = fit_plant(nominal, moved, records, *make_levenberg_marquardt({}), {20});
    REQUIRE(fit.error.size() == 2);
    CHECK(fit.misfit == Approx(1).epsilon(0.05));
    check_found(fit, moved, truth, 0.2);
  }
}

TEST_CASE("of a record that is compared up to a sample, a clock that runs at another rate reads the drive behind it") {
  for (const double skew : {0.005, -0.005, 0.01}) {
    CAPTURE(skew);
    Plant truth = plant_from(quarter_car_text);
    truth.clock_skew = skew;
    Measurement m = measure(truth, 10, 0.003, 0.01, 516);
    m.record.y.conservativeResize(Eigen::NoChange, m.record.y.cols() * 39 / 40);
    const auto solver = make_levenberg_marquardt({});
    const std::vector<FitParameter> clock = {{"timebase.clock_skew", 1e-4, 0}};
    Plant nominal = truth;
    nominal.clock_skew = 0.999 * skew;
    PlantFit fit = fit_plant(nominal, clock, {m.record}, *solver, {.iterations = 10, .linearise = false});
    REQUIRE(fit.error.size() == 1);
    CHECK(fit.misfit == Approx(1).epsilon(0.06));
    CHECK(fit.plant.clock_skew == Approx(skew).epsilon(1e-4));
    const Vector residual = fit.residual;
    REQUIRE(linearise(fit, clock, {m.record}));
    CHECK((fit.residual - residual).norm() < 1e-6 * residual.norm());
  }
}

TEST_CASE("a damper on a dynamometer, with no mass and no state, is fitted to the force that it was measured with") {
  const Plant nominal = plant_from(R"({
    "name": "dynamometer",
    "inputs": [{"name": "stroke", "kind": "displacement", "unit": "m", "hold_hz": 1000}],
    "elements": [{"name": "damper", "between": ["ground", "stroke"],
                  "laws": [{"law": "viscous_damper", "damping_ns_per_m": 900, "tolerance": 0.2}]}],
    "sensors": [{"name": "cell", "kind": "force", "element": "damper", "unit": "N"}]})");
  Plant truth = nominal;
  set_parameter(truth, "damper.viscous_damper.damping_ns_per_m", 1060);
  const Measurement m = measure(truth, 5, 0.004, 0.01, 515);
  const auto solver = make_levenberg_marquardt({});
  const PlantFit bare = fit_plant(nominal, {}, {m.record}, *solver, {10});
  REQUIRE(bare.error.size() == 1);
  CHECK(bare.misfit > 10);
  const PlantFit fit = fit_plant(nominal, tolerance_parameters(nominal), {m.record}, *solver, {10});
  REQUIRE(fit.error.size() == 1);
  CHECK(fit.misfit == Approx(1).epsilon(0.15));
  CHECK(get_parameter(fit.plant, "damper.viscous_damper.damping_ns_per_m") == Approx(1060).epsilon(0.005));
}

TEST_CASE("a common factor of masses and forces cannot be seen: its posterior is its prior, and its sum stays put") {
  const Plant nominal = plant_from(quarter_car_text);
  const std::vector<FitParameter> all = tolerance_parameters(nominal);
  const Measurement m = measure(nominal, 8, 0.003, 0.01, 511);
  const PlantFit fit = fit_plant(nominal, all, {m.record}, *make_levenberg_marquardt({}), {10});
  REQUIRE(fit.solution.status != Status::outside_domain);
  // Direction in theta of one relative change of every mass, stiffness and damping; shape parameters stay.
  Vector direction = Vector::Zero(static_cast<Index>(all.size())), precision = direction;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool forceful = all[i].name.find("mass_kg") != std::string::npos ||
                          all[i].name.find("stiffness") != std::string::npos ||
                          all[i].name.find("damping_ns") != std::string::npos;
    if (forceful) direction(static_cast<Index>(i)) = get_parameter(nominal, all[i].name) / all[i].scale;
  }
  // The least variance any estimate along it can have is the prior's, 1 / |direction|^2 of the common factor.
  const double factor_variance = direction.dot(fit.covariance * direction) / std::pow(direction.squaredNorm(), 2);
  CHECK(factor_variance == Approx(1 / direction.squaredNorm()).epsilon(0.05));
}

TEST_CASE("an effect's coefficient that starts on the wrong side of zero crosses it, a tolerance's does not") {
  Plant nominal = plant_from(one_mass_text);
  nominal.elements[0].laws.push_back({find_law("polynomial_spring"), {0, 0, 5e5}});
  Plant truth = nominal;
  const std::string cubic = "spring.polynomial_spring.coefficients_3";
  set_parameter(truth, cubic, -4e5);
  const Measurement m = measure(truth, 6, 4, 0.005, 514, 250);
  const auto fitted = [&](double prior_std) {
    const PlantFit fit = fit_plant(nominal, {{cubic, 3e5, prior_std}}, {m.record}, *make_levenberg_marquardt({}), {30});
    return get_parameter(fit.plant, cubic);
  };
  CHECK(fitted(0) == Approx(-4e5).epsilon(0.1));
  CHECK(fitted(100) >= 0);
}

TEST_CASE("the scale of a parameter is a unit: it does not change what is found") {
  const Plant nominal = plant_from(one_mass_text);
  Plant truth = nominal;
  set_parameter(truth, "spring.viscous_damper.damping_ns_per_m", 5);
  Random random = numbers(512);
  Measurement m;
  const Index samples = 2000;
  m.record.drive = some_drive(nominal, samples, 4, random);
  const GeneratedRecord generated = generate_record(truth, m.record.drive, 500);
  REQUIRE(generated.status == Status::ok);
  m.record.y = generated.signal.y;
  m.record.weight_std = Vector::Constant(3, 1e-3);
  double found[2];
  int at = 0;
  for (const double scale : {0.2, 1.0})
    found[at++] = get_parameter(fit_plant(nominal, {{"spring.viscous_damper.damping_ns_per_m", scale, 0}}, {m.record},
                                          *make_levenberg_marquardt({}), {30})
                                    .plant,
                                "spring.viscous_damper.damping_ns_per_m");
  CHECK(found[0] == Approx(5).epsilon(1e-5));
  CHECK(found[1] == Approx(found[0]).epsilon(1e-6));
}

TEST_CASE("a drive that the plant cannot follow is outside the domain, and negative parameters are never tried") {
  const Plant nominal = plant_from(quarter_car_text);
  Measurement m = measure(nominal, 2, 0.003, 0.01, 513);
  m.record.drive *= 100;
  const PlantFit fit =
      fit_plant(nominal, tolerance_parameters(nominal), {m.record}, *make_levenberg_marquardt({}), {5});
  CHECK(fit.solution.status == Status::outside_domain);
  CHECK_FALSE(fit.solution.message.empty());

  m = measure(nominal, 2, 0.003, 0.01, 513);
  const Vector state_scale = Vector::Ones(4);
  const auto problem = plant_problem(nominal, {{"body.mass_kg", 300, 0}}, {m.record}, state_scale);
  Vector theta = Vector::Zero(5);
  double cost = 0;
  CHECK(problem->cost(theta, cost));
  theta(0) = -1.5;
  CHECK_FALSE(problem->cost(theta, cost));
}

TEST_CASE("a law with memory and the delay of the drive are fitted like any other parameter") {
  Plant start = plant_from(quarter_car_text);
  start.elements[0].laws.push_back(parse_law(
      JsonCursor::from(Json::parse(R"({"law": "bouc_wen", "force_n": 40, "yield_travel_m": 0.001})"), "law.json")));
  Plant truth = start;
  set_parameter(truth, "suspension.bouc_wen.force_n", 90);
  set_parameter(truth, "actuator:road.delay_s", 0.0023);
  const std::vector<FitParameter> moved = {{"suspension.bouc_wen.force_n", 20, 0}, {"actuator:road.delay_s", 1e-3, 0}};
  const Measurement m = measure(truth, 10, 0.004, 0.01, 514);
  const PlantFit fit = fit_plant(start, moved, {m.record}, *make_levenberg_marquardt({}), {30});
  INFO(fit.solution.message);
  REQUIRE(fit.solution.status != Status::outside_domain);
  CHECK(fit.misfit == Approx(1).epsilon(0.05));
  CHECK(get_parameter(fit.plant, "suspension.bouc_wen.force_n") == Approx(90).epsilon(0.03));
  CHECK(get_parameter(fit.plant, "actuator:road.delay_s") == Approx(0.0023).epsilon(0.03));
}

TEST_CASE("a parameter that would leave its range stays at its end, and the others of the fit go on") {
  Plant truth = plant_from(quarter_car_text), start = truth;
  truth.inputs[0].path.delay_s = 0.0031;  // its sampling phase is 0, the least there is
  const Measurement m = measure(truth, 5, 0.004, 0.002, 516);
  const auto fitted = [&](std::vector<FitParameter> parameters) {
    return fit_plant(start, parameters, {m.record}, *make_levenberg_marquardt({}), {20});
  };
  const FitParameter delay{"actuator:road.delay_s", 1e-3, 0}, phase{"actuator:road.sampling_phase", 0.2, 0};
  for (const double from : {0.002, 0.0028}) {
    CAPTURE(from);
    start.inputs[0].path = {.delay_s = from};
    const double least = fitted({delay}).residual.squaredNorm();  // the phase at its end from the beginning
    start.inputs[0].path.sampling_phase = 0.5;
    const PlantFit fit = fitted({delay, phase});
    const DrivePath& path = fit.plant.inputs[0].path;
    CHECK(path.sampling_phase >= 0);
    CHECK(path.sampling_phase < 0.005);
    CHECK(path.delay_s == Approx(0.0031).epsilon(1e-3));
    CHECK(fit.residual.squaredNorm() < least + 1);
  }
}

TEST_CASE(
    "however strong the data, a parameter stays within fifteen tolerances, without a prior it goes where they say") {
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  const std::string name = "suspension.viscous_damper.damping_ns_per_m";
  const double damping = get_parameter(nominal, name);
  set_parameter(truth, name, 2 * damping);
  const Measurement m = measure(truth, 5, 0.004, 0.002, 517);
  for (const double prior_std : {1.0, 0.0}) {
    const PlantFit fit =
        fit_plant(nominal, {{name, 0.05 * damping, prior_std}}, {m.record}, *make_levenberg_marquardt({}), {30});
    CHECK(fit.theta(0) == Approx(prior_std > 0 ? 15 : 20).epsilon(1e-2));
  }
}

TEST_CASE("an initial state is found in the part of a record that remembers it, as in the whole of it") {
  const Plant plant = plant_from(quarter_car_text);
  for (const double seconds : {2.0, 40.0}) {
    Measurement m = measure(plant, seconds, 0.004, 0.05, 520);
    // The record begins in the middle of a motion.
    const Index cut = 100;
    m.record.drive = m.record.drive.rightCols(m.record.drive.cols() - cut * m.record.ratio).eval();
    m.record.y = m.record.y.rightCols(m.record.y.cols() - cut).eval();
    const auto solver = make_levenberg_marquardt({});
    const PlantFit fit = fit_plant(plant, {}, {m.record}, *solver, {.iterations = 30});
    REQUIRE(fit.solution.status == Status::ok);
    CHECK(fit.error[0].cols() == m.record.y.cols());
    CHECK(fit.misfit == Approx(1).epsilon(0.1));
    // The step that the whole record would still ask for, in standard deviations.
    const auto problem = plant_problem(plant, {}, {m.record}, fit.state_scale);
    const Vector theta = fit.initial_states[0].motion.cwiseQuotient(fit.state_scale);
    Vector r(problem->residuals());
    Matrix J(problem->residuals(), problem->parameters());
    REQUIRE(problem->jacobian(theta, r, J));
    CHECK((r - fit.residual).norm() < 1e-9 * r.norm());
    const Matrix H = J.transpose() * J + Matrix(fit.precision.asDiagonal());
    const Vector step = solve(H, J.transpose() * r + fit.precision.cwiseProduct(theta - fit.states_at_rest));
    const Matrix covariance = solve(H, Matrix::Identity(4, 4));
    for (Index i = 0; i < 4; ++i) CHECK(std::abs(step(i)) < 1e-2 * std::sqrt(covariance(i, i)));
  }
}

TEST_CASE("internal states have names in the order in which simulations keep them") {
  Plant plant = plant_from(quarter_car_text);
  plant.elements[0].laws.insert(plant.elements[0].laws.begin(), {find_law("maxwell_branch"), {4000, 0.05}});
  plant.elements[0].laws.push_back({find_law("bouc_wen"), {60, 0.001, 1, 0.5, 0, 0, 0.1}});
  plant.elements[1].laws.push_back({find_law("bouc_wen"), {80, 0.001, 1, 0.5, 0, 0, 0.1}});
  plant.elements[0].laws.push_back({find_law("bouc_wen"), {50, 0.002, 1, 0.5, 0, 0, 0.1}});
  for (const Element& element : plant.elements)
    plant.sensors.push_back({element.name + "_n", SensorKind::force, "", "", "N", {}, element.name});
  const std::vector<std::string> names = memory_names(plant);
  CHECK(names == std::vector<std::string>{"suspension.maxwell_branch.z_1", "suspension.bouc_wen.z_1",
                                          "suspension.bouc_wen[2].z_1", "tyre.bouc_wen.z_1"});
  const std::vector<double> force = {-1, 60 * 0.3, 50 * 0.3, 80 * 0.3};  // that of Maxwell's branch is not asked for
  FitRecord record;
  record.drive = Matrix::Zero(1, 5);
  record.y = Matrix::Zero(plant.sensor_count(), 5);
  for (std::size_t k = 1; k < names.size(); ++k) {
    InitialState start(Vector(Vector::Zero(4)));
    start.memories = {{names[k], 0.3}};
    CHECK(memories_of(plant, start) == 0.3 * Vector::Unit(4, static_cast<Index>(k)));
    const Simulation run = simulate(plant, record.drive, run_options(plant, record, start));
    REQUIRE(run.status == Status::ok);
    const bool at_tyre = names[k].rfind("tyre", 0) == 0;
    CHECK(run.outputs(at_tyre ? 4 : 3, 0) == Approx(force[k]));
    CHECK(run.outputs(at_tyre ? 3 : 4, 0) == Approx(0).margin(1e-9));
  }
  // Another plant takes what it knows.
  Plant other = plant;
  other.elements[0].laws.erase(other.elements[0].laws.begin());
  InitialState start(Vector(Vector::Zero(4)));
  for (std::size_t k = 0; k < names.size(); ++k) start.memories.emplace_back(names[k], static_cast<double>(k));
  CHECK(memories_of(other, start) == (Vector(3) << 1, 2, 3).finished());
}

TEST_CASE("memories of laws are found where a record begins in the middle of a motion, with their derivatives") {
  Plant plant = plant_from(quarter_car_text);
  plant.elements[0].laws.push_back({find_law("bouc_wen"), {300, 0.004, 1, 0.5, 0, 0, 0.1}});
  plant.elements[1].laws.push_back({find_law("maxwell_branch"), {40000, 0.02}});
  const std::vector<std::string> names = memory_names(plant);
  REQUIRE(names.size() == 2);
  Measurement m = measure(plant, 8, 0.003, 0.01, 526);
  const Index cut = 300;
  const Simulation whole = simulate_measured(plant, m.record.drive, run_options(plant, m.record));
  const Vector there = whole.states.col(cut);
  m.record.drive = m.record.drive.rightCols(m.record.drive.cols() - cut * m.record.ratio).eval();
  m.record.y = m.record.y.rightCols(m.record.y.cols() - cut).eval();
  const auto solver = make_levenberg_marquardt({});
  PlantFit fit = fit_plant(plant, {}, {m.record}, *solver, {.iterations = 30, .linearise = false});
  REQUIRE(fit.solution.status == Status::ok);
  CHECK(fit.misfit == Approx(1).epsilon(0.05));
  REQUIRE(linearise(fit, {}, {m.record}));
  REQUIRE(fit.jacobian.cols() == 6);
  const Matrix H = fit.jacobian.transpose() * fit.jacobian + Matrix(fit.precision.asDiagonal());
  const Matrix covariance = solve(H, Matrix::Identity(6, 6));
  const Vector found = memories_of(plant, fit.initial_states[0]);
  for (Index k = 0; k < 2; ++k) {
    const double std = std::sqrt(covariance(4 + k, 4 + k)) * fit.memory_scale(k);
    CAPTURE(names[static_cast<std::size_t>(k)], found(k), there(4 + k), std);
    CHECK(std::abs(found(k) - there(4 + k)) < 4 * std);
    CHECK(std < fit.memory_scale(k));  // the readings tell it, and not its prior alone
  }
  // The column of each memory against a difference of simulations.
  for (Index k = 0; k < 2; ++k) {
    const double step = 1e-4 * fit.memory_scale(k);
    Vector above, below;
    std::vector<InitialState> moved = fit.initial_states;
    moved[0].memories[static_cast<std::size_t>(k)].second += step;
    REQUIRE(plant_residual(plant, {m.record}, moved, above));
    moved[0].memories[static_cast<std::size_t>(k)].second -= 2 * step;
    REQUIRE(plant_residual(plant, {m.record}, moved, below));
    const Vector difference = (above - below) / (2e-4);
    CHECK((fit.jacobian.col(4 + k) - difference).norm() < 2e-3 * difference.norm());
  }
  // With memories at rest the start is missed.
  InitialState still = fit.initial_states[0];
  still.memories.clear();
  Vector r;
  REQUIRE(plant_residual(plant, {m.record}, {still}, r));
  CHECK(r.squaredNorm() > 1.2 * fit.residual.squaredNorm());
}

TEST_CASE("what a record tells of its start is not moved, and what it does not tell is found") {
  Plant plant = plant_from(quarter_car_text);
  plant.elements[0].laws.push_back({find_law("bouc_wen"), {100, 0.002, 1, 0.5, 0, 0, 0.1}});
  const auto solver = make_levenberg_marquardt({});
  Measurement m = measure(plant, 4, 0.004, 0.3, 527);  // so noisy that a free start would be anywhere
  FitRecord& record = m.record;
  Vector size;  // of the motion
  const auto start_of = [&](const KnownStart& start) {
    record.start = start;
    const PlantFit fit = fit_plant(plant, {}, {record}, *solver, {.iterations = 30});
    REQUIRE(fit.solution.status == Status::ok);
    if (size.size() == 0) size = fit.state_scale;
    Vector whole(5);
    whole << fit.initial_states[0].motion.cwiseQuotient(size),
        memories_of(plant, fit.initial_states[0]).cwiseQuotient(fit.memory_scale);
    return whole;
  };
  const Vector free = start_of({}), rest = start_of({.rest = true});
  Vector still = Vector::Zero(5);  // on the road as it is at the first sample
  still.head(2) = static_equilibrium(plant, record.drive.col(0)).positions.cwiseQuotient(size.head(2));
  CHECK((rest - still).norm() < 5e-3);
  CHECK((free - still).norm() > 0.03);
  const Vector given = start_of({false, {{"body", 2 * size(0)}}, {{"wheel", 0}}});
  CHECK(given(0) == Approx(2).epsilon(5e-3));
  CHECK(std::abs(given(3)) < 5e-3);
  CHECK(std::abs(given(2)) > 0.1);  // the speed of the body is free, and makes up for the wrong displacement
  CHECK_THROWS_WITH(start_of({false, {{"bdy", 1}}, {}}),
                    Catch::Contains("expected a mass of the plant (body, wheel), found \"bdy\""));
  CHECK_THROWS_WITH(
      start_of({.angle_rad = {{"body", 1}}}),
      Catch::Contains("\"body\" slides: expected displacement_m or velocity_m_per_s, but angle_rad is given"));
}

TEST_CASE("the start of a mass that turns is told by its angle and its angular velocity") {
  const Plant plant = plant_from(R"({"name": "drive",
    "masses": [{"name": "motor", "inertia_kg_m2": 0.02}, {"name": "table", "mass_kg": 5}],
    "inputs": [{"name": "push", "kind": "force", "on": "table", "unit": "N", "hold_hz": 1000}],
    "elements": [
      {"name": "shaft", "between": ["ground", "motor"], "laws": [{"law": "linear_spring", "stiffness_nm_per_rad": 30}]},
      {"name": "mount", "between": ["ground", "table"], "laws": [{"law": "linear_spring", "stiffness_n_per_m": 1000}]}],
    "sensors": [{"name": "x", "kind": "displacement", "of": "table", "unit": "m"}]})");
  const KnownStart start{
      .displacement_m = {{"table", 0.1}}, .angle_rad = {{"motor", 2}}, .angular_velocity_rad_per_s = {{"motor", 3}}};
  std::vector<std::pair<Index, double>> found = known_states(plant, start, Vector::Zero(4));
  std::sort(found.begin(), found.end());
  CHECK(found == std::vector<std::pair<Index, double>>{{0, 2.0}, {1, 0.1}, {2, 3.0}});
  CHECK_THROWS_WITH(known_states(plant, {.displacement_m = {{"motor", 1}}}, Vector::Zero(4)),
                    Catch::Contains("\"motor\" turns: expected angle_rad or angular_velocity_rad_per_s"));
}

TEST_CASE("the Jacobian of several records is stored without the columns of other records' states, which are zero") {
  const Plant plant = plant_from(quarter_car_text);
  std::vector<FitRecord> records;
  for (const std::uint64_t cell : {523, 524, 525})
    records.push_back(measure(plant, cell == 524 ? 3.0 : 2.0, 0.004, 0.05, cell).record);
  const std::vector<FitParameter> parameters = tolerance_parameters(plant);
  const auto problem = plant_problem(plant, parameters, records, Vector::Constant(4, 0.01));
  const BlockAngular layout = problem->layout();
  REQUIRE(layout.columns() == problem->parameters());
  CHECK(layout.stored() == static_cast<Index>(parameters.size()) + 4);
  const Vector theta = Vector::Constant(problem->parameters(), 0.1);
  Vector r(problem->residuals()), r_stored = r;
  Matrix J(problem->residuals(), problem->parameters()), stored(problem->residuals(), layout.stored());
  REQUIRE(problem->jacobian(theta, r, J));
  REQUIRE(problem->stored_jacobian(theta, r_stored, stored));
  CHECK(r == r_stored);
  for (const RowBlock& block : layout.blocks())
    for (Index j = 0; j < layout.stored(); ++j)
      CHECK(J.col(layout.column(j, block.group)).segment(block.first, block.count) ==
            stored.col(j).segment(block.first, block.count));
  CHECK(J.norm() == Approx(stored.norm()));  // nothing stands elsewhere
  // One record's columns, one after the other, are those of a problem of that record alone.
  Vector residual;
  Index columns = 0;
  const auto alone = plant_problem(plant, parameters, {records[0]}, Vector::Constant(4, 0.01));
  Vector r_alone(alone->residuals()), start = Vector::Zero(alone->parameters());
  Matrix J_alone(alone->residuals(), alone->parameters());
  REQUIRE(alone->jacobian(start, r_alone, J_alone));
  REQUIRE(record_derivatives(plant, parameters, records[0], Vector::Constant(4, 0.01), Vector::Zero(4), residual,
                             [&](Index column, const Matrix& values) {
                               ++columns;
                               CHECK(values.reshaped() == J_alone.col(column));
                             }));
  CHECK(columns == alone->parameters());
  CHECK(residual == r_alone);
}

TEST_CASE("a plant that fails beyond the part of a record that remembers the start has no fit of its initial states") {
  const Plant plant = plant_from(quarter_car_text);
  Measurement m = measure(plant, 40, 0.004, 0.05, 521);
  const auto solver = make_levenberg_marquardt({});
  const PlantFit first = fit_plant(plant, {}, {m.record}, *solver, {.iterations = 10});
  m.record.drive.rightCols(200).setConstant(1);  // through the end stop, long after the start is forgotten
  const PlantFit fit = fit_plant(plant, {}, {m.record}, *solver, {.iterations = 10, .from = &first});
  CHECK(fit.solution.status == Status::outside_domain);
  CHECK(fit.error.empty());
}
