// The rig that makes blind cases: against closed forms, against the plant code it must not share, and its seal.
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <numbers>

#include "core/plant/simulate.hpp"
#include "experiments/rig/prepare.hpp"
#include "experiments/rig/sha256.hpp"
#include "tests/support/plants.hpp"

using namespace wheelhop;
namespace {

using Complex = std::complex<double>;
constexpr double two_pi = 2 * std::numbers::pi;

blind::Plan plan_from(const Json& plant) { return blind::read_plan(JsonCursor::from(plant, "plant.json")); }

Json linear_quarter_car() {
  Json plant = parse_json(test::quarter_car_text, "plant.json");
  plant["elements"][0]["laws"][0] = {{"law", "linear_spring"}, {"stiffness_n_per_m", 18000}};
  return plant;
}

/// Travel and body acceleration over road of the quarter car above, in steady state.
std::pair<Complex, Complex> response(double frequency_hz) {
  const Complex s(0, two_pi * frequency_hz);
  const double body = 300, wheel = 40, tyre = 200000;
  const Complex strut = 18000.0 + 850.0 * s;
  const Complex a = body * s * s + strut, b = wheel * s * s + strut + tyre;
  const Complex x_wheel = tyre * a / (a * b - strut * strut), x_body = strut / a * x_wheel;
  return {x_body - x_wheel, s * s * x_body};
}

/// Amplitude and phase of a line, relative to the cosine that drove it.
Complex line(const Matrix& y, Index row, double frequency_hz) {
  Complex sum = 0;
  for (Index k = 0; k < y.cols(); ++k)
    sum += y(row, k) * std::polar(1.0, -two_pi * frequency_hz * static_cast<double>(k) / blind::record_hz);
  return 2.0 * sum / static_cast<double>(y.cols());
}

}  // namespace

TEST_CASE("the check sum is SHA-256: the vectors of FIPS 180") {
  CHECK(blind::sha256("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  CHECK(blind::sha256("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  CHECK(blind::sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq") ==
        "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  CHECK(blind::sha256(std::string(1000000, 'a')) == "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST_CASE("a linear quarter car answers a held sine by its transfer function") {
  const blind::Plan plan = plan_from(linear_quarter_car());
  const blind::TrueSystem system{&plan, plan.nominal(), {}};
  for (const double f : {1.5, 11.0}) {
    CAPTURE(f);
    const blind::ObserveOptions options{.samples = 400, .lead_s = 12};
    const auto seen = blind::observe(system, blind::play(plan, {{{0.003, f, 0}}}, options), options);
    // A held sine is delayed by half a hold interval and a little smaller.
    const double half = std::numbers::pi * f / plan.hold_hz;
    const Complex held = 0.003 * std::sin(half) / half * std::polar(1.0, -half);
    const auto [travel, body_acc] = response(f);
    CHECK(std::abs(line(seen.clean, 0, f) / (held * travel) - 1.0) < 1e-4);
    CHECK(std::abs(line(seen.clean, 1, f) / (held * body_acc) - 1.0) < 1e-3);  // with the steps' images in the second
  }
}

TEST_CASE("without an effect the rig moves as the plant simulation does, which shares no code with it") {
  for (const Json& file : {parse_json(test::quarter_car_text, "plant.json"), to_json(test::full_car())}) {
    CAPTURE(file["name"]);
    const blind::Plan plan = plan_from(file);
    std::vector<blind::Command> commands;
    for (std::size_t i = 0; i < plan.inputs.size(); ++i) {
      Random random(3, Stream::road, i);
      commands.push_back(blind::make_command({}, random));
    }
    const blind::ObserveOptions options{.samples = 300, .lead_s = 2};
    const auto playback = blind::play(plan, commands, options);
    const auto seen = blind::observe({&plan, plan.nominal(), {}}, playback, options);
    const Plant plant = parse_plant(JsonCursor::from(file, "plant.json"));
    const Simulation reference = simulate(plant, playback.held, {.decimation = 5, .lead_samples = 2000});
    REQUIRE(reference.status == Status::ok);
    for (Index i = 0; i < seen.clean.rows(); ++i)
      CHECK((seen.clean.row(i) - reference.outputs.row(i)).norm() < 1e-5 * reference.outputs.row(i).norm());
  }
}

TEST_CASE("a delayed command is the command earlier, and a skewed clock reads it ahead in proportion to time") {
  Random random(4, Stream::road);
  const blind::Command command = blind::make_command({.name = "iso8608"}, random);
  const Vector early = blind::sample_command(command, 0.25, 1e-3, 1000),
               all = blind::sample_command(command, 0, 1e-3, 1250);
  CHECK((early - all.tail(1000)).norm() < 1e-10 * all.norm());
  const Vector skewed = blind::sample_command(command, 0, 1.01e-3, 1001);
  CHECK(skewed(1000) == Approx(blind::sample_command(command, 1.01, 1e-3, 1)(0)).epsilon(1e-9));
}

TEST_CASE("every drive has the RMS asked for and stays in its band") {
  for (const std::string& name : blind::drive_names()) {
    CAPTURE(name);
    Random random(5, Stream::road);
    const blind::Command command = blind::make_command({.name = name, .rms = 0.01}, random);
    for (const blind::Cosine& c : command) CHECK(c.frequency_hz < 26);
    const Vector u = blind::sample_command(command, 0, 0.01, 40000);
    CHECK(u.norm() / std::sqrt(40000.0) == Approx(0.01).epsilon(0.05));
  }
}

TEST_CASE("tyres carry the weight of the car at rest, fore and aft by the lever of the centre of mass") {
  const blind::Plan plan = plan_from(to_json(test::full_car()));
  const Vector load = blind::static_loads(plan);
  double sum = 0;
  for (Index e = 0; e < load.size(); ++e) sum += load(e);
  CHECK(sum == Approx(9.81 * (1300 + 2 * 40 + 2 * 45)).epsilon(1e-9));
  CHECK(load(1) - 40 * 9.81 == Approx(0.5 * 9.81 * 1300 * 1.5 / 2.7).epsilon(1e-9));  // tyre_fl
}

TEST_CASE("sizes are set by what re-tuning leaves: inside the range of the strength, and none without an effect",
          "[slow]") {
  blind::CaseSpec spec;
  spec.case_class = "single";
  spec.plan = std::make_shared<const blind::Plan>(plan_from(parse_json(test::quarter_car_text, "plant.json")));
  spec.samples = 400;
  for (const auto& kind : blind::effect_kinds(blind::Family::catalogue))
    if (kind.effect == "damper_asymmetry") spec.effects = {{&kind, "suspension"}};
  REQUIRE(spec.effects.size() == 1);
  for (const auto& [strength, low, high] : {std::tuple("weak", 0.3, 0.7), {"medium", 0.7, 2.0}, {"strong", 2.0, 6.0}}) {
    CAPTURE(strength);
    spec.strength_class = strength;
    const blind::Prepared prepared = blind::prepare(spec);
    REQUIRE(prepared.unreachable.empty());
    CHECK(prepared.gap_sigma > low);
    CHECK(prepared.gap_sigma < high);
    CHECK(prepared.gap_sigma < prepared.delivered_sigma);
  }
  spec.effects.clear();
  const blind::Prepared none = blind::prepare(spec);
  CHECK(none.gap_sigma < 0.1);
  CHECK(none.delivered_sigma > 0.5);  // the parameters are off inside their tolerances
}
