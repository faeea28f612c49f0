// Drive paths and sensor paths: each stage alone against its definition, and all of them absent.
#include "core/plant/paths.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>

#include "core/base/status.hpp"
#include "core/plant/dataset.hpp"
#include "tests/support/plants.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

Plant quarter_car() { return plant_from(quarter_car_text); }

/// Sum of sines of 1, 4 and 9 Hz at 200 Hz, starting at rest in value.
Signal record(const Plant& plant, Index samples = 800) {
  Signal signal;
  signal.sample_time_s = 1.0 / 200;
  signal.inputs = plant.input_channels();
  signal.u.resize(plant.input_count(), samples);
  for (Index k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) / 200;
    signal.u.col(k).setConstant(
        0.004 * (std::sin(2 * M_PI * t) + 0.3 * std::sin(8 * M_PI * t + 1) + 0.1 * std::sin(18 * M_PI * t + 2)));
  }
  return signal;
}

Matrix outputs(const Plant& plant, Index samples = 800) {
  const GeneratedRecord run = simulate_record(plant, record(plant, samples));
  REQUIRE(run.status == Status::ok);
  return run.signal.y;
}

Vector sine(double frequency_hz, double rate_hz, Index samples) {
  Vector u(samples);
  for (Index k = 0; k < samples; ++k) u(k) = std::sin(2 * M_PI * frequency_hz * static_cast<double>(k) / rate_hz + 0.4);
  return u;
}

/// Complex amplitude of a line over the last `samples` (whole periods) of y.
std::complex<double> line(const Vector& y, double frequency_hz, double rate_hz, Index samples) {
  std::complex<double> sum = 0;
  for (Index k = y.size() - samples; k < y.size(); ++k)
    sum += y(k) * std::polar(1.0, -2 * M_PI * frequency_hz * static_cast<double>(k) / rate_hz);
  return sum;
}

std::string refusal(const char* list, const Json& keys) {
  Json plant = Json::parse(quarter_car_text);
  plant[list][0].update(keys);
  try {
    parse_plant(JsonCursor::from(plant, "plant.json"));
  } catch (const UserError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace

TEST_CASE("ideal paths change no bit and stand in no file") {
  const Plant plant = quarter_car();
  const Matrix drive = Matrix::Random(1, 50);
  CHECK(apply_drive_paths(plant, drive, 0) == drive);
  const Matrix readings = Matrix::Random(3, 50);
  CHECK(apply_sensor_paths(plant, readings, 200) == readings);
  const Json text = to_json(plant);
  CHECK(text["inputs"][0].size() == 5);
  CHECK(text["sensors"][0].size() == 4);
  CHECK_FALSE(text.contains("clock_skew"));
  CHECK(plant_parameters(plant).size() == 8);
}

TEST_CASE("a delay of whole hold samples is a shift, and delays add") {
  Plant plant = quarter_car();
  plant.inputs[0].path.delay_s = 0.003;
  const Matrix drive = sine(9, 1000, 400).transpose();
  const Matrix late = apply_drive_paths(plant, drive, 0);
  CHECK(late.rightCols(397) == drive.leftCols(397));
  CHECK(late.leftCols(3) == Matrix::Constant(1, 3, drive(0, 0)));  // held before the record
  plant.inputs[0].path.delay_s = -0.002;
  CHECK(apply_drive_paths(plant, drive, 0).leftCols(398) == drive.rightCols(398));
  // The output of a delayed drive is that of the drive, later.
  plant.inputs[0].path.delay_s = 0.005;
  const Matrix moved = outputs(plant), direct = outputs(quarter_car());
  CHECK((moved.rightCols(500) - direct.middleCols(299, 500)).cwiseAbs().maxCoeff() <
        1e-3 * direct.rightCols(500).cwiseAbs().maxCoeff());
}

TEST_CASE("a fractional delay is that of the sine, up to a third of the hold rate") {
  for (const double frequency : {3.0, 40.0, 200.0, 340.0})
    for (const double delay : {0.31, 2.5, -0.77, 1e-4}) {
      const Vector u = sine(frequency, 1000, 400), late = resample_on_grid(u, delay, 0, 0);
      for (Index k = 40; k < 360; ++k)
        REQUIRE(std::abs(late(k) - std::sin(2 * M_PI * frequency * (static_cast<double>(k) - delay) / 1000 + 0.4)) <
                1e-4);
    }
  // Smooth in the delay, also across a whole sample: what a fit by differences needs.
  const Vector u = sine(15, 1000, 200);
  const auto slope = [&](double delay) {
    return Vector((resample_on_grid(u, delay + 1e-5, 0, 0) - resample_on_grid(u, delay - 1e-5, 0, 0)).segment(50, 100) /
                  2e-5);
  };
  CHECK((slope(2.0) - slope(2.01)).norm() < 0.01 * slope(2.0).norm());
  CHECK((slope(1.999) - slope(2.001)).norm() < 0.002 * slope(2.0).norm());
}

TEST_CASE("a skewed clock plays the drive faster, from the record's first sample on") {
  const double skew = 2e-3;
  const Vector u = sine(12, 1000, 2000), fast = resample_on_grid(u, 0, skew, 500);
  for (Index k = 60; k < 1940; ++k) {
    const double played = static_cast<double>(k) + skew * (static_cast<double>(k) - 500);
    REQUIRE(fast(k) == Approx(std::sin(2 * M_PI * 12 * played / 1000 + 0.4)).margin(1e-4));
  }
  CHECK(fast(500) == u(500));
}

TEST_CASE("lags have the frequency response of their formula") {
  const double rate = 1000;
  for (const double frequency : {1.0, 10.0, 25.0, 50.0}) {
    const std::complex<double> s(0, 2 * M_PI * frequency);
    const Vector u = sine(frequency, rate, 4000);
    const auto response = [&](const Lag& lag) {
      return line(apply_lag(lag, u, rate), frequency, rate, 2000) / line(u, frequency, rate, 2000);
    };
    const double tau = 0.006, w = 2 * M_PI * 30, zeta = 0.5;
    CHECK(std::abs(response({.time_constant_s = tau}) - 1.0 / (1.0 + tau * s)) < 2e-4);
    CHECK(std::abs(response({.cutoff_hz = 30, .damping_ratio = zeta}) - w * w / (s * s + 2 * zeta * w * s + w * w)) <
          2e-4);
  }
  const Vector constant = Vector::Constant(20, 3.5);
  CHECK((apply_lag({.cutoff_hz = 30, .damping_ratio = 0.5}, constant, rate) - constant).cwiseAbs().maxCoeff() < 1e-12);
}

TEST_CASE("gain and offset, rate limit and saturation of a drive") {
  Plant plant = quarter_car();
  DrivePath& path = plant.inputs[0].path;
  const Matrix drive = (Matrix(1, 6) << 0, 1, 1, -3, -3, 0.5).finished();
  path.gain = 2;
  path.offset = -1;
  CHECK(apply_drive_paths(plant, drive, 0) == Matrix(2 * drive.array() - 1));
  path = {.rate_limit = 2000};
  CHECK(apply_drive_paths(plant, drive, 0) == (Matrix(1, 6) << 0, 1, 1, -1, -3, -1).finished());
  path = {.saturation = 0.75};
  CHECK(apply_drive_paths(plant, drive, 0) == (Matrix(1, 6) << 0, 0.75, 0.75, -0.75, -0.75, 0.5).finished());
}

TEST_CASE("a sensor's gain, bias, drift, crosstalk, lag and quantum change its channel alone") {
  const Matrix ideal = outputs(quarter_car());
  const auto with = [&](const SensorPath& path) {
    Plant plant = quarter_car();
    plant.sensors[1].path = path;
    const Matrix y = outputs(plant);
    CHECK(y.row(0) == ideal.row(0));
    CHECK(y.row(2) == ideal.row(2));
    return Eigen::RowVectorXd(y.row(1));
  };
  const Eigen::RowVectorXd own = ideal.row(1), other = ideal.row(2);
  CHECK((with({.gain = 1.03}) - 1.03 * own).norm() < 1e-14 * own.norm());
  CHECK((with({.bias = 0.2}).array() - own.array() - 0.2).abs().maxCoeff() < 1e-14);
  const Eigen::RowVectorXd drift = with({.drift_per_s = 0.1}) - own;
  CHECK(drift(0) == 0);
  CHECK(drift(600) == Approx(0.3));
  const Eigen::RowVectorXd warm_up = with({.drift_per_s = 0.1, .drift_settling_per_s = 0.5}) - own;
  CHECK(warm_up(600) == Approx(0.2 * (1 - std::exp(-1.5))));
  const Eigen::RowVectorXd hardly = with({.drift_per_s = 0.1, .drift_settling_per_s = 1e-9}) - own;
  CHECK((hardly - drift).cwiseAbs().maxCoeff() < 1e-8);
  CHECK((with({.crosstalk = {{"wheel_acc", -0.02}}}) - own + 0.02 * other).norm() < 1e-14 * own.norm());
  const Eigen::RowVectorXd steps = with({.quantum = 0.05});
  CHECK((steps - own).cwiseAbs().maxCoeff() <= 0.025 + 1e-12);
  CHECK((steps / 0.05 - (steps / 0.05).array().round().matrix()).cwiseAbs().maxCoeff() < 1e-9);
  // A first-order lag satisfies tau y' + y = ideal; the response to sines of 1, 4 and 9 Hz, at a fast record.
  const double tau = 0.008;
  const Eigen::RowVectorXd slow = with({.lag = {.time_constant_s = tau}});
  double wrong = 0;
  for (Index k = 200; k < 798; ++k) {
    const double slope = (slow(k - 2) - 8 * slow(k - 1) + 8 * slow(k + 1) - slow(k + 2)) * 200 / 12;
    wrong = std::max(wrong, std::abs(tau * slope + slow(k) - own(k)));
  }
  CHECK(wrong < 0.02 * own.cwiseAbs().maxCoeff());
  CHECK((slow - own).cwiseAbs().maxCoeff() > 0.1 * own.cwiseAbs().maxCoeff());
}

TEST_CASE("a reading beyond a sensor's range is the end of the range, with its bias and before its rounding") {
  Plant plant = quarter_car();
  const Matrix ideal = outputs(plant);
  const double end = 0.4 * ideal.row(1).cwiseAbs().maxCoeff();
  plant.sensors[1].path.saturation = end;
  const Matrix clipped = outputs(plant);
  CHECK(clipped.row(0) == ideal.row(0));
  CHECK(clipped.row(2) == ideal.row(2));
  CHECK(clipped.row(1) == ideal.row(1).cwiseMax(-end).cwiseMin(end));
  CHECK((clipped.row(1).array().abs() == end).count() > 20);
  plant.sensors[1].path.saturation = 1.01 * ideal.row(1).cwiseAbs().maxCoeff();
  CHECK(outputs(plant) == ideal);
  // Gain and bias come first, the steps of the converter last.
  plant.sensors[1].path = {.gain = -2, .bias = 1, .quantum = 0.5, .saturation = 3.1};
  Matrix y = Matrix::Zero(3, 5);
  y.row(1) << 0, -2, 3, 0.55, 1;
  const Eigen::RowVectorXd read = apply_sensor_paths(plant, y, 200).row(1);
  CHECK((read - (Eigen::RowVectorXd(5) << 1, 3, -3, 0, -1).finished()).cwiseAbs().maxCoeff() < 1e-12);
}

TEST_CASE("noise enters a measurement before the end of the range: what was clipped with it is clipped again") {
  Plant plant = quarter_car();
  plant.sensors[1].path = {.quantum = 0.1, .saturation = 1.5};
  const Plant open = unconverted(plant);
  CHECK(std::isinf(open.sensors[1].path.saturation));
  CHECK(open.sensors[1].path.quantum == 0);
  CHECK(unquantised(plant).sensors[1].path.saturation == 1.5);
  const Matrix ideal = 3 * Matrix::Random(3, 200);
  Matrix readings = apply_sensor_paths(open, ideal, 200);
  CHECK(readings == ideal);
  convert_readings(plant, readings);
  CHECK(readings == apply_sensor_paths(plant, ideal, 200));
  CHECK(readings.row(1).cwiseAbs().maxCoeff() == Approx(1.5));
  CHECK(readings.row(2) == ideal.row(2));
}

TEST_CASE("a sensor of limited rate never reads a faster change, between the samples of a record either") {
  Plant plant = quarter_car();
  const Matrix ideal = outputs(plant);
  const double fastest = 200 * (ideal.row(2).tail(799) - ideal.row(2).head(799)).cwiseAbs().maxCoeff();
  const auto with = [&](double limit) {
    plant.sensors[2].path.rate_limit = limit;
    const Matrix y = outputs(plant);
    CHECK(y.topRows(2) == ideal.topRows(2));
    return Eigen::RowVectorXd(y.row(2));
  };
  for (const double share : {0.2, 0.6}) {
    const Eigen::RowVectorXd slow = with(share * fastest);
    CHECK(200 * (slow.tail(799) - slow.head(799)).cwiseAbs().maxCoeff() <= share * fastest * (1 + 1e-9));
    CHECK((slow - ideal.row(2)).cwiseAbs().maxCoeff() > 1e-3 * ideal.row(2).cwiseAbs().maxCoeff());
  }
  CHECK((with(1e9) - ideal.row(2)).cwiseAbs().maxCoeff() < 1e-12 * ideal.row(2).cwiseAbs().maxCoeff());
  // It follows what it can follow at once, and a jump in steps.
  plant.sensors[2].path.rate_limit = 200;
  Matrix y = Matrix::Zero(3, 6);
  y.row(2) << 0, 0.5, 4, 4, 4, 4;
  CHECK((apply_sensor_paths(plant, y, 200).row(2) - (Eigen::RowVectorXd(6) << 0, 0.5, 1.5, 2.5, 3.5, 4).finished())
            .cwiseAbs()
            .maxCoeff() < 1e-12);
}

TEST_CASE(
    "a late sensor reads what the plant did before, and AC coupling passes a sine by the response of its corner") {
  Plant plant = quarter_car();
  const Matrix ideal = outputs(plant);
  plant.sensors[1].path.delay_s = 0.035;  // seven samples of the record
  const Matrix late = outputs(plant);
  CHECK(late.topRows(1) == ideal.topRows(1));
  CHECK((late.row(1).tail(700) - ideal.row(1).segment(93, 700)).norm() < 1e-9 * ideal.row(1).norm());
  plant.sensors[1].path = {.high_pass_hz = 0.4};
  const double rate = 200, f = 1.5;
  Matrix y = Matrix::Zero(3, 4000);
  y.row(1) = sine(f, rate, 4000).transpose();
  const Matrix read = apply_sensor_paths(plant, y, rate);
  const std::complex<double> passed =
      line(read.row(1).transpose(), f, rate, 2000) / line(y.row(1).transpose(), f, rate, 2000);
  CHECK(std::abs(passed - 1.0 / (1.0 - std::complex<double>(0, 0.4 / f))) < 1e-3);
  y.row(1).setConstant(9.81);  // gravity does not pass, from the first sample on
  CHECK(apply_sensor_paths(plant, y, rate).cwiseAbs().maxCoeff() < 1e-9);
}

TEST_CASE(
    "the derivatives of what sensors read are those of their paths: range, rate limit, lag of either order, delay, "
    "coupling") {
  Plant plant = quarter_car();
  const Matrix ideal = outputs(plant);
  const double peak = ideal.row(2).cwiseAbs().maxCoeff();
  const double fastest = 200 * (ideal.row(2).tail(799) - ideal.row(2).head(799)).cwiseAbs().maxCoeff();
  const Matrix drive = 0.004 * sine(3, 1000, 2000).transpose();
  const std::string place = "sensor:wheel_acc.";
  const std::vector<std::pair<std::string, double>> sizes = {{"saturation", 0.5 * peak}, {"rate_limit", 0.5 * fastest},
                                                             {"lag.cutoff_hz", 30},      {"lag.damping_ratio", 0.6},
                                                             {"delay_s", 0.0123},        {"high_pass_hz", 0.7}};
  for (const auto& [key, value] : sizes) {
    CAPTURE(key);
    plant.sensors[2].path = {};
    if (key == "lag.damping_ratio") plant.sensors[2].path.lag.cutoff_hz = 30;
    set_parameter(plant, place + key, value);
    // How the path itself moves, and how it hands on what the plant does.
    for (const std::string& moved : {place + key, std::string("suspension.viscous_damper.damping_ns_per_m")}) {
      CAPTURE(moved);
      const double scale = 1e-4 * get_parameter(plant, moved);
      const auto run = [&](double steps) {
        Plant there = plant;
        set_parameter(there, moved, get_parameter(plant, moved) + steps * scale);
        return simulate_measured(there, drive, {.substeps = 2, .decimation = 5}).outputs;
      };
      Plant neighbour = plant;
      set_parameter(neighbour, moved, get_parameter(plant, moved) + scale);
      const VariedSimulation varied =
          simulate_varied(plant, drive, {.substeps = 2, .decimation = 5}, {{.neighbour = &neighbour, .step = 1}});
      REQUIRE(varied.simulation.status == Status::ok);
      CHECK((varied.simulation.outputs - run(0)).cwiseAbs().maxCoeff() < 1e-9 * peak);
      const Matrix difference = 0.5 * (run(1) - run(-1));
      CHECK(difference.row(2).norm() > 0);
      CHECK((varied.outputs[0] - difference).norm() < 0.02 * difference.norm());
    }
  }
}

TEST_CASE("the command stays in the record, and generating equals simulating") {
  Plant plant = quarter_car();
  plant.inputs[0].path = {.gain = 0.9, .delay_s = 0.0042, .lag = {.cutoff_hz = 40}};
  plant.sensors[2].path.lag.time_constant_s = 0.003;
  plant.clock_skew = 1e-4;
  const Signal command = record(plant);
  const GeneratedRecord simulated = simulate_record(plant, command);
  REQUIRE(simulated.status == Status::ok);
  CHECK(simulated.signal.u == command.u);
  CHECK(simulated.signal.y.cols() == 800);
  CHECK(simulated.states.cols() == 800);
  plant.inputs[0].interpolation = "zoh";
  Matrix held(1, 4000);
  for (Index k = 0; k < 4000; ++k) held(0, k) = command.u(0, k / 5);
  const GeneratedRecord again = simulate_record(plant, command);
  const GeneratedRecord generated = generate_record(plant, held, 200, {.from_equilibrium = true});
  REQUIRE(generated.status == Status::ok);
  CHECK(generated.signal.y == again.signal.y);
  CHECK(generated.signal.u == command.u);
}

TEST_CASE("paths read back what they write, and their numbers are parameters with a location") {
  Json text = Json::parse(quarter_car_text);
  text["inputs"][0].update(Json::parse(R"({"gain": 0.97, "offset": 0.001, "delay_s": 0.0021,
    "lag": {"cutoff_hz": 35, "damping_ratio": 0.7}, "rate_limit": 1.2, "saturation": 0.06})"));
  text["sensors"][1].update(
      Json::parse(R"({"gain": 1.02, "bias": 0.1, "drift_per_s": 0.01, "drift_settling_per_s": 0.02,
    "lag": {"time_constant_s": 0.004}, "crosstalk": {"wheel_acc": 0.02}, "rate_limit": 900, "saturation": 20,
    "quantum": 0.01})"));
  text["sensors"][2].update(Json::parse(R"({"lag": {"cutoff_hz": 60, "damping_ratio": 0.65}})"));
  text["clock_skew"] = 5e-5;
  Plant plant = plant_from(text.dump());
  const Json written = to_json(plant);
  CHECK(to_json(parse_plant(JsonCursor::from(written, "again.json"))) == written);
  CHECK(written["inputs"][0]["lag"] == text["inputs"][0]["lag"]);
  CHECK(written["sensors"][1]["crosstalk"] == text["sensors"][1]["crosstalk"]);
  CHECK(get_parameter(plant, "actuator:road.lag.cutoff_hz") == 35);
  CHECK(get_parameter(plant, "sensor:body_acc.crosstalk.wheel_acc") == 0.02);
  CHECK(written["sensors"][2]["lag"] == text["sensors"][2]["lag"]);
  CHECK(get_parameter(plant, "sensor:body_acc.rate_limit") == 900);
  CHECK(get_parameter(plant, "sensor:body_acc.saturation") == 20);
  CHECK(get_parameter(plant, "timebase.clock_skew") == 5e-5);
  set_parameter(plant, "sensor:travel.gain", 1.01);  // ideal so far
  CHECK(plant.sensors[0].path.gain == 1.01);
  std::vector<std::string> places;
  for (const PlantParameter& parameter : plant_parameters(plant))
    if (parameter.name == "actuator:road.delay_s" || parameter.name == "sensor:travel.gain" ||
        parameter.name == "sensor:body_acc.rate_limit" || parameter.name == "timebase.clock_skew")
      places.push_back(to_string(parameter.handle.place) + " " + parameter.unit);
  CHECK(places == std::vector<std::string>{"actuator s", "sensor:travel -", "sensor:body_acc m/s^2/s", "timebase -"});
}

TEST_CASE("mistakes in paths are refused with their place and the known names") {
  CHECK_THAT(refusal("inputs", {{"delay", 0.1}}), Contains("$.inputs[0]") && Contains("delay_s"));
  CHECK_THAT(refusal("inputs", {{"rate_limit", 0}}), Contains("$.inputs[0].rate_limit"));
  CHECK_THAT(refusal("inputs", {{"gain", "high"}}), Contains("$.inputs[0].gain") && Contains("number"));
  CHECK_THAT(refusal("inputs", {{"lag", {{"cutoff_hz", 30}, {"time_constant_s", 1}}}}),
             Contains("$.inputs[0].lag") && Contains("either"));
  CHECK_THAT(refusal("inputs", {{"lag", {{"cutoff_hz", 30}, {"damping", 1}}}}), Contains("damping_ratio"));
  CHECK_THAT(refusal("inputs", {{"lag", {{"time_constant_s", 1}, {"damping_ratio", 1}}}}),
             Contains("$.inputs[0].lag.damping_ratio"));
  CHECK_THAT(refusal("sensors", {{"crosstalk", {{"wheel", 0.1}}}}),
             Contains("$.sensors[0].crosstalk.wheel") && Contains("wheel_acc"));
  CHECK_THAT(refusal("sensors", {{"crosstalk", {{"travel", 0.1}}}}), Contains("$.sensors[0].crosstalk.travel"));
  CHECK_THAT(refusal("sensors", {{"offset", 0.1}}), Contains("offset") && Contains("bias"));
  CHECK_THAT(refusal("sensors", {{"saturation", 0}}), Contains("$.sensors[0].saturation"));
  CHECK_THAT(refusal("sensors", {{"rate_limit", -1}}), Contains("$.sensors[0].rate_limit"));
  Json plant = Json::parse(quarter_car_text);
  plant["clock_skew"] = 0.5;
  CHECK_THROWS_WITH(plant_from(plant.dump()), Contains("$.clock_skew"));
}

TEST_CASE("a soft end of stroke never passes its limit, hardly bends small commands, and hardens with its sharpness") {
  Plant plant = plant_from(quarter_car_text);
  Matrix drive(1, 9);
  drive << -0.5, -0.05, -0.02, -0.001, 0, 0.001, 0.02, 0.05, 0.5;
  const auto felt = [&](double sharpness) {
    plant.inputs[0].path.saturation = 0.03;
    plant.inputs[0].path.saturation_sharpness = sharpness;
    return apply_drive_paths(plant, drive, 0);
  };
  const Matrix hard = felt(std::numeric_limits<double>::infinity()), soft = felt(4);
  CHECK(soft.cwiseAbs().maxCoeff() <= 0.03);
  CHECK(soft(0, 5) == Approx(0.001).epsilon(1e-5));
  CHECK((soft + soft.rowwise().reverse()).norm() < 1e-15);
  CHECK(soft(0, 6) < hard(0, 6));
  CHECK((felt(200) - hard).cwiseAbs().maxCoeff() < 2e-4);
}

TEST_CASE("a staircase that arrives between two samples is a delay and a sampling phase") {
  Plant fine = plant_from(quarter_car_text), coarse = fine;
  fine.inputs[0].hold_hz = 10000;
  const Vector command = sine(7, 1000, 1500) * 0.004;
  Matrix stairs(1, 15000);  // ten of its columns to one of the command, 2.6 ms late
  for (Index k = 0; k < stairs.cols(); ++k) stairs(0, k) = command(std::max<Index>(k - 26, 0) / 10);
  const Simulation truth = simulate(fine, stairs, {.decimation = 50});
  coarse.inputs[0].path.delay_s = 0.0026;
  const auto error = [&](double phase) {
    coarse.inputs[0].path.sampling_phase = phase;
    const Simulation run = simulate_measured(coarse, command.transpose(), {.decimation = 5});
    return Vector((run.outputs - truth.outputs).rightCols(200).rowwise().norm());
  };
  const Vector right = error(0.4), early = error(0), late = error(0.8);
  const Index wheel_acc = 2;  // the tyre's force on the wheel follows the drive at once
  CHECK(right(wheel_acc) < 0.02 * early(wheel_acc));
  CHECK(right(wheel_acc) < 0.02 * late(wheel_acc));
  CHECK(right(1) == Approx(early(1)));  // the body's acceleration does not
}
