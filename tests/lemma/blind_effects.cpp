// The true effects of blind cases: what physics demands of their signs.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "experiments/rig/effects.hpp"
#include "tests/support/plants.hpp"

using namespace wheelhop;
namespace {

blind::Plan quarter_car() {
  return blind::read_plan(JsonCursor::from(parse_json(test::quarter_car_text, "plant.json"), "plant.json"));
}

/// Motion as of a road of 8 mm.
blind::Surroundings surroundings(const blind::Plan& plan) {
  const blind::Extent motion{-0.02, 0.02, 0.007, 0.15};
  return {&plan,
          plan.nominal(),
          {motion, motion},
          {motion, motion},
          Vector::Ones(3),
          Vector::Ones(3),
          Vector::Constant(1, 0.02),
          Vector::Constant(1, 0.15),
          blind::static_loads(plan),
          25,
          40,
          Vector::Constant(3, 20)};
}

/// An effect of the kind at its place, at a share of the way from the smallest to the largest size (in logarithm).
blind::TrueEffect made(const blind::Plan& plan, const blind::EffectKind& kind, double share) {
  Random random(1, Stream::parameters);
  const auto formed = kind.form_at(surroundings(plan), kind.places(plan).front(), random);
  REQUIRE(formed);
  return formed->at_size(formed->smallest * std::pow(formed->largest / formed->smallest, share));
}

const blind::EffectKind& kind_of(blind::Family family, const std::string& form) {
  for (const auto& kind : blind::effect_kinds(family))
    if (kind.form == form) return kind;
  FAIL("no form " << form);
  throw std::logic_error(form);
}

/// Carries the element's forces along a sine of travel and calls visit(x, v, forces) at every step of the last period.
template <class Visit>
void run_sine(const blind::Plan& plan, const blind::TrueEffect& effect, double amplitude_m, double frequency_hz,
              Visit visit) {
  const blind::BaseLaws base = blind::base_laws(plan, plan.nominal(), effect.mounts.front().at);
  const auto attachment = effect.mounts.front().make();
  std::vector<double> z(8), rate(8);
  const double w = 2 * std::numbers::pi * frequency_hz;
  const int steps = 20000, periods = 3;
  const double h = 1 / frequency_hz / steps;
  for (int k = 0; k < periods * steps; ++k) {
    const double x = amplitude_m * std::sin(w * k * h), v = amplitude_m * w * std::cos(w * k * h);
    blind::Forces forces{&base, base.spring(x), base.damping * v};
    attachment->act(k * h, x, v, z.data(), rate.data(), forces);
    if (k >= (periods - 1) * steps) visit(x, v, forces, h);
    for (std::size_t i = 0; i < z.size(); ++i) z[i] += h * rate[i];
    attachment->accept(k * h, x, v);
  }
}

}  // namespace

TEST_CASE("what is added by friction, hysteresis and relaxation takes energy from every closed cycle") {
  const blind::Plan plan = quarter_car();
  for (const char* form : {"LuGre with Stribeck", "Iwan, six Jenkins elements", "two Zener branches", "Maxwell branch",
                           "smoothed sign", "Bouc-Wen with an exponent of two", "dashpot"})
    for (const double amplitude : {0.002, 0.02}) {
      CAPTURE(form, amplitude);
      double work = 0, largest = 0;
      run_sine(plan, made(plan, kind_of(blind::Family::catalogue, form), 0.5), amplitude, 2,
               [&](double, double v, const blind::Forces& f, double h) {
                 work += f.extra * v * h;
                 largest = std::max(largest, std::abs(f.extra));
               });
      CHECK(work > 0.01 * largest * amplitude);
    }
}

TEST_CASE("friction of Coulomb's size slides against the motion, a hysteresis never exceeds its limit") {
  const blind::Plan plan = quarter_car();
  const auto friction = made(plan, kind_of(blind::Family::catalogue, "LuGre with Stribeck"), 0.6);
  run_sine(plan, friction, 0.02, 1, [&](double, double v, const blind::Forces& f, double) {
    if (std::abs(v) > 0.1) CHECK(f.extra * (v > 0 ? 1 : -1) == Approx(friction.strength).epsilon(0.05));
  });
  const auto iwan = made(plan, kind_of(blind::Family::catalogue, "Iwan, six Jenkins elements"), 0.6);
  double largest = 0;
  run_sine(plan, iwan, 0.02, 1,
           [&](double, double, const blind::Forces& f, double) { largest = std::max(largest, std::abs(f.extra)); });
  CHECK(largest == Approx(iwan.strength).epsilon(1e-6));
}

TEST_CASE("changed dampers still damp, whatever the form") {
  const blind::Plan plan = quarter_car();
  for (const char* form :
       {"two valves, smooth transition", "table of straight pieces with blow-off", "exponential in the heat stored",
        "dead travel after reversal", "two slopes", "saturated by a hyperbolic tangent", "orifice", "bypass",
        "linear in the temperature", "no force over the dead travel"}) {
    CAPTURE(form);
    double work = 0;
    bool against = true;
    run_sine(plan, made(plan, kind_of(blind::Family::catalogue, form), 0.9), 0.01, 2,
             [&](double, double v, const blind::Forces& f, double h) {
               work += f.damper * v * h;
               against = against && f.damper * v >= 0;
             });
    CHECK(work > 0);
    CHECK(against);
  }
}

TEST_CASE("a damper behind a mount takes 1 / (1 + (w tau)^2) of its energy from a sine") {
  const blind::Plan plan = quarter_car();
  const auto effect = made(plan, kind_of(blind::Family::catalogue, "damper behind a mount"), 0.5);
  const double damping = blind::base_laws(plan, plan.nominal(), 0).damping, relaxation_s = damping / effect.strength;
  const double amplitude = 0.01, frequency = 20, lag = 2 * std::numbers::pi * frequency * relaxation_s;
  double work = 0, whole = 0;
  run_sine(plan, effect, amplitude, frequency, [&](double, double v, const blind::Forces& f, double h) {
    work += f.damper * v * h;
    whole += damping * v * v * h;
  });
  CHECK(lag > 0.1);
  CHECK(work == Approx(whole / (1 + lag * lag)).epsilon(1e-2));
}

TEST_CASE("a drive of first order follows a ramp late by its time constant") {
  const blind::Plan plan = quarter_car();
  const auto effect = made(plan, kind_of(blind::Family::catalogue, "drive of first order"), 0.8);
  Vector ramp = Vector::LinSpaced(4000, 0, 3999);
  effect.drive.front().change(ramp, 1000);
  CHECK(ramp(0) == 0);
  CHECK(ramp(3999) == Approx(3999 - 1000 * effect.strength).epsilon(1e-9));
}

TEST_CASE("a tyre lifts off only where its static load is used up, and presses as before elsewhere") {
  const blind::Plan plan = quarter_car();
  const auto effect = made(plan, kind_of(blind::Family::catalogue, "unilateral contact"), 0.8);
  bool lifted = false;
  run_sine(plan, effect, 0.02, 2, [&](double x, double, const blind::Forces& f, double) {
    const double delivered = f.spring + f.damper;
    CHECK(f.total() <= effect.strength * (1 + 1e-12));
    if (x <= 0 || delivered < effect.strength) CHECK(f.total() == Approx(delivered).margin(1e-9));
    lifted = lifted || f.total() < delivered - 1;
  });
  CHECK(lifted);
}

TEST_CASE("a tyre's power law keeps its stiffness at rest and stiffens under load") {
  const blind::Plan plan = quarter_car();
  const auto effect = made(plan, kind_of(blind::Family::catalogue, "power law about the static load"), 0.8);
  run_sine(plan, effect, 0.01, 2, [&](double x, double, const blind::Forces& f, double) {
    if (std::abs(x) < 1e-4) CHECK(f.spring == Approx(200000 * x).epsilon(0.01).margin(1e-6));
    if (x < -0.002) CHECK(f.spring < 200000 * x);
    if (x > 0.002) CHECK(f.spring < 200000 * x);  // softer as it is relieved
  });
}

TEST_CASE("every effect vanishes with its size: at the smallest, hardly any force differs") {
  const blind::Plan plan = quarter_car();
  for (const auto family : {blind::Family::catalogue, blind::Family::unknown, blind::Family::added})
    for (const auto& kind : blind::effect_kinds(family)) {
      CAPTURE(kind.form);
      const auto effect = made(plan, kind, 0);
      if (effect.mounts.empty() || effect.mounts.front().on_mass) continue;
      double change = 0, usual = 0;
      run_sine(plan, effect, 0.01, 2, [&](double, double, const blind::Forces& f, double) {
        change = std::max(change, std::abs(f.extra) + std::abs(f.share_at_from - 1) * std::abs(f.total()));
        usual = std::max(usual, std::abs(f.spring + f.damper));
      });
      CHECK(change < 0.01 * usual);
    }
}

TEST_CASE("forms have names of their own, and every kind of effect stands somewhere on a quarter car") {
  const blind::Plan plan = quarter_car();
  std::vector<std::string> forms;
  for (const auto family :
       {blind::Family::catalogue, blind::Family::unknown, blind::Family::parameter, blind::Family::added})
    for (const auto& kind : blind::effect_kinds(family)) {
      CAPTURE(kind.form);
      CHECK_FALSE(kind.places(plan).empty());
      CHECK(std::find(forms.begin(), forms.end(), kind.form) == forms.end());
      forms.push_back(kind.form);
    }
  CHECK(blind::effect_kinds(blind::Family::catalogue).size() >= 26);
  CHECK(blind::effect_kinds(blind::Family::unknown).size() >= 8);
}
