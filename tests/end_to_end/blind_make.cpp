// `blind make`: what it hands out, what it keeps, what it refuses.
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>

#include "core/base/files.hpp"
#include "core/data/records.hpp"
#include "core/plant/dataset.hpp"
#include "experiments/blind/make.hpp"
#include "experiments/blind/score_key.hpp"
#include "experiments/rig/sha256.hpp"
#include "tests/support/folder.hpp"

using namespace wheelhop;
using Catch::Contains;
namespace fs = std::filesystem;
namespace {

const fs::path configs = fs::path(WHEELHOP_SOURCE) / "experiments/configs";

enum Set { friction, none, magnet };  ///< of the committed smoke config, in its order

/// Some sets of the smoke config, with changes to the first of them. On the smallest plant, one mass whose drive is
/// held as long as a sample, for a few seconds: nearly all of the cost is steps of simulation.
fs::path config_in(const test::Folder& folder, const std::vector<Set>& sets, const Json& change = Json::object()) {
  const Json smoke = parse_json(read_file(configs / "blind_smoke.json"), "smoke");
  Json plant = parse_json(read_file(configs / "plants/one_mass.json"), "plant");
  plant["inputs"][0]["hold_hz"] = 200;
  Json config = {{"seed", smoke["seed"]}, {"sets", Json::array()}};
  for (const Set number : sets) {
    Json set = smoke["sets"][number];
    set.update({{"plant", plant}, {"level", 30}, {"band_hz", {0.3, 8}}, {"samples", 600}});
    if (number == none) set["seeds"] = 1;
    config["sets"].push_back(std::move(set));
  }
  config["sets"][0].update(change);
  write_json(folder / "config.json", config);
  return folder / "config.json";
}

std::string refusal(const BlindMakeRequest& request) {
  try {
    run_blind_make(request);
  } catch (const UserError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace

TEST_CASE("a set of blind cases is the same bytes whatever the number of threads, sealed, and fit to be diagnosed") {
  const test::Folder folder;
  const fs::path config = config_in(folder, {none, magnet});
  for (const int jobs : {1, 2}) {
    const std::string id = std::to_string(jobs);
    REQUIRE(run_blind_make({config, folder / ("out" + id), folder / ("key" + id), {}, jobs, true}) == 0);
  }
  std::vector<std::string> names;
  for (const char* top : {"out", "key"})
    for (const auto& item : fs::recursive_directory_iterator(folder / (std::string(top) + "1"))) {
      if (!item.is_regular_file()) continue;
      const fs::path inside = fs::relative(item.path(), folder / (std::string(top) + "1"));
      CAPTURE(inside);
      CHECK(read_file(item.path()) == read_file(folder / (std::string(top) + "2") / inside));
      names.push_back(inside.generic_string());
    }
  CHECK(names.size() == 2 * (5 + 3) + 2);

  const Json key = parse_json(read_file(folder / "key1" / "key.json"), "key.json");
  const Json manifest = parse_json(read_file(folder / "out1" / "manifest.json"), "manifest.json");
  CHECK(manifest["cases"] == 2);
  CHECK(manifest["key_sha256"] == blind::sha256(read_file(folder / "key1" / "key.json")));
  REQUIRE(key.size() == 2);
  for (const Json& entry : key) {
    const fs::path place = folder / "out1" / entry["case"].get<std::string>();
    CAPTURE(entry.dump());
    const Plant plant = load_plant(place / "plant.json");
    const RecordSet set = load_records(place / "records.json", plant.input_channels(), plant.output_channels());
    REQUIRE(set.records.size() == 3);
    CHECK(set.records[0].signal.u == set.records[1].signal.u);
    CHECK(set.records[0].signal.u != set.records[2].signal.u);
    // Two repeats differ by twice the power of the noise, which the key tells relative to the signal.
    const Matrix apart = set.records[0].signal.y - set.records[1].signal.y;
    for (Index i = 0; i < apart.rows(); ++i) {
      const double noise = apart.row(i).norm() / std::sqrt(2.0) / set.records[0].signal.y.row(i).norm();
      CHECK(noise == Approx(entry["noise"].get<double>()).epsilon(0.2));
    }
    if (entry["class"] == "unknown") {
      CHECK(entry["effects"][0]["in_catalogue"] == false);
      CHECK(entry["gap_sigma"].get<double>() > 2);  // strong
      continue;
    }
    // Another simulation of the plant as delivered misses the record by what the key says.
    const Signal& record = set.records[0].signal;
    const GeneratedRecord delivered = simulate_record(plant, record);
    REQUIRE(delivered.status == Status::ok);
    double sum = 0;
    const Index settled = 300, count = record.samples() - settled - 20;
    for (Index i = 0; i < apart.rows(); ++i) {
      const double sigma = apart.row(i).norm() / std::sqrt(2.0 * static_cast<double>(apart.cols()));
      sum += (record.y - delivered.signal.y).row(i).segment(settled, count).squaredNorm() / (sigma * sigma);
    }
    const double gap = std::sqrt(sum / static_cast<double>(count * apart.rows()) - 1);
    CHECK(gap == Approx(entry["gap_delivered_sigma"].get<double>()).epsilon(0.2));
    CHECK(entry["gap_sigma"].get<double>() < 0.1);
  }
}

TEST_CASE("the key of a mixed case names its effect and its parameter, and what each leaves") {
  const test::Folder folder;
  const fs::path config = config_in(folder, {friction},
                                    {{"class", "mixed"},
                                     {"effects", {"damper_asymmetry"}},
                                     {"parameters", {"stiffness_error@mount"}},
                                     {"strengths", {"medium"}}});
  REQUIRE(run_blind_make({config, folder / "out", folder / "key", {}, 1, true}) == 0);
  const Json entry = parse_json(read_file(folder / "key" / "key.json"), "key.json").at(0);
  CAPTURE(entry.dump());
  CHECK(entry["class"] == "mixed");
  REQUIRE(entry["effects"].size() == 2);
  CHECK(entry["effects"][0]["effect"] == "damper_asymmetry");
  CHECK(entry["effects"][1]["effect"] == "stiffness_error");
  for (const Json& effect : entry["effects"]) CHECK(effect["location"] == "mount");
  CHECK(std::abs(entry["effects"][1]["strength"].get<double>()) > 4 * 0.03);  // tolerances of the mount's spring
  CHECK(entry["gap_sigma"].get<double>() > 0.7);
  CHECK(entry["gap_parameter_sigma"].get<double>() > 0.1);
  CHECK(entry["gap_delivered_sigma"].get<double>() > entry["gap_sigma"].get<double>());
  const std::vector<scoring::TrueCase> read = scoring::load_key(folder / "key");
  REQUIRE(read.size() == 1);
  CHECK(read.front().kind == scoring::CaseKind::mixed);
}

TEST_CASE("another seed makes other cases") {
  const test::Folder folder;
  const fs::path config = config_in(folder, {none}, {{"samples", 200}});
  REQUIRE(run_blind_make({config, folder / "a", folder / "a_key", {}, 1, true}) == 0);
  REQUIRE(run_blind_make({config, folder / "b", folder / "b_key", 99, 1, true}) == 0);
  CHECK(read_file(folder / "a/case_000/est_1.csv.gz") != read_file(folder / "b/case_000/est_1.csv.gz"));
}

TEST_CASE("a key inside the folder that is handed out, and a folder that is not empty, are refused") {
  const test::Folder folder;
  const fs::path config = config_in(folder, {friction});
  CHECK_THAT(refusal({config, folder / "out", folder / "out/key", {}, 1, true}), Contains("for the key outside"));
  CHECK_THAT(refusal({config, folder / "out", folder / "out/../out", {}, 1, true}), Contains("for the key outside"));
  CHECK_FALSE(fs::exists(folder / "out"));
  CHECK(refusal({config, folder.path(), folder / "../elsewhere", {}, 1, true}).find("empty folder") !=
        std::string::npos);
}

TEST_CASE("a key is never written over, whatever the seed") {
  const test::Folder folder;
  const fs::path config = config_in(folder, {none}, {{"samples", 200}});
  fs::create_directory(folder / "key");
  for (const char* name : {"key.json", "truth"}) {
    write_file(folder / "key" / name, "sealed");
    CHECK_THAT(refusal({config, folder / "out", folder / "key", 99, 1, true}),
               Contains(name) && Contains("without a key"));
    CHECK(read_file(folder / "key" / name) == "sealed");
    CHECK_FALSE(fs::exists(folder / "out"));
    fs::remove(folder / "key" / name);
  }
  const std::string before = read_file(config);
  fs::rename(config, folder / "key/key.json");
  CHECK_THAT(refusal({folder / "key/key.json", folder / "out", folder / "key", 99, 1, true}), Contains("CONFIG"));
  CHECK(read_file(folder / "key/key.json") == before);
}

TEST_CASE("mistakes in a config are told with their place and the known names") {
  const test::Folder folder;
  const auto told = [&](const Json& change) {
    return refusal({config_in(folder, {friction}, change), folder / "out", folder / "key", {}, 1, true});
  };
  CHECK_THAT(told({{"effects", {"coulomb_frction"}}}), Contains("coulomb_friction"));
  CHECK_THAT(told({{"effects", {"coulomb_friction@tyre"}}}), Contains("mount"));
  CHECK_THAT(told({{"strengths", {"huge"}}}), Contains("weak, medium, strong"));
  CHECK_THAT(told({{"noise_relative", {0.02, 0.01}}}), Contains("low <= high"));
  CHECK_THAT(told({{"sample", 100}}), Contains("samples"));
}

TEST_CASE("committed configs of the blind check are valid") {
  for (const auto& item : fs::directory_iterator(configs)) {
    const std::string name = item.path().filename();
    if (!name.starts_with("blind_")) continue;
    CAPTURE(name);
    const test::Folder folder;
    std::ofstream(folder / "taken") << "x";
    // The config is read before anything else is looked at.
    CHECK_THAT(refusal({item.path(), folder.path(), folder / "../key", {}, 1, true}), Contains("empty folder"));
  }
}
