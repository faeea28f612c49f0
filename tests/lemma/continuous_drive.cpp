/// Drives that are not held: simulated as the smooth signals that were measured.
#include <catch2/catch.hpp>
#include <complex>
#include <functional>
#include <numbers>

#include "core/base/random.hpp"
#include "core/gap/where/forced.hpp"
#include "core/greybox/plant_fit.hpp"
#include "core/plant/dataset.hpp"
#include "core/plant/simulate.hpp"
#include "tests/support/places.hpp"
#include "tests/support/plants.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

double between(Random& random, double low, double high) { return low + (high - low) * random.uniform(); }

/// One mass on a spring and a damper, moved by a force on it or by the displacement of their far end.
struct Oscillator {
  double m, c, k;
  bool force;
  Plant plant() const {
    const Json input = force ? Json{{"name", "u"}, {"kind", "force"}, {"unit", "N"}, {"on", "body"}}
                             : Json{{"name", "u"}, {"kind", "displacement"}, {"unit", "m"}};
    const Json file = {{"name", "oscillator"},
                       {"masses", {{{"name", "body"}, {"mass_kg", m}}}},
                       {"inputs", {input}},
                       {"elements",
                        {{{"name", "leg"},
                          {"between", {force ? "ground" : "u", "body"}},
                          {"laws",
                           {{{"law", "linear_spring"}, {"stiffness_n_per_m", k}},
                            {{"law", "viscous_damper"}, {"damping_ns_per_m", c}}}}}}},
                       {"sensors",
                        {{{"name", "x"}, {"kind", "displacement"}, {"of", "body"}, {"unit", "m"}},
                         {{"name", "a"}, {"kind", "acceleration"}, {"of", "body"}, {"unit", "m/s^2"}}}}};
    return parse_plant(JsonCursor::from(file, "oscillator.json"));
  }
  std::complex<double> response(double w) const {
    const std::complex<double> up = force ? 1.0 : std::complex<double>(k, c * w);
    return up / std::complex<double>(k - m * w * w, c * w);
  }
};

/// A sum of sines, its samples, and what it makes of an oscillator in the steady state.
struct Sines {
  std::vector<double> frequency_hz, phase;
  double at(double t, const std::function<std::complex<double>(double)>& of) const {
    double sum = 0;
    for (std::size_t i = 0; i < frequency_hz.size(); ++i) {
      const double w = 2 * std::numbers::pi * frequency_hz[i];
      sum += (of(w) * std::polar(1.0, w * t + phase[i])).imag();
    }
    return sum;
  }
};

struct Drawn {
  Oscillator oscillator;
  Sines sines;
  double sampling_hz;
  Signal record;
  Vector start;
};

/// @param top highest frequency of the drive over the sampling rate
Drawn draw(Random& random, bool force, double sampling_hz, double top) {
  Drawn drawn;
  const double m = between(random, 1, 300), f0 = between(random, 1, 8), w0 = 2 * std::numbers::pi * f0;
  drawn.oscillator = {m, 2 * between(random, 0.03, 0.4) * m * w0, m * w0 * w0, force};
  drawn.sampling_hz = sampling_hz;
  for (int i = 0; i < 6; ++i) {
    drawn.sines.frequency_hz.push_back(between(random, 0.2, std::min(30.0, top * sampling_hz)));
    drawn.sines.phase.push_back(between(random, 0, 6));
  }
  const auto samples = static_cast<Index>(4 * sampling_hz);
  drawn.record.sample_time_s = 1 / sampling_hz;
  drawn.record.inputs = {{"u", force ? "N" : "m"}};
  drawn.record.outputs = {{"x", "m"}, {"a", "m/s^2"}};
  drawn.record.u.resize(1, samples);
  drawn.record.y.resize(2, samples);
  const auto one = [](double) { return std::complex<double>(1); };
  const auto x = [&](double w) { return drawn.oscillator.response(w); };
  const auto v = [&](double w) { return std::complex<double>(0, w) * drawn.oscillator.response(w); };
  const auto a = [&](double w) { return -w * w * drawn.oscillator.response(w); };
  for (Index k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) / sampling_hz;
    drawn.record.u(0, k) = drawn.sines.at(t, one);
    drawn.record.y.col(k) << drawn.sines.at(t, x), drawn.sines.at(t, a);
  }
  drawn.start = (Vector(2) << drawn.sines.at(0, x), drawn.sines.at(0, v)).finished();
  return drawn;
}

RecordSet set_of(const Drawn& drawn) {
  RecordSet set;
  set.sampling_hz = drawn.sampling_hz;
  set.records.push_back({"a.csv", "estimation", "", 0, drawn.record});
  return set;
}

}  // namespace

TEST_CASE("a measured drive that is not held gives the exact steady state, at every sampling rate", "[greybox]") {
  Random random(11, Stream::road);
  for (const double sampling_hz : {100.0, 200.0, 512.0, 1000.0, 4000.0})
    for (const bool force : {true, false}) {
      const Drawn drawn = draw(random, force, sampling_hz, 0.2);
      const Plant plant = with_drive_rate(drawn.oscillator.plant(), set_of(drawn));
      const FitRecord record = fit_record(plant, drawn.record, Vector::Ones(2));
      const Simulation run = simulate_measured(plant, record.drive, run_options(plant, record, drawn.start));
      REQUIRE(run.status == Status::ok);
      const Index samples = drawn.record.samples(),
                  edge = samples / 10;  // the record's ends are continued by reflection
      for (Index i = 0; i < 2; ++i) {
        const Vector error =
            (run.outputs.row(i).leftCols(samples) - drawn.record.y.row(i)).segment(edge, samples - 2 * edge);
        INFO("rate " << sampling_hz << " Hz, force " << force << ", channel " << i << ", drive at " << plant.hold_hz());
        CHECK(error.norm() <= 2e-3 * drawn.record.y.row(i).norm());
      }
    }
}

TEST_CASE("a free decay is integrated as well as a driven motion, at every sampling rate, rubbing or not",
          "[greybox]") {
  Random random = numbers(6422);
  for (const double sampling_hz : {50.0, 200.0, 1000.0})
    for (const double friction : {0.0, 0.02, 0.1}) {  // of the spring's force at the start
      const double m = between(random, 1, 100), w0 = between(random, 0.5, 1.2) * sampling_hz;
      const double size = std::pow(10, between(random, -4, -2)), k = m * w0 * w0;
      Plant rig = Oscillator{m, 2 * between(random, 0.005, 0.05) * m * w0, k, true}.plant();
      if (friction > 0)
        rig.elements[0].laws.push_back(
            {find_law("coulomb_friction"), {friction * k * size, 0, 0.05, 0.05 * size * w0}});
      Drawn drawn{{}, {}, sampling_hz, {}, {}};
      drawn.record.sample_time_s = 1 / sampling_hz;
      drawn.record.inputs = rig.input_channels();
      drawn.record.outputs = rig.output_channels();
      drawn.record.u = Matrix::Zero(1, 300);
      drawn.record.y = Matrix::Zero(2, 300);
      const InitialState start((Vector(2) << size, 0).finished());
      const auto readings_of = [&](const Plant& plant) {
        const FitRecord record = fit_record(plant, drawn.record, Vector::Ones(2));
        const Simulation run = simulate_measured(plant, record.drive, run_options(plant, record, start));
        REQUIRE(run.status == Status::ok);
        return run.outputs;
      };
      Plant fine = rig;
      fine.inputs[0].hold_hz = 256 * sampling_hz;
      drawn.record.y = readings_of(fine);
      const Plant plant = with_drive_rate(rig, set_of(drawn));
      const Matrix error = readings_of(plant) - drawn.record.y;
      for (Index i = 0; i < 2; ++i) {
        INFO("rate " << sampling_hz << " Hz, friction " << friction << ", channel " << i << ", steps at "
                     << plant.hold_hz() / sampling_hz << " x");
        CHECK(error.row(i).norm() <= 5 * kDriveAccuracy * drawn.record.y.row(i).norm());
      }
    }
}

TEST_CASE("derivatives of a simulation under a drive that is not held are those of differences", "[greybox]") {
  Random random(12, Stream::road);
  for (const bool force : {true, false}) {
    const Drawn drawn = draw(random, force, 200, 0.15);
    const Plant plant = with_drive_rate(drawn.oscillator.plant(), set_of(drawn));
    const FitRecord record = fit_record(plant, drawn.record, Vector::Ones(2));
    const SimulateOptions options = run_options(plant, record, drawn.start);
    const double step = 1e-5;
    for (const char* name : {"leg.linear_spring.stiffness_n_per_m", "leg.viscous_damper.damping_ns_per_m",
                             "actuator:u.gain", "actuator:u.delay_s"}) {
      std::string parameter = name;
      const bool path = parameter.starts_with("actuator");
      const double value = path && parameter.ends_with("delay_s") ? 0 : get_parameter(plant, parameter);
      const double size = parameter.ends_with("delay_s") ? 0.01 : std::abs(value);
      Plant up = plant, down = plant;
      set_parameter(up, parameter, value + step * size);
      set_parameter(down, parameter, value - step * size);
      const VariedSimulation varied =
          simulate_varied(plant, record.drive, options, {Variation{.neighbour = &up, .step = step}});
      REQUIRE(varied.simulation.status == Status::ok);
      const Matrix difference = (simulate_measured(up, record.drive, options).outputs -
                                 simulate_measured(down, record.drive, options).outputs) /
                                (2 * step);
      INFO(name);
      CHECK((varied.outputs[0] - difference).norm() <= 1e-3 * difference.norm());
    }
  }
}

TEST_CASE("four simulations side by side under drives that are not held equal those one by one", "[greybox]") {
  Random random(13, Stream::road);
  for (const bool force : {true, false}) {
    const Drawn drawn = draw(random, force, 200, 0.15);
    const Plant first = with_drive_rate(drawn.oscillator.plant(), set_of(drawn));
    const FitRecord record = fit_record(first, drawn.record, Vector::Ones(2));
    std::vector<Plant> plants(4, first);
    for (std::size_t i = 0; i < plants.size(); ++i) plants[i].masses[0].mass_kg *= 1 + 0.1 * static_cast<double>(i);
    std::vector<SimulationTask> tasks;
    for (const Plant& plant : plants) tasks.push_back({&plant, &record.drive, run_options(first, record, drawn.start)});
    const std::vector<Simulation> together = simulate_measured_side_by_side(tasks);
    for (std::size_t i = 0; i < plants.size(); ++i) {
      const Simulation alone = simulate_measured(plants[i], record.drive, tasks[i].options);
      CHECK((together[i].outputs - alone.outputs).norm() <= 1e-9 * alone.outputs.norm());
    }
  }
}

TEST_CASE("a plant file without a hold rate stays one, and says so where a rate is needed", "[greybox]") {
  const Plant plant = Oscillator{10, 5, 1000, true}.plant();
  CHECK_FALSE(plant.held());
  CHECK_THROWS_AS(plant.hold_hz(), UserError);
  CHECK_FALSE(to_json(plant)["inputs"][0].contains("hold_hz"));
  Json file = to_json(plant);
  file["inputs"][0]["interpolation"] = "zoh";
  CHECK_THROWS_AS(parse_plant(JsonCursor::from(file, "held.json")), UserError);
}

TEST_CASE("a force that is known as long as a record is compared acts there alone, and none changes nothing") {
  Random random(14, Stream::road);
  for (const bool by_force : {true, false}) {
    const Drawn drawn = draw(random, by_force, 200, 0.2);
    PlantFit fit;
    fit.plant = with_drive_rate(drawn.oscillator.plant(), set_of(drawn));
    const FitRecord record = fit_record(fit.plant, drawn.record, Vector::Ones(2));
    REQUIRE(record.drive.cols() > record.y.cols() * record.ratio);
    fit.initial_states = {drawn.start};
    Vector plain;
    REQUIRE(plant_residual(fit.plant, {record}, fit.initial_states, plain));
    for (const double size : {0.0, 1.0}) {
      const ForcedPlant forced = force_at(fit, {record}, "leg"_at, {Vector::Constant(record.y.cols(), size)});
      const Matrix& drive = forced.records[0].drive;
      REQUIRE(drive.cols() == record.drive.cols());
      CHECK(drive.topRows(1) == record.drive);
      CHECK(drive.bottomRows(1).rightCols(drive.cols() - record.y.cols() * record.ratio).isZero(0));
      const std::vector<Matrix> left = residuals(forced);
      REQUIRE(left.size() == 1);
      if (size == 0) CHECK((left[0].reshaped() - plain).norm() <= 1e-9 * plain.norm());
    }
  }
}

TEST_CASE("a plant without inputs moves as one whose drive is always zero, and stays without them in its file") {
  Json text = Json::parse(one_mass_text);
  text["inputs"] = Json::array();
  Random random = numbers(6421);
  for (int trial = 0; trial < 5; ++trial) {
    Plant left = plant_from(text.dump());
    REQUIRE(left.inputs.empty());
    Plant driven = plant_from(one_mass_text);
    RecordSet set;
    set.sampling_hz = 100;
    Record record;
    record.role = "estimation";
    record.signal.u = Matrix(0, 200);
    record.signal.y = random.normal(left.sensor_count(), 200);
    record.signal.sample_time_s = 0.01;
    set.records = {record};
    RecordSet known = set;
    known.records[0].signal.u = Matrix::Zero(1, 200);
    known.records[0].signal.inputs = driven.input_channels();
    add_silent_drive(left, set);
    REQUIRE(set.records[0].signal.u.rows() == 1);
    driven.inputs[0].held = false;
    add_silent_drive(driven, known);  // it has a drive
    REQUIRE(driven.inputs.size() == 1);
    left = with_drive_rate(left, set);
    driven = with_drive_rate(driven, known);
    const InitialState start(Vector(0.01 * random.normal(2, 1)));
    const auto residual = [&](const Plant& plant, const RecordSet& records) {
      Vector r;
      const FitRecord own = fit_record(plant, records.records[0].signal, Vector::Ones(plant.sensor_count()));
      REQUIRE(plant_residual(plant, {own}, {start}, r));
      return r;
    };
    // Of a drive that may have moved before the record and after it the ends are not compared.
    const Vector free = residual(left, set), held_still = residual(driven, known);
    const Index ends = (free.size() - held_still.size()) / 2;
    CHECK(ends == left.sensor_count() * kUnsureEnds);
    CHECK((free.segment(ends, held_still.size()) - held_still).norm() < 1e-6 * held_still.norm());
    CHECK(to_json(left).at("inputs").empty());
  }
}
