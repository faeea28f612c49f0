// The kinds of true effects that came after the first sets of blind cases: what physics demands of them.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>

#include "experiments/rig/system.hpp"
#include "tests/support/plants.hpp"

using namespace wheelhop;
namespace {

blind::Plan read_plant_text(const std::string& text) {
  return blind::read_plan(JsonCursor::from(parse_json(text, "plant.json"), "plant.json"));
}

/// Masses and elements that move by 7 mm at 0.15 m/s, sensors of RMS 1 whose rate has 20.
blind::Surroundings slow_sine_surroundings(const blind::Plan& plan) {
  const blind::Extent motion{-0.02, 0.02, 0.007, 0.15};
  const auto sensors = static_cast<Index>(plan.sensors.size());
  return {.plan = &plan,
          .theta = plan.nominal(),
          .elements = std::vector(plan.elements.size(), motion),
          .masses = std::vector(plan.masses.size(), motion),
          .sensor_rms = Vector::Ones(sensors),
          .sensor_std = Vector::Ones(sensors),
          .sensor_rate_rms = Vector::Constant(sensors, 20)};
}

const blind::EffectKind& added_kind(const std::string& form) {
  for (const auto& kind : blind::effect_kinds(blind::Family::added))
    if (kind.form == form) return kind;
  FAIL("no form " << form);
  throw std::logic_error(form);
}

blind::Formed formed_at(const blind::Plan& plan, const std::string& form, const std::string& place) {
  Random random(1, Stream::parameters);
  const auto formed = added_kind(form).form_at(slow_sine_surroundings(plan), place, random);
  REQUIRE(formed);
  return *formed;
}

/// What the rig without noise records of a sine of the road.
Matrix recorded(const blind::Plan& plan, std::vector<blind::TrueEffect> effects, double frequency_hz,
                Index samples = 400) {
  const blind::ObserveOptions options{.samples = samples, .lead_s = 4};
  const blind::TrueSystem system{&plan, plan.nominal(), std::move(effects)};
  const auto playback = blind::play(plan, {{{0.003, frequency_hz, 0}}}, options);
  return blind::observe(system, playback, options).clean;
}

}  // namespace

TEST_CASE("guides stand at masses that no element holds to the ground") {
  CHECK(blind::guides(read_plant_text(test::quarter_car_text)) ==
        std::vector<std::string>{"guide:body", "guide:wheel"});
  CHECK(blind::guides(read_plant_text(test::one_mass_text)).empty());
}

TEST_CASE("an inerter stands between two masses only: against the ground it is a mass") {
  const auto& kind = added_kind("flywheel behind a shaft");
  CHECK(kind.places(read_plant_text(test::quarter_car_text)) == std::vector<std::string>{"suspension"});
  CHECK(kind.places(read_plant_text(test::one_mass_text)).empty());
}

TEST_CASE("friction of a guide pushes against the motion of its mass, by its size where it slides fast") {
  const blind::Plan plan = read_plant_text(test::quarter_car_text);
  for (const char* form : {"Stribeck on a guide", "Dahl on a guide"}) {
    CAPTURE(form);
    const auto effect = formed_at(plan, form, "guide:wheel").at_size(40);
    REQUIRE(effect.mounts.size() == 1);
    CHECK(effect.mounts.front().on_mass);
    CHECK(effect.mounts.front().at == 1);
    const auto attachment = effect.mounts.front().make();
    double z = 0, rate = 0, work = 0;
    const double amplitude = 0.02, w = 2 * 3.14159265358979, h = 1e-5;
    for (int k = 0; k < 300000; ++k) {
      const double v = amplitude * w * std::cos(w * k * h);
      blind::Forces forces;
      attachment->act(k * h, amplitude * std::sin(w * k * h), v, &z, &rate, forces);
      z += h * rate;
      work -= forces.extra * v * h;
      if (k > 100000 && std::abs(v) > 0.12) CHECK(-forces.extra * (v > 0 ? 1 : -1) == Approx(40).epsilon(0.1));
    }
    CHECK(work > 0.9 * 40 * 4 * amplitude * 3);  // three periods of four strokes
  }
}

TEST_CASE("an inerter moves the rig as an inertance between its masses would, below the swing of its shaft") {
  Json file = parse_json(test::quarter_car_text, "plant.json");
  file["elements"][0]["laws"][0] = {{"law", "linear_spring"}, {"stiffness_n_per_m", 18000}};
  const blind::Plan plan = read_plant_text(file.dump());
  const auto effect = formed_at(plan, "flywheel behind a shaft", "suspension").at_size(0.1);
  CHECK(effect.strength == Approx(4));  // a tenth of the wheel's 40 kg
  const double f = 3, w = 2 * 3.14159265358979 * f;
  const std::complex<double> s(0, w);
  const auto response = [&](double inertance) {
    const std::complex<double> strut = 18000.0 + 850.0 * s + inertance * s * s;
    const std::complex<double> a = 300.0 * s * s + strut, b = 40.0 * s * s + strut + 200000.0;
    const std::complex<double> x_wheel = 200000.0 * a / (a * b - strut * strut);
    return strut / a * x_wheel - x_wheel;  // travel over road
  };
  const auto amplitude = [&](const Matrix& y) {
    std::complex<double> sum = 0;
    for (Index k = 0; k < y.cols(); ++k)
      sum += y(0, k) * std::polar(1.0, -w * static_cast<double>(k) / blind::record_hz);
    return 2.0 * sum / static_cast<double>(y.cols());
  };
  const std::complex<double> measured = amplitude(recorded(plan, {effect}, f)) / amplitude(recorded(plan, {}, f));
  const std::complex<double> expected = response(4) / response(0);
  CHECK(std::abs(expected - 1.0) > 0.003);
  CHECK(std::abs(measured - expected) < 0.1 * std::abs(expected - 1.0));
}

TEST_CASE("oil that thins has lost the share asked for after the usual work of a record") {
  const blind::Plan plan = read_plant_text(test::quarter_car_text);
  const auto effect = formed_at(plan, "oil that thins by work", "suspension").at_size(0.15);
  const auto attachment = effect.mounts.front().make();
  const blind::BaseLaws base = blind::base_laws(plan, plan.nominal(), 0);
  const double work = base.damping * 0.15 * 0.15 * 40;  // of the surroundings' speed over their 40 s
  double rate = 0;
  for (const auto& [done, share] : {std::pair(0.0, 0.0), {work, 0.15}}) {
    blind::Forces forces{&base, 0, 100};
    attachment->act(0, 0, 0.1, &done, &rate, forces);
    CHECK(forces.damper == Approx(100 * (1 - share)));
    CHECK(rate == Approx(forces.damper * 0.1));
  }
}

TEST_CASE("readings are clipped and slew-limited at their bounds, and kept inside them") {
  const blind::Plan plan = read_plant_text(test::quarter_car_text);
  for (const char* form : {"reading that bends toward its end", "reading cut at its end"}) {
    CAPTURE(form);
    const auto effect = formed_at(plan, form, "sensor:body_acc").at_size(0.5);
    CHECK(effect.strength == 2);  // an RMS of 1 over 0.5
    Matrix y = Matrix::Zero(3, 3);
    y.row(1) << 0.2, -50, 4;
    effect.sensors.front()(y, 0, 1000);
    CHECK(y(1, 0) == Approx(0.2).epsilon(1e-4));
    CHECK(y(1, 1) == Approx(-2).epsilon(1e-3));
    CHECK(y(1, 2) <= 2);
    CHECK(y(1, 2) > 1.95);
    CHECK(y.row(0).norm() + y.row(2).norm() == 0);
  }
  for (const char* form : {"reading whose rate bends toward a bound", "reading of bounded rate"}) {
    CAPTURE(form);
    const auto effect = formed_at(plan, form, "sensor:travel").at_size(0.5);
    CHECK(effect.strength == 40);  // a rate of RMS 20 over 0.5
    Matrix y = Matrix::Zero(3, 2000);
    for (Index k = 0; k < 1000; ++k)
      y(0, k) = 1e-3 * static_cast<double>(k);  // 1 per second at 1 kHz: ten times slower
    y.row(0).tail(1000).setConstant(9);
    effect.sensors.front()(y, 0, 1000);
    CHECK(y(0, 999) == Approx(0.999).epsilon(1e-4));
    CHECK(y(0, 1099) == Approx(0.999 + 4).epsilon(1e-2));  // 100 ms at 40 per second
    CHECK(y(0, 1999) == Approx(9).epsilon(1e-6));
  }
}

TEST_CASE("a late sensor reads what it read before, and AC coupling turns a slow sine by its corner") {
  const blind::Plan plan = read_plant_text(test::quarter_car_text);
  const double rate = 1000, f = 1.7, w = 2 * 3.14159265358979 * f;
  const auto read = [&](const std::string& form, double size) {
    const auto effect = formed_at(plan, form, "sensor:body_acc").at_size(size);
    CHECK(effect.strength == size);
    Matrix y = Matrix::Zero(3, 20000);
    for (Index k = 0; k < y.cols(); ++k) y(1, k) = std::sin(w * static_cast<double>(k) / rate);
    effect.sensors.front()(y, 0, rate);
    CHECK(y.row(0).norm() + y.row(2).norm() == 0);
    std::complex<double> sum = 0;  // of the last 10 s, 17 periods
    for (Index k = 10000; k < y.cols(); ++k) sum += y(1, k) * std::polar(1.0, -w * static_cast<double>(k) / rate);
    return sum * std::complex<double>(0, 2) / 10000.0;
  };
  for (const double late : {0.0004, 0.0173})
    CHECK(std::abs(read("reading late by a fixed time", late) - std::polar(1.0, -w * late)) < 1e-5);
  CHECK(std::abs(read("bus whose delay wanders", 0.01) - std::polar(1.0, -w * 0.01)) < 0.05 * w * 0.01);
  for (const double corner : {0.1, 1.5}) {
    const std::complex<double> one = 1.0 / (1.0 - std::complex<double>(0, corner / f));
    CHECK(std::abs(read("AC coupling in one stage", corner) - one) < 1e-3);
    const std::complex<double> two = read("AC coupling in two stages", corner);
    CHECK(std::abs(two) < std::abs(one));
    CHECK(std::arg(two) > std::arg(one));
  }
}

TEST_CASE("a recorder of too long an interval reads the same motion later and later, its command not") {
  const blind::Plan plan = read_plant_text(test::quarter_car_text);
  for (const double sign : {1.0, -1.0}) {
    CAPTURE(sign);
    blind::TrueEffect effect{.strength = 0, .unit = "-", .recorder_rate = 1 + sign * 0.005};
    const Matrix right = recorded(plan, {}, 2, 800), off = recorded(plan, {effect}, 2, 800);
    CHECK(off.col(0) == right.col(0));
    // Sample 600 of a clock that is 0.5 % off holds what the right clock has in sample 603 or 597.
    const auto later = static_cast<Index>(600 + sign * 3);
    for (Index i = 0; i < right.rows(); ++i) {
      CHECK(off(i, 600) == Approx(right(i, later)).margin(1e-3 * right.row(i).cwiseAbs().maxCoeff()));
      CHECK((off.row(i) - right.row(i)).norm() > 0.01 * right.row(i).norm());
    }
  }
  const auto formed = formed_at(plan, "clock of the recorder", "timebase");
  for (const double ppm : {10.0, 100.0, 3000.0}) {
    CHECK(ppm * 1e-6 >= formed.smallest);
    CHECK(ppm * 1e-6 <= formed.largest);
  }
}

TEST_CASE("laws against the ground have a name but for drag on what a tyre carries, and act against the motion there") {
  const blind::Plan plan = read_plant_text(test::quarter_car_text);
  const auto places = [&](blind::Family family, const std::string& form) {
    for (const auto& kind : blind::effect_kinds(family))
      if (kind.form == form) return kind.places(plan);
    FAIL("no form " << form);
    return std::vector<std::string>{};
  };
  using Names = std::vector<std::string>;
  CHECK(places(blind::Family::added, "drag of the air on a mass") == Names{"guide:body"});
  CHECK(places(blind::Family::added, "contact with a third body") == Names{"guide:body", "guide:wheel"});
  CHECK(places(blind::Family::unknown, "drag in proportion to speed squared") == Names{"wheel"});
  for (const std::string form : {"drag of the air on a mass", "contact with a third body"}) {
    const auto formed = formed_at(plan, form, "guide:body");
    const blind::TrueEffect effect = formed.at_size(formed.largest);
    CHECK(added_kind(form).effect == (form.starts_with("drag") ? "damper_nonlinearity" : "bump_stop"));
    REQUIRE(effect.mounts.size() == 1);
    CHECK(effect.mounts.front().on_mass);
    const auto attachment = effect.mounts.front().make();
    double pushed = 0;
    for (const double x : {-1.0, 0.0, 1.0})
      for (const double v : {-1.0, 0.0, 1.0}) {
        blind::Forces forces;
        attachment->act(0, x, v, nullptr, nullptr, forces);
        CHECK(forces.extra * (form.starts_with("drag") ? v : x) <= 0);
        pushed = std::max(pushed, std::abs(forces.extra));
      }
    CHECK(pushed > 0);
  }
}
