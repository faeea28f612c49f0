// `generate` from config to folder: what it writes reads back, twice the same bytes, and mistakes leave nothing behind.
#include "experiments/generate/generate.hpp"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <functional>
#include <map>

#include "core/base/files.hpp"
#include "core/base/random.hpp"
#include "core/base/status.hpp"
#include "core/data/records.hpp"
#include "core/plant/plant.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/plants.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

Json small_config() {
  return Json::parse(R"({"plant": "plant.json", "sampling_hz": 200, "seed": 4, "noise_snr_db": 30, "records": [
    {"role": "estimation", "duration_s": 5, "repeats": 2,
     "drive": {"name": "multisine", "rms": 0.004, "period_s": 1, "from_hz": 1, "to_hz": 20}},
    {"role": "validation", "duration_s": 3, "drive": {"road": {"name": "band_limited_noise", "rms": 0.0155}}}]})");
}

struct Run {
  int code = 0;
  std::string message;
};

Run generate(const Folder& folder, const Json& config, const std::string& out) {
  write_json(folder / "plant.json", parse_json(quarter_car_text, "plant.json"));
  write_json(folder / "config.json", config);
  try {
    return {run_generate({folder / "config.json", folder / out, true}), ""};
  } catch (const UserError& error) {
    return {2, error.what()};
  }
}

RecordSet load(const Folder& folder, const std::string& out) {
  const Plant plant = load_plant(folder / out / "plant.json");
  return load_records(folder / out / "records.json", plant.input_channels(), plant.output_channels());
}

}  // namespace

TEST_CASE("a generated folder holds plant, records and provenance that read back, and again the same bytes") {
  const Folder folder;
  REQUIRE(generate(folder, small_config(), "a").code == 0);
  REQUIRE(generate(folder, small_config(), "b").code == 0);
  for (const char* name :
       {"records.json", "plant.json", "provenance.json", "estimation_1.csv", "estimation_2.csv", "validation_1.csv"})
    CHECK(read_file(folder / "a" / name) == read_file(folder / "b" / name));

  const RecordSet set = load(folder, "a");
  REQUIRE(set.records.size() == 3);
  CHECK(set.with_role("validation").size() == 1);
  CHECK(set.records[0].repeat_of == set.records[1].repeat_of);
  CHECK(set.records[0].signal.samples() == 1000);
  CHECK(set.records[0].signal.u == set.records[1].signal.u);
  CHECK(set.records[0].signal.y != set.records[1].signal.y);
  CHECK(set.records[2].signal.u(0, 0) != set.records[0].signal.u(0, 0));

  // The config in the provenance is complete: it makes the same records again.
  const Json provenance = parse_json(read_file(folder / "a" / "provenance.json"), "provenance.json");
  CHECK(provenance.at("status") == "ok");
  CHECK(provenance.at("records").at(0).at("lines").at("road").at("excited").size() > 3);
  REQUIRE(generate(folder, provenance.at("config"), "c").code == 0);
  CHECK(read_file(folder / "a" / "estimation_2.csv") == read_file(folder / "c" / "estimation_2.csv"));
}

TEST_CASE("the noise of a generated record has the level asked for and changes nothing else") {
  const Folder folder;
  Json config = small_config();
  REQUIRE(generate(folder, config, "noisy").code == 0);
  config["noise_snr_db"] = nullptr;
  REQUIRE(generate(folder, config, "clean").code == 0);
  const RecordSet noisy = load(folder, "noisy"), clean = load(folder, "clean");
  CHECK(clean.noise_std.empty());
  CHECK(clean.records[0].signal.y == clean.records[1].signal.y);
  for (std::size_t r = 0; r < 3; ++r) {
    CHECK(noisy.records[r].signal.u == clean.records[r].signal.u);
    const Matrix noise = noisy.records[r].signal.y - clean.records[r].signal.y;
    for (Index i = 0; i < noise.rows(); ++i) {
      const double ratio = noise.row(i).norm() / clean.records[r].signal.y.row(i).norm();
      CHECK(20 * std::log10(ratio) == Approx(-30).margin(0.8));
    }
  }
  CHECK(noisy.noise_std.size() == 3);
}

TEST_CASE("a converter rounds what it measures with its noise, and a stiff law is followed in shorter steps") {
  const Folder folder;
  Json plant = parse_json(quarter_car_text, "plant.json");
  plant["sensors"][1]["quantum"] = 0.05;
  plant["inputs"][0]["delay_s"] = 0.004;
  plant["elements"][0]["laws"].push_back(
      {{"law", "maxwell_branch"}, {"series_stiffness_n_per_m", 4e5}, {"relaxation_s", 1e-4}});
  Json config = small_config();
  config["plant"] = plant;
  REQUIRE(generate(folder, config, "noisy").code == 0);
  config["noise_snr_db"] = nullptr;
  REQUIRE(generate(folder, config, "clean").code == 0);
  const Json provenance = parse_json(read_file(folder / "noisy" / "provenance.json"), "provenance.json");
  CHECK(provenance.at("config").at("substeps").get<int>() >= 5);  // 1 / 0.1 ms is 10 in a hold interval of 1 ms
  const RecordSet noisy = load(folder, "noisy"), clean = load(folder, "clean");
  const Eigen::RowVectorXd steps = noisy.records[0].signal.y.row(1) / 0.05;
  CHECK((steps.array() - steps.array().round()).abs().maxCoeff() < 1e-6);
  CHECK(noisy.records[0].signal.y.row(1) != clean.records[0].signal.y.row(1));
  CHECK(noisy.records[0].signal.u == clean.records[0].signal.u);
}

TEST_CASE("a drive beyond the end stop ends with status 1 and says where, no record is written") {
  const Folder folder;
  Json config = small_config();
  config["records"][1]["drive"]["road"]["rms"] = 0.08;
  CHECK(generate(folder, config, "out").code == 1);
  const Json provenance = parse_json(read_file(folder / "out" / "provenance.json"), "provenance.json");
  CHECK(provenance.at("status") == "outside_domain");
  CHECK_THAT(provenance.at("message").get<std::string>(), Contains("record 2") && Contains("\"suspension\""));
  CHECK_FALSE(std::filesystem::exists(folder / "out" / "records.json"));
}

TEST_CASE("a set that is generated over another one and killed is the one or the other, or none") {
  const Folder folder;
  Json config = small_config();
  config["records"][0]["repeats"] = 12;
  config["records"][0]["duration_s"] = config["records"][1]["duration_s"] = 0.5;
  config["settle_s"] = 0;
  // The second set has another seed and fewer records.
  Json configs[2] = {config, config};
  configs[1]["seed"] = 5;
  configs[1]["records"][0]["repeats"] = 9;
  std::map<std::string, std::string> whole[2];
  const auto content = [](const std::filesystem::path& place) {
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(place))
      if (entry.is_regular_file() && entry.path().filename().string()[0] != '.')
        files[entry.path().filename()] = read_file(entry.path());
    return files;
  };
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 2; ++i) {
    const std::string out = "whole_" + std::to_string(i);
    REQUIRE(generate(folder, configs[i], out).code == 0);
    whole[i] = content(folder / out);
  }
  const double both_us = std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
  CHECK(whole[0] != whole[1]);
  Random random(31, Stream::parameters);
  int found[2] = {0, 0};
  for (int trial = 0; trial < 40; ++trial) {
    CAPTURE(trial);
    const pid_t child = ::fork();
    if (child == 0)
      for (int i = trial;; ++i) generate(folder, configs[i % 2], "out");
    ::usleep(static_cast<useconds_t>(2 * both_us * random.uniform()));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    if (!std::filesystem::exists(folder / "out/records.json")) continue;
    const auto files = content(folder / "out");
    CHECK((files == whole[0] || files == whole[1]));
    ++found[files == whole[1]];
  }
  CHECK(found[0] > 0);
  CHECK(found[1] > 0);
}

TEST_CASE("a set stays as it is where another one cannot be simulated, and files of two sets are refused") {
  const Folder folder;
  REQUIRE(generate(folder, small_config(), "out").code == 0);
  const std::string before = read_file(folder / "out/provenance.json");
  Json config = small_config();
  config["records"][1]["drive"]["road"]["rms"] = 0.08;
  CHECK(generate(folder, config, "out").code == 1);
  CHECK(read_file(folder / "out/provenance.json") == before);
  CHECK(load(folder, "out").identity.size() == 16);

  config = small_config();
  config["seed"] = 6;
  write_file(folder / "out/notes.txt", "mine");
  REQUIRE(generate(folder, config, "out").code == 0);
  CHECK(read_file(folder / "out/notes.txt") == "mine");
  REQUIRE(generate(folder, small_config(), "other").code == 0);
  CHECK(load(folder, "out").identity != load(folder, "other").identity);
  write_file(folder / "out/records.json", read_file(folder / "other/records.json"));
  CHECK_THROWS_WITH(load(folder, "out"), Contains("records.json: $.set") && Contains("two sets"));
}

TEST_CASE("a mistake in a config is named by file and path before anything is made") {
  const Folder folder;
  const auto refused = [&](const std::function<void(Json&)>& edit) {
    Json config = small_config();
    edit(config);
    const Run run = generate(folder, config, "out");
    CHECK(run.code == 2);
    CHECK_FALSE(std::filesystem::exists(folder / "out"));
    return run.message;
  };
  CHECK_THAT(refused([](Json& c) { c["sampling_hz"] = 300; }),
             Contains("config.json") && Contains("sampling_hz") && Contains("300"));
  CHECK_THAT(refused([](Json& c) { c["records"][0]["drive"]["nmae"] = 1; }), Contains("$.records[0].drive"));
  CHECK_THAT(refused([](Json& c) {
               c["records"][1]["drive"]["raod"] = {{"name", "bump"}};
             }),
             Contains("raod") && Contains("road"));
  CHECK_THAT(refused([](Json& c) { c["records"][0]["role"] = "test"; }),
             Contains("$.records[0].role") && Contains("validation"));
  CHECK_THAT(refused([](Json& c) { c["records"][0]["duration_s"] = 0.0012; }), Contains("$.records[0].duration_s"));
  CHECK_THAT(refused([](Json& c) { c["records"] = Json::array(); }), Contains("at least one record"));
  CHECK_THAT(refused([](Json& c) { c["plant"] = "nowhere.json"; }), Contains("nowhere.json"));
  CHECK_THAT(refused([](Json& c) { c["noise_snr_db"] = "loud"; }), Contains("$.noise_snr_db"));
  CHECK_THAT(refused([](Json& c) { c["sede"] = 1; }), Contains("sede") && Contains("seed"));
  write_file(folder / "blocked", "a file");
  CHECK(generate(folder, small_config(), "blocked").code == 2);
}
