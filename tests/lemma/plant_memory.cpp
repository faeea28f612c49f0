// Laws with memory and what all laws obey together: passivity, energy balance, linearisation, order of the integrator.
#include "core/plant/laws.hpp"

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>

#include "core/base/random.hpp"
#include "core/plant/linearise.hpp"
#include "core/plant/simulate.hpp"
#include "tests/support/law_bench.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

TEST_CASE("no law delivers net energy over a closed cycle, corrections with the damper they correct", "[slow]") {
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
    const double scale = kind.name == "maxwell_branch" || kind.name == "damper_mount" ? 100 : 0.6;
    double f = 1, rate = 1, zero = 0;
    REQUIRE(kind.memory.force(law.values, 0.03, 0, &zero, f, &rate));
    CHECK(f == 0);
    CHECK(rate == 0);
    const auto energy = [&](const double* z) { return kind.memory.energy ? kind.memory.energy(law.values, z) : 0; };
    CHECK(energy(&zero) == 0);
    for (int trial = 0; trial < 60; ++trial) {
      const double x = 0.03 * random.normal(), v = random.normal();
      double z = scale * (2 * random.uniform() - 1);
      REQUIRE(kind.memory.force(law.values, x, v, &z, f, &rate));
      const double h = 1e-6 * scale;
      const double above = z + h, below = z - h;
      const double gradient = (energy(&above) - energy(&below)) / (2 * h);
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
      CHECK(s.df_dz[0] == Approx(df).epsilon(1e-6).margin(1e-5));
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

TEST_CASE("hysteresis that stiffens turns no cycle around, and on unloading is steeper than on loading") {
  for (const double stiffening : {0.5, 1.0, 1.2, 1.6})
    for (const double amplitude : {0.0002, 0.001, 0.003}) {
      CAPTURE(stiffening, amplitude);
      const std::vector<Law> laws = {law_from(
          Json{{"law", "bouc_wen"}, {"force_n", 80}, {"yield_travel_m", 0.001}, {"stiffening", stiffening}}.dump())};
      double largest = 0;
      const double slow = loop_area(laws, amplitude, 0.1, &largest);
      CHECK(slow > 0);
      CHECK(slow < 4 * largest * amplitude);
      CHECK(loop_area(laws, amplitude, 10) == Approx(slow).epsilon(1e-9));
      MemorySlopes loading, unloading;
      const double z = 0.3;
      const LawMemory& memory = laws[0].kind->memory;
      REQUIRE(memory.slopes(laws[0].values, 0, 1, &z, loading));
      REQUIRE(memory.slopes(laws[0].values, 0, -1, &z, unloading));
      CHECK(unloading.dz_dv[0] > loading.dz_dv[0]);
      CHECK((loading.dz_dv[0] > 1000) == (stiffening > 1));
    }
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

TEST_CASE("a damper behind a mount is that damper at low frequency, and the mount's spring at high") {
  const std::vector<Law> behind = {
      law_from(R"({"law": "viscous_damper", "damping_ns_per_m": 1500})"),
      law_from(R"({"law": "damper_mount", "damping_ns_per_m": 1500, "relaxation_s": 0.004})")};
  for (const double frequency : {0.1, 1 / (2 * M_PI * 0.004), 200.0}) {
    CAPTURE(frequency);
    const double w = 2 * M_PI * frequency, lag = w * 0.004, amplitude = 0.001;
    double largest = 0;
    const double area = loop_area(behind, amplitude, frequency, &largest);
    CHECK(largest == Approx(amplitude * 1500 * w / std::hypot(1, lag)).epsilon(0.01));
    CHECK(area == Approx(M_PI * amplitude * amplitude * 1500 * w / (1 + lag * lag)).epsilon(0.02));
  }
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
    REQUIRE(s == 7 * static_cast<Index>(plant.elements.size()));
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

TEST_CASE("the forces of the elements are those that accelerate the masses, memories and contact included") {
  Plant plant = plant_from(quarter_car_text);
  for (Element& element : plant.elements)
    for (const std::string& law : {hysteresis_text, maxwell_text, friction_text}) element.laws.push_back(law_from(law));
  plant.elements[1].laws.push_back(law_from(R"({"law": "liftoff", "static_load_n": 900})"));
  Motion motion(plant);
  const Vector q = (Vector(2) << 0.03, 0.02).finished(), v = (Vector(2) << 0.4, -0.1).finished(),
               rest = Vector::Zero(1);
  const Vector z = (Vector(4) << 0.5, 70, -0.3, 20).finished();
  Vector a(2), z_rate(4);
  motion.set_inputs(rest.data(), rest.data());
  REQUIRE(motion.accelerations(q.data(), v.data(), z.data(), a.data(), z_rate.data()) == Motion::all_defined);
  CHECK(motion.element_force(1) == 900);  // 200 kN/m over 20 mm would be 4000 N
  CHECK(300 * a(0) == Approx(-motion.element_force(0)));
  CHECK(40 * a(1) == Approx(motion.element_force(0) - motion.element_force(1)));
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
    Vector numerical = (evaluate(up) - evaluate(down)) / 2e-7;
    if (j == N + 1) {  // laws that take a drive's motion in steps: what a unit of it does to them at once
      const double unit = 1;
      Vector jumped = Vector::Zero(s);
      motion.step_memories(&unit, jumped.data());
      numerical.segment(2 * n, s) += jumped;
    }
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

TEST_CASE("sparing steps are short where friction yields fast, and follow it") {
  Plant plant = plant_from(quarter_car_text);
  plant.elements[0].laws.push_back(law_from(R"({"law": "bouc_wen", "force_n": 40, "yield_travel_m": 1e-4})"));
  Matrix drive(1, 4000);
  for (Index k = 0; k < drive.cols(); ++k) drive(0, k) = 0.02 * std::sin(30 * static_cast<double>(k) / plant.hold_hz());
  const auto run = [&](const SimulateOptions& options) {
    const Simulation result = simulate(plant, drive, options);
    REQUIRE(result.status == Status::ok);
    return result.states;
  };
  const SimulateOptions sparing = sparing_steps(plant, 4, 16);
  CHECK(sparing.substeps < sparing.most_substeps);
  const Matrix exact = run({.substeps = 64});
  const auto error = [&](const SimulateOptions& options) {
    return (run(options) - exact).row(4).norm() / exact.row(4).norm();  // of the memory
  };
  CHECK(error(sparing) < 0.5 * error({.substeps = sparing.substeps}));
  CHECK(error(sparing) < 2e-3);
  // A plant at rest asks for no more steps than the linear one: the same numbers.
  drive.setZero();
  CHECK(run(sparing) == run({.substeps = sparing.substeps}));
}

TEST_CASE("a step of a held drive reaches a Maxwell branch at once and decays from there") {
  const double k = 3000, tau = 0.02, step_m = 0.002;
  Plant plant = plant_from(quarter_car_text);
  plant.elements[1].laws.push_back(
      law_from(R"({"law": "maxwell_branch", "series_stiffness_n_per_m": 3000, "relaxation_s": 0.02})"));
  plant.masses[1].mass_kg = 1e9;  // does not give way
  Matrix drive = Matrix::Constant(1, 40, step_m);
  drive.leftCols(5).setZero();
  const Simulation run = simulate(plant, drive);
  REQUIRE(run.status == Status::ok);
  const Index memory = run.states.rows() - 1;
  CHECK(run.states(memory, 4) == 0);
  // The tyre is between the road and the wheel: what pushes the road up shortens it.
  CHECK(run.states(memory, 5) == Approx(-k * step_m));
  CHECK(run.states(memory, 25) == Approx(-k * step_m * std::exp(-20 / plant.hold_hz() / tau)).epsilon(1e-6));
}
