// Every family of effects on every plant: candidates stand where they say, simulate, and vanish at their ideal
// strength.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "core/gap/which/screen.hpp"
#include "core/optimise/bounded_step.hpp"
#include "core/plant/dataset.hpp"
#include "core/plant/simulate.hpp"
#include "tests/support/effect_cases.hpp"
#include "tests/support/places.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/effect/effects.hpp"
#include "variants/solver/levenberg_marquardt.hpp"
#include "variants/table.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

TEST_CASE("candidates stand at places of the plant, name parameters it has, and simulate") {
  for (const Case& c : cases()) {
    std::set<Place> places = {clock_place()};
    for (const PlantInput& input : c.plant.inputs) places.insert(actuator_of(c.plant, input));
    for (const Element& element : c.plant.elements) places.insert(part_place(element.name));
    for (const Mass& mass : c.plant.masses) places.insert({part_place(mass.name), guide_place(mass.name)});
    for (const Sensor& sensor : c.plant.sensors) places.insert(sensor_place(sensor.name));
    std::set<EffectId> seen;
    for (const EffectCandidate& candidate : effect_candidates(c.plant, c.operation)) {
      CAPTURE(c.plant.name, candidate.label().effect, candidate.location, candidate.label().form);
      CHECK(places.count(candidate.location) == 1);
      seen.insert(candidate.label().effect);
      CHECK(candidate.parameters.empty() == (candidate.label().effect == "quantisation"));
      for (const Label& label : candidate.labels)
        for (const Plausible& plausible : label.plausible) {
          CHECK(0 < plausible.low);
          CHECK(plausible.low < plausible.high);
          CHECK_NOTHROW(get_parameter(candidate.plant, plausible.parameter));
        }
      for (const FitParameter& parameter : candidate.parameters) {
        CHECK(parameter.scale > 0);
        CHECK_NOTHROW(get_parameter(candidate.plant, parameter.name));
      }
      for (const auto& [name, value] : candidate.typical)
        CHECK(get_parameter(at_typical_size(candidate).plant, name) == value);
      Vector residual;
      CHECK(plant_residual(candidate.plant, {c.record}, {c.rest}, residual));
    }
    CHECK(seen.size() >= 10);
  }
}

TEST_CASE("a proportional effect acts more the stronger it is, and at its ideal strength the plant is as before") {
  for (const Case& c : cases()) {
    Vector base;
    REQUIRE(plant_residual(c.plant, {c.record}, {c.rest}, base));
    for (EffectCandidate candidate : effect_candidates(c.plant, c.operation)) {
      if (!candidate.proportional || candidate.parameters.size() != 1) continue;
      CAPTURE(c.plant.name, candidate.label().effect, candidate.location, candidate.label().form);
      const std::string& name = candidate.parameters.front().name;
      const double typical = get_parameter(candidate.plant, name) - candidate.ideal;
      const auto change = [&](double strength) {
        set_parameter(candidate.plant, name, candidate.ideal + strength * typical);
        Vector residual;
        REQUIRE(plant_residual(candidate.plant, {c.record}, {c.rest}, residual));
        return (residual - base).norm();
      };
      const double vanishing = change(1e-3), half = change(0.5), whole = change(1);
      CHECK(vanishing <= 0.05 * whole + 1e-9 * (1 + base.norm()));
      CHECK(half <= whole);
    }
  }
}

TEST_CASE("the screen finds the effect that is missing, at its place, and nothing in what re-tuning can do") {
  Case c = make_case(quarter_car_text, 0.01);
  c.record.quantum.setZero();
  REQUIRE(operation_of(c.plant, {c.record}, {c.rest}, c.operation));
  Plant truth = c.plant;
  for (EffectCandidate& candidate : effect_candidates(c.plant, c.operation))
    if (candidate.label().effect == "damper_asymmetry" && candidate.refines.empty()) truth = candidate.plant;
  Random random = numbers(612);
  const GeneratedRecord record = generate_record(truth, c.record.drive, 200);
  REQUIRE(record.status == Status::ok);
  c.record.weight_std = 0.01 * (record.signal.y.rowwise().norm() / std::sqrt(200.0));
  c.record.y = record.signal.y + c.record.weight_std.asDiagonal() * random.normal(3, 200);
  const PlantFit base =
      fit_plant(c.plant, tolerance_parameters(c.plant), {c.record}, *make_levenberg_marquardt({}), {8});
  REQUIRE(base.error.size() == 1);
  std::vector<EffectCandidate> candidates = effect_candidates(base.plant, c.operation);
  EffectCandidate stiffer{{{"stiffness", ""}}, part_place("tyre"), base.plant, {}};
  stiffer.either_sign = true;
  set_parameter(stiffer.plant, "tyre.linear_spring.stiffness_n_per_m", 201000);
  candidates.push_back(stiffer);
  Changes changes;
  const std::vector<Screened> order = screen(base, {c.record}, candidates, {}, &changes);
  REQUIRE(order.size() == candidates.size());
  CHECK(candidates[order[0].candidate].label().effect == "damper_asymmetry");
  CHECK(order[0].strength == Approx(1).epsilon(0.3));
  // A second screen of the same fit needs no simulation and says the same.
  Changes more;
  const std::vector<Screened> again = screen(base, {c.record}, candidates, changes, &more);
  CHECK(more.empty());
  for (std::size_t i = 0; i < 5; ++i) CHECK(again[i].gain == Approx(order[i].gain).epsilon(1e-3));
  for (const Screened& screened : order)
    if (screened.candidate + 1 == candidates.size()) CHECK(screened.gain < 0.05 * order[0].gain);
}

TEST_CASE("a mass that no element joins to the ground has a guide, and every law that may stand there vanishes") {
  std::set<EffectId> seen;
  for (const Case& c : cases()) {
    Vector base;
    REQUIRE(plant_residual(c.plant, {c.record}, {c.rest}, base));
    for (const EffectCandidate& candidate : effect_candidates(c.plant, c.operation)) {
      if (candidate.location.kind != PlaceKind::guide || candidate.label().effect == "load") continue;
      CAPTURE(c.plant.name, candidate.label().effect, candidate.location, candidate.label().form);
      seen.insert(candidate.label().effect);
      CHECK(c.plant.name != "one_mass");  // its spring stands on the ground
      REQUIRE(candidate.plant.elements.size() == c.plant.elements.size() + 1);
      const Element& guide = candidate.plant.elements.back();
      CHECK(guide.from == "ground");
      CHECK(guide_place(guide.to) == candidate.location);
      // The plant is one that a file can hold, and the law's numbers stand at the guide.
      const Json written = to_json(candidate.plant);
      CHECK(to_json(parse_plant(JsonCursor::from(written, "guided.json"))) == written);
      Plant without = candidate.plant;
      for (const PlantParameter& parameter : plant_parameters(candidate.plant)) {
        if (parameter.handle.place != candidate.location) continue;
        const bool size = parameter.name.ends_with(".force_n") || parameter.name.ends_with(".damping_ns_per_m") ||
                          parameter.name.ends_with(".stiffness_n_per_m");
        if (size) set_parameter(without, parameter.name, 0);
      }
      Vector gone, there;
      REQUIRE(plant_residual(without, {c.record}, {c.rest}, gone));
      REQUIRE(plant_residual(candidate.plant, {c.record}, {c.rest}, there));
      // Memories choose steps of their own, which the difference of two integrations shows.
      CHECK((gone - base).norm() <= 1e-4 * c.record.y.norm());
      CHECK((there - base).norm() > 1e-3 * c.record.y.norm());
    }
  }
  CHECK(seen == std::set<EffectId>{"added_damping", "added_stiffness", "bump_stop", "coulomb_friction",
                                   "damper_nonlinearity", "hysteresis"});
}

TEST_CASE("places of laws: all elements, and a guide for each mass that neither turns nor stands on the ground") {
  const auto guided = [](const Plant& plant) {
    Operation operation;
    operation.elements.resize(plant.elements.size());
    operation.guides.resize(plant.masses.size());
    std::vector<std::string> masses;
    const std::vector<LawPlace> places = law_places(plant, operation);
    for (const LawPlace& place : places)
      if (place.guide()) masses.push_back(place.mass);
    CHECK(places.size() >= masses.size());
    return masses;
  };
  using Names = std::vector<std::string>;
  CHECK(guided(plant_from(one_mass_text)).empty());
  CHECK(guided(plant_from(chain_text)) == Names{"low", "mid", "top"});
  CHECK(guided(full_car()) == Names{"heave", "wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr"});
  const Case c = make_case(quarter_car_text, 0.005);
  REQUIRE(guided(c.plant) == Names{"body", "wheel"});
  // Once an effect has put an element there, a second law joins the first, at the same place.
  const LawPlace wheel = law_places(c.plant, c.operation).back();
  const EffectCandidate first =
      with_law(c.plant, wheel, "coulomb_friction", "", "coulomb_friction", {20, 0, 0.1, 0.01}, {{"force_n", 1}});
  CHECK(first.location == "guide:wheel"_at);
  CHECK(guided(first.plant) == Names{"body", "wheel"});
  Operation again;
  REQUIRE(operation_of(first.plant, {c.record}, {c.rest}, again));
  const LawPlace same = law_places(first.plant, again).back();
  CHECK(same.mass == "wheel");
  CHECK(same.operation.force_rms_n == Approx(c.operation.guides[1].force_rms_n).epsilon(0.3));
  const EffectCandidate second =
      with_law(first.plant, same, "hysteresis", "", "bouc_wen", {20, 0.001, 1, 0.5, 0}, {{"force_n", 1}});
  CHECK(second.location == "guide:wheel"_at);
  CHECK(second.plant.elements.size() == first.plant.elements.size());
  CHECK(second.plant.elements.back().laws.size() == 2);
  // A damper there is no damper as delivered, whose bend another effect would be.
  Plant damped = first.plant;
  damped.elements.back().laws.push_back({find_law("viscous_damper"), {100}});
  for (const EffectCandidate& candidate : effect_candidates(damped, again)) {
    CAPTURE(candidate.label().effect, candidate.label().form);
    if (candidate.location == "guide:wheel"_at)
      CHECK(candidate.label().effect.text().find("damp") == std::string::npos);
  }
  // An element of the plant file at the ground is a place of its own.
  Plant joined = c.plant;
  joined.elements.push_back({"post", "wheel", "ground", {{find_law("viscous_damper"), {10}}}});
  CHECK(guided(joined) == Names{"body"});
}

TEST_CASE("an unknown load is offered on each mass that does not turn, but where it is known or a reading's bias") {
  const auto offered = [](const Plant& plant) {
    Operation operation;
    operation.guides.resize(plant.masses.size());
    for (ElementOperation& guide : operation.guides) guide.force_rms_n = 100;
    std::set<Place> places;
    for (const EffectCandidate& candidate : make_load({})->candidates(plant, operation)) {
      CHECK(candidate.plant.loads.size() == plant.loads.size() + 1);
      CHECK(candidate.plant.loads.back().force_n == get_parameter(candidate.plant, candidate.parameters.front().name));
      const Json written = to_json(candidate.plant);
      CHECK(to_json(parse_plant(JsonCursor::from(written, "loaded.json"))) == written);
      places.insert(candidate.location);
    }
    return places;
  };
  using Places = std::set<Place>;
  const Plant car = plant_from(quarter_car_text);
  CHECK(offered(car) == Places{"guide:body"_at, "guide:wheel"_at});
  CHECK(offered(plant_from(one_mass_text)) == Places{"guide:m"_at});
  CHECK(offered(full_car()).count("guide:pitch"_at) == 0);
  Plant loaded = car;
  loaded.loads = {{"gravity", "body", -2450}};
  CHECK(offered(loaded) == Places{"guide:wheel"_at});
  // A linear plant whose only reading of a position is the travel: a constant force is that reading's bias. With a
  // second reading that it shifts in a ratio of its own it is none.
  Plant linear = car;
  linear.elements[0].laws = {{find_law("linear_spring"), {18000}}, {find_law("viscous_damper"), {850}}};
  CHECK(offered(linear).empty());
  linear.sensors.push_back({"cell", SensorKind::force, "", "", "N", {}, "tyre"});
  CHECK(offered(linear) == Places{"guide:body"_at});  // one on the wheel shifts the force of the tyre alone
  linear.sensors.push_back({"height", SensorKind::displacement, "ground", "wheel", "m"});
  CHECK(offered(linear) == Places{"guide:body"_at, "guide:wheel"_at});
}

TEST_CASE("a spring that the plant does not know is offered beside a damper alone, and acts as its stiffness says") {
  Case c = make_case(one_mass_text, 1);
  const auto offered = [&] {
    std::vector<EffectCandidate> list = effect_candidates(c.plant, c.operation);
    std::erase_if(list, [](const EffectCandidate& own) { return own.label().effect != "added_stiffness"; });
    return list;
  };
  CHECK(offered().empty());  // it has a spring
  std::erase_if(c.plant.elements[0].laws, [](const Law& law) { return law.kind->name != "viscous_damper"; });
  const std::vector<EffectCandidate> list = offered();
  REQUIRE(list.size() == 1);
  CHECK(list[0].location == part_place(c.plant.elements[0].name));
  const double stiffness = get_parameter(list[0].plant, list[0].parameters.front().name);
  CHECK(stiffness_at_rest(list[0].plant.elements[0]) == Approx(stiffness));
  CHECK(stiffness == Approx(0.1 * c.operation.elements[0].force_rms_n / c.operation.elements[0].travel_rms_m));
}

TEST_CASE("a spring to the ground is offered at every mass that no other joins to it, but at no wheel") {
  const Case c = make_case(quarter_car_text, 0.005);
  std::vector<Place> places;
  for (const EffectCandidate& own : effect_candidates(c.plant, c.operation))
    if (own.label().effect == "added_stiffness") {
      places.push_back(own.location);
      CHECK(stiffness_at_rest(own.plant.elements.back()) > 0);
      CHECK(own.plant.elements.back().from == "ground");
    }
  CHECK(places == std::vector<Place>{guide_place("body")});
}

TEST_CASE("a mount over a moving base and the columns of a frame are no tyres, what carries a wheel is one") {
  Random random = numbers(641);
  for (int trial = 0; trial < 20; ++trial) {
    const double stiffness = 1000 * std::pow(100, random.uniform());
    Plant mount = plant_from(one_mass_text);
    mount.inputs = {{.name = "base", .unit = "m", .hold_hz = 500, .from = {}, .to = {}}};
    mount.elements[0] = {"mount", "base", "m", {{find_law("linear_spring"), {stiffness}}}};
    CHECK_FALSE(is_tyre(mount, mount.elements[0]));
    Plant two = mount;
    two.masses.push_back({"top", 3});
    const double share = 0.05 + 1.5 * random.uniform();
    two.elements.push_back({"above", "m", "top", {{find_law("linear_spring"), {share * stiffness}}}});
    CAPTURE(share);
    CHECK(is_tyre(two, two.elements[0]) == (share < 0.5));
    CHECK_FALSE(is_tyre(two, two.elements[1]));
  }
}

TEST_CASE("a damper between two held nodes is a damper, no tyre") {
  const Plant bench = plant_from(R"({
    "name": "dynamometer",
    "inputs": [{"name": "stroke", "kind": "displacement", "unit": "m", "hold_hz": 1000}],
    "elements": [{"name": "damper", "between": ["ground", "stroke"],
                  "laws": [{"law": "viscous_damper", "damping_ns_per_m": 900}]}],
    "sensors": [{"name": "cell", "kind": "force", "element": "damper", "unit": "N"}]})");
  FitRecord record;
  record.drive.resize(1, 1000);
  for (Index k = 0; k < 1000; ++k) record.drive(0, k) = 0.01 * std::sin(0.02 * static_cast<double>(k));
  record.ratio = 5;
  record.y = simulate(bench, record.drive, {.decimation = 5}).outputs;
  record.weight_std = Vector::Ones(1);
  Operation operation;
  REQUIRE(operation_of(bench, {record}, {Vector(0)}, operation));
  std::set<std::string> seen;
  for (const EffectCandidate& candidate : effect_candidates(bench, operation)) {
    CAPTURE(candidate.label().effect, candidate.location, candidate.label().form);
    CHECK_FALSE(candidate.label().effect.text().starts_with("tyre"));
    Vector residual;
    CHECK(plant_residual(candidate.plant, {record}, {Vector(0)}, residual));
    seen.insert(to_string(name_of(candidate)));
  }
  for (const char* name : {"coulomb_friction@damper", "hysteresis@damper", "damper_asymmetry@damper",
                           "gain_error@sensor:cell", "bias@sensor:cell"})
    CHECK(seen.count(name) == 1);
}

TEST_CASE(
    "beside a damper that follows a drive an added force may follow it, and what corrects it follows as it does") {
  const Case c = make_case(semi_active_text, 0.005);
  const std::string slope = "suspension.viscous_damper.scheduled.damping_ns_per_m";
  std::size_t added = 0, corrections = 0;
  for (const EffectCandidate& candidate : effect_candidates(c.plant, c.operation)) {
    CAPTURE(candidate.label().effect, candidate.label().form, candidate.location);
    const std::string scheduled = candidate.law + ".scheduled.";
    const auto follows = [&](const FitParameter& own) { return own.name.starts_with(scheduled); };
    const bool moves = std::any_of(candidate.parameters.begin(), candidate.parameters.end(), follows);
    if (candidate.law.empty() || candidate.location != part_place("suspension")) {
      CHECK_FALSE(moves);
      continue;
    }
    const Law& law = candidate.plant.elements[0].laws.back();
    if (!law.kind->is_correction) {
      CHECK(moves == (law.kind->role == LawRole::force));
      added += moves;
      continue;
    }
    ++corrections;
    CHECK_FALSE(moves);
    Plant moved = candidate.plant;
    set_parameter(moved, slope, 400);
    CHECK(get_parameter(moved, scheduled + "damping_ns_per_m") == 400);
    const auto all = plant_parameters(candidate.plant);
    const auto own = std::find_if(all.begin(), all.end(), [&](const PlantParameter& parameter) {
      return parameter.name == scheduled + "damping_ns_per_m";
    });
    REQUIRE(own != all.end());
    CHECK(own->follows);
  }
  CHECK(added >= 4);
  CHECK(corrections >= 3);
}

TEST_CASE("the screen finds friction between a mass and the ground, where the plant file has no element") {
  Case c = make_case(quarter_car_text, 0.01);
  for (const Place& location : {guide_place("wheel"), guide_place("body")}) {
    CAPTURE(location);
    Plant truth = c.plant;
    for (const EffectCandidate& candidate : effect_candidates(c.plant, c.operation))
      if (candidate.label().effect == "coulomb_friction" && candidate.location == location &&
          candidate.label().form == "smoothed sign")
        truth = candidate.plant;
    REQUIRE(truth.elements.size() == c.plant.elements.size() + 1);
    Case measured = c;
    measured.record.quantum.setZero();
    measured.record.y = simulate(truth, c.record.drive, {.decimation = c.record.ratio}).outputs;
    measured.record.weight_std = 0.001 * (measured.record.y.rowwise().norm() / std::sqrt(200.0));
    REQUIRE(operation_of(c.plant, {measured.record}, {c.rest}, measured.operation));
    const PlantFit base = fit_plant(c.plant, {}, {measured.record}, *make_levenberg_marquardt({}), {8});
    REQUIRE(base.error.size() == 1);
    const std::vector<EffectCandidate> candidates = effect_candidates(base.plant, measured.operation);
    const std::vector<Screened> order = screen(base, {measured.record}, candidates);
    CHECK(candidates[order[0].candidate].label().effect == "coulomb_friction");
    CHECK(candidates[order[0].candidate].location == location);
  }
}

TEST_CASE("the screen sees an accelerometer whose range ends too soon, by readings that end at one size") {
  Case c = make_case(quarter_car_text, 0.01);
  Plant truth = c.plant;
  truth.sensors[1].path.saturation = 0.55 * c.operation.output_peak(1);
  c.record.quantum.setZero();
  c.record.y = simulate_measured(truth, c.record.drive, {.decimation = c.record.ratio}).outputs;
  c.record.weight_std = 0.001 * (c.record.y.rowwise().norm() / std::sqrt(200.0));
  REQUIRE(operation_of(c.plant, {c.record}, {c.rest}, c.operation));
  CHECK(c.operation.output_ceiling(1) == Approx(truth.sensors[1].path.saturation));
  const PlantFit base = fit_plant(c.plant, {}, {c.record}, *make_levenberg_marquardt({}), {8});
  REQUIRE(base.error.size() == 1);
  const std::vector<EffectCandidate> candidates = effect_candidates(base.plant, c.operation);
  const std::vector<Screened> order = screen(base, {c.record}, candidates);
  CHECK(candidates[order[0].candidate].label().effect == "saturation");
  CHECK(candidates[order[0].candidate].location == "sensor:body_acc"_at);
  CHECK(order[0].gain > 0.9 * 0.5 * base.residual.squaredNorm());
}

TEST_CASE(
    "a sensor is offered a range, a limited rate, a lag of either order, a delay and AC coupling where its path has "
    "none") {
  const Case c = make_case(quarter_car_text, 0.005);
  const auto offered = [&](const Plant& plant) {
    std::set<std::string> forms;
    for (const EffectCandidate& candidate : effect_candidates(plant, c.operation))
      if (candidate.location == "sensor:body_acc"_at && candidate.label().effect != "crosstalk")
        forms.insert(candidate.label().effect.text() + ", " + candidate.label().form);
    return forms;
  };
  const std::set<std::string> all = offered(c.plant);
  for (const char* form :
       {"saturation, end of range", "saturation, soft end", "rate_limit, amplifier", "sensor_lag, first order",
        "sensor_lag, second order", "high_pass, AC coupling", "time_delay, late reading"})
    CHECK(all.count(form) == 1);
  Plant known = c.plant;
  known.sensors[1].path = {
      .delay_s = 0.01, .high_pass_hz = 0.5, .lag = {.cutoff_hz = 60}, .rate_limit = 100, .saturation = 10};
  const std::set<std::string> others = offered(known);
  for (const std::string& form : others) {
    CAPTURE(form);
    CHECK(form.find("saturation") == std::string::npos);
    CHECK(form.find("rate_limit") == std::string::npos);
    CHECK(form.find("sensor_lag") == std::string::npos);
    CHECK(form.find("high_pass") == std::string::npos);
    CHECK(form.find("time_delay") == std::string::npos);
  }
  CHECK(others.size() + 7 == all.size());
}

TEST_CASE("the screen sees a tyre that softens or hardens, by the square of its travel or by the cube") {
  Case c = make_case(quarter_car_text, 0.005);
  const double reach = 2 * c.operation.elements[1].travel_rms_m, stiffness = stiffness_at_rest(c.plant.elements[1]);
  for (const double sign : {-1.0, 1.0})
    for (const Index power : {2, 3}) {
      CAPTURE(sign, power);
      const double size = sign * 0.02 * stiffness / std::pow(reach, power - 1);
      Plant truth = c.plant;
      truth.elements[1].laws.push_back(
          {find_law("polynomial_spring"), {0, power == 2 ? size : 0, power == 3 ? size : 0}});
      c.record.y = simulate(truth, c.record.drive, {.decimation = c.record.ratio}).outputs;
      c.record.weight_std = 0.001 * (c.record.y.rowwise().norm() / std::sqrt(200.0));
      const PlantFit base = fit_plant(c.plant, {}, {c.record}, *make_levenberg_marquardt({}), {8});
      REQUIRE(base.error.size() == 1);
      const std::vector<EffectCandidate> candidates = effect_candidates(base.plant, c.operation);
      double most = 0;
      for (const Screened& screened : screen(base, {c.record}, candidates))
        if (candidates[screened.candidate].label().effect == "tyre_nonlinearity") most = std::max(most, screened.gain);
      CHECK(most > 0.9 * 0.5 * base.residual.squaredNorm());
    }
}

TEST_CASE("however soon a friction may yield in a fit, the steps of the fit follow it: its derivatives stay finite") {
  int seen = 0;
  for (const Case& c : {make_case(quarter_car_text, 0.005), make_case(quarter_car_text, 0.02)})
    for (const EffectCandidate& candidate : effect_candidates(c.plant, c.operation))
      for (std::size_t j = 0; j < candidate.parameters.size(); ++j) {
        if (!candidate.parameters[j].name.ends_with("yield_travel_m")) continue;
        ++seen;
        CAPTURE(candidate.label().effect, candidate.location, candidate.label().form);
        const auto problem =
            plant_problem(candidate.plant, candidate.parameters, {c.record}, Vector::Constant(c.rest.size(), 0.001));
        Vector theta = Vector::Zero(problem->parameters()), r(problem->residuals());
        theta(static_cast<Index>(j)) = problem->box().lower(static_cast<Index>(j));
        Matrix J(problem->residuals(), problem->parameters());
        REQUIRE(problem->jacobian(theta, r, J));
        CHECK(J.col(static_cast<Index>(j)).norm() < 1e3 * r.norm());
      }
  CHECK(seen >= 6);
}

TEST_CASE("however soon a memory may relax in a fit, few steps of the fit follow it") {
  int seen = 0;
  for (const Case& c : {make_case(quarter_car_text, 0.005), make_case(quarter_car_text, 0.02)})
    for (const EffectCandidate& candidate : effect_candidates(c.plant, c.operation))
      for (const FitParameter& parameter : candidate.parameters) {
        if (!parameter.name.ends_with("relaxation_s")) continue;
        ++seen;
        CAPTURE(candidate.label().effect, candidate.location, candidate.label().form);
        Plant soonest = candidate.plant;
        set_parameter(soonest, parameter.name, parameter.least);
        CHECK(sparing_steps(soonest, 100, 100).substeps <= kSubsteps);
        CHECK(get_parameter(candidate.plant, parameter.name) > 2 * parameter.least);
      }
  CHECK(seen >= 6);
}

TEST_CASE("the Jacobian of a fit is the derivative of its residuals, in every parameter of plant and effect",
          "[slow]") {
  for (const Case& c : cases()) {
    Vector scale = Vector::Constant(c.rest.size(), 0.001);
    for (const EffectCandidate& candidate : effect_candidates(c.plant, c.operation)) {
      std::vector<FitParameter> parameters = tolerance_parameters(c.plant);
      parameters.insert(parameters.end(), candidate.parameters.begin(), candidate.parameters.end());
      const auto problem = plant_problem(candidate.plant, parameters, {c.record}, scale);
      Vector theta = Vector::Constant(problem->parameters(), 0.02), r(problem->residuals()), ahead = r, behind = r;
      for (Index j = 1; j < theta.size(); j += 2) theta(j) *= -3;  // no element at rest, where some laws have a corner
      theta = clamped(theta, problem->box());
      Matrix J(problem->residuals(), problem->parameters());
      REQUIRE(problem->jacobian(theta, r, J));
      REQUIRE(problem->residual(theta, behind));
      CHECK(r == behind);
      for (Index j = 0; j < problem->parameters(); ++j) {
        const bool state = j >= static_cast<Index>(parameters.size());
        CAPTURE(c.plant.name, candidate.label().effect, candidate.location, candidate.label().form, j,
                state ? "initial state" : parameters[static_cast<std::size_t>(j)].name);
        Vector there = theta, back = theta;
        there(j) = std::min(theta(j) + 2e-4, problem->box().upper(j));
        back(j) = std::max(theta(j) - 2e-4, problem->box().lower(j));
        REQUIRE(problem->residual(there, ahead));
        REQUIRE(problem->residual(back, behind));
        const Vector difference = (ahead - behind) / (there(j) - back(j));
        CHECK((J.col(j) - difference).norm() <= 4e-2 * difference.norm() + 1e-9 * J.norm());
      }
    }
  }
}
