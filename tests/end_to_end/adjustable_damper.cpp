// `diagnose` where a damper is set from outside: its voltage is a second input.
#include <catch2/catch.hpp>
#include <filesystem>

#include "core/base/random.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/program.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

Json semi_active() { return Json::parse(semi_active_text); }
Json& damper_of(Json& plant) { return plant["elements"][0]["laws"][1]; }

/// What is said of the records of a rig by one who has the plant of `semi_active`.
Json diagnosed(const Folder& folder, const Json& rig, std::uint64_t seed) {
  Json config = {{"plant", rig}, {"sampling_hz", 200}, {"seed", seed}, {"noise_snr_db", 40}, {"settle_s", 2}};
  config["records"] = Json::array();
  for (const char* role : {"estimation", "estimation", "validation"}) {
    Json drive;
    drive["road"] = {{"name", "iso8608"}, {"class", "C"}, {"speed_m_per_s", 15}, {"to_cycles_per_m", 3}};
    drive["voltage"] = {{"name", "steps"}, {"low", 0}, {"high", 5}, {"hold_s", 1.5}};
    config["records"].push_back({{"role", role}, {"duration_s", 15}, {"drive", drive}});
  }
  write_json(folder / "rig.json", config);
  write_json(folder / "plant.json", semi_active());
  const std::string rig_file = (folder / "rig.json").string(), records = (folder / "records").string();
  const Said made = run_program("generate '" + rig_file + "' --quiet --out '" + records + "'");
  INFO(made.err);
  REQUIRE(made.status == 0);
  const std::string out = (folder / "out.json").string();
  const Said said = run_program("diagnose --quiet --plant '" + (folder / "plant.json").string() + "' --records '" +
                                records + "/records.json' --out '" + out + "'");
  INFO(said.err);
  REQUIRE(said.status == 0);
  return parse_json(read_file(out), "out.json");
}

std::string named(const Json& diagnosis) {
  std::string all;
  for (const Json& name : diagnosis["which"]["named"]) all += (all.empty() ? "" : " ") + name.get<std::string>();
  return all;
}

}  // namespace

TEST_CASE(
    "beside a damper that follows a voltage what is missing is named: a friction that follows it, a slow coil, a "
    "wrong slope, and nothing where nothing is",
    "[slow]") {
  const Folder folder;
  Random random(61, Stream::parameters);
  const auto between = [&](double low, double high) { return low + (high - low) * random.uniform(); };
  SECTION("a friction that follows the voltage") {
    Json rig = semi_active();
    const double force = between(15, 40), slope = between(10, 40);
    rig["elements"][0]["laws"].push_back({{"law", "coulomb_friction"}, {"force_n", force}, {"velocity_m_per_s", 0.01}});
    rig["elements"][0]["laws"].back()["scheduled"] = {{"by", "voltage"}, {"slopes", {{"force_n", slope}}}};
    const Json found = diagnosed(folder, rig, 71);
    CHECK(named(found) == "coulomb_friction@suspension");
    CHECK(found["which"]["effects"][0]["closure"].get<double>() > 0.98);
    for (const Json& own : found["which"]["effects"][0]["parameters"])
      if (own["name"].get<std::string>().ends_with("scheduled.force_n"))
        CHECK(own["value"].get<double>() == Approx(slope).epsilon(0.1));
  }
  SECTION("a slow coil") {
    Json rig = semi_active();
    rig["inputs"][1]["lag"] = {{"time_constant_s", between(0.08, 0.25)}};
    CHECK(named(diagnosed(folder, rig, 72)) == "actuator_lag@actuator:voltage");
  }
  SECTION("a wrong slope") {
    Json rig = semi_active();
    damper_of(rig)["scheduled"]["slopes"]["damping_ns_per_m"] = 250 * between(1.8, 2.5);
    CHECK(named(diagnosed(folder, rig, 73)) == "damping_error@suspension");
  }
  SECTION("nothing") { CHECK(named(diagnosed(folder, semi_active(), 74)).empty()); }
}

TEST_CASE("of a magnetorheological damper that was measured at three voltages the friction follows the voltage",
          "[slow]") {
  if (!std::filesystem::exists(std::filesystem::path(WHEELHOP_DATA) / "mrdamper_utfpr_0.88V.csv")) {
    WARN("skipped: no records of the damper in " << WHEELHOP_DATA << "; set WHEELHOP_DATA to the folder of them");
    return;
  }
  const Folder folder;
  const std::filesystem::path configs = std::filesystem::path(WHEELHOP_SOURCE) / "experiments/configs/rigs";
  Json records = parse_json(read_file(configs / "mrdamper_voltage_records.json"), "records.json");
  for (Json& entry : records["records"])
    entry["file"] =
        (std::filesystem::absolute(WHEELHOP_DATA) / std::filesystem::path(entry["file"].get<std::string>()).filename())
            .string();
  write_json(folder / "records.json", records);
  const std::string out = (folder / "out.json").string();
  const Said said = run_program("diagnose --quiet --plant '" + (configs / "mrdamper_voltage_plant.json").string() +
                                "' --records '" + (folder / "records.json").string() + "' --out '" + out + "'");
  INFO(said.err);
  REQUIRE(said.status == 0);
  const Json found = parse_json(read_file(out), "out.json");
  CHECK_THAT(named(found), Contains("coulomb_friction@damper"));
  // Between the fitted voltages, where the authors' own model leaves 14 to 32 %.
  CHECK(found["how_far"]["with_effect"]["nrmse"]["y_force"].get<double>() < 0.14);
  CHECK_THAT(said.out, Contains("scheduled.force_n"));
}
