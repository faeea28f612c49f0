// Files as loggers write them: drawn in every way that is known, read right or refused with what records.json has to
// say.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <iostream>
#include <numbers>
#include <set>

#include "core/base/files.hpp"
#include "core/base/random.hpp"
#include "core/base/status.hpp"
#include "core/data/records.hpp"
#include "tests/support/folder.hpp"

using namespace wheelhop;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

const std::vector<Channel> kDrives = {{"road", "m"}};
const std::vector<Channel> kReadings = {{"travel", "m"}, {"acc", "m/s^2"}};

/// One way to write a record, and what records.json may have to say of it.
struct Writing {
  char separator = ',', decimal = '.';
  std::string preamble, comment, line_end = "\n", mark;
  bool byte_order_mark = false, trailing = false, quoted = false, unit_row = false, units_in_names = false;
  bool text_column = false, empty_column = false, time_unit_told = false;
  std::string time_name = "t", time_unit = "s";
  enum Clock { shortest, micro, milli, single, date, day } clock = shortest;
  double hz = 200, start = 0, jitter = 0;
  struct Unit {
    std::string name;
    double factor;
  } road{"m", 1}, travel{"m", 1}, acc{"m/s^2", 1};
  std::set<int> lost;  ///< samples that are not in the file
  int samples = 500;
  bool rate_said = false;

  double truth(int channel, int k) const {
    const double t = k / hz, pi = std::numbers::pi;
    if (channel == 0) return 0.013 * std::sin(2 * pi * 3 * t) + 0.002 * std::cos(2 * pi * 5.5 * t + 0.3);
    if (channel == 1) return 0.021 * std::sin(2 * pi * 2.1 * t + 1) - 0.004;
    return 9.1 * std::cos(2 * pi * 4.3 * t) + 2.3;
  }
};

template <class T>
T pick(Random& random, std::initializer_list<T> items) {
  return *(items.begin() + random.integer(static_cast<Index>(items.size())));
}

Writing draw(Random& random) {
  Writing w;
  const auto chance = [&](double share) { return random.uniform() < share; };
  w.separator = pick(random, {',', ',', ';', ';', '\t', '|', ' '});
  w.decimal = chance(w.separator == ';' ? 0.7 : 0.25) ? ',' : '.';
  w.quoted = chance(0.2) || (w.separator == ',' && w.decimal == ',');
  for (Index lines = random.integer(5); lines > 0; --lines)
    w.preamble +=
        pick<std::string>(random, {"Recorder: rig 3\n", "Date: 2024-01-05 10:11:12\n", "\n", "Rate: 200 Hz\n"});
  w.comment = chance(0.25) ? pick<std::string>(random, {"#", "# ", "% "}) : "";
  w.line_end = pick<std::string>(random, {"\n", "\n", "\r\n", "\r"});
  w.byte_order_mark = chance(0.25);
  w.trailing = w.separator != ' ' && chance(0.25);
  w.unit_row = chance(0.3);
  w.units_in_names = !w.unit_row && chance(0.4);
  w.text_column = chance(0.3);
  w.empty_column = chance(0.3);
  w.time_name = chance(0.25) ? "Time" : "t";
  w.hz = pick(random, {200.0, 100.0, 256.0, 500.0, 1000.0, 610.3515625});
  w.clock =
      pick(random, {Writing::shortest, Writing::micro, Writing::milli, Writing::single, Writing::date, Writing::day});
  // A float32 of 86398 s is good to 8 ms, in which lost samples hide.
  w.start = w.clock == Writing::single ? pick(random, {0.0, 100.0}) : pick(random, {0.0, 100.0, 86398.0});
  const bool plain = w.clock == Writing::shortest || w.clock == Writing::micro;
  if (plain) w.time_unit = pick<std::string>(random, {"s", "s", "ms", "us"});
  if (plain && w.time_unit == "s" && chance(0.3)) w.jitter = 0.01;
  if (w.unit_row || w.units_in_names) {
    w.time_unit_told = w.clock != Writing::date && w.clock != Writing::day;
    w.road = pick<Writing::Unit>(random, {{"m", 1}, {"mm", 1e-3}, {"in", 0.0254}, {"inch", 0.0254}});
    w.travel = pick<Writing::Unit>(random, {{"m", 1}, {"mm", 1e-3}, {"um", 1e-6}});
    w.acc =
        pick<Writing::Unit>(random, {{"m/s^2", 1}, {"m/s\xc2\xb2", 1}, {"m/s2", 1}, {"g", 9.80665}, {"mm/s^2", 1e-3}});
  }
  if (chance(0.3))
    for (int gap = 0; gap < 3; ++gap) {
      const int first = 40 + 140 * gap + static_cast<int>(random.integer(100));
      const auto count = static_cast<int>(random.integer(4)) + (gap == 0);
      for (int k = 0; k < std::min(count, 3); ++k) w.lost.insert(first + k);
    }
  if (plain && w.time_name == "t" && chance(0.2)) {
    w.time_name = "t_" + w.time_unit;
    w.time_unit_told = true;
  }
  w.rate_said = chance(0.5);
  return w;
}

std::string instant_text(const Writing& w, int k, double jitter) {
  const double t = w.start + (k + jitter) / w.hz;
  switch (w.clock) {
    case Writing::shortest:
      if (jitter != 0) return fmt::format("{:.7f}", t);
      return w.time_unit == "s" ? fmt::format("{}", t) : fmt::format("{:.4f}", t * (w.time_unit == "ms" ? 1e3 : 1e6));
    case Writing::micro:
      return w.time_unit == "s" ? fmt::format("{:.6f}", t)
                                : fmt::format("{:.3f}", t * (w.time_unit == "ms" ? 1e3 : 1e6));
    case Writing::milli: return fmt::format("{:.3f}", t);
    case Writing::single: return fmt::format("{:.9g}", static_cast<double>(static_cast<float>(t)));
    default: {
      const auto ms = static_cast<long>(std::llround(t * 1000));
      const long day = ms / 86400000, rest = ms % 86400000;
      const std::string clock =
          fmt::format("{:02}:{:02}:{:02}.{:03}", rest / 3600000, rest / 60000 % 60, rest / 1000 % 60, rest % 1000);
      if (w.clock == Writing::day) return clock;
      return fmt::format("2024-02-{:02}{}{}", 28 + day, w.separator == ' ' ? 'T' : ' ', clock);
    }
  }
}

std::string in_quotes(const Writing& w, const std::string& text) { return w.quoted ? "\"" + text + "\"" : text; }

std::string written(const Writing& w, Random& random) {
  std::string out;
  const auto add_row = [&](const std::vector<std::string>& cells, const std::string& before = "") {
    out += before;
    for (std::size_t i = 0; i < cells.size(); ++i) out += (i ? std::string(1, w.separator) : "") + cells[i];
    if (w.trailing) out += w.separator;
    out += "\n";
  };
  const auto name = [&](const std::string& base, const std::string& unit) {
    const std::string blank = w.separator == ' ' && !w.quoted ? "" : " ";
    return in_quotes(w, w.units_in_names && !unit.empty() ? base + blank + "[" + unit + "]" : base);
  };
  out += w.preamble;
  const std::string time_unit = w.time_unit_told ? w.time_unit : "";
  std::vector<std::string> names = {name(w.time_name, time_unit), name("acc", w.acc.name), name("road", w.road.name),
                                    name("travel", w.travel.name)};
  std::vector<std::string> units = {time_unit.empty() ? "-" : time_unit, w.acc.name, w.road.name, w.travel.name};
  if (w.text_column) {
    names.insert(names.begin() + 1, "state");
    units.insert(units.begin() + 1, "-");
  }
  if (w.empty_column) {
    names.emplace_back("gps");
    units.emplace_back("-");
  }
  add_row(names, w.comment);
  if (w.unit_row) add_row(units, w.comment);
  for (int k = 0; k < w.samples; ++k) {
    const double late = w.jitter * random.normal();
    if (w.lost.contains(k)) continue;
    const auto number = [&](std::string text) {
      if (w.decimal == ',') std::replace(text.begin(), text.end(), '.', ',');
      return in_quotes(w, text);
    };
    std::vector<std::string> cells = {number(instant_text(w, k, late)),
                                      number(fmt::format("{}", w.truth(2, k) / w.acc.factor)),
                                      number(fmt::format("{}", w.truth(0, k) / w.road.factor)),
                                      number(fmt::format("{}", w.truth(1, k) / w.travel.factor))};
    if (w.text_column)
      cells.insert(cells.begin() + 1, k % 7 == 3 ? "\"door; open, loud|\"" : w.separator == ' ' ? "ok" : "");
    if (w.empty_column) cells.emplace_back(k % 5 == 0 && k < 300 ? "1" : "NaN");
    add_row(cells);
  }
  if (w.line_end != "\n") {
    std::string other;
    for (const char c : out) other += c == '\n' ? w.line_end : std::string(1, c);
    out = other;
  }
  return (w.byte_order_mark ? "\xef\xbb\xbf" : "") + out;
}

/// All that may have to be said.
Json said_in_full(const Writing& w) {
  Json out = {{"sampling_hz", w.hz}, {"records", {{{"file", "a.csv"}, {"role", "estimation"}}}}};
  out["time"] = {{"column", w.time_name}};
  if (w.clock != Writing::date && w.clock != Writing::day) out["time"]["unit"] = w.time_unit;
  out["format"] = {{"decimal", std::string(1, w.decimal)}};
  if (!w.lost.empty()) out["lost_samples"] = "bridge";
  return out;
}

/// How far the numbers of a set are from the truth.
void check_right(const Writing& w, const RecordSet& set, const std::string& text) {
  CAPTURE(text.substr(0, 600));
  CHECK(std::abs(set.sampling_hz / w.hz - 1) < 5e-3);
  REQUIRE(set.records.size() == 1);
  const Signal& signal = set.records[0].signal;
  REQUIRE(signal.samples() == w.samples);
  const double sizes[] = {0.013, 0.021, 9.1};
  for (int channel = 0; channel < 3; ++channel)
    for (int k = 0; k < w.samples; ++k) {
      const double read = channel == 0 ? signal.u(0, k) : signal.y(channel - 1, k);
      const double allowed = (w.lost.contains(k) ? 0.02 : 1e-9) * sizes[channel];
      if (!(std::abs(read - w.truth(channel, k)) <= allowed)) {
        CAPTURE(channel, k, read, w.truth(channel, k));
        FAIL_CHECK("read wrong");
        return;
      }
    }
}

RecordSet load(const test::Folder& folder, const Json& json) {
  write_json(folder / "records.json", json);
  return load_records(folder / "records.json", kDrives, kReadings);
}

}  // namespace

TEST_CASE("files written in every way are read right, or refused with what records.json has to say, never read wrong") {
  const test::Folder folder;
  int at_once = 0, told = 0;
  for (std::uint64_t i = 0; i < 240; ++i) {
    Random random(17, Stream::noise, i);
    const Writing w = draw(random);
    const std::string text = written(w, random);
    CAPTURE(i, w.separator, w.decimal, w.clock, w.hz, w.time_unit, text.substr(0, 400));
    write_file(folder / "a.csv", text);
    Json little = {{"records", {{{"file", "a.csv"}, {"role", "estimation"}}}}};
    if (w.rate_said) little["sampling_hz"] = w.hz;
    std::string refusal;
    try {
      check_right(w, load(folder, little), text);
      ++at_once;
      CHECK(w.lost.empty());
      continue;
    } catch (const UserError& error) {
      refusal = error.what();
    }
    ++told;
    CAPTURE(refusal);
    const bool helps = refusal.find("say \"") != std::string::npos;
    CHECK(helps);
    CHECK(refusal.find('\n') == std::string::npos);
    // What is refused has a reason: the unit of time beside no rate or another one, or lost samples.
    const bool unit_missing = !w.time_unit_told && w.clock != Writing::date && w.clock != Writing::day;
    const bool reason = !w.lost.empty() || (unit_missing && (!w.rate_said || w.time_unit != "s"));
    CHECK(reason);
    check_right(w, load(folder, said_in_full(w)), text);
  }
  CHECK(at_once > 40);
  CHECK(told > 40);
}

TEST_CASE("marks that may be decimal or between thousands are refused until records.json settles them") {
  const test::Folder folder;
  // Every number has one group of three digits behind its mark.
  Random random(3, Stream::noise);
  for (const char mark : {',', '.'}) {
    std::string text = "t;road;travel;acc\n";
    Matrix values(3, 50);
    for (int k = 0; k < 50; ++k) {
      text += fmt::format("{}", k);
      for (int i = 0; i < 3; ++i) {
        const Index whole = 1 + random.integer(99), part = random.integer(1000);
        values(i, k) = static_cast<double>(1000 * whole + part);
        text += fmt::format(";{}{}{:03}", whole, mark, part);
      }
      text += "\n";
    }
    write_file(folder / "a.csv", text);
    Json json = {{"sampling_hz", 1}, {"records", {{{"file", "a.csv"}, {"role", "estimation"}}}}};
    CHECK_THROWS_WITH(load(folder, json), Contains("line 2, column 3") &&
                                              Contains(fmt::format("\"format\": {{\"decimal\": \"{}\"}}", mark)) &&
                                              Contains(fmt::format("\"format\": {{\"thousands\": \"{}\"}}", mark)));
    json["format"] = {{"thousands", std::string(1, mark)}};
    const Signal groups = load(folder, json).records[0].signal;
    CHECK(groups.u.row(0) == values.row(0));
    CHECK(groups.y == values.bottomRows(2));
    json["format"] = {{"decimal", std::string(1, mark)}};
    const Signal decimals = load(folder, json).records[0].signal;
    CHECK((1000 * decimals.y - values.bottomRows(2)).cwiseAbs().maxCoeff() < 1e-9);
    // One number that can only be decimal settles all.
    text.replace(text.rfind(mark), 1, fmt::format("{}{}", mark, 7));
    write_file(folder / "a.csv", text);
    json.erase("format");
    CHECK((1000 * load(folder, json).records[0].signal.u - values.topRows(1)).cwiseAbs().maxCoeff() < 1e-9);
  }
}

TEST_CASE("what is not used is not judged: other columns, and samples outside the range") {
  const test::Folder folder;
  std::string text = "t,road,note,travel,acc,note\n";
  for (int k = 0; k < 100; ++k)
    text += fmt::format("{},{},{},{},{},\n", k == 3 ? "never" : fmt::format("{}", k / 200.0),
                        k < 20 ? "NaN" : fmt::format("{}", k), k % 2 ? "" : "a text", k > 80 ? "" : "1", -k);
  write_file(folder / "a.csv", text);
  Json json = {{"sampling_hz", 200}, {"records", {{{"file", "a.csv"}, {"role", "estimation"}, {"range", {20, 81}}}}}};
  const Signal signal = load(folder, json).records[0].signal;
  CHECK(signal.samples() == 61);
  CHECK(signal.u(0, 0) == 20);
  CHECK(signal.y(1, 60) == -80);
  json["records"][0]["range"] = {19, 81};
  CHECK_THROWS_WITH(load(folder, json),
                    Contains("line 21, column 7: expected a finite number for \"road\", found NaN"));
  json["records"][0]["range"] = {20, 82};
  CHECK_THROWS_WITH(load(folder, json), Contains("line 83") && Contains("for \"travel\", found an empty cell"));
  json["records"][0]["range"] = {2, 10};
  CHECK_THROWS_WITH(load(folder, json), Contains("line 4") || Contains("line 5"));
  // A column that stands there twice is asked for by its number.
  json["records"][0]["range"] = {20, 81};
  json["columns"] = {{"road", "note"}};
  CHECK_THROWS_WITH(load(folder, json), Contains("expected one column \"note\", found columns 3 and 6"));
}

TEST_CASE("units that are not known or of another dimension are refused, voltages go by their sensitivity") {
  const test::Folder folder;
  const auto with = [&](const std::string& header, const Json& members) {
    std::string text = header + "\n";
    for (int k = 0; k < 50; ++k) text += fmt::format("{},{},{},{}\n", k / 200.0, k, 2 * k, 3 * k);
    write_file(folder / "a.csv", text);
    Json json = {{"sampling_hz", 200}, {"records", {{{"file", "a.csv"}, {"role", "estimation"}}}}};
    json.update(members);
    return load(folder, json).records[0];
  };
  const Record plain = with("t,road,travel,acc", Json::object());
  CHECK(plain.reading.empty());
  CHECK(plain.signal.u(0, 10) == 10);
  const Record converted = with("t [s],road [mm],travel (m),acc / g", Json::object());
  CHECK(converted.signal.u(0, 10) == Approx(0.010).epsilon(1e-12));
  CHECK(converted.signal.y(0, 10) == 20);
  CHECK(converted.signal.y(1, 10) == Approx(30 * 9.80665).epsilon(1e-12));
  REQUIRE(converted.reading.size() == 2);
  CHECK_THAT(converted.reading[0], Contains("road") && Contains("mm") && Contains("0.001"));
  CHECK_THROWS_WITH(with("t,road [cubit],travel,acc", Json::object()),
                    Contains("column \"road [cubit]\"") && Contains("found \"cubit\"") && Contains("say \"columns\""));
  CHECK_THROWS_WITH(with("t,road [N],travel,acc", Json::object()),
                    Contains("becomes \"m\"") && Contains("found \"N\""));
  // 100 mV/g: 30 mV are 0.3 g.
  const Record voltage = with("t,road,travel,acc [mV]", {{"columns", {{"acc", {{"sensitivity", "100 mV/g"}}}}}});
  CHECK(voltage.signal.y(1, 10) == Approx(0.3 * 9.80665).epsilon(1e-12));
  const Record scaled = with(
      "t,road,travel,x",
      {{"columns",
        {{"acc", {{"column", "x"}, {"unit", "V"}, {"scale", 2}, {"offset", -1}, {"sensitivity", "0.5 V/(m/s^2)"}}}}}});
  CHECK(scaled.signal.y(1, 10) == Approx((2 * 30 - 1) / 0.5).epsilon(1e-12));
  CHECK_THROWS_WITH(with("t,road,travel,acc", {{"columns", {{"acc", {{"sensitivity", "100 mV/g"}}}}}}),
                    Contains("$.columns.acc") && Contains("\"unit\": \"V\""));
}

TEST_CASE("a channel that no column tells is what records.json says throughout the record, in whatever order") {
  const test::Folder folder;
  Random random(2031, Stream::parameters);
  for (int drawn = 0; drawn < 20; ++drawn) {
    std::string text = "t,road,travel,acc\n";
    for (int k = 0; k < 60; ++k) text += fmt::format("{},{},{},{}\n", k / 200.0, k, 2 * k, 3 * k);
    write_file(folder / "a.csv", text);
    Json json = {{"sampling_hz", 200}, {"records", {{{"file", "a.csv"}, {"role", "estimation"}}}}};
    const std::vector<std::string> names = {"road", "travel", "acc"};
    std::vector<double> constant(3, 0);
    std::vector<bool> told(3);
    for (std::size_t i = 0; i < 3; ++i) {
      told[i] = random.uniform() < 0.5;
      constant[i] = random.normal();
      if (!told[i])
        (random.uniform() < 0.5 ? json : json["records"][0])["columns"][names[i]] = {{"value", constant[i]}};
    }
    if (random.uniform() < 0.3) json["resample_hz"] = 100;
    const Record record = load(folder, json).records[0];
    const Index k = record.signal.samples() / 2;
    const double at = 200 * record.signal.sample_time_s * static_cast<double>(k);
    CHECK(record.signal.u(0, k) == Approx(told[0] ? at : constant[0]).epsilon(1e-6));
    CHECK(record.signal.y(0, k) == Approx(told[1] ? 2 * at : constant[1]).epsilon(1e-6));
    CHECK(record.signal.y(1, k) == Approx(told[2] ? 3 * at : constant[2]).epsilon(1e-6));
    const std::string all = fmt::format("{}", fmt::join(record.reading, "; "));
    for (std::size_t i = 0; i < 3; ++i)
      CHECK((all.find(names[i] + ": " + fmt::format("{:g} throughout", constant[i])) != std::string::npos) == !told[i]);
  }
  Json json = {{"sampling_hz", 200}, {"records", {{{"file", "a.csv"}, {"role", "estimation"}}}}};
  json["columns"]["road"] = {{"value", 1}, {"unit", "mm"}};
  CHECK_THROWS_WITH(load(folder, json), Contains("$.columns.road") && Contains("unit"));
}

TEST_CASE("the only column whose name says time is read as that, in the unit of its name, and of two none") {
  const test::Folder folder;
  const auto read = [&](const std::string& header, double samples_per_number, const Json& time = nullptr) {
    std::string text = header + "\n";
    for (int k = 0; k < 50; ++k)
      text += fmt::format("{},{},{},{},{}\n", k / 200.0 * samples_per_number, k, 2 * k, 3 * k, 7);
    write_file(folder / "a.csv", text);
    Json json = {{"records", {{{"file", "a.csv"}, {"role", "estimation"}}}}};
    if (!time.is_null()) json["time"] = time;
    return load(folder, json);
  };
  for (const auto& [name, factor] : std::vector<std::pair<std::string, double>>{
           {"t_s", 1}, {"t_ms", 1e3}, {"time_us", 1e6}, {"Time (s)", 1}, {"timestamp [ms]", 1e3}, {"Zeit [s]", 1}}) {
    CAPTURE(name);
    const RecordSet set = read(name + ",road,travel,acc,more", factor);
    CHECK(set.sampling_hz == Approx(200).epsilon(1e-9));
    CHECK(set.records[0].signal.u(0, 10) == 10);
    REQUIRE_FALSE(set.records[0].reading.empty());
    CHECK_THAT(set.records[0].reading[0], Contains("time: column \"" + name + "\""));
  }
  CHECK_THROWS_WITH(read("time_s,road,travel,acc,timestamp", 1), Contains("say \"time\": \"time_s\""));
  CHECK_THROWS_WITH(read("x,road,travel,acc,y", 1), Contains("say \"time\": \"NAME\""));
  CHECK_THROWS_WITH(read("time_s,road,travel,acc,x", 1, "t"), Contains("expected a column \"t\""));
  CHECK(read("time_s,road,travel,acc,t_trigger", 1).sampling_hz == Approx(200).epsilon(1e-9));
}

TEST_CASE("a record overrides the set, and all are brought to one rate where that is asked for") {
  const test::Folder folder;
  const auto tone = [](double t) { return std::sin(2 * std::numbers::pi * 7 * t); };
  const auto file = [&](const std::string& name, double hz, const std::string& header, double unit) {
    std::string text = header + "\n";
    for (int k = 0; k < 4 * hz; ++k) text += fmt::format("{},{},{},1\n", k / hz * unit, tone(k / hz), 2 * tone(k / hz));
    write_file(folder / name, text);
  };
  file("slow.csv", 100, "t [s],road,travel,acc", 1);
  file("fast.csv", 1000, "clock [ms],road,stroke,acc", 1000);
  const Json json = {
      {"resample_hz", 250},
      {"records",
       {{{"file", "slow.csv"}, {"role", "estimation"}, {"skip_initial", 10}},
        {{"file", "fast.csv"}, {"role", "validation"}, {"time", "clock"}, {"columns", {{"travel", "stroke"}}}}}}};
  const RecordSet set = load(folder, json);
  CHECK(set.sampling_hz == 250);
  CHECK(set.records[0].signal.skip == 25);
  for (const Record& record : set.records) {
    CHECK(record.signal.sample_time_s == 1.0 / 250);
    CHECK(std::abs(record.signal.samples() - 1000) < 4);
    for (Index k = 100; k < 900; ++k) {
      REQUIRE(std::abs(record.signal.u(0, k) - tone(k / 250.0)) < 1e-5);
      REQUIRE(std::abs(record.signal.y(0, k) - 2 * tone(k / 250.0)) < 2e-5);
    }
    REQUIRE_FALSE(record.reading.empty());
    CHECK_THAT(record.reading.back(), Contains("resampled") && Contains("250 Hz"));
  }
  Json same = json;
  same.erase("resample_hz");
  CHECK_THROWS_WITH(load(folder, same), Contains("$.records[1]") && Contains("found 1000 Hz"));
}

TEST_CASE("a record is cut to its longest stretch without lost samples, and no long gap is bridged") {
  const test::Folder folder;
  Random random(6, Stream::noise);
  for (int i = 0; i < 10; ++i) {
    const Index first = 20 + random.integer(60), second = 200 + random.integer(60), count = 11 + random.integer(20);
    std::string text = "t,road,travel,acc\n";
    for (Index k = 0; k < 300; ++k)
      if (k != first && (k < second || k >= second + count))
        text += fmt::format("{},{},{},{}\n", static_cast<double>(k) / 200, k, 2 * k, 3 * k);
    write_file(folder / "a.csv", text);
    Json json = {{"sampling_hz", 200}, {"records", {{{"file", "a.csv"}, {"role", "estimation"}, {"skip_initial", 7}}}}};
    CHECK_THROWS_WITH(load(folder, json), Contains(fmt::format("line {}", first + 2)) && Contains("\"lost_samples\""));
    json["lost_samples"] = "bridge";
    CHECK_THROWS_WITH(load(folder, json), Contains(fmt::format("line {}", second + 1)) &&
                                              Contains(fmt::format("found {}", count)) && Contains("\"cut\""));
    json["lost_samples"] = "cut";
    const Record record = load(folder, json).records[0];
    REQUIRE(record.signal.samples() == second - first - 1);
    CHECK(record.signal.u(0, 0) == static_cast<double>(first + 1));
    CHECK(record.signal.skip == 7);
    CHECK(record.first == first);
    CHECK(record.file_end() == second - 1);
    CHECK(record.place(0) == fmt::format("line {}", first + 2));
    REQUIRE(record.reading.size() == 1);
    CHECK_THAT(record.reading[0], Contains(fmt::format("[{}, {})", first, second - 1)));
    // A range that leaves the gaps out needs nothing said.
    json.erase("lost_samples");
    json["records"][0]["range"] = {first, second - 1};
    CHECK(load(folder, json).records[0].signal.y == record.signal.y);
  }
}

TEST_CASE("files of other loggers are read right, or say what they need") {
  const fs::path folder = WHEELHOP_STRANGER;
  if (!fs::exists(folder / "file_preamble")) {
    std::cout << "skipped: no files of other loggers in " << folder << " (WHEELHOP_STRANGER)\n";
    return;
  }
  const std::vector<Channel> inputs = {{"road", "m"}};
  const std::vector<Channel> outputs = {
      {"suspension_displacement", "m"}, {"chassis_acceleration", "m/s^2"}, {"axle_acceleration", "m/s^2"}};
  const auto read = [&](const char* name) { return load_records(folder / name / "records.json", inputs, outputs); };
  const Signal truth = read("file_preamble").records[0].signal;
  REQUIRE(truth.samples() == 6000);
  const auto check_same = [&](const Signal& signal, Index first, double share) {
    const Index n = signal.samples();
    REQUIRE(first + n == truth.samples());
    CHECK((signal.u - truth.u.rightCols(n)).norm() <= share * truth.u.norm());
    for (Index i = 0; i < 3; ++i)
      CHECK((signal.y.row(i) - truth.y.row(i).rightCols(n)).norm() <= share * truth.y.row(i).norm());
  };
  for (const char* name : {"file_jitter_1pc", "file_semicolon_comma", "file_units_row", "file_unused_nan_col"}) {
    CAPTURE(name);
    check_same(read(name).records[0].signal, 0, 1e-12);
  }
  check_same(read("file_f32_repr9").records[0].signal, 0, 1e-6);
  check_same(read("file_nan_out_of_range").records[0].signal, 200, 1e-12);
  CHECK_THROWS_WITH(read("file_t_ms"), Contains("say \"time\": {\"unit\": \"ms\"}"));
  const test::Folder own;
  const std::string file = (folder / "file_t_ms" / "rec.csv.gz").string();
  write_json(own / "records.json",
             Json{{"time", {{"unit", "ms"}}}, {"records", {{{"file", file}, {"role", "estimation"}}}}});
  const RecordSet milli = load_records(own / "records.json", inputs, outputs);
  CHECK(milli.sampling_hz == 200);
  check_same(milli.records[0].signal, 0, 1e-12);
}
