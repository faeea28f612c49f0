// What reading a logger's file rests on: units, dates, grids of instants, bridges over lost samples, another rate.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <tuple>

#include "core/base/random.hpp"
#include "core/base/status.hpp"
#include "core/data/inspect.hpp"
#include "core/data/instant.hpp"
#include "core/data/lost_samples.hpp"
#include "core/data/resample.hpp"
#include "core/data/text_layout.hpp"
#include "core/data/time_axis.hpp"
#include "core/data/units.hpp"

using namespace wheelhop;
using Catch::Contains;

TEST_CASE("every spelling of a unit is the same unit, and conversion there and back is none") {
  using Spellings = std::vector<std::string>;
  for (const Spellings& same :
       {Spellings{"m/s^2", "m/s\xc2\xb2", "m/s\xb2", "m/s2", "m/s/s", "m s^-2", "m*s^-2", "[m/s^2]", "(m/s^2)",
                  "m/(s^2)", "m\xc2\xb7s\xe2\x81\xbb\xc2\xb2", "m/s**2"},
        Spellings{"in", "inch", "inches"}, Spellings{"deg", "\xc2\xb0", "\xb0", "degree"},
        Spellings{"um", "\xc2\xb5m", "\xce\xbcm", "\xb5m"}, Spellings{"g", "G", "gn"},
        Spellings{"Ns/m", "N s/m", "N*s/m"}, Spellings{"Nm", "N m", "J"}, Spellings{"kN", "kN "}}) {
    const auto first = find_unit(same.front());
    CAPTURE(same.front());
    REQUIRE(first);
    for (const std::string& other : same) {
      CAPTURE(other);
      const auto unit = find_unit(other);
      REQUIRE(unit);
      CHECK(unit->powers == first->powers);
      CHECK(unit->factor == Approx(first->factor).epsilon(1e-14));
    }
  }
  for (const auto& [from, to, factor] : {std::tuple{"in", "mm", 25.4},
                                         {"g", "m/s^2", 9.80665},
                                         {"lbf", "N", 4.4482216152605},
                                         {"deg", "rad", std::numbers::pi / 180},
                                         {"km/h", "m/s", 1 / 3.6},
                                         {"mV", "V", 1e-3},
                                         {"kN", "N", 1e3},
                                         {"rpm", "rad/s", std::numbers::pi / 30},
                                         {"um", "mm", 1e-3},
                                         {"ft", "in", 12.0},
                                         {"ms", "s", 1e-3},
                                         {"%", "-", 1e-2},
                                         {"1/min", "Hz", 1.0 / 60}}) {
    CAPTURE(from, to);
    const auto forth = conversion_factor(*find_unit(from), *find_unit(to));
    const auto back = conversion_factor(*find_unit(to), *find_unit(from));
    REQUIRE(forth);
    REQUIRE(back);
    CHECK(*forth == Approx(factor).epsilon(1e-12));
    CHECK(*forth * *back == Approx(1).epsilon(1e-14));
  }
  for (const char* unknown : {"", "cubit", "m/", "/s", "m//s", "m/s^", "ms2kg-", "12", "left", "t", "m(s", "x^2"}) {
    CAPTURE(unknown);
    CHECK_FALSE(find_unit(unknown));
  }
  CHECK_FALSE(conversion_factor(*find_unit("m"), *find_unit("m/s")));
  CHECK_FALSE(conversion_factor(*find_unit("rad"), *find_unit("-")));
  const auto sensitivity = find_sensitivity("100 mV/g");
  REQUIRE(sensitivity);
  CHECK(*conversion_factor(*find_unit("V") / *sensitivity, *find_unit("g")) == Approx(10).epsilon(1e-12));
  for (const char* wrong : {"mV/g", "0 V/m", "-1 V/m", "100", "5 cubits"}) CHECK_FALSE(find_sensitivity(wrong));
}

TEST_CASE("a name is split from its unit, whatever brackets they stand in") {
  for (const char* name : {"acc [m/s^2]", "acc (m/s^2)", "acc[m/s^2]", "acc / (m/s^2)", "acc / m/s^2"}) {
    CAPTURE(name);
    CHECK(split_name(name).base == "acc");
    CHECK(split_name(name).unit == "m/s^2");
  }
  CHECK(split_name("in / out").base == "in / out");
  CHECK(split_name("acc [m/(s s)]").unit == "m/(s s)");
  CHECK(split_name("[m]").base == "[m]");
  CHECK(split_name("acc").unit.empty());
}

TEST_CASE("dates in every notation count the same seconds, across days, months and leap years") {
  Random random(4, Stream::noise);
  for (int i = 0; i < 300; ++i) {
    const int month = 1 + static_cast<int>(random.integer(12)),
              day = 1 + static_cast<int>(random.integer(month == 2 ? 29 : 30));
    const int hour = static_cast<int>(random.integer(24)), minute = static_cast<int>(random.integer(60)),
              ms = static_cast<int>(random.integer(60000));
    static constexpr int before[] = {0, 31, 60, 91, 121, 152, 182, 213, 244, 274, 305, 335};
    const double expected = 86400.0 * (before[month - 1] + day - 1) + 3600 * hour + 60 * minute + ms / 1000.0;
    const std::string clock = fmt::format("{:02}:{:02}:{:02}.{:03}", hour, minute, ms / 1000, ms % 1000);
    std::string comma = clock;
    comma[8] = ',';
    const auto start = find_instant("2024-01-01T00:00:00");
    REQUIRE(start);
    for (const std::string& text :
         {fmt::format("2024-{:02}-{:02}T{}", month, day, clock), fmt::format("2024-{:02}-{:02} {}", month, day, comma),
          fmt::format("{:02}.{:02}.2024 {}", day, month, clock),
          fmt::format("2024/{:02}/{:02}  {}Z", month, day, clock),
          fmt::format("2024-{:02}-{:02}T{}+01:00", month, day, clock)}) {
      CAPTURE(text);
      const auto instant = find_instant(text);
      REQUIRE(instant);
      CHECK(seconds_since(*instant, start->day) == Approx(expected).epsilon(1e-15));
    }
    const auto slashed = find_instant(fmt::format("{:02}/{:02}/2024 {}", month, day, clock));
    REQUIRE(slashed);
    CHECK(slashed->day_or_month == (day <= 12 && day != month));
    const auto alone = find_instant(clock);
    REQUIRE(alone);
    CHECK_FALSE(alone->dated);
    CHECK(seconds_since(*alone, 0) == Approx(3600 * hour + 60 * minute + ms / 1000.0).epsilon(1e-15));
  }
  for (const char* wrong : {"2023-02-29 00:00:00", "2024-13-01T00:00:00", "24:00:00", "10:60:00", "10:11:12.",
                            "2024-01-05", "10:11:12 rest", "1.5", "", "2024-01-05X10:11:12", "5-1-2024 10:11:12"}) {
    CAPTURE(wrong);
    CHECK_FALSE(find_instant(wrong));
  }
}

namespace {

TimeRequest asking(std::optional<double> hz, bool may_lose = false) {
  return {hz, 1, {}, may_lose, "t", "f.csv", [](Index k) { return fmt::format("line {}", k + 2); }};
}

/// Instants at a rate, each written by `write`.
template <class Write>
Vector instants(Index n, double start, double hz, Write&& write) {
  Vector t(n);
  for (Index k = 0; k < n; ++k) t(k) = write(start + static_cast<double>(k) / hz);
  return t;
}

}  // namespace

TEST_CASE("a rate is found in rounded, single and exact instants, as exactly as these tell it") {
  Random random(8, Stream::noise);
  for (int i = 0; i < 60; ++i) {
    const double hz = i % 2 ? std::round(20 + 980 * random.uniform()) : 20 + 980 * random.uniform();
    const double start = std::round(1000 * random.uniform()) / 10;
    const Index n = 2000 + random.integer(2000);
    const double span = static_cast<double>(n) / hz;
    CAPTURE(hz, start, n);
    const auto exact = [](double t) { return t; };
    const auto milli = [](double t) { return std::round(1000 * t) / 1000; };
    const auto single = [](double t) { return static_cast<double>(static_cast<float>(t)); };
    CHECK(fit_time_grid(instants(n, start, hz, exact), asking({})).sampling_hz ==
          Approx(hz).epsilon(1.1e-4 / static_cast<double>(n)));
    CHECK(fit_time_grid(instants(n, start, hz, single), asking({})).sampling_hz ==
          Approx(hz).epsilon(3e-5 / span + 1e-6));
    if (hz < 900)
      CHECK(fit_time_grid(instants(n, start, hz, milli), asking({})).sampling_hz == Approx(hz).epsilon(3e-3 / span));
    if (i % 2) CHECK(fit_time_grid(instants(n, start, hz, exact), asking({})).sampling_hz == Approx(hz).epsilon(1e-15));
    for (const Vector& t :
         {instants(n, start, hz, exact), instants(n, start, hz, single), instants(n, start, hz, milli)}) {
      const TimeGrid grid = fit_time_grid(t, asking(hz));
      CHECK(grid.sampling_hz == hz);
      CHECK(grid.scatter == 0);
      CHECK_THROWS_WITH(fit_time_grid(t, asking(1.02 * hz)), Contains("at sampling_hz ="));
    }
  }
}

TEST_CASE("jitter like noise is taken for a grid and told, one late instant is refused at its line") {
  Random random(9, Stream::noise);
  for (int i = 0; i < 20; ++i) {
    const Index n = 3000;
    Vector t = instants(n, 2, 200, [&](double exact) { return exact + 0.01 / 200 * random.normal(); });
    const TimeGrid grid = fit_time_grid(t, asking({}));
    CHECK(grid.sampling_hz == Approx(200).epsilon(1e-5));
    CHECK(grid.scatter > 0.02);
    CHECK(grid.scatter < 0.08);
    CHECK(fit_time_grid(t, asking(200)).sampling_hz == 200);
    t = instants(n, 2, 200, [](double exact) { return exact; });
    const Index late = 10 + random.integer(n - 20);
    t(late) += 0.2 / 200;
    CHECK_THROWS_WITH(fit_time_grid(t, asking(200)),
                      Contains(fmt::format("line {}: expected uniform", late + 2)) && Contains("\"scatter\": "));
    TimeRequest wide = asking(200);
    wide.scatter = 0.25;
    CHECK(fit_time_grid(t, wide).scatter == Approx(0.2).epsilon(0.05));
  }
}

TEST_CASE("lost samples are found with their number and place, in exact, rounded and jittered instants") {
  Random random(10, Stream::noise);
  for (int i = 0; i < 60; ++i) {
    const double hz = 50 + 400 * random.uniform();
    std::vector<LostSamples> lost;
    std::vector<double> written;
    const Index first = 100 + random.integer(300), second = 600 + random.integer(300);
    const Index counts[] = {1 + random.integer(5), 1 + random.integer(5)};
    for (Index k = 0; k < 1500; ++k) {
      if ((k >= first && k < first + counts[0]) || (k >= second && k < second + counts[1])) continue;
      const double exact = 3 + static_cast<double>(k) / hz;
      written.push_back(i % 3 == 0   ? exact
                        : i % 3 == 1 ? std::round(1000 * exact) / 1000
                                     : exact + 0.01 / hz * random.normal());
    }
    const Eigen::Map<const Vector> t(written.data(), static_cast<Index>(written.size()));
    CAPTURE(i, hz, first, second, counts[0], counts[1]);
    for (const bool said : {true, false}) {
      const std::optional<double> rate = said ? std::optional(hz) : std::nullopt;
      const TimeGrid grid = fit_time_grid(t, asking(rate, true));
      CHECK(grid.sampling_hz == Approx(hz).epsilon(1e-3));
      REQUIRE(grid.lost.size() == 2);
      CHECK(grid.lost[0].before == first);
      CHECK(grid.lost[0].count == counts[0]);
      CHECK(grid.lost[1].before == second - counts[0]);
      CHECK(grid.lost[1].count == counts[1]);
      CHECK_THROWS_WITH(fit_time_grid(t, asking(rate)),
                        Contains(fmt::format("lost samples: {} ({} at line {}, {} at line {})", counts[0] + counts[1],
                                             counts[0], first + 2, counts[1], second - counts[0] + 2)) &&
                            Contains("\"lost_samples\": \"bridge\""));
    }
  }
}

TEST_CASE("a bridge keeps cubics, leaves measured samples as they are, and the longest whole stretch is found") {
  Random random(11, Stream::noise);
  for (int i = 0; i < 50; ++i) {
    const Index n = 40;
    const Vector c = random.normal(4, 1);
    Matrix whole(2, n);
    for (Index k = 0; k < n; ++k) {
      const double x = static_cast<double>(k) / 10;
      whole(0, k) = c(0) + x * (c(1) + x * (c(2) + x * c(3)));
      whole(1, k) = random.normal();
    }
    const Index first = 2 + random.integer(8), count = 1 + random.integer(longest_bridge), second = 30;
    std::vector<Index> kept;
    for (Index k = 0; k < n; ++k)
      if ((k < first || k >= first + count) && k != second) kept.push_back(k);
    const std::vector<LostSamples> lost = {{first, count}, {second - count, 1}};
    const Matrix bridged = bridge(whole(Eigen::all, kept), lost);
    REQUIRE(bridged.cols() == n);
    CHECK((bridged.row(0) - whole.row(0)).cwiseAbs().maxCoeff() < 1e-10 * (1 + whole.row(0).cwiseAbs().maxCoeff()));
    CHECK(bridged(Eigen::all, kept) == whole(Eigen::all, kept));
    const auto [begin, length] = longest_whole(static_cast<Index>(kept.size()), lost);
    CHECK(begin == first);
    CHECK(length == second - count - first);
  }
  CHECK(longest_whole(7, {}) == std::pair<Index, Index>{0, 7});
}

TEST_CASE("another rate keeps what lies well below half of it, and folds nothing from above it") {
  Random random(12, Stream::noise);
  const auto tone = [](double hz, double at_hz, Index n, double phase) {
    Matrix x(1, n);
    for (Index k = 0; k < n; ++k) x(k) = std::sin(2 * std::numbers::pi * hz * static_cast<double>(k) / at_hz + phase);
    return x;
  };
  for (const auto& [from, to] :
       {std::pair{1000.0, 250.0}, {1000.0, 400.0}, {610.3515625, 200.0}, {200.0, 500.0}, {256.0, 100.0}}) {
    const double low = std::min(from, to), phase = 6 * random.uniform();
    const auto n = static_cast<Index>(8 * from);
    const Matrix kept = resample(tone(0.34 * low, from, n, phase), from, to);
    CAPTURE(from, to);
    CHECK(kept.cols() == 1 + static_cast<Index>(std::floor(static_cast<double>(n - 1) * to / from + 1e-9)));
    // The window reaches 32 samples of the lower rate to either side.
    const auto end = static_cast<Index>(40 * to / low);
    const Matrix exact = tone(0.34 * low, to, kept.cols(), phase);
    CHECK((kept - exact).middleCols(end, kept.cols() - 2 * end).cwiseAbs().maxCoeff() < 1e-5);
    if (to < from) {
      const Matrix gone = resample(tone(0.51 * to, from, n, phase), from, to);
      CHECK(gone.middleCols(end, gone.cols() - 2 * end).cwiseAbs().maxCoeff() < 1e-5);
    }
  }
  const Matrix level = Matrix::Constant(2, 500, 3.5);
  CHECK((resample(level, 1000, 300).array() - 3.5).abs().maxCoeff() < 1e-12);
  CHECK(resample(level, 100, 100) == level);
  CHECK_THROWS_AS(resample(level, 0, 100), std::invalid_argument);
}

TEST_CASE("spikes, clipping, resolution, missing cells and the end of the spectrum are those that were put in") {
  Random random(13, Stream::noise);
  const Index n = 4000;
  for (int i = 0; i < 20; ++i) {
    const double hz = 200, top_hz = 5 + 40 * random.uniform();
    Vector x(n);
    for (Index k = 0; k < n; ++k)
      x(k) = std::sin(2 * std::numbers::pi * top_hz * static_cast<double>(k) / hz) + 1e-6 * random.normal();
    ColumnFacts facts = column_facts(x, 1 / hz);
    CHECK(facts.spectrum_end_hz == Approx(top_hz).margin(0.3));
    CHECK(facts.spikes.empty());
    CHECK(facts.clipped == 0);
    CHECK(facts.resolution == 0);
    CHECK(facts.missing == 0);
    const Index spike = 10 + random.integer(n - 20);
    x(spike) += i % 2 ? 100 : -100;
    CHECK(column_facts(x, 1 / hz).spikes == std::vector<Index>{spike});
    x(spike) -= i % 2 ? 100 : -100;
    const Vector clipped = x.cwiseMin(0.5);
    Index expected = 0;
    for (Index k = 0, run = 0; k <= n; ++k) {
      if (k < n && clipped(k) == 0.5) {
        ++run;
        continue;
      }
      expected += run >= 3 ? run : 0;
      run = 0;
    }
    CHECK(column_facts(clipped, 1 / hz).clipped == expected);
    const double step = 0.01 + 0.1 * random.uniform();
    const Vector stepped = (x / step).array().round() * step;
    CHECK(column_facts(stepped, 1 / hz).resolution == Approx(step).epsilon(1e-9));
    x(5) = x(7) = std::nan("");
    facts = column_facts(x, 1 / hz);
    CHECK(facts.missing == 2);
    CHECK(facts.spectrum_end_hz == 0);
    CHECK(std::isfinite(facts.low + facts.high));
  }
}
