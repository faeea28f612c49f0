// `rigs`: every rig is diagnosed or identified, in the order of the list, and one that fails does not stop the others.
#include <catch2/catch.hpp>

#include "tests/support/program.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

const std::string configs = WHEELHOP_SOURCE "/experiments/configs/";

Json rig(const std::string& name, const std::string& task, const std::string& first, const std::string& records) {
  return {{"name", name},
          {"known", "simulated"},
          {"known_rmse", {{"suspension_displacement", 1e-4}}},
          {task, {{task == "diagnose" ? "plant" : "config", first}, {"records", records}}}};
}

}  // namespace

TEST_CASE("rigs: names, errors of each stage and what is known stand in one file, and a rig that fails beside them",
          "[slow]") {
  const Folder folder;
  const auto at = [&](const std::string& name) { return (folder / name).string(); };
  REQUIRE(run_program("generate " + configs + "generate_rig.json --quiet --out " + at("rig")).status == 0);
  Json silent = parse_json(read_file(folder / "rig/records.json"), "records.json");
  for (Json& record : silent["records"]) record["range"] = {0, 6};  // too short
  write_json(folder / "rig/short.json", silent);
  const std::string records = at("rig/records.json");
  Json list = {{"rigs",
                {rig("diagnosed", "diagnose", configs + "paper_plant.json", records),
                 rig("short", "diagnose", configs + "paper_plant.json", at("rig/short.json")),
                 rig("identified", "identify", configs + "identify_quarter_car.json", records)}}};
  write_json(folder / "rigs.json", list);
  const Said said = run_program("rigs " + at("rigs.json") + " --quiet --out " + at("out"));
  INFO(said.err);
  CHECK(said.status == 1);
  CHECK(said.err.empty());
  const Json result = parse_json(read_file(folder / "out/rigs.json"), "rigs.json");
  REQUIRE(result["rigs"].size() == 3);
  const Json &diagnosed = result["rigs"][0], &failed = result["rigs"][1], &identified = result["rigs"][2];
  CHECK(diagnosed["named"][0]["name"] == "coulomb_friction@suspension");
  CHECK(diagnosed["known_rmse"]["suspension_displacement"] == 1e-4);
  const auto error = [&](const char* stage) {
    return diagnosed["rmse"][stage]["suspension_displacement"].get<double>();
  };
  CHECK(error("with_answer") < 0.5 * error("retuned"));
  CHECK(error("retuned") < error("as_delivered"));
  CHECK_THAT(failed["error"].get<std::string>(), Contains("short.json"));
  CHECK(identified["rmse"]["validation"][0]["suspension_displacement"].get<double>() > 0);
  CHECK(result.contains("provenance"));
  CHECK(parse_json(read_file(folder / "out/timing.json"), "timing.json")["seconds"].size() == 3);
  for (const char* name : {"diagnosed", "identified"})
    CHECK(std::filesystem::exists(at("out/" + std::string(name) + ".json")));
  CHECK_THAT(said.out, Contains("coulomb_friction@suspension") && Contains("with_answer") && Contains("failed"));
}

TEST_CASE("rigs: a list that cannot be meant is refused before anything is done") {
  const Folder folder;
  const Json good = rig("one", "diagnose", "plant.json", "records.json");
  const auto refused = [&](const Json& list) {
    write_json(folder / "rigs.json", {{"rigs", list}});
    const Said said = run_program("rigs " + (folder / "rigs.json").string() + " --out " + (folder / "out").string());
    CHECK(said.status == 2);
    CHECK_FALSE(std::filesystem::exists(folder / "out"));
    return said.err;
  };
  CHECK_THAT(refused(Json::array({good, good})), Contains("$.rigs[1].name"));
  Json both = good, neither = good, path = good, unknown = good;
  both["identify"] = {{"config", "c.json"}, {"records", "r.json"}};
  neither.erase("diagnose");
  path["name"] = "../out";
  unknown["knwon"] = 1;
  for (const Json& wrong : {both, neither, path, unknown})
    CHECK_THAT(refused(Json::array({wrong})), Contains("$.rigs[0]"));
}
