// What the laws beyond springs and viscous dampers must obey: signs, passivity, memory, limits.
#include "core/plant/laws.hpp"

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>

#include "core/base/random.hpp"
#include "core/base/status.hpp"
#include "core/plant/linearise.hpp"
#include "core/plant/simulate.hpp"
#include "tests/support/plants.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

Law law_from(const std::string& text) { return parse_law(JsonCursor::from(Json::parse(text), "law.json")); }

const std::string friction_text = R"({"law": "coulomb_friction", "force_n": 30, "stribeck_force_n": 12,
                                      "stribeck_velocity_m_per_s": 0.04, "velocity_m_per_s": 0.004})";
const std::string hysteresis_text =
    R"({"law": "bouc_wen", "force_n": 80, "yield_travel_m": 0.001, "exponent": 1.5, "beta": 0.7})";
const std::string maxwell_text = R"({"law": "maxwell_branch", "series_stiffness_n_per_m": 4e5, "relaxation_s": 0.004})";

/// Every law that gives a force, one at a time; corrections with the damper they correct.
std::vector<std::vector<Law>> groups() {
  const auto damper = law_from(R"({"law": "viscous_damper", "damping_ns_per_m": 1500})");
  std::vector<std::vector<Law>> list;
  for (const std::string& text :
       {friction_text, hysteresis_text, maxwell_text,
        std::string(R"({"law": "power_law_damper", "damping_ns_per_m": 1500, "knee_velocity_m_per_s": 0.2})"),
        std::string(R"({"law": "bump_stop", "compression_gap_m": 0.01, "extension_gap_m": 0.02,
                        "stiffness_n_per_m": 100000, "exponent": 2.5})")})
    list.push_back({law_from(text)});
  for (const char* text :
       {R"({"law": "asymmetric_damper", "damping_ns_per_m": 1500, "asymmetry": -0.6})",
        R"({"law": "digressive_damper", "damping_ns_per_m": 1500, "knee_velocity_m_per_s": 0.1, "exponent": 0.2})",
        R"({"law": "digressive_damper", "damping_ns_per_m": 1500, "knee_velocity_m_per_s": 0.1, "exponent": 2})",
        R"({"law": "position_dependent_damper", "damping_ns_per_m": 1500, "per_m2": 80, "per_m": -4})",
        R"({"law": "fading_damper", "damping_ns_per_m": 1500, "fade_per_k": 0.2, "heat_capacity_j_per_k": 3,
            "cooling_s": 2})",
        R"({"law": "cavitating_damper", "damping_ns_per_m": 1500, "dead_travel_m": 0.002, "side": -1})"})
    list.push_back({damper, law_from(text)});
  return list;
}

/// Force of laws in parallel, their states carried along a prescribed travel by Runge-Kutta steps.
class Bench {
 public:
  explicit Bench(std::vector<Law> laws) : laws_(std::move(laws)) {
    for (const Law& law : laws_) states_ += law.states();
    z = Vector::Zero(states_);
  }

  double force(double x, double v, const Vector& state, Vector& rate) const {
    double sum = 0, f = 0;
    rate.resize(states_);
    Index at = 0;
    for (const Law& law : laws_) {
      const bool defined = law.states() > 0
                               ? law.kind->memory.force(law.values, x, v, state.data() + at, f, rate.data() + at)
                               : law.force(x, v, f);
      if (!defined) FAIL(law.kind->name << " is not defined at " << x);
      at += law.states();
      sum += f;
    }
    return sum;
  }

  /// Runs x(t) for `steps` of h, calling visit(x, v, force) at the start of each.
  template <class Travel, class Rate, class Visit>
  void run(Travel x, Rate v, double h, Index steps, Visit visit) {
    Vector r1, r2, r3, r4;
    for (Index k = 0; k < steps; ++k, t += h) {
      visit(x(t), v(t), force(x(t), v(t), z, r1));
      force(x(t + h / 2), v(t + h / 2), z + h / 2 * r1, r2);
      force(x(t + h / 2), v(t + h / 2), z + h / 2 * r2, r3);
      force(x(t + h), v(t + h), z + h * r3, r4);
      z += h / 6 * (r1 + 2 * r2 + 2 * r3 + r4);
    }
  }

  Vector z;
  double t = 0;

 private:
  std::vector<Law> laws_;
  Index states_ = 0;
};

/// Work of the force over the period of a sine of travel that follows two settling periods.
double loop_area(const std::vector<Law>& laws, double amplitude_m, double frequency_hz, double* largest_n = nullptr) {
  const double w = 2 * M_PI * frequency_hz;
  const Index steps = 20000;
  const double h = 1 / frequency_hz / static_cast<double>(steps);
  const auto x = [&](double t) { return amplitude_m * std::sin(w * t); };
  const auto v = [&](double t) { return amplitude_m * w * std::cos(w * t); };
  Bench bench(laws);
  bench.run(x, v, h, 2 * steps, [](double, double, double) {});
  double area = 0, largest = 0;
  bench.run(x, v, h, steps, [&](double, double rate, double f) {
    area += f * rate * h;
    largest = std::max(largest, std::abs(f));
  });
  if (largest_n) *largest_n = largest;
  return area;
}

Plant one_mass_with(const std::vector<std::string>& laws, double hold_hz = 500) {
  Plant plant = plant_from(one_mass_text);
  plant.inputs[0].hold_hz = hold_hz;
  for (const std::string& text : laws) plant.elements[0].laws.push_back(law_from(text));
  return plant;
}

std::string refusal(const std::string& text) {
  try {
    law_from(text);
  } catch (const UserError& error) {
    return error.what();
  }
  return "accepted";
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

TEST_CASE("no law delivers net energy over a closed cycle, corrections with the damper they correct") {
  for (const std::vector<Law>& laws : groups()) {
    INFO(laws.back().kind->name);
    for (const double amplitude : {0.0004, 0.005, 0.05})
      for (const double frequency : {0.2, 3.0, 15.0}) {
        double largest = 0;
        const double area = loop_area(laws, amplitude, frequency, &largest);
        CHECK(area >= -1e-6 * largest * amplitude);
        const bool stores_only = laws.front().kind->name == "bump_stop";
        if (stores_only) CHECK(std::abs(area) <= 1e-6 * largest * amplitude);
        if (!stores_only && amplitude > 0.001) CHECK(area > 0);
      }
  }
}

TEST_CASE("a law with memory rests at zero, splits its power into stored energy and heat, and has exact slopes") {
  Random random(4, Stream::parameters);
  for (const LawKind& kind : law_table()) {
    if (kind.memory.states == 0) continue;
    INFO(kind.name);
    Law law;
    for (const std::vector<Law>& laws : groups())
      if (laws.back().kind == &kind) law = laws.back();
    REQUIRE(law.kind == &kind);
    const double scale = kind.name == "maxwell_branch" ? 100 : 0.6;
    double f = 1, rate = 1, zero = 0;
    REQUIRE(kind.memory.force(law.values, 0.03, 0, &zero, f, &rate));
    CHECK(f == 0);
    CHECK(rate == 0);
    CHECK(kind.memory.energy(law.values, &zero) == 0);
    for (int trial = 0; trial < 60; ++trial) {
      const double x = 0.03 * random.normal(), v = random.normal();
      double z = scale * (2 * random.uniform() - 1);
      REQUIRE(kind.memory.force(law.values, x, v, &z, f, &rate));
      const double h = 1e-6 * scale;
      const double above = z + h, below = z - h;
      const double gradient =
          (kind.memory.energy(law.values, &above) - kind.memory.energy(law.values, &below)) / (2 * h);
      const double heat = kind.memory.dissipation(law.values, x, v, &z);
      CHECK(f * v == Approx(gradient * rate + heat).epsilon(1e-6).margin(1e-6));
      if (!kind.is_correction) CHECK(heat >= 0);
      MemorySlopes s;
      REQUIRE(kind.memory.slopes(law.values, x, v, &z, s));
      const auto difference = [&](double dx, double dv, double dz, double& df, double& dg) {
        double f1, f0, g1, g0;
        const double up = z + dz, down = z - dz;
        REQUIRE(kind.memory.force(law.values, x + dx, v + dv, &up, f1, &g1));
        REQUIRE(kind.memory.force(law.values, x - dx, v - dv, &down, f0, &g0));
        const double size = 2 * (dx + dv + dz);
        df = (f1 - f0) / size;
        dg = (g1 - g0) / size;
      };
      double df, dg;
      difference(1e-6, 0, 0, df, dg);
      CHECK(s.df_dx == Approx(df).margin(1e-3));
      CHECK(s.dz_dx[0] == Approx(dg).margin(1e-3));
      difference(0, 1e-7, 0, df, dg);
      CHECK(s.df_dv == Approx(df).margin(1e-3));
      CHECK(s.dz_dv[0] == Approx(dg).epsilon(1e-5).margin(1e-3));
      difference(0, 0, h, df, dg);
      CHECK(s.df_dz[0] == Approx(df).epsilon(1e-6));
      CHECK(s.dz_dz[0] == Approx(dg).epsilon(1e-4).margin(1e-2));
    }
  }
}

TEST_CASE("hysteresis tends to its limit force, and its loop has the area of the closed form") {
  // n = 1, beta = 1/2: along growing travel z relaxes to 1 as exp(-x / x_y) from 0 and unloads elastically. A cycle
  // long against x_y encloses, branch by branch, the work of dz = dx / x_y from -1 to 0 and of 1 - exp(-x / x_y).
  const double limit = 80, yield = 0.001, amplitude = 0.03;
  const std::vector<Law> laws = {law_from(R"({"law": "bouc_wen", "force_n": 80, "yield_travel_m": 0.001})")};
  double largest = 0;
  const double area = loop_area(laws, amplitude, 1, &largest);
  CHECK(largest == Approx(limit).epsilon(1e-6));
  CHECK(largest <= limit);
  const double branch = -0.5 * yield + (2 * amplitude - yield) - yield;  // integral of z over 2 amplitude
  CHECK(area == Approx(2 * limit * branch).epsilon(1e-4));
}

TEST_CASE("hysteresis does not depend on the rate, a Maxwell branch does") {
  for (const double amplitude : {0.0005, 0.004}) {
    const double slow = loop_area({law_from(hysteresis_text)}, amplitude, 0.01),
                 fast = loop_area({law_from(hysteresis_text)}, amplitude, 20);
    CHECK(fast == Approx(slow).epsilon(1e-9));
    CHECK(loop_area({law_from(maxwell_text)}, amplitude, 20) >
          2 * loop_area({law_from(maxwell_text)}, amplitude, 0.01));
  }
}

TEST_CASE("a Maxwell branch has the stiffness k j w tau / (1 + j w tau)") {
  const double k = 4e5, tau = 0.004, amplitude = 0.002;
  for (const double frequency : {1.0, 12.0, 40.0, 200.0}) {
    const double w = 2 * M_PI * frequency, h = 1 / frequency / 2000;
    Bench bench({law_from(maxwell_text)});
    const auto x = [&](double t) { return amplitude * std::sin(w * t); };
    const auto v = [&](double t) { return amplitude * w * std::cos(w * t); };
    const auto settle = static_cast<Index>(std::ceil(40 * tau * frequency)) * 2000;
    bench.run(x, v, h, settle, [](double, double, double) {});
    std::complex<double> line = 0, travel = 0;
    Index sample = 0;
    bench.run(x, v, h, 2000, [&](double position, double, double f) {
      const auto turn = std::polar(1.0, -w * h * static_cast<double>(sample++));
      line += f * turn;
      travel += position * turn;
    });
    const std::complex<double> s(0, w * tau), expected = k * s / (1.0 + s);
    CHECK(std::abs(line / travel - expected) < 1e-6 * std::abs(expected));
  }
  // The linearised plant holds the same: its frequency response from force to position.
  const Plant plant = one_mass_with({maxwell_text});
  const LinearPlant model = linearise(plant);
  REQUIRE(model.status == Status::ok);
  REQUIRE(model.A.rows() == 3);
  const std::complex<double> s(0, 2 * M_PI * 9), branch = k * s * tau / (1.0 + s * tau);
  const ComplexMatrix system = s * ComplexMatrix::Identity(3, 3) - model.A.cast<std::complex<double>>();
  const std::complex<double> response =
      (model.C.row(0).cast<std::complex<double>>() * system.inverse() * model.B.cast<std::complex<double>>())(0, 0);
  CHECK(std::abs(response * (2.0 * s * s + 4.0 * s + 800.0 + branch) - 1.0) < 1e-10);
}

TEST_CASE("laws with memory leave the equilibrium and its start alone") {
  for (const std::string& law : {hysteresis_text, maxwell_text, friction_text}) {
    const Plant plain = one_mass_with({}, 5000), plant = one_mass_with({law}, 5000);
    const Vector load = Vector::Constant(1, 40);
    CHECK(static_equilibrium(plant, load).positions == static_equilibrium(plain, load).positions);
    const Simulation run = simulate(plant, Matrix::Constant(1, 400, 40), {.from_equilibrium = true});
    REQUIRE(run.status == Status::ok);
    CHECK(run.states.row(1).cwiseAbs().maxCoeff() < 1e-9);
  }
}

TEST_CASE("stored energy grows by the power of the inputs less the heat with every law, memories included") {
  for (Plant plant : {plant_from(quarter_car_text), plant_from(chain_text), full_car()}) {
    for (Element& element : plant.elements) {
      for (const std::vector<Law>& laws : groups()) element.laws.insert(element.laws.end(), laws.begin(), laws.end());
      element.laws.push_back(law_from(R"({"law": "backlash", "gap_m": 0.004})"));
      element.laws.push_back(law_from(R"({"law": "liftoff", "static_load_n": 900})"));
    }
    INFO(plant.name);
    Motion motion(plant);
    Random random(3, Stream::parameters);
    const Index n = plant.mass_count(), m = plant.input_count(), s = motion.memories();
    REQUIRE(s == 4 * static_cast<Index>(plant.elements.size()));
    int lifted = 0;
    for (int trial = 0; trial < 20; ++trial) {
      const Vector q = 0.01 * random.normal(n, 1), v = 0.5 * random.normal(n, 1), u = 0.005 * random.normal(m, 1),
                   u_rate = random.normal(m, 1);
      Vector z = 0.4 * random.normal(s, 1).cwiseMax(-2).cwiseMin(2), a(n), z_rate(s);
      motion.set_inputs(u.data(), u_rate.data());
      REQUIRE(motion.accelerations(q.data(), v.data(), z.data(), a.data(), z_rate.data()) == Motion::all_defined);
      const Motion::Energy now = motion.energy(q.data(), v.data(), z.data());
      const double h = 1e-7;
      const auto stored = [&](double shift) {
        const Vector moved = q + shift * v, memory = z + shift * z_rate;
        return motion.energy(moved.data(), v.data(), memory.data()).potential_j;
      };
      const double stored_w = (stored(h) - stored(-h)) / (2 * h);
      double kinetic_w = 0;
      for (Index i = 0; i < n; ++i) kinetic_w += plant.masses[static_cast<std::size_t>(i)].mass_kg * v(i) * a(i);
      const double scale = std::abs(stored_w) + std::abs(now.input_w) + std::abs(now.dissipated_w);
      CHECK(std::abs(kinetic_w + stored_w - (now.input_w - now.dissipated_w)) < 1e-5 * scale);
      lifted += now.dissipated_w < 0;
    }
    CHECK(lifted < 20);
  }
}

TEST_CASE("the linearisation of a plant with memories is the derivative of all its equations") {
  Plant plant = plant_from(quarter_car_text);
  for (Element& element : plant.elements) {
    for (const std::vector<Law>& laws : groups()) element.laws.insert(element.laws.end(), laws.begin(), laws.end());
    element.laws.push_back(law_from(R"({"law": "backlash", "gap_m": 0.001})"));
  }
  Motion motion(plant);
  const Index n = 2, s = motion.memories(), N = 2 * n + s;
  Random random(6, Stream::parameters);
  Vector point(N + 2);
  point << 0.01 * random.normal(n, 1), random.normal(n, 1), 0.3 * random.normal(s, 1), 0.004, 0;
  const LinearPlant model = linearise(plant, point.head(N), point.segment(N, 1));
  const auto evaluate = [&](const Vector& at) {
    Vector result(N + 3), a(n), z_rate(s);
    motion.set_inputs(&at(N), &at(N + 1));
    REQUIRE(motion.accelerations(at.data(), at.data() + n, at.data() + 2 * n, a.data(), z_rate.data()) ==
            Motion::all_defined);
    Vector y(3);
    motion.outputs(at.data(), at.data() + n, a.data(), y.data());
    result << at.segment(n, n), a, z_rate, y;
    return result;
  };
  Matrix analytic(N + 3, N + 2);
  analytic << model.A, model.B, model.B_rate, model.C, model.D, model.D_rate;
  for (Index j = 0; j < N + 2; ++j) {
    Vector up = point, down = point;
    up(j) += 1e-7;
    down(j) -= 1e-7;
    const Vector numerical = (evaluate(up) - evaluate(down)) / 2e-7;
    INFO("column " << j);
    CHECK((numerical - analytic.col(j)).cwiseAbs().maxCoeff() < 1e-5 * std::max(1.0, numerical.cwiseAbs().maxCoeff()));
  }
}

TEST_CASE("halving the step divides the error by sixteen with a Maxwell branch and smooth friction too") {
  const Plant plant =
      one_mass_with({R"({"law": "maxwell_branch", "series_stiffness_n_per_m": 3000, "relaxation_s": 0.02})",
                     R"({"law": "coulomb_friction", "force_n": 4, "stribeck_force_n": 1, "velocity_m_per_s": 0.5,
           "stribeck_velocity_m_per_s": 0.7})"},
                    100);
  const auto end_state = [&](Index substeps) {
    const Simulation run = simulate(plant, Matrix::Constant(1, 41, 20), {.substeps = substeps});
    REQUIRE(run.status == Status::ok);
    return Vector(run.states.col(40));
  };
  const Vector exact = end_state(128);
  const double coarse = (end_state(2) - exact).norm(), fine = (end_state(4) - exact).norm(),
               finer = (end_state(8) - exact).norm();
  CHECK(coarse / fine == Approx(16).epsilon(0.25));
  CHECK(fine / finer == Approx(16).epsilon(0.15));
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
  // The correction is the whole less the viscous part.
  const Law correction{.kind = find_law("digressive_damper"), .values = {1000, 0.1, 0}};
  double extra = 0;
  REQUIRE(correction.force(0, -0.5, extra));
  CHECK(extra == Approx(soft - linear));
  const Law asymmetric{.kind = find_law("asymmetric_damper"), .values = {1000, 0.3}};
  REQUIRE(asymmetric.force(0, 0.2, rebound));
  REQUIRE(asymmetric.force(0, -0.2, jounce));
  CHECK(rebound == Approx(60));  // growing travel is damped more
  CHECK(jounce == Approx(60));   // shrinking less
  const Law grooves{.kind = find_law("position_dependent_damper"), .values = {1000, 100, 2}};
  double f = 0;
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
    Bench bench({{.kind = find_law("cavitating_damper"), .values = {d, gap, side}}});
    Vector rate;
    CHECK(bench.force(0, -side * v, bench.z, rate) == 0);
    CHECK(d * side * v + bench.force(0, side * v, bench.z, rate) == 0);  // nothing right after the reversal
    bench.run([&](double t) { return side * v * t; }, [&](double) { return side * v; }, 1e-4, 400,
              [](double, double, double) {});
    // Filled as 1 - exp(-travel / gap) over 4 mm.
    CHECK(d * side * v + bench.force(0, side * v, bench.z, rate) == Approx(d * side * v * (1 - std::exp(-2.0))));
  }
  CHECK_THAT(refusal(R"({"law": "cavitating_damper", "damping_ns_per_m": 1, "dead_travel_m": 1e-3, "side": 0.5})"),
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

TEST_CASE("every law works between the ground and a mass") {
  for (const LawKind& kind : law_table()) {
    Json guide = {{"name", "guide"}, {"between", {"ground", "body"}}, {"laws", Json::array()}};
    if (kind.role != LawRole::force)
      guide["laws"].push_back({{"law", "linear_spring"}, {"stiffness_n_per_m", 2000}, {"tolerance", 0.05}});
    Json law = {{"law", kind.name}};
    for (const LawParameter& parameter : kind.parameters) {
      if (parameter.is_list)
        law[parameter.name] = {1000, 0, 1e5};
      else if (parameter.typical != 0 || parameter.required)
        law[parameter.name] = parameter.typical != 0 ? parameter.typical : 1000;
    }
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

TEST_CASE("stable substeps follow the stiffest law") {
  CHECK(stable_substeps(plant_from(one_mass_text)) == 1);
  const Plant stiff = one_mass_with({R"({"law": "coulomb_friction", "force_n": 40, "velocity_m_per_s": 0.001})"});
  // d = 40 / 0.001 on 2 kg: a pole at 20000 1/s against 500 Hz.
  CHECK(stable_substeps(stiff) == Approx(21).margin(1));
  CHECK(stable_substeps(stiff, 4) == 4);
}

TEST_CASE("parameters outside their range are refused with path and known names") {
  CHECK_THAT(refusal(R"({"law": "coulomb_friction", "force_n": -1})"), Contains("law.json") && Contains("$.force_n"));
  CHECK_THAT(refusal(R"({"law": "coulomb_friction"})"), Contains("force_n"));
  CHECK_THAT(refusal(R"({"law": "coulomb_friction", "force_n": 1, "velocity": 2})"), Contains("velocity_m_per_s"));
  CHECK_THAT(refusal(R"({"law": "boucwen", "force_n": 1})"), Contains("bouc_wen") && Contains("maxwell_branch"));
  CHECK_THAT(refusal(R"({"law": "bouc_wen", "force_n": 1, "yield_travel_m": 0})"), Contains("$.yield_travel_m"));
  CHECK_THAT(refusal(R"({"law": "bouc_wen", "force_n": 1, "yield_travel_m": 1e-3, "beta": 0.4})"), Contains("$.beta"));
  CHECK_THAT(refusal(R"({"law": "asymmetric_damper", "damping_ns_per_m": 1, "asymmetry": 1.5})"),
             Contains("$.asymmetry"));
  CHECK_THAT(refusal(R"({"law": "bump_stop", "stiffness_n_per_m": 1, "compression_gap_m": 0, "exponent": 4})"),
             Contains("$.exponent"));
  CHECK_THAT(refusal(R"({"law": "bump_stop", "stiffness_n_per_m": 1})"), Contains("extension_gap_m"));
  Json plant = Json::parse(quarter_car_text);
  plant["elements"][1]["laws"] = Json::parse(R"([{"law": "liftoff", "static_load_n": 3000}])");
  CHECK_THROWS_WITH(parse_plant(JsonCursor::from(plant, "plant.json")), Contains("$.elements[1].laws"));
}
