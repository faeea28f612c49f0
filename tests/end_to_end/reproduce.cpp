// `reproduce` on short records: the same bytes whatever the number of jobs, complete files, figures that may be absent.
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <functional>
#include <limits>

#include "tests/support/program.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

void write_config(
    const Folder& folder, const std::function<void(Json&)>& edit = [](Json&) {}) {
  const std::filesystem::path configs = WHEELHOP_SOURCE "/experiments/configs";
  Json config = parse_json(read_file(configs / "paper.json"), "paper.json");
  config["plant"] = (configs / "paper_plant.json").string();
  config["estimation_s"] = 40;  // in 20 s the body mode is seen too rarely for the gap to show it every time
  config["validation_s"] = 10;
  config["realisations"] = 2;
  config["pipeline"] = {{"passes", 2}, {"refine_iterations", 5}};
  config["as_printed"]["pipeline"] = {{"direct_term", false}, {"passes", 1}};
  edit(config);
  write_json(folder / "config.json", config);
}

std::string reproduce_command(const Folder& folder, const std::string& out, const std::string& more = "") {
  return "reproduce --config '" + (folder / "config.json").string() + "' --out '" + (folder / out).string() + "' " +
         more;
}

}  // namespace

TEST_CASE("a second run, with another number of jobs, writes the same table byte for byte", "[slow]") {
  const Folder folder;
  write_config(folder);
  const Said first = run_program(reproduce_command(folder, "a", "--jobs 1 --quiet"), "PATH=/nowhere");
  INFO(first.err);
  REQUIRE(first.status == 0);
  CHECK(first.err.empty());
  // Without Node.js the run is whole and says what is left out.
  CHECK_THAT(first.out, Contains("not drawn"));
  CHECK_THAT(first.out, Contains("Table 1") && Contains("75.0") && Contains("What the paper does not state"));
  CHECK(run_program(reproduce_command(folder, "b", "--jobs 2"), "PATH=/nowhere").status == 0);
  const std::string table = read_file(folder / "a" / "table1.json");
  CHECK(table == read_file(folder / "b" / "table1.json"));
  CHECK(read_file(folder / "a/figures/figures.json") == read_file(folder / "b/figures/figures.json"));

  const Json json = parse_json(table, "table1.json");
  CHECK(json.at("schema") == "wheelhop.table1/1");
  CHECK(json.at("realisations") == 2);
  REQUIRE(json.at("rows").size() == 3);
  for (const Json& row : json.at("rows"))
    for (const char* column : {"linear", "as_printed", "nonlinear", "refined"}) {
      const Json& statistics = row.at("vaf_percent").at(column);
      for (const char* key : {"median", "q05", "q95", "min"})
        CHECK((statistics.at(key).is_number() || statistics.at(key).is_null()));
      CHECK(statistics.at("n") == 2);
    }
  for (const Json& row : json.at("rows")) {
    const auto median = [&](const char* column) { return row.at("vaf_percent").at(column).at("median").get<double>(); };
    CHECK(median("nonlinear") > median("linear"));
    CHECK(median("refined") > 95);
  }
  CHECK(json.at("physics").at("direct_term_ratio").at("median").get<double>() == Approx(-40.0 / 300).epsilon(0.1));
  CHECK(json.at("per_realisation").size() == 2);
  for (const Json& row : json.at("per_realisation")) {
    const Json& refinement = row.at("refinement");
    double best = std::numeric_limits<double>::infinity();
    for (const Json& cost : refinement.at("round_costs"))
      if (cost.is_number()) best = std::min(best, cost.get<double>());
    CHECK(refinement.at("round_costs").size() == 1);  // one spring: its polynomial beats the map, which gets no rounds
    CHECK(refinement.at("cost").get<double>() < best);
  }
  CHECK(json.at("config").at("estimation_s") == 40);
  CHECK(json.at("notes").size() >= 5);
  CHECK(table.find("seconds") == std::string::npos);
  CHECK(table.find(folder.path().string()) == std::string::npos);
}

TEST_CASE("without a simple map to take its place, the map is fitted anew in rounds until these bring nothing",
          "[slow]") {
  const Folder folder;
  write_config(folder, [](Json& config) {
    config["realisations"] = 1;
    config["pipeline"]["alternative_map"] = "none";
  });
  REQUIRE(run_program(reproduce_command(folder, "a", "--quiet"), "PATH=/nowhere").status == 0);
  const Json refinement =
      parse_json(read_file(folder / "a/table1.json"), "a").at("per_realisation").at(0).at("refinement");
  double best = std::numeric_limits<double>::infinity();
  for (const Json& cost : refinement.at("round_costs"))
    if (cost.is_number()) best = std::min(best, cost.get<double>());
  CHECK(refinement.at("round_costs").size() >= 3);  // two rounds without gain at the earliest
  CHECK(refinement.at("cost").get<double>() <= 1.001 * best);
  CHECK(best < refinement.at("round_costs").at(0).get<double>());  // a map fitted anew does better
}

TEST_CASE("another seed gives other numbers, and noise brings the residual over the noise into the table", "[slow]") {
  const Folder folder;
  write_config(folder, [](Json& config) { config["realisations"] = 1; });
  run_program(reproduce_command(folder, "a", "--quiet"), "PATH=/nowhere");
  run_program(reproduce_command(folder, "b", "--seed 2 --snr 40 --quiet"), "PATH=/nowhere");
  const Json a = parse_json(read_file(folder / "a/table1.json"), "a"),
             b = parse_json(read_file(folder / "b/table1.json"), "b");
  CHECK(a.at("rows") != b.at("rows"));
  CHECK_FALSE(a.at("rows").at(0).contains("residual_over_noise"));
  // No model beats the noise by more than its few parameters can; one that knows nothing is far above.
  for (const Json& row : b.at("rows")) {
    CHECK(row.at("residual_over_noise").at("refined").at("median").get<double>() > 0.95);
    CHECK(row.at("residual_over_noise").at("linear").at("median").get<double>() > 10);
  }
}

TEST_CASE("a suspension with friction, memory and clearance is reproduced like any other", "[slow]") {
  const Folder folder;
  write_config(folder, [](Json& config) {
    Json plant = parse_json(read_file(config.at("plant").get<std::string>()), "plant.json");
    for (Json& element : plant.at("elements")) {
      if (element.at("name") != "suspension") continue;
      for (const char* law :
           {R"({"law": "coulomb_friction", "force_n": 10})",
            R"({"law": "bouc_wen", "force_n": 20, "yield_travel_m": 0.001})", R"({"law": "backlash", "gap_m": 1e-5})"})
        element.at("laws").push_back(Json::parse(law));
    }
    config["plant"] = plant;
    config["realisations"] = 9;  // of short records each hangs on the last digits of the processor
    config["estimation_s"] = 60;
  });
  const Said said = run_program(reproduce_command(folder, "a", "--quiet"), "PATH=/nowhere");
  INFO(said.err);
  CHECK(said.status == 0);
  const Json table = parse_json(read_file(folder / "a/table1.json"), "table1.json");
  CHECK(table.at("physics").at("spring_r2").at("median").get<double>() > 0.999);
}

TEST_CASE("mistakes end with status 2 and one line before anything is made") {
  const Folder folder;
  const auto refused = [&](const std::function<void(Json&)>& edit, const std::string& more = "") {
    write_config(folder, edit);
    const Said said = run_program(reproduce_command(folder, "out", more));
    INFO(said.err);
    CHECK(said.status == 2);
    CHECK(said.lines() == 1);
    CHECK_FALSE(std::filesystem::exists(folder / "out"));
    return said.err;
  };
  const auto nothing = [](Json&) {};
  CHECK_THAT(refused([](Json& c) { c["estimation"] = 3; }), Contains("config.json") && Contains("estimation_s"));
  CHECK_THAT(refused([](Json& c) { c["estimation_s"] = 0.1234567; }), Contains("$.estimation_s"));
  CHECK_THAT(refused([](Json& c) { c["sampling_hz"] = 300; }), Contains("sampling_hz"));
  CHECK_THAT(refused([](Json& c) { c["pipeline"]["pases"] = 3; }), Contains("$.pipeline.pases") && Contains("passes"));
  CHECK_THAT(refused([](Json& c) { c["solver"] = {{"name", "newton"}}; }), Contains("$.solver.name"));
  CHECK_THAT(refused([](Json& c) { c["plant"] = "nowhere.json"; }), Contains("nowhere.json"));
  CHECK_THAT(refused(nothing, "--realisations 0"), Contains("--realisations"));
  CHECK_THAT(refused(nothing, "--snr loud"), Contains("--snr"));
  CHECK_THAT(refused(nothing, "--sede 3"), Contains("--sede"));
  write_config(folder);
  write_file(folder / "blocked", "a file");
  CHECK(run_program(reproduce_command(folder, "blocked")).status == 2);
}
