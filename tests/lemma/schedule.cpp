// Laws whose numbers follow a drive: an adjustable damper with its voltage as a second input.
#include "core/plant/schedule.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "core/base/random.hpp"
#include "core/plant/dataset.hpp"
#include "core/plant/linearise.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

constexpr double kHigh = 2;  // V, the end of the range

/// A law with typical values, but for gaps, and slopes of all its numbers, a tenth of these a volt; none of a list.
Json scheduled_law(const LawKind& kind) {
  Json law = {{"law", kind.name}}, slopes = Json::object();
  for (const LawParameter& parameter : kind.parameters) {
    if (parameter.is_list) {
      law[parameter.name] = {1000, 0, 1e5};
      slopes[parameter.name + "_1"] = 100;
      slopes[parameter.name + "_3"] = 1e4;
      continue;
    }
    if (parameter.typical == 0 && !parameter.required) continue;
    const double typical = parameter.typical != 0 ? parameter.typical : 1000;
    const double value = parameter.name.ends_with("gap_m") ? 0.1 * typical : typical;  // small enough to be closed
    law[parameter.name] = value;
    if (value * (1 + 0.1 * kHigh) <= parameter.range.high) slopes[parameter.name] = 0.1 * value;
  }
  law["scheduled"] = {{"by", "voltage"}, {"slopes", slopes}};
  return law;
}

/// A quarter car with a law that follows a voltage, between the ground and its body. @param hold_hz 0: drives are not
/// held
Json car_with(const Json& law, double hold_hz) {
  Json text = Json::parse(quarter_car_text);
  text["inputs"].push_back({{"name", "voltage"}, {"kind", "schedule"}, {"unit", "V"}, {"range", {0, kHigh}}});
  for (Json& input : text["inputs"]) {
    input.erase("hold_hz");
    if (hold_hz > 0) input["hold_hz"] = hold_hz;
  }
  Json element = {{"name", "guide"}, {"between", {"ground", "body"}}, {"laws", Json::array()}};
  element["laws"].push_back(law);
  text["elements"].push_back(element);
  text["sensors"].push_back({{"name", "load"}, {"kind", "force"}, {"element", "guide"}, {"unit", "N"}});
  return text;
}

Plant plant_of(const Json& text) {
  Plant plant = parse_plant(JsonCursor::from(text, "plant.json"));
  for (PlantInput& input : plant.inputs) input.hold_hz = 1000;
  return plant;
}

/// Road and voltage.
Matrix drives(Index samples, Random& random) {
  Matrix drive(2, samples);
  const double phase = 2 * std::numbers::pi * random.uniform();
  for (Index k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) / 1000;
    drive(0, k) = 0.01 * std::sin(2 * std::numbers::pi * 1.7 * t + phase) + 0.002 * std::sin(60 * t);
    drive(1, k) = 1 + 0.8 * std::sin(2 * std::numbers::pi * 0.9 * t + phase);
  }
  return drive;
}

const Law& law_of(const Plant& plant) { return plant.elements.back().laws.front(); }

template <class Check>
void for_every_law(Check check) {
  for (const LawKind& kind : law_table())
    for (const double hold_hz : {1000.0, 0.0}) {
      if (kind.role != LawRole::force) continue;
      CAPTURE(kind.name, hold_hz);
      check(car_with(scheduled_law(kind), hold_hz));
    }
}

}  // namespace

TEST_CASE("under a constant schedule every law is the law with its numbers there, and so is the plant") {
  Random random = numbers(7441);
  for_every_law([&](const Json& text) {
    const Plant plant = plant_of(text);
    Matrix drive = drives(600, random);
    const double u = kHigh * random.uniform();
    drive.row(1).setConstant(u);
    Plant fixed = plant;
    fixed.elements.back().laws = {law_at(law_of(plant), u)};
    const SimulateOptions options{.substeps = stable_substeps(plant)};
    const Simulation follows = simulate(plant, drive, options), there = simulate(fixed, drive, options);
    REQUIRE(follows.status == Status::ok);
    REQUIRE(there.status == Status::ok);
    CHECK((follows.outputs - there.outputs).norm() <= 1e-9 * there.outputs.norm());
    drive.row(1).setConstant(0);
    CHECK((simulate(plant, drive, options).outputs - there.outputs).norm() > 1e-6 * there.outputs.norm());
  });
}

TEST_CASE("a schedule beyond an end of its range counts as that end") {
  for_every_law([&](const Json& text) {
    Random random = numbers(7442);
    const Plant plant = plant_of(text);
    Matrix drive = drives(200, random), beyond = drive;
    drive.row(1).setConstant(kHigh);
    beyond.row(1).setConstant(1.2 * kHigh);
    CHECK(simulate(plant, drive).outputs == simulate(plant, beyond).outputs);
  });
}

TEST_CASE("plants with schedules give the same alone and four side by side") {
  for_every_law([&](const Json& text) {
    Random random = numbers(7443);
    std::vector<Plant> plants(4, plant_of(text));
    std::vector<Matrix> drive;
    for (std::size_t i = 0; i < plants.size(); ++i) {
      plants[i].elements.back().laws[0].schedule.slopes[0].second *= 1 + 0.1 * static_cast<double>(i);
      drive.push_back(drives(400, random));
    }
    std::vector<SimulationTask> tasks;
    for (std::size_t i = 0; i < plants.size(); ++i) tasks.push_back({&plants[i], &drive[i], {.substeps = 8}});
    const std::vector<Simulation> together = simulate_side_by_side(tasks);
    for (std::size_t i = 0; i < plants.size(); ++i) {
      const Simulation alone = simulate(plants[i], drive[i], tasks[i].options);
      REQUIRE(alone.status == Status::ok);
      REQUIRE(together[i].status == Status::ok);
      CHECK((alone.outputs - together[i].outputs).norm() <= 1e-11 * alone.outputs.norm());
    }
  });
}

TEST_CASE("readings change with slopes, numbers and the path of a schedule as differences say") {
  for_every_law([&](const Json& text) {
    Random random = numbers(7444);
    const Plant plant = plant_of(text);
    const Matrix drive = drives(500, random);
    const std::vector<std::pair<std::size_t, double>> slopes = law_of(plant).schedule.slopes;
    const std::string number = law_of(plant).parameter_names()[slopes.front().first];
    const std::string law = law_name(plant.elements.back(), 0) + ".";
    const SimulateOptions options{.substeps = 2 * stable_substeps(plant)};
    std::vector<std::string> names = {law + "scheduled." + number, law + number, "actuator:voltage.gain",
                                      "actuator:voltage.delay_s"};
    std::vector<Plant> there(names.size(), plant);
    std::vector<Variation> variations(names.size());
    std::vector<double> size;
    for (std::size_t i = 0; i < names.size(); ++i) {
      const double value = get_parameter(plant, names[i]);
      size.push_back(i == 3 ? 0.02 : 0.3 * value);
      variations[i].step = 1e-4;
      set_parameter(there[i], names[i], value + variations[i].step * size[i]);
      variations[i].neighbour = &there[i];
    }
    const VariedSimulation varied = simulate_varied(plant, drive, options, variations);
    REQUIRE(varied.simulation.status == Status::ok);
    CHECK((varied.simulation.outputs - simulate_measured(plant, drive, options).outputs).norm() == 0);
    for (std::size_t i = 0; i < names.size(); ++i) {
      CAPTURE(names[i]);
      const double step = 3e-3;
      const auto at = [&](double share) {
        Plant moved = plant;
        set_parameter(moved, names[i], get_parameter(plant, names[i]) + share * size[i]);
        return simulate_measured(moved, drive, options).outputs;
      };
      const Matrix difference =
          i == 3 ? Matrix((at(step) - at(0)) / step) : Matrix((at(step) - at(-step)) / (2 * step));
      CHECK(difference.norm() > 0);
      CHECK((varied.outputs[i] - difference).norm() < 0.02 * difference.norm());
    }
  });
}

TEST_CASE("a plant with schedules reads back as it was written, and its slopes are parameters") {
  for_every_law([](const Json& text) {
    const Plant plant = parse_plant(JsonCursor::from(text, "plant.json"));
    const Json written = to_json(plant);
    CHECK(to_json(parse_plant(JsonCursor::from(written, "again.json"))) == written);
    const std::string law = law_name(plant.elements.back(), 0);
    for (const auto& [k, slope] : law_of(plant).schedule.slopes) {
      const std::string name = law + ".scheduled." + law_of(plant).parameter_names()[k];
      CHECK(get_parameter(plant, name) == slope);
      Plant moved = plant;
      set_parameter(moved, name, 2 * slope);
      CHECK(get_parameter(moved, name) == 2 * slope);
      const auto all = plant_parameters(plant);
      const auto own = std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.name == name; });
      REQUIRE(own != all.end());
      CHECK(own->unit.ends_with("/V"));
    }
  });
}

TEST_CASE("what a schedule cannot be is refused with its place") {
  const Json friction = {{"law", "coulomb_friction"}, {"force_n", 30}};
  const auto refused = [&](const Json& schedule, const std::string& message, const Json& input = {}) {
    Json law = friction;
    law["scheduled"] = schedule;
    Json text = car_with(law, 1000);
    if (!input.empty()) text["inputs"][1] = input;
    CHECK_THROWS_WITH(parse_plant(JsonCursor::from(text, "plant.json")), Contains(message));
  };
  const Json slopes = {{"force_n", 200}};
  refused({{"by", "voltage"}, {"slopes", {{"force", 200}}}}, "slopes.force");
  refused({{"by", "voltage"}, {"slopes", Json::object()}}, "a slope of one of the law's numbers");
  refused({{"by", "road"}, {"slopes", slopes}}, "known names: voltage");
  refused({{"slopes", slopes}}, "by");
  // At 2 V the friction would push.
  refused({{"by", "voltage"}, {"slopes", {{"force_n", -20}}}}, "at voltage = 2 V, force_n would be -10");
  const Json good = {{"by", "voltage"}, {"slopes", slopes}};
  refused(good, "range", {{"name", "voltage"}, {"kind", "schedule"}, {"unit", "V"}, {"hold_hz", 1000}});
  refused(good, "two numbers [low, high]",
          {{"name", "voltage"}, {"kind", "schedule"}, {"unit", "V"}, {"hold_hz", 1000}, {"range", {2, 0}}});
  Json text = car_with({{"law", "inerter"}, {"inertance_kg", 20}, {"scheduled", good}}, 1000);
  CHECK_THROWS_WITH(parse_plant(JsonCursor::from(text, "plant.json")), Contains("a law that gives a force of its own"));
}

TEST_CASE("a record whose schedule leaves its range is refused, and a little noise beyond an end is not") {
  const Plant plant = plant_of(car_with({{"law", "viscous_damper"},
                                         {"damping_ns_per_m", 100},
                                         {"scheduled", {{"by", "voltage"}, {"slopes", {{"damping_ns_per_m", 300}}}}}},
                                        1000));
  Signal record;
  record.inputs = {{"road", "m"}, {"voltage", "V"}};
  record.u = Matrix::Zero(2, 10);
  record.u(1, 3) = -0.04;
  CHECK(drive_of_record(plant, record)(1, 3) == -0.04);
  record.u(1, 3) = 2.5;
  CHECK_THROWS_WITH(drive_of_record(plant, record), Contains("\"voltage\" to stay in its range of 0 to 2 V"));
}

TEST_CASE("steps are chosen for the stiffest ends of all schedules, whichever way the numbers go") {
  for (const bool falls : {false, true}) {
    CAPTURE(falls);
    Json law = {{"law", "viscous_damper"}, {"damping_ns_per_m", falls ? 2e6 + 10 : 10}};
    law["scheduled"] = {{"by", "current"}, {"slopes", {{"damping_ns_per_m", falls ? -1e6 : 1e6}}}};
    Json text = car_with(scheduled_law(*find_law("coulomb_friction")), 1000);
    text["inputs"].push_back(
        {{"name", "current"}, {"kind", "schedule"}, {"unit", "A"}, {"range", {0, kHigh}}, {"hold_hz", 1000}});
    text["elements"].back()["laws"].push_back(law);
    const Plant plant = plant_of(text);
    CHECK(at_ends_of_schedules(plant).size() == 4);
    CHECK(stable_substeps(plant) > 2);
    Random random = numbers(7445);
    Matrix drive(3, 300);
    drive.topRows(2) = drives(300, random);
    drive.row(2).setConstant(falls ? 0 : kHigh);
    CHECK(simulate(plant, drive, {.substeps = stable_substeps(plant)}).status == Status::ok);
  }
}
