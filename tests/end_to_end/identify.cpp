// generate -> identify -> simulate with the program, and what it refuses.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numeric>
#include <utility>

#include "core/base/random.hpp"
#include "core/data/metrics.hpp"
#include "core/data/table.hpp"
#include "core/identify/judgements.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/program.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

std::string quoted(const std::filesystem::path& path) { return "'" + path.string() + "'"; }

Json sample_config() {
  return Json::parse(R"({"plant": "data/plant.json", "pipeline": {"passes": 2, "refine_iterations": 10},
                         "subspace": {"name": "pi_moesp", "block_rows": 20}})");
}

/// A folder with data of 20 s and a config.
void prepare(const Folder& folder) {
  write_json(folder / "plant.json", parse_json(quarter_car_text, "plant.json"));
  write_json(folder / "generate.json", Json::parse(R"({"plant": "plant.json", "sampling_hz": 200, "records": [
    {"role": "estimation", "duration_s": 20, "drive": {"name": "band_limited_noise", "rms": 0.0155}},
    {"role": "validation", "duration_s": 10, "drive": {"name": "band_limited_noise", "rms": 0.0155}}]})"));
  REQUIRE(run_program("generate " + quoted(folder / "generate.json") + " --quiet --out " + quoted(folder / "data"))
              .status == 0);
  write_json(folder / "config.json", sample_config());
}

Said identify(const Folder& folder, const std::string& records = "data/records.json") {
  return run_program("identify " + quoted(folder / "config.json") + " --quiet --records " + quoted(folder / records) +
                     " --out " + quoted(folder / "model.json"));
}

Said simulate(const Folder& folder, const std::string& system, const std::string& records, const std::string& out,
              const std::string& more = "--quiet") {
  return run_program("simulate " + quoted(folder / system) + " --records " + quoted(folder / records) + " --out " +
                     quoted(folder / out) + " " + more);
}

/// records.json of one record of `count` samples with the columns of the quarter car.
void write_record(const Folder& folder, const std::function<void(Table&)>& edit, Index count = 2000) {
  Table table = read_table(folder / "data/estimation_1.csv");
  table.columns.conservativeResize(Eigen::NoChange, count);
  edit(table);
  std::filesystem::create_directory(folder / "bad");
  write_table(folder / "bad/record.csv", table);
  write_json(folder / "bad/records.json",
             Json::parse(R"({"sampling_hz": 200, "records": [{"file": "record.csv", "role": "estimation"}]})"));
}

}  // namespace

TEST_CASE("a model identified from generated records follows the validation record, from its file as well", "[slow]") {
  const Folder folder;
  prepare(folder);
  const Said said = identify(folder);
  INFO(said.err + said.out);
  REQUIRE(said.status == 0);
  CHECK(said.err.empty());
  const Json model = parse_json(read_file(folder / "model.json"), "model.json");
  CHECK(model.at("status") == "ok");
  const Json& scores = model.at("scores").at("records").at(1);
  CHECK(scores.at("role") == "validation");
  CHECK_FALSE(model.at("scores").at("factor").at("method").get<std::string>().empty());
  // Every number that was chosen stands in the file, with what it means.
  const Json& judgements = model.at("provenance").at("judgements");
  CHECK(judgements == to_json(kJudged));
  CHECK(judgements.at("order_margin").at("value") == kJudged.order_margin);
  for (const auto& [name, judgement] : judgements.items())
    CHECK_FALSE(judgement.at("meaning").get<std::string>().empty());

  REQUIRE(simulate(folder, "model.json", "data/records.json", "all.csv").status == 0);
  const Table all = read_table(folder / "all.csv"), measured = read_table(folder / "data/validation_1.csv");
  REQUIRE(all.find("record") == 0);
  REQUIRE(all.columns.cols() == 4000 + measured.columns.cols());
  for (const char* output : {"travel", "body_acc", "wheel_acc"}) {
    const Matrix run = all.columns.row(all.find(output)).tail(measured.columns.cols());
    const double vaf = vaf_percent(measured.columns.row(measured.find(output)), run)(0);
    CHECK(vaf > 95);
    CHECK(vaf == Approx(scores.at("vaf_percent").at(output).get<double>()).epsilon(1e-9));
  }

  // Only the drive is needed; the state then starts at zero, and it is said.
  Table drive;
  drive.names = {"t", "road"};
  drive.columns.resize(2, measured.columns.cols());
  drive.columns << measured.columns.row(measured.find("t")), measured.columns.row(measured.find("road"));
  write_table(folder / "data/drive.csv", drive);
  write_json(folder / "data/drive.json",
             Json::parse(R"({"sampling_hz": 200, "records": [{"file": "drive.csv", "role": "validation"}]})"));
  const Said alone = simulate(folder, "model.json", "data/drive.json", "alone.csv", "");
  CHECK(alone.status == 0);
  CHECK_THAT(alone.err, Contains("zero state"));
  CHECK(simulate(folder, "model.json", "data/drive.json", "none.csv", "--quiet --x0 estimate").status == 2);
  CHECK_FALSE(std::filesystem::exists(folder / "none.csv"));
  const Table single = read_table(folder / "alone.csv");
  CHECK(single.find("record") == -1);
  CHECK(single.find("wheel_acc") > 0);

  Json unstable = parse_json(read_file(folder / "model.json"), "model.json");
  unstable["A"][0][0] = 1.5 + unstable["A"][0][0].get<double>();
  write_json(folder / "unstable.json", unstable);
  const Said refused = simulate(folder, "unstable.json", "data/drive.json", "none.csv", "");
  CHECK(refused.status == 2);
  CHECK_THAT(refused.err, Contains("unstable.json: $.A") && Contains("spectral radius"));
  CHECK_FALSE(std::filesystem::exists(folder / "none.csv"));

  // A drive of twice the size leaves the training range: that is flagged, by channel.
  drive.columns.row(1) *= 1.5;
  write_table(folder / "data/drive.csv", drive);
  const Said beyond = simulate(folder, "model.json", "data/drive.json", "beyond.csv", "");
  CHECK_THAT(beyond.err, Contains("road leaves the training range"));
}

TEST_CASE(
    "without pieces in the config a quarter car is identified to the noise at any rate, with an input that is late",
    "[slow]") {
  for (const auto& [rate, late] : {std::pair<Index, Index>{125, 0}, {400, 6}}) {
    const Folder folder;
    Json generate = Json::parse(R"({"plant": "plant.json", "noise_snr_db": 40, "records": [
      {"role": "estimation", "duration_s": 16, "drive": {"name": "band_limited_noise", "rms": 0.012}},
      {"role": "validation", "duration_s": 8, "drive": {"name": "band_limited_noise", "rms": 0.012}}]})");
    generate["sampling_hz"] = rate;
    write_json(folder / "generate.json", generate);
    Json plant = parse_json(quarter_car_text, "plant.json");
    plant["inputs"][0]["hold_hz"] = 1000 / std::gcd<Index>(1000, rate) * rate;
    write_json(folder / "plant.json", plant);
    REQUIRE(run_program("generate " + quoted(folder / "generate.json") + " --quiet --out " + quoted(folder / "data"))
                .status == 0);
    for (const char* name : {"estimation_1.csv", "validation_1.csv"}) {
      Table table = read_table(folder / "data" / name);
      const Index road = table.find("road"), N = table.columns.cols();
      const Matrix earlier = table.columns.row(road);
      table.columns.row(road).leftCols(N - late) = earlier.rightCols(N - late);
      table.columns.conservativeResize(Eigen::NoChange, N - late);
      write_table(folder / "data" / name, table);
    }
    write_json(folder / "config.json", Json::parse(R"({"inputs": [{"name": "road"}],
      "outputs": [{"name": "travel"}, {"name": "body_acc"}, {"name": "wheel_acc"}]})"));
    const Said said = identify(folder);
    INFO(said.err + said.out);
    CAPTURE(rate, late);
    REQUIRE(said.status == 0);
    const Json model = parse_json(read_file(folder / "model.json"), "model.json");
    CHECK(std::abs(model.at("inputs").at(0).at("delay_samples").get<double>() - static_cast<double>(late)) <=
          (late > 0 ? 2 : 0));
    for (const Json& nrmse : model.at("scores").at("records").at(1).at("nrmse")) CHECK(nrmse.get<double>() < 0.0125);
  }
}

TEST_CASE("a plant simulates its own records again, beyond its end stop nothing is written and the status is 1") {
  const Folder folder;
  prepare(folder);
  REQUIRE(simulate(folder, "data/plant.json", "data/records.json", "plant.csv").status == 0);
  const Table run = read_table(folder / "plant.csv"), measured = read_table(folder / "data/estimation_1.csv");
  // From rest instead of from the middle of the ride: the transient needs its time.
  const Index from = 1000, count = 2000;
  CHECK(vaf_percent(measured.columns.row(measured.find("body_acc")).segment(from, count),
                    run.columns.row(run.find("body_acc")).segment(from, count))(0) > 99);
  write_record(folder, [](Table& table) { table.columns.row(table.find("road")) *= 6; });
  const Said said = simulate(folder, "data/plant.json", "bad/records.json", "bad.csv");
  CHECK(said.status == 1);
  CHECK_THAT(said.err, Contains("outside_domain"));
  CHECK_FALSE(std::filesystem::exists(folder / "bad.csv"));
}

TEST_CASE("a bad config ends with status 2 and one line with file and path, no model is written") {
  const Folder folder;
  prepare(folder);
  const auto refused = [&](const std::function<void(Json&)>& edit) {
    Json config = sample_config();
    edit(config);
    write_json(folder / "config.json", config);
    const Said said = identify(folder);
    INFO(said.err);
    CHECK(said.status == 2);
    CHECK(said.lines() == 1);
    CHECK_FALSE(std::filesystem::exists(folder / "model.json"));
    return said.err;
  };
  CHECK_THAT(refused([](Json& c) { c["sede"] = 1; }), Contains("config.json") && Contains("seed"));
  CHECK_THAT(refused([](Json& c) { c.erase("plant"); }), Contains("inputs"));
  CHECK_THAT(refused([](Json& c) { c["inputs"] = Json::array(); }), Contains("either"));
  CHECK_THAT(refused([](Json& c) {
               c.erase("plant");
               c["inputs"] = Json::parse(R"([{"name": "raod"}])");
               c["outputs"] = Json::parse(R"([{"name": "travel"}, {"name": "body_acc"}])");
             }),
             Contains("raod") && Contains("road") && Contains("estimation_1.csv"));
  CHECK_THAT(refused([](Json& c) { c["nonlinearity"] = {{"name", "mlq"}}; }), Contains("$.nonlinearity.name"));
  CHECK_THAT(refused([](Json& c) { c["subspace"]["block_rows"] = 1; }), Contains("$.subspace.block_rows"));
  CHECK_THAT(refused([](Json& c) { c["pipeline"]["nonlinearities"] = 3; }),
             Contains("$.pipeline.nonlinearities") && Contains("assumption 2"));
  CHECK_THAT(refused([](Json& c) { c["linear"] = {{"max_order", 5}}; }), Contains("subspace") && Contains("linear"));
  CHECK_THAT(refused([](Json& c) {
               c.erase("subspace");
               c["linear"] = {{"max_ordre", 5}};
             }),
             Contains("max_ordre") && Contains("max_order"));
  CHECK_THAT(refused([](Json& c) {
               c["order"] = 4;
               c["pipeline"]["order"] = 5;
             }),
             Contains("$.pipeline.order"));
  CHECK_THAT(refused([](Json& c) { c["record"] = "estimation_9.csv"; }),
             Contains("$.record") && Contains("estimation_1.csv"));
}

TEST_CASE("a record that cannot carry the identification is refused with the numbers, no model is written") {
  const Folder folder;
  prepare(folder);
  const auto refused = [&](const std::function<void(Table&)>& edit, Index count = 2000) {
    write_record(folder, edit, count);
    const Said said = identify(folder, "bad/records.json");
    INFO(said.err);
    CHECK(said.status == 2);
    CHECK(said.lines() == 1);
    CHECK_THAT(said.err, Contains("records.json") && Contains("record.csv"));
    CHECK_FALSE(std::filesystem::exists(folder / "model.json"));
    return said.err;
  };
  const auto road = [](Table& table) { return table.columns.row(table.find("road")); };
  CHECK_THAT(refused([&](Table& t) { road(t).setZero(); }), Contains("\"road\" constant"));
  CHECK_THAT(refused([&](Table& t) { road(t).setConstant(0.01); }), Contains("\"road\" constant at 0.01"));
  CHECK_THAT(refused([&](Table& t) {
               for (Index k = 0; k < t.columns.cols(); ++k) road(t)(k) = std::sin(0.05 * static_cast<double>(k));
             }),
             Contains("order 40") && Contains("found order 2"));
  CHECK_THAT(refused([&](Table& t) { t.columns.row(t.find("body_acc")).setConstant(9.81); }),
             Contains("\"body_acc\" constant"));
  CHECK_THAT(refused([](Table&) {}, 120), Contains("120") && Contains("block rows"));
}

TEST_CASE("without a piece for step 1 a drive of one sine in noise and collinear inputs are refused by name") {
  const Folder folder;
  prepare(folder);
  Random random(5, Stream::noise);
  const auto refused = [&](const std::string& config, const std::function<void(Table&)>& edit) {
    write_json(folder / "config.json", parse_json(config, "config.json"));
    write_record(folder, edit);
    const Said said = identify(folder, "bad/records.json");
    CHECK(said.status == 2);
    CHECK(said.lines() == 1);
    CHECK_FALSE(std::filesystem::exists(folder / "model.json"));
    return said.err;
  };
  CHECK_THAT(refused(R"({"inputs": [{"name": "road"}], "outputs": [{"name": "travel"}]})",
                     [&](Table& t) {
                       for (Index k = 0; k < t.columns.cols(); ++k) {
                         const double turn = 0.05 * static_cast<double>(k);
                         t.columns(t.find("road"), k) = std::sin(turn) + 1e-3 * random.normal();
                         t.columns(t.find("travel"), k) = 0.3 * std::sin(turn - 1) + 1e-2 * random.normal();
                       }
                     }),
             Contains("one sine") && Contains("record.csv"));
  CHECK_THAT(refused(R"({"inputs": [{"name": "road"}, {"name": "travel"}], "outputs": [{"name": "body_acc"}]})",
                     [&](Table& t) { t.columns.row(t.find("travel")) = -2 * t.columns.row(t.find("road")); }),
             Contains("collinear") && Contains("\"travel\""));
}

TEST_CASE("help teaches, unknown commands and options are refused with what is known") {
  for (const char* command : {"list", "generate", "identify", "simulate", "reproduce", "report"}) {
    const Said said = run_program(std::string(command) + " --help");
    CHECK(said.status == 0);
    CHECK_THAT(said.out, Contains("Example:") && Contains(std::string("wheelhop ") + command));
  }
  CHECK(run_program("").status == 2);
  const Said unknown = run_program("reprodce");
  CHECK(unknown.status == 2);
  CHECK_THAT(unknown.err, Contains("reproduce") && Contains("did you mean"));
  const Said missing = run_program("identify");
  CHECK(missing.status == 2);
  CHECK(missing.lines() == 1);
  CHECK(run_program("simulate nowhere.json --records r.json --out s.csv").status == 2);
}
