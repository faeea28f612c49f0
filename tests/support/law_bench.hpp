/// \file
/// Laws on a test bench: one of each kind, and their force along a prescribed travel.
#pragma once

#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/status.hpp"
#include "core/plant/laws.hpp"
#include "tests/support/plants.hpp"

namespace wheelhop::test {

inline Law law_from(const std::string& text) { return parse_law(JsonCursor::from(Json::parse(text), "law.json")); }

inline const std::string friction_text = R"({"law": "coulomb_friction", "force_n": 30, "stribeck_force_n": 12,
                                      "stribeck_velocity_m_per_s": 0.04, "velocity_m_per_s": 0.004})";
inline const std::string stribeck_text =
    R"({"law": "bouc_wen", "force_n": 60, "yield_travel_m": 0.0008, "stribeck_ratio": 0.4,
        "stribeck_velocity_m_per_s": 0.2})";
inline const std::string hysteresis_text =
    R"({"law": "bouc_wen", "force_n": 80, "yield_travel_m": 0.001, "exponent": 1.5, "beta": 0.7})";
inline const std::string maxwell_text =
    R"({"law": "maxwell_branch", "series_stiffness_n_per_m": 4e5, "relaxation_s": 0.004})";

/// Every law that gives a force, one at a time; corrections with the damper they correct.
inline std::vector<std::vector<Law>> groups() {
  const auto damper = law_from(R"({"law": "viscous_damper", "damping_ns_per_m": 1500})");
  std::vector<std::vector<Law>> list;
  for (const std::string& text :
       {friction_text, hysteresis_text, stribeck_text, maxwell_text,
        std::string(R"({"law": "power_law_damper", "damping_ns_per_m": 1500, "knee_velocity_m_per_s": 0.2})"),
        std::string(R"({"law": "bump_stop", "compression_gap_m": 0.01, "extension_gap_m": 0.02,
                        "stiffness_n_per_m": 100000, "exponent": 2.5})")})
    list.push_back({law_from(text)});
  for (const char* text :
       {R"({"law": "asymmetric_damper", "damping_ns_per_m": 1500, "asymmetry": -0.6})",
        R"({"law": "asymmetric_damper", "damping_ns_per_m": 1500, "asymmetry": 0.4, "knee_velocity_m_per_s": 0.2,
            "rebound_ratio": 0.3, "jounce_ratio": 1.6})",
        R"({"law": "digressive_damper", "damping_ns_per_m": 1500, "knee_velocity_m_per_s": 0.1, "exponent": 0.2})",
        R"({"law": "digressive_damper", "damping_ns_per_m": 1500, "knee_velocity_m_per_s": 0.1, "exponent": 2})",
        R"({"law": "digressive_damper", "damping_ns_per_m": 1500, "knee_velocity_m_per_s": 0.2, "exponent": 0.1,
            "sharpness": 3})",
        R"({"law": "damper_mount", "damping_ns_per_m": 1500, "relaxation_s": 0.004})",
        R"({"law": "position_dependent_damper", "damping_ns_per_m": 1500, "per_m2": 80, "per_m": -4})",
        R"({"law": "fading_damper", "damping_ns_per_m": 1500, "fade_per_k": 0.2, "heat_capacity_j_per_k": 3,
            "cooling_s": 2})",
        R"({"law": "cavitating_damper", "damping_ns_per_m": 1500, "dead_travel_m": 0.002, "side": -1})",
        R"({"law": "cavitating_damper", "damping_ns_per_m": 1500, "dead_travel_m": 0.001, "side": 1, "onset": 4})"})
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
inline double loop_area(const std::vector<Law>& laws, double amplitude_m, double frequency_hz,
                        double* largest_n = nullptr) {
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

inline Plant one_mass_with(const std::vector<std::string>& laws, double hold_hz = 500) {
  Plant plant = plant_from(one_mass_text);
  plant.inputs[0].hold_hz = hold_hz;
  for (const std::string& text : laws) plant.elements[0].laws.push_back(law_from(text));
  return plant;
}

inline std::string law_refusal(const std::string& text) {
  try {
    law_from(text);
  } catch (const UserError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace wheelhop::test
