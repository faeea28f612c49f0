// Inputs that are well formed and mean nothing: each is refused where it stands.
#include "experiments/run/input_checks.hpp"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/files.hpp"
#include "core/base/random.hpp"
#include "core/base/status.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/plants.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

RecordSet random_set(Random& random, int count, Index samples = 60) {
  RecordSet set;
  set.sampling_hz = 100;
  for (int i = 0; i < count; ++i) {
    Record record{fmt::format("r{}.csv", i), i % 2 ? "validation" : "estimation", "", 0, {}};
    record.signal.u = random.normal(1, samples);
    record.signal.y = random.normal(2, samples);
    record.signal.sample_time_s = 0.01;
    record.signal.inputs = {{"u", "N"}};
    record.signal.outputs = {{"x", "m"}, {"y", "m"}};
    set.records.push_back(std::move(record));
  }
  return set;
}

}  // namespace

TEST_CASE("a displacement input without an element is refused by its place, in every position") {
  for (const bool first : {true, false}) {
    Json car = parse_json(quarter_car_text, "car.json");
    const Json loose = {{"name", "loose"}, {"kind", "displacement"}, {"unit", "m"}, {"hold_hz", 1000}};
    CHECK_NOTHROW(require_acting_inputs(parse_plant(JsonCursor::from(car, "car.json")), "car.json: $"));
    Json inputs = Json::array();
    if (first) inputs.push_back(loose);
    inputs.push_back(car["inputs"][0]);
    if (!first) inputs.push_back(loose);
    car["inputs"] = inputs;
    const Plant plant = parse_plant(JsonCursor::from(car, "car.json"));
    CHECK_THROWS_WITH(
        require_acting_inputs(plant, "car.json: $"),
        Contains(fmt::format("car.json: $.inputs[{}]", first ? 0 : 1)) && Contains("\"loose\"") && Contains("nothing"));
  }
  CHECK_NOTHROW(require_acting_inputs(plant_from(one_mass_text), ""));  // a force acts on its mass
}

TEST_CASE("values are refused exactly where their squares leave the numbers, with channel and place") {
  Random random(41, Stream::noise);
  for (int trial = 0; trial < 200; ++trial) {
    RecordSet set = random_set(random, 2);
    const double power = -320 + 630 * random.uniform();
    const Index row = random.integer(2), sample = random.integer(60);
    Matrix& y = set.records[1].signal.y;
    set.records[1].first = 7;
    const double value = std::pow(10.0, power) * (random.integer(2) ? 1 : -1);
    y.row(row).setZero();
    y(row, sample) = value;
    const bool sound =
        value == 0 || (value * value >= std::numeric_limits<double>::min() && std::isfinite(value * value));
    CAPTURE(power, sound);
    if (sound)
      CHECK_NOTHROW(require_sound_records(set, "d/r.json"));
    else
      CHECK_THROWS_WITH(require_sound_records(set, "d/r.json"), Contains("d/r.json: $.records[1] (r1.csv)") &&
                                                                    Contains(row == 0 ? "\"x\"" : "\"y\"") &&
                                                                    Contains(fmt::format("sample {})", 7 + sample)));
  }
}

TEST_CASE("a noise that no double of its channel could show is refused as noise") {
  Random random(42, Stream::noise);
  for (int trial = 0; trial < 200; ++trial) {
    RecordSet set = random_set(random, 2);
    const double scale = std::pow(10.0, -6 + 12 * random.uniform()),
                 share = std::pow(10.0, -20 + 20 * random.uniform());
    for (Record& record : set.records) record.signal.y.row(1) *= scale;
    const double level =
        std::max(set.records[0].signal.y.row(1).norm(), set.records[1].signal.y.row(1).norm()) / std::sqrt(60.0);
    set.noise_std["y"] = share * level;
    CAPTURE(scale, share);
    if (share > 3e-16) CHECK_NOTHROW(require_sound_records(set, "r.json"));
    if (share < 2e-16)
      CHECK_THROWS_WITH(require_sound_records(set, "r.json"), Contains("r.json: $.noise_std.y: expected the standard"));
  }
  RecordSet planned = random_set(random, 1);
  planned.noise_std["not measured yet"] = 1e-300;
  CHECK_THROWS_WITH(require_sound_records(planned, "r.json"), Contains("$.noise_std.not measured yet"));
  planned.noise_std["not measured yet"] = 1e-30;
  CHECK_NOTHROW(require_sound_records(planned, "r.json"));
}

TEST_CASE("a validation record is refused exactly where it shares samples with a fitted one, by file or by number") {
  const Folder folder;
  for (const char* name : {"a.csv", "b.csv"}) write_file(folder / name, "t\n");
  std::filesystem::create_symlink(folder / "a.csv", folder / "link.csv");
  Random random(43, Stream::noise);
  int refused = 0;
  for (int trial = 0; trial < 300; ++trial) {
    RecordSet set = random_set(random, 2, 20 + random.integer(40));
    const char* names[] = {"a.csv", "b.csv", "link.csv", "./a.csv"};
    bool of_a[2];
    for (int i = 0; i < 2; ++i) {
      const Index which = random.integer(4);
      set.records[static_cast<std::size_t>(i)].file = names[which];
      set.records[static_cast<std::size_t>(i)].first = random.integer(150);
      of_a[i] = which != 1;
    }
    const Index n = set.records[0].signal.samples(), apart = std::abs(set.records[0].first - set.records[1].first);
    bool shared = of_a[0] == of_a[1] && apart < n;
    if (random.integer(4) == 0) {
      set.records[1].signal.u = set.records[0].signal.u;
      set.records[1].signal.y = set.records[0].signal.y;
      shared = true;
    }
    CAPTURE(trial, shared);
    if (shared)
      CHECK_THROWS_WITH(require_held_out(set, folder / "r.json"),
                        Contains("r.json: $.records[1]") && Contains("$.records[0]"));
    else
      CHECK_NOTHROW(require_held_out(set, folder / "r.json"));
    set.records[1].role = "estimation";
    CHECK_NOTHROW(require_held_out(set, folder / "r.json"));
    refused += shared;
  }
  CHECK(refused > 50);
  CHECK(refused < 250);
}

TEST_CASE("what is said of records is told with the file and the place in it") {
  Random random(44, Stream::noise);
  RecordSet set = random_set(random, 3);
  set.records[2].file = "r0.csv.gz";
  const auto placed = [&](const std::string& what) {
    try {
      at_records(set, "d/set.json", [&]() -> int { throw UserError(what); });
    } catch (const UserError& error) {
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  CHECK(placed("r1.csv: too short") == "d/set.json: $.records[1]: r1.csv: too short");
  CHECK(placed("r0.csv.gz: too short") == "d/set.json: $.records[2]: r0.csv.gz: too short");
  CHECK(placed("r0.csv: too short") == "d/set.json: $.records[0]: r0.csv: too short");
  CHECK(placed("noise_std: none for x") == "d/set.json: $.noise_std: none for x");
  CHECK(placed("the drive is constant") == "d/set.json: $.records: the drive is constant");
  CHECK_THROWS_AS(at_records(set, "d/set.json", []() -> int { throw MachineError("disk"); }), MachineError);
  CHECK_THROWS_WITH(at_records(set, "d/set.json", []() -> int { throw MachineError("disk"); }), "disk");
  CHECK(at_records(set, "d/set.json", [] { return 7; }) == 7);
  const Plant plant = plant_from(quarter_car_text);  // held at 1000 Hz
  for (const double hz : {1000.0, 500.0, 200.0, 100.0}) {
    set.sampling_hz = hz;
    CHECK_NOTHROW(require_hold_rate(plant, set, "d/set.json"));
    set.sampling_hz = 1.01 * hz;
    CHECK_THROWS_WITH(require_hold_rate(plant, set, "d/set.json"),
                      Contains("d/set.json: $.sampling_hz: ") && Contains("1000"));
  }
}
