// `plan` as a user runs it: drives without outputs, a file with every effect, clear refusals.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>

#include "core/data/records.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/program.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

/// Two runs of one planned drive: inputs alone.
void prepare(const Folder& folder, const Plant& plant, double level) {
  RecordSet set;
  set.sampling_hz = 100;
  Signal signal;
  signal.u.resize(1, 400);
  for (Index k = 0; k < 400; ++k) {
    const double t = 0.01 * static_cast<double>(k);
    signal.u(0, k) = level * (std::sin(17 * t) + std::sin(23.3 * t + 1) + std::sin(9.1 * t + 2) + std::sin(31 * t));
  }
  signal.y.resize(0, 400);
  signal.sample_time_s = 0.01;
  signal.inputs = plant.input_channels();
  for (const char* file : {"run_1.csv", "run_2.csv"}) set.records.push_back({file, "estimation", "drive", 0, signal});
  write_records(folder.path(), set);
  write_json(folder / "plant.json", to_json(plant));
}

std::string plan_command(const Folder& folder, const std::string& records = "records.json") {
  return "plan --quiet --plant '" + (folder / "plant.json").string() + "' --records '" + (folder / records).string() +
         "'";
}

}  // namespace

TEST_CASE("a plan needs drives only, its noise may be given for sensors that have not measured yet") {
  const Folder folder;
  prepare(folder, plant_from(one_mass_text), 0.5);
  const std::string out = " --out '" + (folder / "plan.json").string() + "'";
  const Said assumed = run_program(plan_command(folder) + out);
  INFO(assumed.err);
  REQUIRE(assumed.status == 0);
  CHECK_THAT(assumed.out, Contains("With this drive") && Contains("The noise of x, v, a is assumed"));
  CHECK_THAT(assumed.out, Contains("with 4 repeats"));
  const std::string bytes = read_file(folder / "plan.json");
  const Json plan = parse_json(bytes, "plan.json");
  CHECK(plan.at("schema") == "wheelhop.plan/1");
  CHECK_FALSE(plan.at("provenance").contains("reading"));  // the files are plain
  CHECK(plan.at("noise").at("assumed_one_percent").size() == 3);
  CHECK(plan.at("parameters").size() == 4);
  std::size_t showing = 0;
  for (const Json& effect : plan.at("effects")) {
    for (const char* key : {"effect", "location", "form", "size_sigma", "visible", "confusable_with", "separated_by"})
      CHECK(effect.contains(key));
    showing += effect.at("visible").get<bool>();
    for (const Json& other : effect.at("confusable_with")) CHECK(std::abs(other.at("cosine").get<double>()) <= 1);
  }
  CHECK(showing > 0);
  CHECK(plan.at("menu").size() >= 5);
  REQUIRE(run_program(plan_command(folder) + out).status == 0);
  CHECK(read_file(folder / "plan.json") == bytes);

  Json records = parse_json(read_file(folder / "records.json"), "records.json");
  records["noise_std"] = {{"x", 1e-5}, {"v", 1e-3}, {"a", 1e-2}};
  write_json(folder / "known.json", records);
  const Said known = run_program(plan_command(folder, "known.json"));
  REQUIRE(known.status == 0);
  CHECK_THAT(known.out, !Contains("assumed") && !Contains("written"));
}

TEST_CASE("mistakes in a plan's files end in one message, a drive that is too strong in exit status 1") {
  const Folder folder;
  prepare(folder, plant_from(one_mass_text), 0.5);
  Json records = parse_json(read_file(folder / "records.json"), "records.json");
  records["noise_std"] = {{"y", 1e-5}};
  write_json(folder / "wrong.json", records);
  const Said wrong = run_program(plan_command(folder, "wrong.json"));
  CHECK(wrong.status == 2);
  CHECK(wrong.lines() == 1);
  CHECK_THAT(wrong.err, Contains("noise_std") && Contains("\"y\""));

  Plant car = plant_from(quarter_car_text);
  prepare(folder, car, 1);
  const Said strong = run_program(plan_command(folder) + " --out '" + (folder / "none.json").string() + "'");
  CHECK(strong.status == 1);
  CHECK_THAT(strong.err, Contains("suspension") && Contains("too strong"));
  CHECK_FALSE(std::filesystem::exists(folder / "none.json"));
}
