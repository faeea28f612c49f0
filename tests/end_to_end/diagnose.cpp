// `diagnose` on records of known plants: the right effect at the right place, no name where nothing is missing.
#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <filesystem>
#include <numbers>
#include <set>

#include "core/base/random.hpp"
#include "core/data/metrics.hpp"
#include "core/data/records.hpp"
#include "core/plant/dataset.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/program.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

const std::string one_sensor_text =
    R"({"name": "one mass", "masses": [{"name": "mass", "mass_kg": 8, "tolerance": 0.01}],
  "inputs": [{"name": "push", "kind": "force", "unit": "N", "on": "mass", "hold_hz": 1000}],
  "elements": [{"name": "mount", "between": ["ground", "mass"], "laws": [
    {"law": "polynomial_spring", "coefficients": [12000, 0, 9e6], "tolerance": 0.03},
    {"law": "viscous_damper", "damping_ns_per_m": 45, "tolerance": 0.08}]}],
  "sensors": [{"name": "position", "kind": "displacement", "of": "mass", "unit": "m"}]})";

/// 8 mm RMS, or of another level, behind six poles at 10 Hz: hardly anything above half the sampling rate, so that the
/// record tells the whole drive.
Matrix smooth_drive(Random& road, Index samples, double level = 0.008) {
  Matrix drive(1, samples);
  std::array<double, 6> poles{};
  for (double& value : drive.reshaped()) {
    value = road.normal();
    for (double& pole : poles) value = pole += 0.06 * (value - pole);
  }
  return drive * (level * std::sqrt(static_cast<double>(samples)) / drive.norm());
}

/// Two repeats and a validation record of `truth`, and the plant file of `nominal`.
/// @param unknown share of what drives the plant that no record tells   @param calmer drive of the validation record
/// over that of the others   @param level RMS of the drive
void measure(const Folder& folder, const Plant& nominal, const Plant& truth, double noise, double unknown = 0,
             double calmer = 1, double level = 0.008) {
  RecordSet set;
  set.sampling_hz = 200;
  const Index ratio = 5, samples = 3000;
  Random random(77, Stream::road);
  for (int which = 0; which < 3; ++which) {
    Random road(78, Stream::road, which == 2);
    const Matrix drive = (which == 2 ? calmer : 1.0) * smooth_drive(road, samples * ratio, level);
    GeneratedRecord made = generate_record(truth, drive, 200);
    REQUIRE(made.status == Status::ok);
    if (unknown > 0) {
      const GeneratedRecord whole =
          generate_record(truth, drive + unknown * smooth_drive(road, samples * ratio, level), 200);
      REQUIRE(whole.status == Status::ok);
      made.signal.y = whole.signal.y;
    }
    for (Index i = 0; i < made.signal.y.rows(); ++i) {
      const double std = noise * made.signal.y.row(i).norm() / std::sqrt(static_cast<double>(samples));
      made.signal.y.row(i) += std * random.normal(1, samples);
    }
    set.records.push_back({which < 2 ? "est_" + std::to_string(which) + ".csv" : "val.csv",
                           which < 2 ? "estimation" : "validation", which < 2 ? "drive" : "", 0, made.signal});
  }
  write_records(folder.path(), set);
  write_json(folder / "plant.json", to_json(nominal));
}

Json diagnosis(const Folder& folder, std::string& out) {
  const Said said = run_program("diagnose --quiet --plant '" + (folder / "plant.json").string() + "' --records '" +
                                    (folder / "records.json").string() + "' --out '" + (folder / "d.json").string() +
                                    "' --report '" + (folder / "d.html").string() + "'",
                                "PATH=/nowhere");
  INFO(said.err);
  REQUIRE(said.status == 0);
  out = said.out;
  return parse_json(read_file(folder / "d.json"), "d.json");
}

}  // namespace

TEST_CASE("a wheel that is heavier than its file says is named beside friction, and both make the corrected plant",
          "[slow]") {
  const Folder folder;
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  truth.elements[0].laws.push_back({find_law("coulomb_friction"), {40, 0, 0.05, 0.005}});
  truth.masses[1].mass_kg *= 1.4;
  measure(folder, nominal, truth, 0.01);
  std::string out;
  const Json d = diagnosis(folder, out);
  CHECK(d.at("which").at("named") == Json({"coulomb_friction@suspension", "mass_error@wheel"}));
  CHECK(d.at("which").at("outcome") == "several");
  CHECK(d.at("decided_by").at("row") == "3f");
  const Plant corrected = load_plant(folder / "d.plant.json");
  CHECK(corrected.masses[1].mass_kg == Approx(truth.masses[1].mass_kg).epsilon(0.02));
  CHECK(d.at("how_far").at("with_effect").at("misfit").get<double>() < 1.1);
}

TEST_CASE("an asymmetric damper is named at its element, closes the gap, and the corrected plant is a plant file",
          "[slow]") {
  const Folder folder;
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  truth.elements[0].laws.push_back({find_law("asymmetric_damper"), {850, 0.25, 0.1, 1, 1}});
  set_parameter(truth, "tyre.linear_spring.stiffness_n_per_m", 200000 * 1.03);
  measure(folder, nominal, truth, 0.01);
  std::string out;
  const Json d = diagnosis(folder, out);
  CHECK(d.at("schema") == "wheelhop.diagnosis/1");
  CHECK(d.at("verdict") == "gap");
  CHECK(d.at("where").at("location") == "suspension");
  REQUIRE(d.at("which").at("named").size() == 1);
  CHECK(d.at("which").at("named")[0] == "damper_asymmetry@suspension");
  CHECK(d.at("how_far").at("closure").get<double>() > 0.95);
  CHECK(d.at("how_far").at("closure_ci90")[0].get<double>() <= d.at("how_far").at("closure").get<double>());
  for (const Json& effect : d.at("which").at("effects")) CHECK(effect.at("probability").get<double>() < 1);
  CHECK_THAT(out, Contains("damper_asymmetry") && Contains("x the noise"));
  // The file holds all that its verdict rests on: it is made again from there, and by other thresholds another one.
  const auto decided = [&](const std::string& more) {
    const Said said = run_program("decide '" + (folder / "d.json").string() + "' " + more);
    INFO(said.err);
    REQUIRE(said.status == 0);
    return parse_json(said.out, "stdout");
  };
  const Json again = decided("");
  CHECK(again.at("named") == d.at("which").at("named"));
  CHECK(again.at("decided_by") == d.at("decided_by"));
  CHECK(again.at("locations")[0].at("probability") == d.at("where").at("locations")[0].at("probability"));
  CHECK(again.at("closure") == d.at("how_far").at("closure"));
  CHECK(decided("--set notice=1e9 --set too_small=1e9").at("outcome") == "none");
  write_json(folder / "evidence.json", d.at("evidence"));
  const Said alone = run_program("decide '" + (folder / "evidence.json").string() + "'");
  CHECK(parse_json(alone.out, "stdout").at("named") == again.at("named"));
  const Said unknown = run_program("decide '" + (folder / "d.json").string() + "' --set notise=1");
  CHECK(unknown.status == 2);
  CHECK_THAT(unknown.err, Contains("notise") && Contains("notice"));
  double shares = 0;
  for (const Json& band : d.at("where").at("bands")) shares += band.at("share").get<double>();
  CHECK(shares == Approx(1));
  CHECK(d.at("how_far").at("beyond_envelope").at("time_share").get<double>() < 1);
  // Without Node.js there is no page; the diagnosis stands, and the figures' data with it.
  CHECK_THAT(out, Contains("not drawn") && Contains("Node.js"));
  CHECK_FALSE(std::filesystem::exists(folder / "d.html"));
  const Json figures = parse_json(read_file(folder / "d.figures.json"), "d.figures.json");
  CHECK(figures.at("unknown_signal").at("location") == "suspension");
  const Plant corrected = load_plant(folder / d.at("corrected_plant").get<std::string>());
  CHECK(get_parameter(corrected, "suspension.asymmetric_damper.asymmetry") == Approx(0.25).epsilon(0.1));
}

TEST_CASE("valves that open each way in their own manner are one damper's law, and no load or offset beside it",
          "[slow]") {
  Random random(2803, Stream::parameters);
  for (int trial = 0; trial < 3; ++trial) {
    const Folder folder;
    const Plant nominal = plant_from(quarter_car_text);
    Plant truth = nominal;
    // Of the form that is fitted, and as the sum of two laws that are not.
    const double knee = 0.06 + 0.1 * random.uniform(), asymmetry = 0.2 + 0.2 * random.uniform();
    const double rebound = 0.3 + 0.3 * random.uniform();
    CAPTURE(trial, knee, asymmetry, rebound);
    if (trial < 2) {
      const double jounce = trial == 0 ? 1 : 0.4;
      truth.elements[0].laws.push_back({find_law("asymmetric_damper"), {850, asymmetry, knee, rebound, jounce}});
    } else {
      truth.elements[0].laws.push_back({find_law("asymmetric_damper"), {850, asymmetry, knee, 1, 1}});
      truth.elements[0].laws.push_back({find_law("digressive_damper"), {850, knee, 0.6, 3}});
    }
    measure(folder, nominal, truth, 0.01);
    std::string out;
    const Json d = diagnosis(folder, out);
    CAPTURE(out);
    const Json& named = d.at("which").at("named");
    REQUIRE_FALSE(named.empty());
    CHECK(named[0] == "damper_asymmetry@suspension");
    for (const Json& name : named) CHECK_THAT(name.get<std::string>(), Contains("damper_") && Contains("@suspension"));
    CHECK(d.at("how_far").at("closure").get<double>() > 0.97);
  }
}

TEST_CASE("a mass on a spring that splits a resonance of a tower is found at the floor it hangs on", "[slow]") {
  Random random(2804, Stream::parameters);
  for (int trial = 0; trial < 2; ++trial) {
    const Folder folder;
    // Four floors on a shaken base, of which two are measured; the tank hangs on one that is not.
    std::string masses, elements, below = "ground";
    for (const char* floor : {"f1", "f2", "f3", "f4"}) {
      masses +=
          fmt::format(R"({}{{"name": "{}", "mass_kg": 10, "tolerance": 0.03}})", masses.empty() ? "" : ", ", floor);
      elements += fmt::format(
          R"({}{{"name": "c_{}", "between": ["{}", "{}"], "laws": [
              {{"law": "linear_spring", "stiffness_n_per_m": {}, "tolerance": 0.1}},
              {{"law": "viscous_damper", "damping_ns_per_m": 45, "tolerance": 0.3}}]}})",
          elements.empty() ? "" : ", ", floor, below, floor, 45000 + 5000 * random.uniform());
      below = floor;
    }
    const Plant nominal = plant_from(fmt::format(
        R"({{"name": "tower", "masses": [{}], "inputs": [{{"name": "table", "kind": "acceleration", "unit": "m/s^2",
             "hold_hz": 1000}}], "elements": [{}], "sensors": [
             {{"name": "a2", "kind": "acceleration", "of": "f2", "unit": "m/s^2"}},
             {{"name": "a4", "kind": "acceleration", "of": "f4", "unit": "m/s^2"}}]}})",
        masses, elements));
    Plant truth = nominal;
    const double mass_kg = 1 + 0.5 * random.uniform(), omega = 2 * std::numbers::pi * (3.7 + 0.4 * random.uniform());
    CAPTURE(trial, mass_kg, omega);
    truth.masses.push_back({"tank", mass_kg});
    truth.elements.push_back({"straps",
                              "f3",
                              "tank",
                              {{find_law("linear_spring"), {mass_kg * omega * omega}},
                               {find_law("viscous_damper"), {0.06 * mass_kg * omega}}}});
    measure(folder, nominal, truth, 0.005, 0, 1, 2);
    std::string out;
    const Json d = diagnosis(folder, out);
    CAPTURE(out);
    CHECK(d.at("which").at("named") == Json::array({"added_mode@f3"}));
    CHECK(d.at("how_far").at("closure").get<double>() > 0.97);
  }
}

TEST_CASE("where nothing is missing no effect is named, and a wrong parameter is named as one", "[slow]") {
  const Plant nominal = plant_from(quarter_car_text);
  std::string out;
  {
    const Folder folder;
    measure(folder, nominal, nominal, 0.02);
    const Json d = diagnosis(folder, out);
    CHECK(d.at("verdict") == "no_gap");
    CHECK(d.at("which").at("named").empty());
    CHECK_THAT(out, Contains("No gap"));
  }
  for (const double factor : {1.5, 3.0}) {  // inside what re-tuning may move, and far outside
    CAPTURE(factor);
    const Folder folder;
    Plant truth = nominal;
    set_parameter(truth, "suspension.viscous_damper.damping_ns_per_m", 850 * factor);
    measure(folder, nominal, truth, 0.01);
    const Json d = diagnosis(folder, out);
    CHECK(d.at("which").at("outcome") == "parameter");
    CHECK(d.at("which").at("named")[0] == "damping_error@suspension");
  }
}

TEST_CASE("a wrong bend of the plant's own spring is a spring nonlinearity, no error of its stiffness", "[slow]") {
  const Folder folder;
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  set_parameter(truth, "suspension.hardening_spring.alpha_per_m2", 1500 * 2.5);
  measure(folder, nominal, truth, 0.01);
  std::string out;
  const Json d = diagnosis(folder, out);
  CHECK(d.at("which").at("outcome") == "effect");
  CHECK(d.at("which").at("named")[0] == "spring_nonlinearity@suspension");
}

TEST_CASE("a relaxation too slow for any mount is located, not named", "[slow]") {
  const Folder folder;
  const Plant nominal = plant_from(quarter_car_text);
  for (const double relaxation_s : {0.01, 0.3}) {
    CAPTURE(relaxation_s);
    Plant truth = nominal;
    truth.elements[0].laws.push_back({find_law("maxwell_branch"), {8000, relaxation_s}});
    measure(folder, nominal, truth, 0.01);
    std::string out;
    const Json d = diagnosis(folder, out);
    const bool slow = relaxation_s > 0.1;
    CHECK(d.at("which").at("named")[0] == (slow ? "unknown@suspension" : "series_compliance@suspension"));
    CHECK(d.at("where").at("location") == "suspension");
    CHECK(d.at("checks").empty() == slow);  // an answer that was withdrawn leaves none
    if (slow) CHECK_THAT(out, Contains("it acts as series_compliance would"));
  }
}

TEST_CASE("an effect that the validation record never reaches is named all the same", "[slow]") {
  const Folder folder;
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  truth.inputs[0].path.saturation = 0.016;
  measure(folder, nominal, truth, 0.01, 0, 0.5);
  std::string out;
  CHECK(diagnosis(folder, out).at("which").at("named") == Json::array({"saturation@actuator"}));
}

TEST_CASE("a sensor that is late, or AC-coupled, is named alone, with its delay or corner", "[slow]") {
  Random random(31, Stream::parameters);
  for (std::size_t i = 0; i < 3; ++i) {
    const Folder folder;
    const Plant nominal = plant_from(quarter_car_text);
    Plant truth = nominal;
    SensorPath& path = truth.sensors[i].path;
    const bool late = i != 2;
    double& value = late ? path.delay_s : path.high_pass_hz;
    value = late ? 0.006 + 0.019 * random.uniform() : 0.2 + 0.8 * random.uniform();
    CAPTURE(i, value);
    measure(folder, nominal, truth, 0.01);
    std::string out;
    const Json d = diagnosis(folder, out);
    const std::string place = "sensor:" + nominal.sensors[i].name;
    CHECK(d.at("which").at("named") == Json::array({(late ? "time_delay@" : "high_pass@") + place}));
    CHECK(d.at("which").at("effects")[0].at("parameters")[0].at("value").get<double>() == Approx(value).epsilon(0.05));
  }
}

TEST_CASE("two sensors at fault are both named, each at its place", "[slow]") {
  const Folder folder;
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  truth.sensors[0].path.drift_per_s = 3e-4;
  truth.sensors[1].path.lag.time_constant_s = 0.004;
  measure(folder, nominal, truth, 0.01);
  std::string out;
  const Json d = diagnosis(folder, out);
  CHECK(d.at("which").at("outcome") == "several");
  const Json& named = d.at("which").at("named");
  for (const char* name : {"drift@sensor:travel", "sensor_lag@sensor:body_acc"})
    CHECK(std::count(named.begin(), named.end(), name) == 1);
  const std::string first = named[0].get<std::string>();
  CHECK(first.ends_with("@" + d.at("where").at("location").get<std::string>()));
  CHECK_THAT(out, Contains("sensor:travel and sensor:body_acc") || Contains("sensor:body_acc and sensor:travel"));
  CHECK_THAT(out, Contains(" remove "));
}

TEST_CASE("three effects at three places are all named", "[slow]") {
  const Folder folder;
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  truth.elements[0].laws.push_back({find_law("coulomb_friction"), {60, 0, 0.05, 0.005}});
  truth.sensors[0].path.drift_per_s = 1e-3;
  truth.sensors[1].path.lag.time_constant_s = 0.004;
  measure(folder, nominal, truth, 0.01);
  std::string out;
  const Json d = diagnosis(folder, out);
  INFO(out);
  const Json& named = d.at("which").at("named");
  CHECK(named.size() == 3);
  for (const char* name : {"coulomb_friction@suspension", "drift@sensor:travel", "sensor_lag@sensor:body_acc"})
    CHECK(std::count(named.begin(), named.end(), name) == 1);
  CHECK(d.at("how_far").at("with_effect").at("misfit").get<double>() < 1.1);
  double shares = 0;
  for (std::size_t i = 0; i < 3; ++i) shares += d.at("which").at("effects")[i].at("share").get<double>();
  CHECK(shares == Approx(d.at("how_far").at("closure").get<double>()).epsilon(0.02));
}

TEST_CASE("a second effect a hundredth of the first one's size is found where it enters", "[slow]") {
  const Folder folder;
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  truth.elements[0].laws.push_back({find_law("asymmetric_damper"), {850, 0.6, 0.1, 1, 1}});
  truth.sensors[0].path.lag.time_constant_s = 0.0008;
  measure(folder, nominal, truth, 0.004);
  std::string out;
  const Json d = diagnosis(folder, out);
  CHECK(d.at("which").at("named") == Json::array({"damper_asymmetry@suspension", "sensor_lag@sensor:travel"}));
  CHECK(d.at("which").at("effects")[1].at("share").get<double>() < 0.06);
}

TEST_CASE("two wrong parameters are not told as one", "[slow]") {
  const Folder folder;
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  set_parameter(truth, "wheel.mass_kg", 40 * 0.65);
  set_parameter(truth, "tyre.linear_spring.stiffness_n_per_m", 200000 * 0.65);
  measure(folder, nominal, truth, 0.01);
  std::string out;
  const Json d = diagnosis(folder, out);
  CHECK(d.at("verdict") == "gap");
  CHECK(d.at("which").at("outcome") != "parameter");
  CHECK_THAT(out, Contains("as well"));
}

TEST_CASE("an effect that shows only beside another one is named alone where it needs no other", "[slow]") {
  // Re-tuning bends the spring so far around the stops that only a gain seems to help, and the stops beside it.
  const Folder folder;
  const Plant nominal = plant_from(one_sensor_text);
  Plant truth = nominal;
  truth.elements[0].laws.push_back({find_law("bump_stop"), {0.005, 0.005, 40000, 2}});
  measure(folder, nominal, truth, 0.012, 0, 1, 40);
  std::string out;
  const Json d = diagnosis(folder, out);
  INFO(out);
  CHECK(d.at("where").at("location") == "mount");
  CHECK(d.at("which").at("named").size() == 1);
  CHECK(d.at("how_far").at("closure").get<double>() > 0.8);
}

TEST_CASE("behind a channel in another unit, or a drive of the wrong sign, the effect in the plant is found as well",
          "[slow]") {
  // Re-tuning goes to the end of every tolerance, and what an effect does to that plant says little of the true one.
  const Folder folder;
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  truth.elements[0].laws.push_back({find_law("coulomb_friction"), {40, 0, 0.05, 0.005}});
  const bool drive = GENERATE(true, false);
  (drive ? truth.inputs[0].path.gain : truth.sensors[1].path.gain) = drive ? -1 : 0.102;  // g for m/s^2
  measure(folder, nominal, truth, 0.01);
  std::string out;
  const Json d = diagnosis(folder, out);
  const std::string place = drive ? "actuator" : "sensor:body_acc";
  CHECK(d.at("which").at("named") == Json::array({"gain_error@" + place, "coulomb_friction@suspension"}));
  CHECK(d.at("how_far").at("closure").get<double>() > 0.99);
}

TEST_CASE("one channel under an unknown force: a gap, but no place and no name") {
  const Folder folder;
  const Plant nominal = plant_from(one_sensor_text);
  measure(folder, nominal, nominal, 0.01, 0.3);
  std::string out;
  const Json d = diagnosis(folder, out);
  CHECK(d.at("verdict") == "insufficient");
  CHECK(d.at("which").at("named").empty());
  CHECK(d.at("where").at("location").is_null());
  CHECK_THAT(out, Contains("one channel does not tell where"));
}

TEST_CASE("records that are too short or do not fit the plant are refused with the reason, and nothing is written") {
  const Folder folder;
  const Plant nominal = plant_from(quarter_car_text);
  measure(folder, nominal, nominal, 0.02);
  Json records = parse_json(read_file(folder / "records.json"), "records.json");
  for (Json& record : records.at("records")) record["range"] = {0, 10};
  write_json(folder / "short.json", records);
  const std::string base = "diagnose --quiet --plant '" + (folder / "plant.json").string() + "' --out '" +
                           (folder / "d.json").string() + "' --records ";
  const Said said = run_program(base + "'" + (folder / "short.json").string() + "'");
  CHECK(said.status == 2);
  CHECK_THAT(said.err, Contains("expected at least") && Contains("readings"));
  CHECK_FALSE(std::filesystem::exists(folder / "d.json"));
}

TEST_CASE(
    "a clipped sensor is named although a gain looked better first, and the plant written does what is said of it",
    "[slow]") {
  const Plant nominal = plant_from(one_sensor_text);
  for (const double level : {0.4, 0.55, 0.7}) {
    CAPTURE(level);
    const Folder folder;
    measure(folder, nominal, nominal, 0.01, 0, 1, 40);
    RecordSet set = load_records(folder / "records.json", nominal.input_channels(), nominal.output_channels());
    const double end = level * set.records[0].signal.y.cwiseAbs().maxCoeff();
    for (Record& record : set.records) record.signal.y = record.signal.y.cwiseMin(end).cwiseMax(-end);
    write_records(folder.path(), set);
    std::string out;
    const Json d = diagnosis(folder, out);
    INFO(out);
    REQUIRE(d.at("which").at("named").size() == 1);
    CHECK(d.at("which").at("named")[0] == "saturation@sensor:position");
    const Plant corrected = load_plant(folder / "d.plant.json");
    CHECK(corrected.sensors[0].path.saturation == Approx(end).epsilon(0.02));
    const GeneratedRecord again = simulate_record(corrected, set.records.back().signal);
    REQUIRE(again.status == Status::ok);
    const Index from = std::llround(200 * d.at("how_far").at("judged_from_s").get<double>());
    const Index kept = again.signal.y.cols() - from;
    const double nrmse = (again.signal.y - set.records.back().signal.y).rightCols(kept).norm() /
                         set.records.back().signal.y.rightCols(kept).norm();
    CHECK(nrmse == Approx(d.at("how_far").at("with_effect").at("nrmse").at("position").get<double>()).epsilon(0.05));
  }
}

TEST_CASE("in short records, and in free decays without any drive, an effect is named as in others", "[slow]") {
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  truth.elements[0].laws.push_back({find_law("coulomb_friction"), {40, 0, 0.05, 0.005}});
  for (const bool decay : {false, true}) {
    CAPTURE(decay);
    const Folder folder;
    RecordSet set;
    set.sampling_hz = 200;
    const Index ratio = 5, samples = 500;  // 2.5 s, three periods of the body
    Random random(79, Stream::road);
    for (const char* role : {"estimation", "validation"}) {
      const double size = set.records.empty() ? 1 : -0.7;
      SimulateOptions options{.from_equilibrium = !decay};
      Matrix drive = smooth_drive(random, samples * ratio);
      if (decay) {
        drive.setZero();
        options.initial_state = size * (Vector(4) << 0.03, 0.002, 0, 0).finished();
      }
      GeneratedRecord made = generate_record(truth, drive, set.sampling_hz, options);
      REQUIRE(made.status == Status::ok);
      for (Index i = 0; i < made.signal.y.rows(); ++i)
        made.signal.y.row(i) += 0.005 * rms(made.signal.y)(i) * random.normal(1, samples);
      set.records.push_back({std::string(role) + ".csv", role, "", 0, made.signal});
    }
    for (Index i = 0; i < nominal.sensor_count(); ++i)
      set.noise_std[nominal.sensors[static_cast<std::size_t>(i)].name] = 0.005 * rms(set.records[0].signal.y)(i);
    write_records(folder.path(), set);
    write_json(folder / "plant.json", to_json(nominal));
    std::string out;
    const Json d = diagnosis(folder, out);
    INFO(out);
    REQUIRE(d.at("which").at("named").size() >= 1);
    CHECK(d.at("which").at("named")[0] == "coulomb_friction@suspension");
    CHECK(d.at("how_far").at("closure").get<double>() > 0.9);
    for (const Json& parameter : d.at("which").at("effects")[0].at("parameters"))
      if (parameter.at("name").get<std::string>().ends_with("force_n"))
        CHECK(parameter.at("value").get<double>() == Approx(40).epsilon(0.1));
  }
}

TEST_CASE("a drive that never moves, beside readings that go on moving, is refused") {
  const Folder folder;
  const Plant nominal = plant_from(quarter_car_text);
  measure(folder, nominal, nominal, 0.02);
  RecordSet set = load_records(folder / "records.json", nominal.input_channels(), nominal.output_channels());
  for (Record& record : set.records) record.signal.u.setConstant(0.001);
  write_records(folder.path(), set);
  const Said said =
      run_program("diagnose --quiet --plant '" + (folder / "plant.json").string() + "' --out '" +
                  (folder / "d.json").string() + "' --records '" + (folder / "records.json").string() + "'");
  CHECK(said.status == 2);
  CHECK_THAT(said.err, Contains("the drive is constant in every record"));
  CHECK_FALSE(std::filesystem::exists(folder / "d.json"));
}

TEST_CASE("a drive in another unit than the plant's is no gap: its size is told, and no effect named") {
  const Folder folder;
  const Plant nominal = plant_from(quarter_car_text);
  measure(folder, nominal, nominal, 0.02);
  RecordSet set = load_records(folder / "records.json", nominal.input_channels(), nominal.output_channels());
  for (Record& record : set.records) record.signal.u *= 1000;  // mm
  write_records(folder.path(), set);
  const Said said =
      run_program("diagnose --quiet --plant '" + (folder / "plant.json").string() + "' --out '" +
                  (folder / "d.json").string() + "' --records '" + (folder / "records.json").string() + "'");
  CHECK(said.status == 1);
  CHECK_THAT(said.err, Contains("road") && Contains(" m: is that the unit"));
  const Json d = parse_json(read_file(folder / "d.json"), "d.json");
  CHECK(d.at("verdict") == "insufficient");
  CHECK(d.at("which").at("named").empty());
}

TEST_CASE("a plant that is right shows no gap under a measured drive that was never held, at every sampling rate",
          "[slow]") {
  Random random(41, Stream::parameters);
  const auto between = [&](double low, double high) { return low + (high - low) * random.uniform(); };
  for (const double sampling_hz : {100.0, 400.0, 2000.0}) {
    // The steady state of a mass on a spring and a damper under a sum of sines is known exactly.
    const double m = between(1, 300), w0 = 2 * 3.14159265358979 * between(1, 6), k = m * w0 * w0,
                 c = 2 * between(0.05, 0.4) * m * w0;
    const Folder folder;
    write_json(folder / "plant.json",
               Json{{"name", "one mass"},
                    {"masses", {{{"name", "mass"}, {"mass_kg", m}, {"tolerance", 0.01}}}},
                    {"inputs", {{{"name", "push"}, {"kind", "force"}, {"unit", "N"}, {"on", "mass"}}}},
                    {"elements",
                     {{{"name", "mount"},
                       {"between", {"ground", "mass"}},
                       {"laws",
                        {{{"law", "linear_spring"}, {"stiffness_n_per_m", k}, {"tolerance", 0.03}},
                         {{"law", "viscous_damper"}, {"damping_ns_per_m", c}, {"tolerance", 0.08}}}}}}},
                    {"sensors",
                     {{{"name", "position"}, {"kind", "displacement"}, {"of", "mass"}, {"unit", "m"}},
                      {{"name", "shake"}, {"kind", "acceleration"}, {"of", "mass"}, {"unit", "m/s^2"}}}}});
    RecordSet set;
    set.sampling_hz = sampling_hz;
    for (const char* role : {"estimation", "estimation", "validation"}) {
      Signal signal;
      const auto samples = static_cast<Index>(12 * sampling_hz);
      signal.sample_time_s = 1 / sampling_hz;
      signal.inputs = {{"push", "N"}};
      signal.outputs = {{"position", "m"}, {"shake", "m/s^2"}};
      signal.u = Matrix::Zero(1, samples);
      signal.y = Matrix::Zero(2, samples);
      for (int line = 0; line < 30; ++line) {
        const double f = between(0.3, std::min(20.0, 0.2 * sampling_hz)), w = 2 * 3.14159265358979 * f;
        const std::complex<double> push = std::polar(k * 0.01 / (1 + f / 8), between(0, 6)),
                                   x = push / std::complex<double>(k - m * w * w, c * w);
        for (Index i = 0; i < samples; ++i) {
          const auto turn = std::polar(1.0, w * static_cast<double>(i) / sampling_hz);
          signal.u(0, i) += (push * turn).imag();
          signal.y(0, i) += (x * turn).imag();
          signal.y(1, i) += (-w * w * x * turn).imag();
        }
      }
      for (Index i = 0; i < 2; ++i) {
        const double std = 0.003 * signal.y.row(i).norm() / std::sqrt(static_cast<double>(samples));
        for (double& value : signal.y.row(i)) value += std * random.normal();
      }
      set.records.push_back({"", role, "", 0, signal});
    }
    write_records(folder.path(), set);
    std::string out;
    const Json d = diagnosis(folder, out);
    INFO(sampling_hz << " Hz: " << out);
    CHECK(d.at("verdict") == "no_gap");
  }
}

TEST_CASE("on a servo axis that nothing holds, friction and weight are named from records under a controller",
          "[slow]") {
  Random random(43, Stream::parameters);
  const auto between = [&](double low, double high) { return low + (high - low) * random.uniform(); };
  const double m = between(20, 100), d = m * between(1, 3);
  Plant nominal;
  nominal.name = "axis";
  nominal.masses = {{"slide", m, 0.03}};
  nominal.inputs = {{"force", InputKind::force, "N", 1000, "zoh", "ground", "slide"}};
  nominal.elements = {{"rail", "ground", "slide", {{find_law("viscous_damper"), {d}, 0.2}}}};
  nominal.sensors = {{"q", SensorKind::displacement, "ground", "slide", "m"}};
  Plant rig = nominal;
  rig.elements[0].laws.push_back({find_law("bouc_wen"), {0.3 * m, 1e-4, 1, 0.5, 0, 0.2, 0.02}});
  rig.loads = {{"weight", "slide", -0.1 * m}};
  const Folder folder;
  write_json(folder / "plant.json", to_json(nominal));
  RecordSet set;
  set.sampling_hz = 1000;
  for (const char* role : {"estimation", "validation"}) {
    // A controller follows a course; each sample of the force is what it makes of the sample before.
    const Index samples = 10000;
    Vector frequency(8), phase(8);
    for (Index i = 0; i < 8; ++i) {
      frequency(i) = between(0.2, 2.5);
      phase(i) = between(0, 6);
    }
    Motion motion(rig);
    Matrix states = Matrix::Zero(3, samples), force(1, samples);
    const double h = 1e-3 / 16;
    for (Index k = 0; k < samples; ++k) {
      double wanted = 0, speed = 0;
      for (Index i = 0; i < 8; ++i) {
        const double w = 2 * 3.14159265358979 * frequency(i), a = 0.02 / frequency(i);
        wanted += a * (std::sin(w * static_cast<double>(k) * 1e-3 + phase(i)) - std::sin(phase(i)));
        speed += a * w * std::cos(w * static_cast<double>(k) * 1e-3 + phase(i));
      }
      force(k) = 400 * m * (wanted - states(0, k)) + 28 * m * (speed - states(1, k));
      if (k + 1 == samples) break;
      Vector x = states.col(k);
      const double u = force(k), u_rate = 0;
      motion.set_inputs(&u, &u_rate);
      for (int step = 0; step < 16; ++step) {
        double a = 0, z_rate = 0;
        REQUIRE(motion.accelerations(&x(0), &x(1), &x(2), &a, &z_rate) == Motion::all_defined);
        x(1) += h * a;
        x(0) += h * x(1);
        x(2) = std::clamp(x(2) + h * z_rate, -1.2, 1.2);
      }
      states.col(k + 1) = x;
    }
    Signal signal;
    signal.sample_time_s = 1e-3;
    signal.inputs = {{"force", "N"}};
    signal.outputs = {{"q", "m"}};
    signal.u = force;
    signal.y = states.row(0);
    for (double& value : signal.y.reshaped()) value += 5e-6 * random.normal();
    set.records.push_back({"", role, "", 0, signal});
  }
  write_records(folder.path(), set);
  std::string out;
  const Json d_json = diagnosis(folder, out);
  INFO(out);
  const std::vector<std::string> named = d_json.at("which").at("named");
  CHECK(std::set<std::string>(named.begin(), named.end()) ==
        std::set<std::string>{"coulomb_friction@rail", "load@guide:slide"});
  CHECK_THAT(out, Contains("in pieces of about"));
  const Plant corrected = load_plant(folder / "d.plant.json");
  CHECK(get_parameter(corrected, "load:load_on_slide.force_n") == Approx(-0.1 * m).epsilon(0.1));
}

TEST_CASE("channels that were read at a lower rate are compared as they were read, and hide no effect", "[slow]") {
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  truth.elements[0].laws.push_back({find_law("coulomb_friction"), {40, 0, 0.05, 0.005}});
  for (const auto& [every, lines] : {std::pair<Index, bool>{10, false}, {5, true}}) {
    CAPTURE(every, lines);
    const Folder folder;
    measure(folder, nominal, truth, 0.01);
    RecordSet set = load_records(folder / "records.json", nominal.input_channels(), nominal.output_channels());
    for (Record& record : set.records) {
      auto travel = record.signal.y.row(0);
      const Vector read = travel;
      const Index last = (travel.size() - 1) / every * every;
      for (Index k = 0; k < travel.size(); ++k) {
        const Index before = k / every * every, after = std::min(before + every, last);
        const double share = lines ? static_cast<double>(k - before) / static_cast<double>(every) : 0;
        travel(k) = (1 - share) * read(before) + share * read(after);
      }
    }
    write_records(folder.path(), set);
    std::string out;
    const Json d = diagnosis(folder, out);
    INFO(out);
    CHECK(d.at("which").at("named") == Json({"coulomb_friction@suspension"}));
    const auto left = [&](const char* stage) { return d.at("how_far").at(stage).at("misfit").get<double>() - 1; };
    CHECK(left("with_effect") < 0.2 * left("retuned"));
    REQUIRE(d.at("slow_channels").size() == 3);
    CHECK(d.at("slow_channels")[0].at("channel") == "travel");
    CHECK(d.at("slow_channels")[0].at("samples").get<double>() == Approx(static_cast<double>(every)).epsilon(0.01));
    CHECK_THAT(out, Contains("travel was read at"));
  }
}

TEST_CASE("a rotary axis is diagnosed in its own names and units", "[slow]") {
  const std::string text = R"({
    "name": "axis",
    "masses": [{"name": "motor", "inertia_kg_m2": 0.02, "tolerance": 0.03},
               {"name": "wheel", "inertia_kg_m2": 0.05, "tolerance": 0.03}],
    "inputs": [{"name": "drive", "kind": "torque", "on": "motor", "unit": "N m", "hold_hz": 1000}],
    "elements": [
      {"name": "shaft", "between": ["motor", "wheel"], "laws": [
        {"law": "linear_spring", "stiffness_nm_per_rad": 40},
        {"law": "viscous_damper", "damping_nms_per_rad": 0.05, "tolerance": 0.15}]},
      {"name": "bearing", "between": ["ground", "wheel"], "laws": [
        {"law": "linear_spring", "stiffness_nm_per_rad": 8},
        {"law": "viscous_damper", "damping_nms_per_rad": 0.04, "tolerance": 0.15}]}],
    "sensors": [{"name": "phi", "kind": "angle", "of": "motor", "unit": "rad"},
                {"name": "speed", "kind": "angular_velocity", "of": "wheel", "unit": "rad/s"},
                {"name": "twist", "kind": "angle", "between": ["motor", "wheel"], "unit": "rad"}]})";
  const Plant nominal = plant_from(text);
  Plant truth = nominal;
  truth.elements[1].laws.push_back({find_law("coulomb_friction"), {0.15, 0, 1, 0.02}});
  const Folder folder;
  measure(folder, nominal, truth, 0.01, 0, 1, 1.5);
  std::string out;
  const Json d = diagnosis(folder, out);
  INFO(out);
  CHECK(d.at("which").at("named") == Json({"coulomb_friction@bearing"}));
  CHECK(d.at("which").at("effects")[0].at("parameters")[0].at("name") == "bearing.coulomb_friction.torque_nm");
  CHECK(d.at("retuning")[0].at("name") == "motor.inertia_kg_m2");
  CHECK_THAT(out, Contains("torque_nm = 0.1") && !Contains("_n_per_m"));
  const Plant corrected = load_plant(folder / "d.plant.json");
  CHECK(get_parameter(corrected, "bearing.coulomb_friction.force_n") == Approx(0.15).epsilon(0.1));
}
