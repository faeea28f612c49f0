// `wheelhop look`: what it finds in a file is what was put there, and the records.json it writes reads the file.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/json.hpp"
#include "core/base/random.hpp"
#include "core/data/records.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/program.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;
using Catch::StartsWith;

namespace {

std::string shell_word(const std::filesystem::path& path) { return "'" + path.string() + "'"; }

/// What a logger wrote: preamble, semicolons, decimal commas, units in a row, one sample in `lost` missing (-1: none).
std::string logged(int samples, int lost) {
  std::string text = "Recorder: rig 3\r\n\r\nZeit;Weg;Beschl;Zustand\r\nms;mm;g;\r\n";
  for (int k = 0; k < samples; ++k) {
    if (k == lost) continue;
    std::string line = fmt::format("{:.1f};{:.6f};{:.6f};ok\r\n", 5.0 * k, 10 * std::sin(0.1 * k), std::cos(0.1 * k));
    std::replace(line.begin(), line.end(), '.', ',');
    text += line;
  }
  return text;
}

}  // namespace

TEST_CASE("look tells layout, rate, units and lost samples, and its records.json reads the file") {
  const Folder folder;
  std::filesystem::create_directory(folder / "logs");
  for (const int lost : {-1, 120}) {
    write_file(folder / "logs" / "a.csv", logged(400, lost));
    const Said said =
        run_program("look " + shell_word(folder / "logs" / "a.csv") + " --out " + shell_word(folder / "records.json"));
    CAPTURE(said.out, said.err);
    REQUIRE(said.status == 0);
    CHECK(said.err.empty());
    CHECK_THAT(said.out, Contains("cells separated by \";\"") && Contains("decimal comma") &&
                             Contains("names in line 3") && Contains("units in line 4") && Contains("200 Hz"));
    CHECK_THAT(said.out, Contains("Weg") && Contains("mm") && Contains("no numbers"));
    CHECK((said.out.find("lost samples: 1 (1 before line 125)") != std::string::npos) == (lost >= 0));
    const Json json = parse_json(read_file(folder / "records.json"), "records.json");
    CHECK(json["records"][0]["file"] == "logs/a.csv");
    CHECK(json["time"]["column"] == "Zeit");
    CHECK(json.contains("lost_samples") == (lost >= 0));
    const RecordSet set = load_records(folder / "records.json", {{"Weg", "m"}}, {{"Beschl", "m/s^2"}});
    CHECK(set.sampling_hz == 200);
    const Signal& signal = set.records[0].signal;
    REQUIRE(signal.samples() == 400);
    for (int k = 0; k < 400; ++k) {
      REQUIRE(std::abs(signal.u(0, k) - 0.01 * std::sin(0.1 * k)) < 2e-6);
      REQUIRE(std::abs(signal.y(0, k) - 9.80665 * std::cos(0.1 * k)) < 2e-3);
    }
  }
}

TEST_CASE("look on a generated set finds nothing to say but the rate, in text and in MATLAB files") {
  const Folder folder;
  RecordSet set;
  set.sampling_hz = 250;
  Random random(3, Stream::noise);
  for (const char* file : {"a.csv", "a.csv.gz", "a.mat"}) {
    Record record;
    record.file = file;
    record.role = "estimation";
    record.signal.u = random.normal(1, 300);
    record.signal.y = random.normal(1, 300);
    record.signal.sample_time_s = 1.0 / 250;
    record.signal.inputs = {{"road", "m"}};
    record.signal.outputs = {{"acc", "m/s^2"}};
    set.records.push_back(record);
  }
  write_records(folder.path(), set);
  for (const Record& record : set.records) {
    CAPTURE(record.file);
    const Said said =
        run_program("look " + shell_word(folder / record.file) + " --out " + shell_word(folder / "look.json"));
    CAPTURE(said.out, said.err);
    REQUIRE(said.status == 0);
    const Json json = parse_json(read_file(folder / "look.json"), "look.json");
    CHECK(json == Json({{"sampling_hz", 250}, {"records", {{{"file", record.file}, {"role", "estimation"}}}}}));
    const RecordSet again = load_records(folder / "look.json", record.signal.inputs, record.signal.outputs);
    CHECK(again.records[0].signal.u == record.signal.u);
    CHECK(again.records[0].signal.y == record.signal.y);
    CHECK(again.records[0].reading.empty());
  }
}

TEST_CASE("look at a folder tells what it holds, and at nothing that it is not there, whatever the name ends in") {
  const Folder folder;
  std::filesystem::create_directory(folder / "run3");
  write_file(folder / "run3" / "left.csv", "t,x\n0,1\n1,2\n");
  for (const std::string name : {"run3", "none", "none.csv", "none.mat"}) {
    CAPTURE(name);
    const Said said = run_program("look " + shell_word(folder / name));
    CHECK(said.status == 2);
    CHECK_THAT(said.err, Contains(name == "run3" ? "found a folder with left.csv" : "No such file"));
  }
}

TEST_CASE("look says what it cannot find, and what it is told it believes") {
  const Folder folder;
  std::string text;
  for (int k = 0; k < 60; ++k) text += fmt::format("{},{}\n", 10 + k, 100 - k * k);
  write_file(folder / "bare.csv", text);
  const std::string file = shell_word(folder / "bare.csv");
  const Said names = run_program("look " + file);
  CHECK(names.status == 2);
  CHECK(names.lines() == 1);
  CHECK_THAT(names.err, Contains("line 1") && Contains("\"format\": {\"header_row\": 0}"));
  const std::string layout = " --layout '{\"header_row\": 0}'";
  const Said rate = run_program("look " + file + layout + " --out " + shell_word(folder / "r.json"));
  CHECK(rate.status == 1);
  CHECK_THAT(rate.err, Contains("--rate HZ"));
  CHECK_FALSE(std::filesystem::exists(folder / "r.json"));
  const Said said = run_program("look " + file + layout + " --rate 50 --out " + shell_word(folder / "r.json"));
  CAPTURE(said.out, said.err);
  REQUIRE(said.status == 0);
  const RecordSet set = load_records(folder / "r.json", {{"channel_1", "m"}}, {{"channel_2", "N"}});
  CHECK(set.sampling_hz == 50);
  CHECK(set.records[0].signal.u(0, 0) == 10);
  CHECK(set.records[0].signal.y(0, 59) == 100 - 59 * 59);

  CHECK_THAT(run_program("look " + file + " --layout '{\"seperator\": \";\"}'").err,
             Contains("--layout: $.seperator") && Contains("did you mean \"separator\"?"));
  CHECK_THAT(run_program("look " + file + " --layout '{'").err, Contains("--layout"));
  const Said over = run_program("look " + file + " --out " + file);
  CHECK(over.status == 2);
  CHECK_THAT(over.err, StartsWith("wheelhop: --out: "));
  CHECK(read_file(folder / "bare.csv") == text);
}

TEST_CASE("what was done to a file to read it stands in the provenance of a result") {
  const Folder folder;
  write_json(folder / "plant.json", parse_json(one_mass_text, "plant"));
  std::string text = "t;push [kN]\n";
  for (int k = 0; k < 400; ++k) {
    const double t = 0.01 * k;
    text +=
        fmt::format("{};{}\n", k / 100.0, 5e-4 * (std::sin(17 * t) + std::sin(23.3 * t + 1) + std::sin(9.1 * t + 2)));
  }
  write_file(folder / "a.csv", text);
  write_file(folder / "records.json",
             R"({"sampling_hz": 100, "records": [{"file": "a.csv", "role": "estimation"}], "noise_std":
                {"x": 1e-5, "v": 1e-4, "a": 1e-3}})");
  const Said said = run_program("plan --quiet --plant " + shell_word(folder / "plant.json") + " --records " +
                                shell_word(folder / "records.json") + " --out " + shell_word(folder / "plan.json"));
  CAPTURE(said.err);
  REQUIRE(said.status == 0);
  const Json reading = parse_json(read_file(folder / "plan.json"), "plan.json").at("provenance").at("reading");
  REQUIRE(reading.size() == 1);
  CHECK(reading.at(0).at("record") == 0);
  CHECK(reading.at(0).at("file") == "a.csv");
  CHECK(reading.at(0).at("did").at(0) == "cells separated by \";\"");
  CHECK(reading.at(0).at("did").at(1) == "push: column \"push [kN]\" in kN times 1000 to N");
}
