// Sets of records as users bring them: what is read, what is refused, and what the refusal says.
#include "core/data/records.hpp"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/base/files.hpp"
#include "core/base/random.hpp"
#include "core/base/status.hpp"
#include "core/data/metrics.hpp"
#include "core/data/noise.hpp"
#include "tests/support/folder.hpp"

using namespace wheelhop;
using Catch::Contains;
using Catch::Equals;
namespace fs = std::filesystem;

namespace {

const std::vector<Channel> kInputs = {{"road", "m"}};
const std::vector<Channel> kOutputs = {{"travel", "m"}, {"acc", "m/s^2"}};

/// Columns t, road, travel, acc, extra at the rate; instants printed with `format`.
std::string record_text(int samples, double hz, const char* format = "{}", double start = 0) {
  std::string text = "t,road,travel,acc,extra\n";
  for (int k = 0; k < samples; ++k)
    text += fmt::format(fmt::runtime(format), start + k / hz) + fmt::format(",{},{},{},7\n", k, 10 + k, -k);
  return text;
}

/// A folder with one CSV file and a records.json; `load` reads them.
struct Set {
  test::Folder folder;
  explicit Set(const std::string& text, const std::string& name = "a.csv") { write_file(folder / name, text); }
  RecordSet load(const std::string& json) const {
    write_file(folder / "records.json", json);
    return load_records(folder / "records.json", kInputs, kOutputs);
  }
  RecordSet at(double hz) const {
    return load(fmt::format(R"({{"sampling_hz": {}, "records": [{{"file": "a.csv", "role": "estimation"}}]}})", hz));
  }
  RecordSet with(const std::string& members) const {
    return load(R"({"sampling_hz": 200, "records": [{"file": "a.csv", "role": "estimation", )" + members + "}]}");
  }
};

}  // namespace

TEST_CASE("records are loaded by channel name, in the order asked for, with range, skip, role and repeats") {
  const Set set(record_text(100, 200));
  const RecordSet r = set.load(R"({"sampling_hz": 200, "records": [
      {"file": "a.csv", "role": "estimation", "repeat_of": "d", "range": [10, 60], "skip_initial": 5},
      {"file": "a.csv", "role": "validation", "range": [60, 100]}], "noise_std": {"acc": 0.02, "extra": 1}})");
  REQUIRE(r.records.size() == 2);
  const Signal& s = r.records[0].signal;
  CHECK(s.samples() == 50);
  CHECK(s.u(0, 0) == 10);
  CHECK(s.y(0, 0) == 20);
  CHECK(s.y(1, 49) == -59);
  CHECK(s.skip == 5);
  CHECK(s.sample_time_s == 1.0 / 200);
  CHECK(s.outputs[1].unit == "m/s^2");
  CHECK(r.records[0].repeat_of == "d");
  CHECK(r.records[0].first == 10);
  CHECK(r.records[1].signal.u(0, 0) == 60);
  CHECK(r.noise_std.at("acc") == 0.02);
  CHECK(r.with_role("validation").size() == 1);
  CHECK(r.with_role("estimation")[0]->first == 10);
}

TEST_CASE("a set or a record tells how it starts, and what is written reads back") {
  const Set set(record_text(100, 200));
  CHECK(set.with(R"("range": [0, 50])").records[0].start == KnownStart{});
  CHECK(set.with(R"("start": "free")").records[0].start == KnownStart{});
  CHECK(set.with(R"("start": "rest")").records[0].start == KnownStart{true, {}, {}});
  const KnownStart given{false, {{"body", 0.01}}, {{"body", -0.2}, {"wheel", 0}}};
  const RecordSet read = set.load(R"({"sampling_hz": 200, "start": "rest", "records": [
      {"file": "a.csv", "role": "estimation"},
      {"file": "a.csv", "role": "validation", "start": {"displacement_m": {"body": 0.01},
       "velocity_m_per_s": {"body": -0.2, "wheel": 0}}}]})");
  CHECK(read.records[0].start.rest);
  CHECK(read.records[1].start == given);
  RecordSet written = read;
  for (Record& record : written.records) record.file.clear();
  const test::Folder other;
  write_records(other.path(), written);
  const RecordSet again = load_records(other / "records.json", kInputs, kOutputs);
  CHECK(again.records[0].start == read.records[0].start);
  CHECK(again.records[1].start == given);
  RecordSet turning = read;
  for (Record& record : turning.records) record.file.clear();
  turning.records[0].start = {.angle_rad = {{"motor", 1}}, .angular_velocity_rad_per_s = {{"motor", -2}}};
  const test::Folder third;
  write_records(third.path(), turning);
  CHECK(load_records(third / "records.json", kInputs, kOutputs).records[0].start == turning.records[0].start);
  CHECK_THROWS_WITH(set.with(R"("start": "resting")"), Contains("$.records[0].start: expected a known name"));
  CHECK_THROWS_WITH(set.with(R"("start": {"displacement": {}})"), Contains("$.records[0].start.displacement"));
  CHECK_THROWS_WITH(set.with(R"("start": {"displacement_m": {"body": "1"}})"),
                    Contains("$.records[0].start.displacement_m.body: expected a number"));
  CHECK_THROWS_WITH(set.with(R"("start": {"displacement_m": 3})"), Contains("an object of numbers by mass"));
}

TEST_CASE("a missing column names the file and the columns that are there") {
  const Set set("t,roda,acc,travel\n0,1,2,3\n0.005,1,2,3\n");
  CHECK_THROWS_WITH(
      set.at(200),
      Contains(
          "a.csv: expected a column \"road\", found only: t, roda, acc, travel; did you mean \"road\" by \"roda\"?"));
  // A column that is another channel's is not what was meant.
  const Set taken("t,road,acc_1,force\n0,1,2,3\n0.005,1,2,3\n");
  write_file(taken.folder / "r.json", R"({"sampling_hz": 200, "records": [{"file": "a.csv", "role": "estimation"}]})");
  CHECK_THROWS_WITH(load_records(taken.folder / "r.json", kInputs, {{"acc_1", ""}, {"acc_2", ""}}),
                    Contains("expected a column \"acc_2\"") && !Contains("did you mean"));
  const Set no_time("clock,road,acc,travel\n0,1,2,3\n0.005,1,2,3\n");
  CHECK_THROWS_WITH(no_time.at(200), Contains("a.csv: expected a column \"t\", found only: clock, road"));
}

TEST_CASE("instants printed with few decimals, an offset or binary round-off still count as uniform") {
  for (const char* format : {"{}", "{:.3f}", "{:.4f}", "{:.9g}", "{:.6e}"})
    CHECK(Set(record_text(3000, 200, format)).at(200).records[0].signal.samples() == 3000);
  for (const char* format : {"{}", "{:.7f}", "{:.4f}", "{:.3f}", "{:.6g}"})
    CHECK_NOTHROW(Set(record_text(20000, 610.3515625, format)).at(610.3515625));
  CHECK_NOTHROW(Set(record_text(20000, 610.3515625)).at(610.35));
  CHECK_NOTHROW(Set(record_text(20000, 750, "{:.12g}")).at(750));
  CHECK_NOTHROW(Set(record_text(2000, 400, "{:.3f}")).at(400));
  CHECK_NOTHROW(Set(record_text(2000, 200, "{}", 1e6)).at(200));
  CHECK_NOTHROW(Set(record_text(2000, 200, "{:.3f}", -3)).at(200));
  CHECK_NOTHROW(Set(record_text(500, 0.25)).at(0.25));
  CHECK_NOTHROW(Set(record_text(2, 200)).at(200));
  std::string text = "t,road,travel,acc\n";
  double t = 0;
  for (int k = 0; k < 5000; ++k, t += 0.005) text += fmt::format("{},0,0,0\n", t);
  CHECK_NOTHROW(Set(text).at(200));
}

TEST_CASE("a wrong rate is refused with both rates") {
  CHECK_THROWS_WITH(Set(record_text(1000, 200)).at(500),
                    Contains("a.csv: line 3: expected t at sampling_hz = 500 Hz, found 200 Hz"));
  CHECK_THROWS_WITH(Set(record_text(1000, 200, "{:.3f}")).at(201), Contains("sampling_hz = 201 Hz, found 200 Hz"));
  CHECK_THROWS_WITH(Set(record_text(2, 200)).at(100), Contains("found 200 Hz"));
  CHECK_THROWS_WITH(Set(record_text(20000, 610.3515625, "{:.4f}")).at(611), Contains("found 610.35"));
  // A time column in milliseconds.
  CHECK_THROWS_WITH(Set(record_text(100, 0.2)).at(200), Contains("sampling_hz = 200 Hz, found 0.2 Hz"));
}

TEST_CASE("a lost sample, a shifted instant, a repeated one and a step back are refused at their line") {
  const auto edit = [](int line, const std::string& instant, const char* format = "{}") {
    std::string text = record_text(1000, 200, format);
    std::size_t begin = 0;
    for (int i = 1; i < line; ++i) begin = text.find('\n', begin) + 1;
    if (instant.empty()) return text.erase(begin, text.find('\n', begin) + 1 - begin);
    return text.replace(begin, text.find(',', begin) - begin, instant);
  };
  CHECK_THROWS_WITH(Set(edit(502, "")).at(200),
                    Contains("a.csv: line 502: expected uniform sampling, found a step of 0.01 s in t where 0.005 s"));
  CHECK_THROWS_WITH(Set(edit(12, "", "{:.3f}")).at(200), Contains("line 12: expected uniform"));
  CHECK_THROWS_WITH(Set(edit(502, "2.501", "{:.3f}")).at(200), Contains("line 502: expected uniform"));
  CHECK_THROWS_WITH(Set(edit(502, "2.50001")).at(200), Contains("line 502: expected uniform"));
  CHECK_NOTHROW(Set(edit(502, "2.5000001")).at(200));
  CHECK_THROWS_WITH(Set(edit(502, "2.495")).at(200),
                    Contains("line 502: expected t to increase, found 2.495 after 2.495"));
  CHECK_THROWS_WITH(Set(edit(502, "-1")).at(200), Contains("line 502: expected t to increase, found -1 after"));
  // The damage lies outside the range that is used.
  CHECK_NOTHROW(Set(edit(502, "")).with(R"("range": [0, 500])"));
  CHECK_NOTHROW(Set(edit(502, "")).with(R"("range": [500, 999])"));
  CHECK_THROWS_WITH(Set(edit(502, "")).with(R"("range": [400, 600])"), Contains("line 502"));
}

TEST_CASE("ranges and skips that leave nothing or leave the file are refused") {
  const Set set(record_text(100, 200));
  CHECK(set.with(R"("range": [0, 100])").records[0].signal.samples() == 100);
  CHECK_THROWS_WITH(
      set.with(R"("range": [0, 101])"),
      Contains("records.json: $.records[0].range: expected samples within the file, which has 100, found [0, 101)"));
  CHECK_THROWS_WITH(set.with(R"("range": [50, 50])"),
                    Contains("$.records[0].range: expected [first, last) with first < last"));
  CHECK_THROWS_WITH(set.with(R"("range": [60, 50])"), Contains("first < last"));
  CHECK_THROWS_WITH(set.with(R"("range": [-1, 50])"),
                    Contains("$.records[0].range[0]: expected a whole number >= 0, found -1"));
  CHECK_THROWS_WITH(set.with(R"("range": [0])"), Contains("expected [first, last) in samples, found an array of 1"));
  CHECK_THROWS_WITH(set.with(R"("range": 5)"), Contains("expected an array"));
  CHECK_THROWS_WITH(set.with(R"("range": [0, 1])"), Contains("at least two samples"));
  CHECK(set.with(R"("skip_initial": 99)").records[0].signal.skip == 99);
  CHECK_THROWS_WITH(set.with(R"("skip_initial": 100)"),
                    Contains("$.records[0].skip_initial: expected fewer than the 100 samples"));
  CHECK_THROWS_WITH(set.with(R"("range": [0, 20], "skip_initial": 20)"), Contains("fewer than the 20 samples"));
  CHECK_THROWS_WITH(set.with(R"("skip_initial": -1)"), Contains(">= 0, found -1"));
  CHECK_THROWS_WITH(Set("t,road,travel,acc\n0,1,2,3\n").at(200), Contains("at least two samples"));
}

TEST_CASE("every mistake in records.json is named with its path") {
  const Set set(record_text(100, 200));
  const auto refused = [&](const std::string& json, const std::string& text) {
    CHECK_THROWS_WITH(set.load(json), Contains(text));
  };
  refused(R"({"sampling_hz": 200, "records": []})", "$.records: expected at least one record");
  refused(R"({"sampling_hz": 200})", "expected the key \"records\"");
  refused(R"({"records": []})", "$.records: expected at least one record");
  refused(R"({"records": [{"file": "a.csv", "role": "estimation"}]})",
          "a.csv: expected \"sampling_hz\", or the unit of column \"t\", found neither; say \"sampling_hz\": 200");
  refused(R"({"sampling_hz": 0, "records": []})", "$.sampling_hz: expected a rate > 0 in Hz, found 0");
  refused(R"({"sampling_hz": -5, "records": []})", "a rate > 0");
  refused(R"({"sampling_hz": "200", "records": []})", "expected a number, found \"200\"");
  refused(R"({"sampling_hz": 200, "records": {}})", "$.records: expected an array");
  refused(R"({"sampling_hz": 200, "records": [{}]})", "$.records[0]: expected the key \"file\"");
  refused(R"({"sampling_hz": 200, "records": [{"file": "", "role": "estimation"}]})", "the name of a file");
  refused(R"({"sampling_hz": 200, "records": [{"file": "a.csv"}]})", "expected the key \"role\"");
  refused(R"({"sampling_hz": 200, "records": [{"file": "a.csv", "role": "estimate"}]})",
          "$.records[0].role: expected a known name, found \"estimate\"; known names: estimation, validation; did you "
          "mean \"estimation\"?");
  refused(R"({"sampling_hz": 200, "records": [{"file": "b.csv", "role": "estimation"}]})",
          "b.csv: cannot read: No such file");
  refused(R"({"sampling_hz": 200, "records": [{"file": "a.csv", "role": "estimation", "skip": 3}]})",
          "$.records[0].skip: expected a known name, found \"skip\"; known names: file, role, repeat_of, skip_initial, "
          "range, columns, format, time, lost_samples, start; did you mean \"skip_initial\"?");
  refused(R"({"sampling_hz": 200, "records": [{"file": "a.csv", "role": "estimation"}], "noise": 1})",
          "$.noise: expected a known name");
  refused(R"({"sampling_hz": 200, "records": [{"file": "a.csv", "role": "estimation"}], "noise_std": {"ac": 1}})",
          "$.noise_std.ac: expected a known name, found \"ac\"; known names: road, travel, acc, extra; did you mean "
          "\"acc\"?");
  refused(R"({"sampling_hz": 200, "records": [{"file": "a.csv", "role": "estimation"}], "noise_std": {"acc": 0}})",
          "$.noise_std.acc: expected a number > 0, found 0");
  refused(R"({"sampling_hz": 200, "records": [{"file": "a.csv", "role": "estimation"}], "noise_std": 3})",
          "an object of standard deviations");
  refused(R"({"sampling_hz": 200, "sampling_hz": 200, "records": []})", "found \"sampling_hz\" again");
}

TEST_CASE("what is wrong with the file of a record is told with the place that names it") {
  const Set set(record_text(100, 200));
  write_file(set.folder / "bad.csv", "t,road,travel,acc\n0,1,2,3\n0.005,1,2,x\n");
  write_file(set.folder / "slow.csv", record_text(100, 50));
  write_file(set.folder / "other.csv", "t,road\n0,1\n0.005,1\n");
  for (const char* name : {"bad.csv", "slow.csv", "other.csv", "absent.csv", "a.xlsx"})
    for (const int before : {0, 1, 2}) {
      Json records = Json::array();
      for (int i = 0; i < before; ++i) records.push_back({{"file", "a.csv"}, {"role", "estimation"}});
      records.push_back({{"file", name}, {"role", "validation"}});
      const std::string text = Json{{"sampling_hz", 200}, {"records", records}}.dump();
      CHECK_THROWS_WITH(set.load(text),
                        Contains(fmt::format("records.json: $.records[{}].file: ", before)) && Contains(name));
    }
}

namespace {

RecordSet sample_set() {
  RecordSet set;
  set.sampling_hz = 200;
  Random random(9, Stream::noise);
  for (const char* file : {"est.csv", "est.csv.gz", "val.mat", ""}) {
    Record record;
    record.file = file;
    record.role = record.file == "val.mat" ? "validation" : "estimation";
    if (record.file.starts_with("est")) record.repeat_of = "drive_1";
    record.signal.u = random.normal(1, 150);
    record.signal.y = random.normal(2, 150);
    record.signal.sample_time_s = 1.0 / 200;
    record.signal.skip = record.file.empty() ? 12 : 0;
    record.signal.inputs = kInputs;
    record.signal.outputs = kOutputs;
    set.records.push_back(record);
  }
  set.noise_std = {{"acc", 0.125}};
  return set;
}

}  // namespace

TEST_CASE("a set of records survives writing and reading in every format, bit for bit") {
  const test::Folder folder;
  const RecordSet set = sample_set();
  write_records(folder / "new" / "set", set);
  const RecordSet again = load_records(folder / "new" / "set" / "records.json", kInputs, kOutputs);
  REQUIRE(again.records.size() == 4);
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(again.records[i].signal.u == set.records[i].signal.u);
    CHECK(again.records[i].signal.y == set.records[i].signal.y);
    CHECK(again.records[i].signal.skip == set.records[i].signal.skip);
    CHECK(again.records[i].role == set.records[i].role);
    CHECK(again.records[i].repeat_of == set.records[i].repeat_of);
  }
  CHECK(again.records[3].file == "record_4.csv");
  CHECK(again.noise_std == set.noise_std);
  CHECK(read_file(folder / "new" / "set" / "est.csv").find("\n0.015,") != std::string::npos);
}

TEST_CASE("a set that cannot be written in full leaves no records.json") {
  const test::Folder folder;
  RecordSet set = sample_set();
  set.records[1].signal.y(1, 3) = std::nan("");
  CHECK_THROWS_WITH(write_records(folder / "x", set), Contains("channel \"acc\" is not finite at sample 3"));
  CHECK_FALSE(fs::exists(folder / "x" / "records.json"));
  set = sample_set();
  set.records[1].file = "est.csv";
  CHECK_THROWS_AS(write_records(folder / "y", set), std::invalid_argument);
  set.records[1].file = "../up.csv";
  CHECK_THROWS_AS(write_records(folder / "y", set), std::invalid_argument);
  set = sample_set();
  set.records[0].role = "training";
  CHECK_THROWS_AS(write_records(folder / "y", set), std::invalid_argument);
  CHECK_FALSE(fs::exists(folder / "y"));
  write_file(folder / "file", "");
  CHECK_THROWS_WITH(write_records(folder / "file", sample_set()), Contains("file: cannot"));
}

TEST_CASE("noise has the asked ratio a channel, leaves the inputs alone and repeats with its seed") {
  Signal clean;
  clean.u = Random(1, Stream::road).normal(1, 40000);
  clean.y = Random(2, Stream::road).normal(2, 40000);
  clean.y.row(1) = (100 * clean.y.row(1).array() + 300).matrix();
  Signal noisy = clean, again = clean;
  Random random(5, Stream::noise), same(5, Stream::noise);
  const Vector deviation = add_noise(noisy, 40, random);
  CHECK(deviation == add_noise(again, 40, same));
  CHECK(noisy.y == again.y);
  CHECK(noisy.u == clean.u);
  CHECK(deviation.isApprox(0.01 * rms(clean.y), 1e-14));
  const Matrix noise = noisy.y - clean.y;
  for (Index i = 0; i < 2; ++i) {
    CHECK(rms(noise)(i) == Approx(deviation(i)).epsilon(0.02));
    CHECK(std::abs(noise.row(i).mean()) < 5 * deviation(i) / 200);
  }
  CHECK(std::abs(noise.row(0).dot(noise.row(1))) < 5 * 200 * deviation(0) * deviation(1));
  Signal untouched = clean;
  CHECK(add_noise(untouched, std::numeric_limits<double>::infinity(), random).isZero());
  CHECK(untouched.y == clean.y);
  CHECK_THROWS_AS(add_noise(untouched, std::nan(""), random), std::invalid_argument);
}

TEST_CASE("coloured noise has the asked ratio too, and the correlation of a first-order low-pass") {
  Signal clean;
  clean.sample_time_s = 0.005;
  clean.u = Matrix::Zero(1, 200000);
  clean.y = Random(2, Stream::road).normal(1, 200000);
  for (const double corner_hz : {2.0, 10.0, 50.0}) {
    Signal noisy = clean;
    Random random(6, Stream::noise);
    const Vector deviation = add_noise(noisy, 20, random, corner_hz);
    CHECK(deviation(0) == Approx(0.1 * rms(clean.y)(0)));
    const Matrix noise = noisy.y - clean.y;
    const double a = std::exp(-2 * std::numbers::pi * corner_hz * clean.sample_time_s);
    // Correlated samples count as (1 - a) / (1 + a) of independent ones.
    const double scatter = 4 * std::sqrt(0.5 * (1 + a) / (1 - a) / 200000);
    CHECK(rms(noise)(0) == Approx(deviation(0)).epsilon(scatter));
    const double next = noise.leftCols(199999).row(0).dot(noise.rightCols(199999).row(0)) / noise.squaredNorm();
    CHECK(next == Approx(a).margin(4 * std::sqrt((1 - a * a) / 200000)));
  }
}

TEST_CASE("public measurement records load at their own rates") {
  const fs::path data = WHEELHOP_DATA;
  if (!fs::exists(data / "silverbox_snls80mv.csv.gz")) {
    WARN("skipped: no measured records in " << data);
    return;
  }
  struct Known {
    const char* file;
    double hz;
    Index samples;
    std::vector<Channel> inputs, outputs;
  };
  const std::vector<Known> files = {
      {"silverbox_snls80mv.csv.gz", 610.3515625, 131072, {{"u", "V"}}, {{"y", "V"}}},
      {"quanser_qc_sweepA_1.csv.gz", 500, 14951, {{"u_fc", "N"}, {"u_zr", "m"}}, {{"y_zs", "m"}, {"y_zus", "m"}}},
      {"boucwen_train_multisine.csv.gz", 750, 40960, {{"u", "N"}}, {{"y", "m"}}},
      {"mrdamper_utfpr_0V.csv", 100, 3001, {{"u_vel", ""}}, {{"y_force", "N"}}},
      {"cascaded_tanks_test.csv", 0.25, 1024, {{"u", "V"}}, {{"y", "V"}}},
      {"ced_unif_low.csv", 50, 500, {{"u", "V"}}, {{"y", "V"}}}};
  const test::Folder folder;
  for (const Known& known : files) {
    INFO(known.file);
    const Json json = {{"sampling_hz", known.hz},
                       {"records", Json::array({{{"file", (data / known.file).string()}, {"role", "validation"}}})}};
    write_json(folder / "records.json", json);
    const RecordSet set = load_records(folder / "records.json", known.inputs, known.outputs);
    CHECK(set.records[0].signal.samples() == known.samples);
  }
}
