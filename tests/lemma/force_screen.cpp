// The screen in the domain of forces, on plants whose motion is far from that of the rig.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/data/metrics.hpp"
#include "core/gap/which/force_screen.hpp"
#include "core/plant/dataset.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/solver/levenberg_marquardt.hpp"
#include "variants/table.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// Two storeys of little damping on a shaking table.
Plant frame() {
  Plant plant = plant_from(shaken_text);
  plant.elements[0].laws = {{find_law("linear_spring"), {9000}}, {find_law("viscous_damper"), {6}}};
  plant.sensors.pop_back();  // no rig has a cell in its columns
  plant.inputs[0].interpolation = "zoh";
  return plant;
}

RecordSet measured(const Plant& rig, Random& random) {
  RecordSet set;
  set.sampling_hz = 200;
  for (const char* role : {"estimation", "validation"}) {
    Matrix drive(1, 20000);
    double level = 0;
    for (Index k = 0; k < drive.cols(); ++k) {
      if (k % 5 == 0) level = 0.9 * level + random.normal();
      drive(k) = level;
    }
    GeneratedRecord made = generate_record(rig, drive, set.sampling_hz, {.substeps = stable_substeps(rig)});
    REQUIRE(made.status == Status::ok);
    set.records.push_back({role, role, "", 0, made.signal});
  }
  for (Index i = 0; i < rig.sensor_count(); ++i)
    set.noise_std[rig.sensors[static_cast<std::size_t>(i)].name] = 0.005 * rms(set.records[0].signal.y)(i);
  return set;
}

}  // namespace

TEST_CASE("the law that bends a motion beyond recognition is the first of the screen by force, at about its size",
          "[slow]") {
  Random random = numbers(6601);
  const Plant nominal = frame();
  const auto solver = make_levenberg_marquardt({});
  const GapSolvers solvers{*solver, *solver, *solver};
  const CandidateList candidates = effect_candidates;
  for (int trial = 0; trial < 4; ++trial) {
    const std::size_t element = trial % 2 == 0 ? 0 : 1;
    const double cubic = std::pow(10, 7.6 + 0.5 * random.uniform());
    Plant rig = nominal;
    rig.elements[element].laws.push_back({find_law("polynomial_spring"), {0, 0, cubic}});
    const RecordSet set = measured(rig, random);
    const GapData data = gap_data(nominal, set, noise_floor(set), 0.5);
    const Study study{nominal, data, solvers, candidates, tolerance_parameters(nominal)};
    const Hypothesis home = fit_hypothesis(study, nominal, {});
    REQUIRE(home.stage.misfit > 100);
    const Place location = part_place(nominal.elements[element].name);
    CAPTURE(location, cubic);
    PlantFit from = home.fit;
    from.theta = Vector::Zero(static_cast<Index>(study.tolerances.size()));
    const ForceScreened found = screen_by_force(study, home.fit, from, location, {});
    REQUIRE_FALSE(found.screened.empty());
    const EffectCandidate& best = found.candidates[found.screened.front().candidate];
    CHECK(name_of(best) == EffectAt{"spring_nonlinearity", location});
    CHECK(found.screened.front().gain > 0.8);
    for (const Screened& own : found.screened) {
      const EffectCandidate& candidate = found.candidates[own.candidate];
      if (candidate.label().form != "polynomial") continue;
      const std::string name = location.name + ".polynomial_spring.coefficients_3";
      CHECK(get_parameter(candidate.plant, name) == Approx(cubic).epsilon(0.25));
    }
    // At the other place it is no law of that place's motion.
    const Place elsewhere = part_place(nominal.elements[1 - element].name);
    const ForceScreened wrong = screen_by_force(study, home.fit, from, elsewhere, {});
    if (!wrong.screened.empty()) CHECK(wrong.screened.front().gain < found.screened.front().gain);
  }
}

TEST_CASE("another law that makes an answer's force along its motion is a rival of it, at the size that makes it",
          "[slow]") {
  Random random = numbers(6602);
  const Plant nominal = frame();
  const auto solver = make_levenberg_marquardt({});
  const GapSolvers solvers{*solver, *solver, *solver};
  const CandidateList candidates = effect_candidates;
  const ForceScreenOptions options{.fits = 6, .share = 0.9, .fits_of_plant = 3};
  for (int trial = 0; trial < 4; ++trial) {
    const std::size_t element = trial % 2 == 0 ? 0 : 1;
    const double cubic = std::pow(10, 7.6 + 0.5 * random.uniform());
    Plant rig = nominal;
    rig.elements[element].laws.push_back({find_law("polynomial_spring"), {0, 0, cubic}});
    const RecordSet set = measured(rig, random);
    const GapData data = gap_data(nominal, set, noise_floor(set), 0.5);
    const Study study{nominal, data, solvers, candidates, tolerance_parameters(nominal)};
    // The answer may have any law that makes the rig's force: here the rig's own.
    const Study answered{rig, data, solvers, candidates, tolerance_parameters(rig)};
    Hypothesis answer = fit_hypothesis(answered, rig, {});
    REQUIRE(answer.fit.misfit < 1.1);
    answer.fit.theta = Vector::Zero(static_cast<Index>(study.tolerances.size()));
    const Place location = part_place(nominal.elements[element].name);
    CAPTURE(location, cubic);
    const auto rivals = [&](const Place& place, const std::function<bool(const EffectCandidate&)>& asked) {
      return screen_rivals(study, answer.fit, answer.fit, place, asked, options);
    };
    const ForceScreened all = rivals(location, [](const EffectCandidate&) { return true; });
    REQUIRE_FALSE(all.screened.empty());
    const EffectCandidate& best = all.candidates[all.screened.front().candidate];
    CHECK(name_of(best) == EffectAt{"spring_nonlinearity", location});
    CHECK(best.label().form == "polynomial");
    CHECK(all.screened.front().gain > 0.999);
    CHECK(get_parameter(best.plant, location.name + ".polynomial_spring.coefficients_3") ==
          Approx(cubic).epsilon(0.02));
    // What may not be one is none, and no dissipative law makes an elastic force.
    const ForceScreened others =
        rivals(location, [](const EffectCandidate& own) { return own.label().effect != "spring_nonlinearity"; });
    for (const Screened& own : others.screened) {
      CHECK(own.gain > options.share);
      CHECK(others.candidates[own.candidate].label().effect == "bump_stop");
    }
    // Where the answer has no effect there is nothing to be mistaken.
    const Place elsewhere = part_place(nominal.elements[1 - element].name);
    CHECK(rivals(elsewhere, [](const EffectCandidate&) { return true; }).screened.empty());
  }
}
