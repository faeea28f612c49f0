// Friction that slides and sticks, in motion that nothing drives: states at the beginning, screen, and fits.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "core/data/metrics.hpp"
#include "core/gap/which/extend.hpp"
#include "core/gap/which/hypothesis.hpp"
#include "core/plant/dataset.hpp"
#include "tests/support/places.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/solver/levenberg_marquardt.hpp"
#include "variants/solver/secant_levenberg_marquardt.hpp"
#include "variants/table.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

constexpr const char* two_masses_text = R"({"name": "frame",
  "masses": [{"name": "a", "mass_kg": 2, "tolerance": 0.03}, {"name": "b", "mass_kg": 1, "tolerance": 0.03}],
  "inputs": [{"name": "F", "kind": "force", "unit": "N", "on": "a", "hold_hz": 1600, "interpolation": "zoh"}],
  "elements": [
    {"name": "s1", "between": ["ground", "a"], "laws": [
      {"law": "linear_spring", "stiffness_n_per_m": 5000, "tolerance": 0.1},
      {"law": "viscous_damper", "damping_ns_per_m": 10, "tolerance": 0.3}]},
    {"name": "s2", "between": ["a", "b"], "laws": [
      {"law": "linear_spring", "stiffness_n_per_m": 3000, "tolerance": 0.1},
      {"law": "viscous_damper", "damping_ns_per_m": 7, "tolerance": 0.3}]}],
  "sensors": [{"name": "d_a", "kind": "displacement", "of": "a", "unit": "m"},
              {"name": "d_b", "kind": "displacement", "of": "b", "unit": "m"}]})";

/// A rig that differs from the plant inside its tolerances and has friction in an element, let go from two positions.
struct Decay {
  Plant rig;
  RecordSet set;
};

Decay let_go(const Plant& plant, std::size_t element, double force, double speed, Random& random) {
  Decay out{plant, {}};
  for (const FitParameter& own : tolerance_parameters(plant))
    set_parameter(out.rig, own.name, get_parameter(plant, own.name) + 0.4 * random.normal() * own.scale);
  out.rig.elements[element].laws.push_back({find_law("coulomb_friction"), {force, 0, 0.05, speed}});
  out.set.sampling_hz = 200;
  Vector noise;
  for (const char* role : {"estimation", "validation"}) {
    const Matrix silence = Matrix::Zero(1, 800 * 8);
    Vector start(4);
    start << 0.012, 0.019, 0, 0;
    start *= role[0] == 'e' ? 1 : 0.8;
    const GeneratedRecord made =
        generate_record(out.rig, silence, out.set.sampling_hz, {.substeps = 8, .initial_state = start});
    REQUIRE(made.status == Status::ok);
    Signal signal = made.signal;
    if (noise.size() == 0) noise = 2e-3 * rms(signal.y);
    for (Index i = 0; i < signal.y.rows(); ++i) {
      for (Index k = 0; k < signal.y.cols(); ++k) signal.y(i, k) += noise(i) * random.normal();
      out.set.noise_std[plant.sensors[static_cast<std::size_t>(i)].name] = noise(i);
    }
    out.set.records.push_back({role, role, "", 0, signal});
  }
  return out;
}

}  // namespace

TEST_CASE("friction of any size and sharpness that brings a plant to rest is fitted to the noise where it acts",
          "[slow]") {
  Random random = numbers(8101);
  const Plant plant = plant_from(two_masses_text);
  const auto quick =
      make_secant_levenberg_marquardt({.relative_decrease = kQuickDecrease, .trusted_gain = 0.25, .ending_share = 1});
  const auto thorough = make_secant_levenberg_marquardt({.relative_decrease = 1e-4});
  const auto patient = make_levenberg_marquardt({.relative_decrease = 1e-5});
  const GapSolvers solvers{*quick, *thorough, *patient};
  const CandidateList candidates = effect_candidates;
  for (int trial = 0; trial < 6; ++trial) {
    const std::size_t element = trial % 2 == 0 ? 0 : 1;
    const double force = std::pow(10, -0.6 + 0.7 * random.uniform());
    const double speed = std::pow(10, -3 + 0.8 * random.uniform());
    const Decay decay = let_go(plant, element, force, speed, random);
    const GapData data = gap_data(plant, decay.set, noise_floor(decay.set), 2);
    const Study study{plant, data, solvers, candidates, tolerance_parameters(plant)};
    const Hypothesis retuned = fit_hypothesis(study, plant, study.tolerances);
    CAPTURE(trial, force, speed, retuned.stage.misfit);
    REQUIRE(retuned.stage.misfit > 10);
    std::vector<Hypothesis> fits = extend(study, retuned, {});
    REQUIRE_FALSE(fits.empty());
    finish(study, retuned.chi2, 4, fits);
    const EffectAt there{"coulomb_friction", part_place(plant.elements[element].name)};
    CHECK(name_of(fits.front().effects.back()) == there);
    CHECK(fits.front().chi2 < 1.3 * data.samples);
    CHECK(get_parameter(fits.front().fit.plant, fits.front().parameters.back().name) == Approx(speed).epsilon(0.3));
  }
}

TEST_CASE("a decay of a plant that holds friction begins where the rig was let go, whatever rest looks like",
          "[slow]") {
  Random random = numbers(8102);
  const auto solver = make_levenberg_marquardt({.relative_decrease = 1e-5});
  for (int trial = 0; trial < 8; ++trial) {
    const double force = std::pow(10, -0.6 + 0.7 * random.uniform());
    const double speed = std::pow(10, -3 + 0.8 * random.uniform());
    const Decay decay = let_go(plant_from(two_masses_text), trial % 2 == 0 ? 0 : 1, force, speed, random);
    const GapData data = gap_data(decay.rig, decay.set, noise_floor(decay.set), 2);
    const PlantFit fit = fit_plant(decay.rig, {}, data.fitted, *solver, {.linearise = false});
    CAPTURE(trial, force, speed);
    REQUIRE_FALSE(fit.error.empty());
    CHECK(fit.misfit < 1.3);
    CHECK(fit.initial_states.front().motion(0) == Approx(0.012).epsilon(0.02));
  }
}
