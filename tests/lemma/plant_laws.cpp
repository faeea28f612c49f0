// What each law beyond springs and viscous dampers does: signs, sizes, limits, and what of it is refused.
#include "core/plant/laws.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "core/plant/simulate.hpp"
#include "tests/support/law_bench.hpp"
#include "tests/support/plants.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

/// A law with typical values, as it stands in a plant file.
Json typical_law(const LawKind& kind) {
  Json law = {{"law", kind.name}};
  for (const LawParameter& parameter : kind.parameters) {
    if (parameter.is_list)
      law[parameter.name] = {1000, 0, 1e5};
    else if (parameter.typical != 0 || parameter.required)
      law[parameter.name] = parameter.typical != 0 ? parameter.typical : 1000;
  }
  return law;
}

}  // namespace

TEST_CASE("friction opposes the velocity, holds its size and is larger where it breaks away") {
  const Law law = law_from(friction_text);
  double f = 0, back = 0;
  for (const double v : {1e-4, 0.01, 0.3, 2.0}) {
    REQUIRE(law.force(0.02, v, f));
    REQUIRE(law.force(0.02, -v, back));
    CHECK(f > 0);  // a positive force pulls node b back toward a
    CHECK(back == -f);
  }
  CHECK(f == Approx(30));
  REQUIRE(law.force(0, 0.02, f));
  CHECK(f == Approx(30 + 12 * std::exp(-0.25)).epsilon(1e-3));

  // A sliding mass stops: v' = -F/m until it rests, then stays.
  Plant plant = one_mass_with({R"({"law": "coulomb_friction", "force_n": 10, "velocity_m_per_s": 0.02})"});
  plant.elements[0].laws.erase(plant.elements[0].laws.begin(), plant.elements[0].laws.begin() + 2);
  const Vector start = (Vector(2) << 0, 1).finished();
  const Simulation run = simulate(plant, Matrix::Zero(1, 500), {.initial_state = start});
  REQUIRE(run.status == Status::ok);
  CHECK(run.states(1, 50) == Approx(1 - 10.0 / 2 * 0.1).epsilon(1e-6));
  CHECK(run.states(0, 499) == Approx(0.1).epsilon(0.01));  // v^2 / (2 F/m)
  CHECK(std::abs(run.states(1, 499)) < 1e-6);
}

TEST_CASE("dampers keep the sign of the velocity, and each family bends the way its parameter says") {
  double soft = 0, linear = 0, hard = 0, rebound = 0, jounce = 0;
  const auto power = [](double exponent, double v, double& f) {
    const Law law{.kind = find_law("power_law_damper"), .values = {1000, 0.1, exponent}};
    REQUIRE(law.force(0, v, f));
  };
  power(0, -0.5, soft);
  power(1, -0.5, linear);
  power(2, -0.5, hard);
  CHECK(soft == Approx(-1000 * 0.5 / 6));
  CHECK(linear == -500);
  CHECK(hard == Approx(-1000 * 0.5 * 6));
  double f = 0;
  // The correction is the whole less the viscous part.
  const Law correction{.kind = find_law("digressive_damper"), .values = {1000, 0.1, 0, 1}};
  double extra = 0;
  REQUIRE(correction.force(0, -0.5, extra));
  CHECK(extra == Approx(soft - linear));
  const Law asymmetric{.kind = find_law("asymmetric_damper"), .values = {1000, 0.3, 0.1, 1, 1}};
  REQUIRE(asymmetric.force(0, 0.2, rebound));
  REQUIRE(asymmetric.force(0, -0.2, jounce));
  CHECK(rebound == Approx(60));  // growing travel is damped more
  CHECK(jounce == Approx(60));   // shrinking less
  // Valves that open: one slope far below the knee and another far beyond it, each way its own.
  const Law valves{.kind = find_law("asymmetric_damper"), .values = {1000, 0.3, 0.1, 0.25, 1}};
  REQUIRE(valves.force(0, 0.01, f));
  CHECK(f == Approx(0.3 * 1000 * 0.01).epsilon(1e-4));
  double far = 0, farther = 0;
  REQUIRE(valves.force(0, 2, far));
  REQUIRE(valves.force(0, 3, farther));
  CHECK(farther - far == Approx(1300 * 0.25 - 1000).epsilon(1e-4));
  CHECK(far == Approx(1300 * (0.1 + 0.25 * (2 - 0.1)) - 1000 * 2).epsilon(1e-4));
  REQUIRE(valves.force(0, -0.2, jounce));
  CHECK(jounce == Approx(60));
  // A sharp knee leaves the damper alone below it, a rounded one bends from standstill on.
  const Law sharp{.kind = find_law("digressive_damper"), .values = {1000, 0.1, 0, 8}};
  REQUIRE(sharp.force(0, 0.05, f));
  CHECK(f == Approx(0).margin(0.1));
  REQUIRE(sharp.force(0, 0.5, f));
  CHECK(f == Approx(1000 * (0.1 - 0.5)).epsilon(1e-3));
  const Law grooves{.kind = find_law("position_dependent_damper"), .values = {1000, 100, 2}};
  REQUIRE(grooves.force(0.1, 0.5, f));
  CHECK(f == Approx(1000 * (100 * 0.01 + 0.2) * 0.5));
}

TEST_CASE("a fading damper warms by the work it takes, up to the balance with its cooling") {
  const double d = 1500, a = 0.004, C = 50, tau = 4, v = 0.4;
  Bench bench({law_from(R"({"law": "fading_damper", "damping_ns_per_m": 1500, "fade_per_k": 0.004,
                            "heat_capacity_j_per_k": 50, "cooling_s": 4})")});
  double cold = 1, warm = 0;
  bench.run([&](double t) { return v * t; }, [&](double) { return v; }, 0.01, 6000,
            [&](double, double, double f) {
              if (bench.t == 0) cold = f;
              warm = f;
            });
  CHECK(cold == 0);
  const double T = (std::sqrt(1 + 4 * a * d * v * v * tau / C) - 1) / (2 * a);  // T (1 + a T) = d v^2 tau / C
  CHECK(bench.z(0) == Approx(T).epsilon(1e-5));
  CHECK(warm == Approx(d * v * (1 / (1 + a * T) - 1)).epsilon(1e-5));
}

TEST_CASE("a cavitating damper misses its force after a reversal, on its own side alone") {
  const double d = 1000, gap = 0.002, v = 0.1;
  for (const double side : {1.0, -1.0}) {
    Bench bench({{.kind = find_law("cavitating_damper"), .values = {d, gap, side, 3}}});
    Vector rate;
    CHECK(bench.force(0, -side * v, bench.z, rate) == 0);
    CHECK(d * side * v + bench.force(0, side * v, bench.z, rate) == 0);  // nothing right after the reversal
    bench.run([&](double t) { return side * v * t; }, [&](double) { return side * v; }, 1e-4, 400,
              [](double, double, double) {});
    // Two dead travels of 2 mm.
    CHECK(d * side * v + bench.force(0, side * v, bench.z, rate) ==
          Approx(d * side * v * (1 - (1.0 / 9 - 1.0 / 65) / (1 - 1.0 / 65))));
    bench.run([&](double t) { return side * v * t; }, [&](double) { return side * v; }, 1e-4, 4000,
              [](double, double, double) {});
    CHECK(bench.force(0, side * v, bench.z, rate) == 0);  // the chamber is full, exactly
    bench.run([&](double t) { return -side * v * t; }, [&](double) { return -side * v; }, 1e-4, 120,
              [](double, double, double) {});
    // 0.6 of the dead travel back start it anew, however long the stroke had been: 20 dead travels.
    CHECK(d * side * v + bench.force(0, side * v, bench.z, rate) == Approx(0).margin(4));
  }
  CHECK_THAT(law_refusal(R"({"law": "cavitating_damper", "damping_ns_per_m": 1, "dead_travel_m": 1e-3, "side": 0.5})"),
             Contains("side"));
}

TEST_CASE("a bump stop acts beyond its gap on its own side, with the stiffness at one centimetre") {
  const Law both = law_from(R"({"law": "bump_stop", "compression_gap_m": 0.03, "extension_gap_m": 0.05,
                                "stiffness_n_per_m": 100000, "exponent": 3})");
  const auto force = [](const Law& law, double x) {
    double f = 0;
    REQUIRE(law.force(x, 0, f));
    return f;
  };
  CHECK(force(both, -0.03) == 0);
  CHECK(force(both, 0.05) == 0);
  CHECK(force(both, -0.04) == Approx(-1000));
  CHECK(force(both, 0.06) == Approx(1000));
  CHECK(force(both, 0.07) == Approx(8000));
  const Law one = law_from(R"({"law": "bump_stop", "compression_gap_m": 0.03, "stiffness_n_per_m": 100000})");
  CHECK(force(one, 10) == 0);
  CHECK(force(one, -0.05) == Approx(-4000));
  CHECK(to_json(one).contains("extension_gap_m") == false);
}

TEST_CASE("a lifted tyre pulls no harder than its static load and pushes as before") {
  Plant plant = plant_from(quarter_car_text);
  const double load = 340 * 9.81;
  plant.elements[1].laws.push_back(law_from(R"({"law": "liftoff", "static_load_n": 3335.4})"));
  Motion motion(plant);
  const double u = 0, u_rate = 0;
  motion.set_inputs(&u, &u_rate);
  const Vector v = Vector::Zero(2);
  Vector a(2);
  const auto wheel_force = [&](double lift) {
    const Vector q = Vector::Constant(2, lift);
    REQUIRE(motion.accelerations(q.data(), v.data(), a.data()) == Motion::all_defined);
    return 40 * a(1);
  };
  CHECK(wheel_force(0.01) == Approx(-2000));
  CHECK(wheel_force(0.05) == Approx(-load));
  CHECK(wheel_force(0.5) == Approx(-load));
  CHECK(wheel_force(-0.05) == Approx(10000));
  // In flight the centre of mass falls freely: deviations from rest accelerate by -g.
  const Vector start = (Vector(4) << 0.08, 0.08, 0.5, 0.5).finished();
  const Simulation run = simulate(plant, Matrix::Zero(1, 30), {.initial_state = start});
  REQUIRE(run.status == Status::ok);
  REQUIRE(run.states.row(1).minCoeff() > 0.0167);  // in the air all the time
  const Eigen::RowVectorXd momentum = (300 * run.states.row(2) + 40 * run.states.row(3)) / 340;
  CHECK(momentum(29) == Approx(0.5 - 9.81 * 29e-3).epsilon(1e-9));
}

TEST_CASE("inside its clearance an element's spring is slack, and a load rests beyond it") {
  const Plant plant = one_mass_with({R"({"law": "backlash", "gap_m": 0.003})"});
  Motion motion(plant);
  const double u = 0, u_rate = 0, v = 0;
  double a = 0;
  motion.set_inputs(&u, &u_rate);
  for (const double x : {-0.003, -0.001, 0.0, 0.0029}) {
    REQUIRE(motion.accelerations(&x, &v, &a) == Motion::all_defined);
    CHECK(std::abs(a) < 1e-12);
  }
  const double beyond = -0.013;
  REQUIRE(motion.accelerations(&beyond, &v, &a) == Motion::all_defined);
  CHECK(2 * a == Approx(800 * 0.01 + 50000 * 1e-6));
  for (const double load : {60.0, 1e-3, -0.5, 1e-6, 0.0}) {
    INFO(load);
    const Equilibrium rest = static_equilibrium(plant, Vector::Constant(1, load));
    REQUIRE(rest.status == Status::ok);
    const Equilibrium tight = static_equilibrium(plant_from(one_mass_text), Vector::Constant(1, load));
    const double gap = load > 0 ? 0.003 : load < 0 ? -0.003 : 0;
    CHECK(rest.positions(0) == Approx(tight.positions(0) + gap).epsilon(1e-6).margin(1e-12));
  }
  Plant car = plant_from(quarter_car_text);
  car.elements[0].laws.push_back(law_from(R"({"law": "backlash", "gap_m": 0.0005})"));
  const Equilibrium lifted = static_equilibrium(car, Vector::Constant(1, 0.4));
  REQUIRE(lifted.status == Status::ok);
  CHECK(lifted.positions(0) == Approx(0.4));
}

TEST_CASE("a bending spring leaves rest alone, saturates or hardens as its exponent says, and never pulls back") {
  const auto total = [](double exponent, double x) {
    const Law law{.kind = find_law("bending_spring"), .values = {20000, 0.01, exponent}};
    double f = 0;
    REQUIRE(law.force(x, 0, f));
    return 20000 * x + f;
  };
  for (const double exponent : {0.0, 0.5, 1.0, 3.0}) {
    CAPTURE(exponent);
    CHECK(total(exponent, 1e-5) == Approx(0.2).epsilon(1e-5));
    CHECK(total(exponent, -0.03) == Approx(-total(exponent, 0.03)));
    for (double x = 0; x < 0.1; x += 0.01) CHECK(total(exponent, x + 0.01) > total(exponent, x));
  }
  CHECK(total(0, 10) == Approx(20000 * 0.01).epsilon(1e-3));
  CHECK(total(3, 0.02) == Approx(20000 * (0.02 + 8e-6 / 1e-4)));  // linear and cubic
}

TEST_CASE("a shifted working point gives F(x + x0) - F(x0), and a linear spring does not notice it") {
  const double x0 = 0.004, k2 = 3e5, k3 = 2e7;
  Plant plant = one_mass_with({});
  plant.elements[0].laws = {law_from(R"({"law": "polynomial_spring", "coefficients": [9000, 3e5, 2e7]})"),
                            law_from(R"({"law": "rest_offset", "offset_m": 0.004})")};
  Motion motion(plant);
  const double u = 0;
  motion.set_inputs(&u, &u);
  const auto spring = [&](double x) { return 9000 * x + k2 * x * x + k3 * x * x * x; };
  for (const double x : {-0.003, 0.0, 0.005}) {
    const double v = 0;
    double a = 0;
    REQUIRE(motion.accelerations(&x, &v, &a) == Motion::all_defined);
    CHECK(motion.element_force(0) == Approx(spring(x + x0) - spring(x0)).margin(1e-9));
    Matrix stiffness, damping;
    REQUIRE(motion.slopes(&x, &v, stiffness, damping) == Motion::all_defined);
    const double slope = 9000 + 2 * k2 * (x + x0) + 3 * k3 * (x + x0) * (x + x0);
    CHECK(stiffness(0, 0) == Approx(slope));
    // The energy's slope is the force.
    const double h = 1e-6, ahead = x + h, behind = x - h;
    const double rise = motion.energy(&ahead, &v).potential_j - motion.energy(&behind, &v).potential_j;
    CHECK(rise / (2 * h) == Approx(spring(x + x0) - spring(x0)).epsilon(1e-6).margin(1e-3));
  }
}

TEST_CASE("every law works between the ground and a mass") {
  for (const LawKind& kind : law_table()) {
    Json guide = {{"name", "guide"}, {"between", {"ground", "body"}}, {"laws", Json::array()}};
    if (kind.role != LawRole::force)
      guide["laws"].push_back({{"law", "linear_spring"}, {"stiffness_n_per_m", 2000}, {"tolerance", 0.05}});
    Json law = typical_law(kind);
    law["tolerance"] = 0.05;
    guide["laws"].push_back(law);
    Json text = Json::parse(quarter_car_text);
    text["elements"].push_back(guide);
    INFO(guide.dump());
    const Plant plant = parse_plant(JsonCursor::from(text, "plant.json"));
    CHECK(to_json(parse_plant(JsonCursor::from(to_json(plant), "again.json"))) == to_json(plant));
    Matrix drive(1, 1000);
    for (Index k = 0; k < 1000; ++k) drive(0, k) = 0.01 * std::sin(0.03 * static_cast<double>(k));
    const Simulation with = simulate(plant, drive), without = simulate(plant_from(quarter_car_text), drive);
    REQUIRE(with.status == Status::ok);
    if (kind.name != "bump_stop" && kind.name != "hardening_spring")
      CHECK((with.outputs - without.outputs).norm() > 1e-8 * without.outputs.norm());
  }
}

TEST_CASE("a law is elastic where its force does not depend on the rate, and dissipative where it vanishes with it") {
  for (const LawKind& kind : law_table()) {
    CAPTURE(kind.name);
    const Law law = parse_law(JsonCursor::from(typical_law(kind), "law.json"));
    if (kind.role != LawRole::force) {
      CHECK_FALSE((kind.is_elastic() || kind.is_dissipative()));
      continue;
    }
    bool rate_matters = false, force_at_rest = false;
    for (const double x : {-0.02, 0.001, 0.03}) {
      double still = 0, moving = 0;
      if (kind.memory.states > 0) {  // with something remembered
        std::array<double, max_law_states> z = {0.3, 0.3}, rate;
        REQUIRE(kind.memory.force(law.values, x, 0, z.data(), still, rate.data()));
        rate_matters = true;
      } else {
        if (!law.force(x, 0, still) || !law.force(x, 0.7, moving)) continue;
        rate_matters = rate_matters || moving != still;
      }
      force_at_rest = force_at_rest || still != 0;
    }
    CHECK(kind.is_elastic() == !rate_matters);
    CHECK(kind.is_dissipative() == (rate_matters && !force_at_rest));
  }
}

TEST_CASE("stable substeps follow the stiffest law") {
  CHECK(stable_substeps(plant_from(one_mass_text)) == 1);
  const Plant stiff = one_mass_with({R"({"law": "coulomb_friction", "force_n": 40, "velocity_m_per_s": 0.001})"});
  // d = 40 / 0.001 on 2 kg: a pole at 20000 1/s against 500 Hz.
  CHECK(stable_substeps(stiff) == Approx(21).margin(1));
  CHECK(stable_substeps(stiff, 4) == 4);
  // Yielding over 0.1 mm at 1 m/s: a state that decays with 10000 1/s in motion, and with nothing at rest.
  const Plant presliding = one_mass_with({R"({"law": "bouc_wen", "force_n": 40, "yield_travel_m": 1e-4})"});
  CHECK(stable_substeps(presliding) == 10);
  CHECK(sparing_steps(presliding, 4, 16).substeps == 1);
  CHECK(sparing_steps(presliding, 4, 16).most_substeps == 16);
  CHECK(sparing_steps(stiff, 4, 16).substeps == 4);
}

TEST_CASE("parameters outside their range are refused with path and known names") {
  CHECK_THAT(law_refusal(R"({"law": "coulomb_friction", "force_n": -1})"),
             Contains("law.json") && Contains("$.force_n"));
  CHECK_THAT(law_refusal(R"({"law": "coulomb_friction"})"), Contains("force_n"));
  CHECK_THAT(law_refusal(R"({"law": "coulomb_friction", "force_n": 1, "velocity": 2})"), Contains("velocity_m_per_s"));
  CHECK_THAT(law_refusal(R"({"law": "boucwen", "force_n": 1})"), Contains("bouc_wen") && Contains("maxwell_branch"));
  CHECK_THAT(law_refusal(R"({"law": "bouc_wen", "force_n": 1, "yield_travel_m": 0})"), Contains("$.yield_travel_m"));
  CHECK_THAT(law_refusal(R"({"law": "bouc_wen", "force_n": 1, "yield_travel_m": 1e-3, "beta": 0.4})"),
             Contains("$.beta"));
  CHECK_THAT(law_refusal(R"({"law": "asymmetric_damper", "damping_ns_per_m": 1, "asymmetry": 1.5})"),
             Contains("$.asymmetry"));
  CHECK_THAT(law_refusal(R"({"law": "bump_stop", "stiffness_n_per_m": 1, "compression_gap_m": 0, "exponent": 4})"),
             Contains("$.exponent"));
  CHECK_THAT(law_refusal(R"({"law": "bump_stop", "stiffness_n_per_m": 1})"), Contains("extension_gap_m"));
  Json plant = Json::parse(quarter_car_text);
  plant["elements"][1]["laws"] = Json::parse(R"([{"law": "liftoff", "static_load_n": 3000}])");
  CHECK_THROWS_WITH(parse_plant(JsonCursor::from(plant, "plant.json")), Contains("$.elements[1].laws"));
}

TEST_CASE("what corrects a damper or a spring follows its damping or stiffness, as long as both are the same") {
  for (const LawKind& kind : law_table()) {
    if (!kind.is_correction && !kind.corrects_spring) continue;
    CAPTURE(kind.name);
    const std::string number = kind.is_correction ? "damping_ns_per_m" : "stiffness_n_per_m";
    const std::string damper = "suspension.viscous_damper.damping_ns_per_m";
    const std::string spring = "suspension.hardening_spring.stiffness_n_per_m";
    const std::string &followed = kind.is_correction ? damper : spring, &other = kind.is_correction ? spring : damper;
    Plant plant = plant_from(quarter_car_text);
    const double cold = get_parameter(plant, followed);
    Law law{.kind = &kind, .values = {}};
    for (const LawParameter& parameter : kind.parameters) law.values.push_back(parameter.typical);
    std::size_t own = 0;
    while (kind.parameters[own].name != number) ++own;
    const std::string name = "suspension." + std::string(kind.name) + "." + number;
    law.values[own] = cold;
    plant.elements[0].laws.push_back(law);
    const auto follows = [&] {
      const std::vector<PlantParameter> list = plant_parameters(plant);
      const auto found = std::find_if(list.begin(), list.end(), [&](const auto& each) { return each.name == name; });
      REQUIRE(found != list.end());
      return found->follows &&
             std::count_if(list.begin(), list.end(), [](const auto& each) { return each.follows; }) == 1;
    };
    CHECK(follows());
    for (const double value : {1.7 * cold, 0.3 * cold, cold}) {
      set_parameter(plant, followed, value);
      CHECK(get_parameter(plant, name) == value);
    }
    // One that was given another number keeps it, and can be wrong by itself.
    set_parameter(plant, name, 1.1 * cold);
    set_parameter(plant, followed, 2 * cold);
    CHECK(get_parameter(plant, name) == 1.1 * cold);
    CHECK_FALSE(follows());
    // A spring of the same number is no damper, and a damper no spring.
    set_parameter(plant, other, 1.1 * cold);
    CHECK(get_parameter(plant, name) == 1.1 * cold);
  }
}
