// What the drives promise: levels met exactly, lines where they belong, the densities of the standards.
#include "core/plant/road.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <set>

#include "core/base/status.hpp"
#include "core/plant/butterworth.hpp"

using namespace wheelhop;
using Catch::Contains;

namespace {

Drive drive(const DriveOptions& options, Index lead, Index samples, double hold_hz = 1000,
            std::uint64_t realisation = 0) {
  Random random(11, Stream::road, 0, realisation);
  return make_drive(options, hold_hz, lead, samples, random);
}

double rms(const Vector& x) { return std::sqrt(x.squaredNorm() / static_cast<double>(x.size())); }

/// Amplitude of line k of a record that is a whole number of its periods.
double line_amplitude(const Vector& x, Index k) {
  std::complex<double> sum = 0;
  const double step = -2 * M_PI * static_cast<double>(k) / static_cast<double>(x.size());
  for (Index i = 0; i < x.size(); ++i) sum += x(i) * std::polar(1.0, step * static_cast<double>(i));
  return 2 * std::abs(sum) / static_cast<double>(x.size());
}

double gain(const std::vector<Biquad>& sections, double frequency_hz, double rate_hz) {
  Vector impulse = Vector::Zero(20000);
  impulse(0) = 1;
  filter(sections, impulse);
  std::complex<double> sum = 0;
  for (Index i = 0; i < impulse.size(); ++i)
    sum += impulse(i) * std::polar(1.0, -2 * M_PI * frequency_hz / rate_hz * static_cast<double>(i));
  return std::abs(sum);
}

DriveOptions parsed(const std::string& text, const std::string& unit = "m") {
  return parse_drive(JsonCursor::from(parse_json(text, "c.json"), "c.json"), 1000, unit);
}

}  // namespace

TEST_CASE("a Butterworth low-pass loses 3 dB at its cutoff and falls off maximally flat, whatever its order") {
  for (const Index order : {1, 2, 3, 5, 8, 16}) {
    INFO("order " << order);
    const auto sections = butterworth_lowpass(order, 10, 1000);
    CHECK(gain(sections, 0, 1000) == Approx(1).epsilon(1e-9));
    CHECK(gain(sections, 10, 1000) == Approx(std::sqrt(0.5)).epsilon(1e-9));
    for (const double f : {3.0, 14.0, 20.0}) {
      const double ratio = std::tan(M_PI * f / 1000) / std::tan(M_PI * 10 / 1000);
      CHECK(gain(sections, f, 1000) ==
            Approx(1 / std::sqrt(1 + std::pow(ratio, 2.0 * static_cast<double>(order)))).margin(1e-9));
    }
  }
}

TEST_CASE("noise meets its level exactly in every record, and only random numbers tell realisations apart") {
  const BandLimitedNoise options{.rms = 0.02, .cutoff_hz = 10};
  for (std::uint64_t realisation = 0; realisation < 5; ++realisation) {
    const Drive d = drive(options, 2000, 30000, 1000, realisation);
    REQUIRE(d.values.size() == 32000);
    CHECK(rms(d.values.tail(30000)) == Approx(0.02).epsilon(1e-13));
    CHECK(rms(d.values.head(2000)) > 0.005);  // the lead is noise of the same kind
  }
  CHECK(drive(options, 10, 100).values == drive(options, 10, 100).values);
  CHECK(drive(options, 10, 100).values != drive(options, 10, 100, 1000, 1).values);
}

TEST_CASE("noise keeps to its band and has no transient of the filter at its start") {
  // Averages over 200 realisations: the first hundredth of a second is as loud as the last.
  double first = 0, last = 0, slow = 0, fast = 0;
  for (std::uint64_t r = 0; r < 200; ++r) {
    const Vector x = drive(BandLimitedNoise{.rms = 1}, 0, 4000, 1000, r).values;
    first += x.head(10).squaredNorm() / 200 / 10;
    last += x.tail(10).squaredNorm() / 200 / 10;
    slow += std::pow(line_amplitude(x, 20), 2) / 200;  // 5 Hz
    Vector windowed = x;  // Hann: what a rectangle leaks from 10 Hz to 40 Hz is more than the filter lets through
    for (Index i = 0; i < x.size(); ++i) windowed(i) *= 1 - std::cos(2 * M_PI * static_cast<double>(i) / 4000);
    fast += std::pow(line_amplitude(windowed, 160), 2) / 200;  // 40 Hz
  }
  // Standard error of a mean square over 200 independent stretches: 10 %.
  CHECK(first == Approx(1).margin(0.35));
  CHECK(last == Approx(1).margin(0.35));
  // White power of 1 spread over 10 Hz, lines of 1/4 Hz: amplitude^2 = 2 / 40.
  CHECK(slow == Approx(0.05).epsilon(0.3));
  CHECK(fast < 1e-8 * slow);
}

TEST_CASE("a multisine is periodic, fills exactly its lines, leaves even lines empty and meets its level") {
  const Multisine options{.rms = 0.01, .from_hz = 0.5, .to_hz = 12, .period_s = 4, .detection_group = 4};
  const Drive d = drive(options, 1500, 8000);
  REQUIRE(d.period_samples == 4000);
  CHECK(rms(d.values.tail(4000)) == Approx(0.01).epsilon(1e-12));
  CHECK((d.values.tail(4000) - d.values.segment(1500, 4000)).cwiseAbs().maxCoeff() < 1e-15);
  CHECK((d.values.head(1500) - d.values.segment(4000, 1500)).cwiseAbs().maxCoeff() < 1e-15);

  const Vector period = d.values.tail(4000);
  std::vector<Index> role(60, 0);
  for (const Index line : d.excited_lines) role.at(static_cast<std::size_t>(line)) += 1;
  for (const Index line : d.odd_detection_lines) role.at(static_cast<std::size_t>(line)) += 2;
  for (const Index line : d.even_detection_lines) role.at(static_cast<std::size_t>(line)) += 4;
  const double level = 0.01 * std::sqrt(2 / static_cast<double>(d.excited_lines.size()));
  for (Index line = 1; line < 60; ++line) {
    INFO("line " << line);
    const Index is = role[static_cast<std::size_t>(line)];
    CHECK(line_amplitude(period, line) == Approx(is == 1 ? level : 0).margin(1e-14));
    const bool in_band = line >= 2 && line <= 48;
    if (!in_band)
      CHECK(is == 0);
    else if (line % 2 == 0)
      CHECK(is == 4);
    else
      CHECK((is == 1 || is == 2));
  }
  // Odd lines 3, 5, ... 47: 23 of them in five whole groups of four and one of three.
  REQUIRE(d.excited_lines.size() + d.odd_detection_lines.size() == 23);
  for (Index group = 0; group < 5; ++group) {
    Index left_out = 0;
    for (const Index line : d.odd_detection_lines) left_out += (line - 3) / 8 == group;
    CHECK(left_out == 1);
  }
  const Drive steep =
      drive(Multisine{.rms = 1, .from_hz = 1, .to_hz = 9, .period_s = 1, .detection_group = 0, .slope = 1}, 0, 1000);
  CHECK(steep.odd_detection_lines.empty());
  CHECK(line_amplitude(steep.values, 3) == Approx(3 * line_amplitude(steep.values, 9)));
}

TEST_CASE("a sweep runs through the cycles of its law and reaches its amplitude") {
  for (const std::string progress : {"linear", "logarithmic"}) {
    const Drive d = drive(Sweep{.amplitude = 0.02, .from_hz = 1, .to_hz = 8, .progress = progress}, 100, 20000);
    CHECK(d.values.head(100).isZero(0));
    CHECK(d.values(100) == 0);
    CHECK(d.values(101) > 0);
    CHECK(d.values.cwiseAbs().maxCoeff() == Approx(0.02).epsilon(1e-3));
    int crossings = 0, early = 0;
    for (Index i = 102; i < d.values.size(); ++i) {
      const bool crossed = d.values(i - 1) * d.values(i) < 0 || d.values(i) == 0;
      crossings += crossed;
      if (i < 2100) early += crossed;
    }
    const double cycles = progress == "linear" ? 4.5 * 20 : 7 * 20 / std::log(8.0);
    CHECK(crossings == Approx(2 * cycles).margin(2));
    const double early_cycles = progress == "linear" ? 2 + 7.0 * 4 / 40 : 20 / std::log(8.0) * (std::pow(8.0, 0.1) - 1);
    CHECK(early == Approx(2 * early_cycles).margin(1.5));
  }
}

TEST_CASE("a road of ISO 8608 has the displacement density of its class, falling with the square of frequency") {
  // Samples of a power of two: the lines of the record are the lines of the road.
  const Index samples = 16384;
  const double speed = 15;
  for (const char letter : {'A', 'C', 'H'}) {
    const Drive d = drive(Iso8608{.road_class = std::string(1, letter), .speed_m_per_s = speed}, 0, samples);
    const double line_per_m = 1000.0 / static_cast<double>(samples) / speed;
    for (const Index line : {5, 25, 400}) {
      const double n = static_cast<double>(line) * line_per_m;
      const double density = 16e-6 * std::pow(4.0, letter - 'A') * std::pow(n / 0.1, -2);
      const double amplitude = line_amplitude(d.values, line);
      CHECK(amplitude * amplitude / 2 / line_per_m == Approx(density).epsilon(1e-6));
    }
    const double variance = 16e-6 * std::pow(4.0, letter - 'A') * 0.01 * (1 / 0.01 - 1 / 10.0);
    CHECK(rms(d.values) == Approx(std::sqrt(variance)).epsilon(0.2));  // few lines carry the longest waves
  }
}

TEST_CASE("a bump is a haversine of its height, length and place") {
  const Drive d = drive(Bump{.height = 0.06, .length_m = 1.5, .speed_m_per_s = 5, .start_s = 0.5}, 200, 2000);
  CHECK(d.values.head(700).isZero(0));
  CHECK(d.values.tail(1200).isZero(0));
  CHECK(d.values(200 + 650) == Approx(0.06));
  CHECK(d.values(200 + 575) == Approx(0.03));
  CHECK(d.values.sum() / 1000 == Approx(0.06 * 0.3 / 2).epsilon(1e-9));
}

TEST_CASE(
    "steps hold levels of their range for their time, begin at the first one, and are constant where both ends meet") {
  const Drive d = drive(Steps{.low = 1, .high = 4, .hold_s = 0.25}, 300, 2600);
  CHECK((d.values.head(550).array() == d.values(300)).all());
  std::set<double> levels;
  for (Index i = 300; i < 2900; ++i) {
    CHECK((d.values(i) >= 1 && d.values(i) <= 4));
    levels.insert(d.values(i));
    if ((i - 300) % 250 != 0) CHECK(d.values(i) == d.values(i - 1));
  }
  CHECK(levels.size() == 11);
  CHECK((drive(Steps{.low = 2, .high = 2}, 10, 90).values.array() == 2).all());
  CHECK_THROWS_WITH(parsed(R"({"name": "steps", "low": 2, "high": 1})"), Contains("$.high"));
}

TEST_CASE("every generator reads back what it writes, and refuses what it cannot make") {
  const std::vector<DriveEntry> table = drive_table();
  REQUIRE(table.size() == std::variant_size_v<DriveOptions>);
  for (const DriveEntry& entry : table) {
    INFO(entry.name);
    CHECK_FALSE(entry.source.empty());
    CHECK_FALSE(entry.options.empty());
    const DriveOptions options = parsed("{\"name\": \"" + entry.name + "\"}");
    const Json written = to_json(options);
    CHECK(written.at("name") == entry.name);
    CHECK(to_json(parsed(written.dump())) == written);
    const Drive d = drive(options, 50, 5000);
    CHECK(d.values.size() == 5050);
    CHECK(all_finite(d.values));
    CHECK(d.values.tail(5000).cwiseAbs().maxCoeff() > 0);
    CHECK_THROWS_WITH(parsed("{\"name\": \"" + entry.name + "\", \"colour\": 1}"), Contains("colour"));
  }
  CHECK_THROWS_WITH(parsed(R"({"name": "nois"})"),
                    Contains("$.name") && Contains("band_limited_noise") && Contains("bump"));
  CHECK_THROWS_WITH(parsed(R"({"name": "band_limited_noise", "cutoff_hz": 500})"),
                    Contains("$.cutoff_hz") && Contains("half the hold rate of 1000 Hz"));
  CHECK_THROWS_WITH(parsed(R"({"name": "band_limited_noise", "order": 0})"), Contains("$.order"));
  CHECK_THROWS_WITH(parsed(R"({"name": "multisine", "period_s": 0.12345})"), Contains("$.period_s"));
  CHECK_THROWS_WITH(parsed(R"({"name": "multisine", "detection_group": 1})"), Contains("$.detection_group"));
  CHECK_THROWS_WITH(parsed(R"({"name": "multisine", "to_hz": 0.15})"), Contains("$.to_hz"));
  CHECK_THROWS_WITH(parsed(R"({"name": "iso8608", "class": "Z"})"), Contains("$.class") && Contains("H"));
  CHECK_THROWS_WITH(parsed(R"({"name": "iso8608"})", "N"), Contains("this input in N"));
}
