/// \file
/// Plants that several tests use, as the text of plant files.
#pragma once

#include <string>

#include "core/plant/plant.hpp"

namespace wheelhop::test {

inline Plant plant_from(const std::string& text) {
  return parse_plant(JsonCursor::from(parse_json(text, "plant.json"), "plant.json"));
}

inline const std::string quarter_car_text = R"({
  "name": "quarter_car",
  "masses": [{"name": "body", "mass_kg": 300, "tolerance": 0.03}, {"name": "wheel", "mass_kg": 40}],
  "inputs": [{"name": "road", "kind": "displacement", "unit": "m", "hold_hz": 1000}],
  "elements": [
    {"name": "suspension", "between": ["wheel", "body"], "laws": [
      {"law": "hardening_spring", "stiffness_n_per_m": 18000, "alpha_per_m2": 1500, "beta_m": 0.02,
       "travel_limit_m": 0.09, "tolerance": 0.1},
      {"law": "viscous_damper", "damping_ns_per_m": 850, "tolerance": 0.15}]},
    {"name": "tyre", "between": ["road", "wheel"], "laws": [{"law": "linear_spring", "stiffness_n_per_m": 200000}]}],
  "sensors": [
    {"name": "travel", "kind": "displacement", "between": ["wheel", "body"], "unit": "m"},
    {"name": "body_acc", "kind": "acceleration", "of": "body", "unit": "m/s^2"},
    {"name": "wheel_acc", "kind": "acceleration", "of": "wheel", "unit": "m/s^2"}]})";

/// The quarter car with a damper whose damping follows a voltage.
inline const std::string semi_active_text = R"({
  "name": "semi_active",
  "masses": [{"name": "body", "mass_kg": 300, "tolerance": 0.03}, {"name": "wheel", "mass_kg": 40}],
  "inputs": [{"name": "road", "kind": "displacement", "unit": "m", "hold_hz": 1000},
             {"name": "voltage", "kind": "schedule", "unit": "V", "range": [0, 5], "hold_hz": 1000}],
  "elements": [
    {"name": "suspension", "between": ["wheel", "body"], "laws": [
      {"law": "linear_spring", "stiffness_n_per_m": 18000, "tolerance": 0.1},
      {"law": "viscous_damper", "damping_ns_per_m": 600, "tolerance": 0.15,
       "scheduled": {"by": "voltage", "slopes": {"damping_ns_per_m": 250}, "tolerance": 0.3}}]},
    {"name": "tyre", "between": ["road", "wheel"], "laws": [{"law": "linear_spring", "stiffness_n_per_m": 200000}]}],
  "sensors": [
    {"name": "travel", "kind": "displacement", "between": ["wheel", "body"], "unit": "m"},
    {"name": "body_acc", "kind": "acceleration", "of": "body", "unit": "m/s^2"},
    {"name": "wheel_acc", "kind": "acceleration", "of": "wheel", "unit": "m/s^2"}]})";

/// A mass on a cubic spring and damper, pushed by a force: the electronic rig known as Silverbox has this form.
inline const std::string one_mass_text = R"({
  "name": "one_mass",
  "masses": [{"name": "m", "mass_kg": 2}],
  "inputs": [{"name": "push", "kind": "force", "unit": "N", "on": "m", "hold_hz": 500}],
  "elements": [{"name": "spring", "between": ["ground", "m"], "laws": [
    {"law": "polynomial_spring", "coefficients": [800, 0, 50000]},
    {"law": "viscous_damper", "damping_ns_per_m": 4}]}],
  "sensors": [{"name": "x", "kind": "displacement", "of": "m", "unit": "m"},
              {"name": "v", "kind": "velocity", "of": "m", "unit": "m/s"},
              {"name": "a", "kind": "acceleration", "of": "m", "unit": "m/s^2"}]})";

/// Three plates in a row above a moving base, a damper at the base, and a force between the two upper plates.
inline const std::string chain_text = R"({
  "name": "chain",
  "masses": [{"name": "low", "mass_kg": 3}, {"name": "mid", "mass_kg": 2}, {"name": "top", "mass_kg": 1}],
  "inputs": [{"name": "base", "kind": "displacement", "unit": "m", "hold_hz": 1000},
             {"name": "motor", "kind": "force", "unit": "N", "between": ["mid", "top"], "hold_hz": 1000}],
  "elements": [
    {"name": "foot", "between": ["base", "low"], "laws": [{"law": "linear_spring", "stiffness_n_per_m": 2500},
                                                           {"law": "viscous_damper", "damping_ns_per_m": 5}]},
    {"name": "lower", "between": ["low", "mid"], "laws": [{"law": "linear_spring", "stiffness_n_per_m": 900},
                                                          {"law": "viscous_damper", "damping_ns_per_m": 7}]},
    {"name": "upper", "between": ["mid", "top"], "laws": [{"law": "linear_spring", "stiffness_n_per_m": 1000},
                                                          {"law": "viscous_damper", "damping_ns_per_m": 3}]}],
  "sensors": [{"name": "stroke", "kind": "displacement", "between": ["mid", "top"], "unit": "m"},
              {"name": "foot_stroke", "kind": "displacement", "between": ["base", "low"], "unit": "m"},
              {"name": "foot_speed", "kind": "velocity", "between": ["base", "low"], "unit": "m/s"},
              {"name": "top_acc", "kind": "acceleration", "of": "top", "unit": "m/s^2"}]})";

/// Two storeys on a shaking table. One accelerometer stands on a beam between them; what two storeys differ by has
/// nothing of the table's acceleration in it.
inline const std::string shaken_text = R"({
  "name": "shaken",
  "masses": [{"name": "first", "mass_kg": 5}, {"name": "second", "mass_kg": 3}],
  "points": [{"name": "beam", "weights": {"first": 0.4, "second": 0.6}}],
  "inputs": [{"name": "table", "kind": "acceleration", "unit": "m/s^2", "hold_hz": 1000}],
  "elements": [
    {"name": "columns", "between": ["ground", "first"], "laws": [
      {"law": "polynomial_spring", "coefficients": [9000, 0, 2e6]}, {"law": "viscous_damper", "damping_ns_per_m": 6}]},
    {"name": "upper", "between": ["first", "second"], "laws": [{"law": "linear_spring", "stiffness_n_per_m": 7000},
                                                               {"law": "viscous_damper", "damping_ns_per_m": 4}]}],
  "sensors": [{"name": "drift", "kind": "displacement", "of": "first", "unit": "m"},
              {"name": "roof", "kind": "acceleration", "of": "second", "unit": "m/s^2"},
              {"name": "beam_acc", "kind": "acceleration", "of": "beam", "unit": "m/s^2"},
              {"name": "relative", "kind": "acceleration", "between": ["first", "second"], "unit": "m/s^2"},
              {"name": "shear", "kind": "force", "element": "columns", "unit": "N"}]})";

/// A car in seven degrees of freedom: heave, pitch and roll of the body (the latter two as moments of inertia, with
/// weights in metres), whose corners are rigid points, on four wheels over four roads. Twelve outputs.
inline Plant full_car() {
  const std::string corners[4] = {"fl", "fr", "rl", "rr"};
  Json car = {{"name", "full_car"}};
  car["masses"] = Json::parse(R"([{"name": "heave", "mass_kg": 1300}, {"name": "pitch", "mass_kg": 1900},
                                  {"name": "roll", "mass_kg": 480}])");
  car["points"] = car["inputs"] = car["elements"] = car["sensors"] = Json::array();
  for (int c = 0; c < 4; ++c) {
    const std::string& id = corners[c];
    car["masses"].push_back({{"name", "wheel_" + id}, {"mass_kg", c < 2 ? 40 : 45}});
    Json weights = {{"heave", 1}, {"pitch", c < 2 ? -1.2 : 1.5}, {"roll", c % 2 == 0 ? 0.7 : -0.7}};
    car["points"].push_back({{"name", "corner_" + id}, {"weights", weights}});
    car["inputs"].push_back({{"name", "road_" + id}, {"kind", "displacement"}, {"unit", "m"}, {"hold_hz", 1000}});
    Json element = {{"name", "strut_" + id}};
    element["between"] = {"wheel_" + id, "corner_" + id};
    element["laws"] = Json::array();
    element["laws"].push_back({{"law", "linear_spring"}, {"stiffness_n_per_m", c < 2 ? 22000 : 25000}});
    element["laws"].push_back({{"law", "viscous_damper"}, {"damping_ns_per_m", 1400}});
    car["elements"].push_back(element);
    element["name"] = "tyre_" + id;
    element["between"] = {"road_" + id, "wheel_" + id};
    element["laws"] = Json::array();
    element["laws"].push_back({{"law", "linear_spring"}, {"stiffness_n_per_m", 190000}});
    car["elements"].push_back(element);
    Json sensor = {{"name", "travel_" + id}, {"kind", "displacement"}, {"unit", "m"}};
    sensor["between"] = {"wheel_" + id, "corner_" + id};
    car["sensors"].push_back(sensor);
    car["sensors"].push_back(
        {{"name", "wheel_acc_" + id}, {"kind", "acceleration"}, {"of", "wheel_" + id}, {"unit", "m/s^2"}});
    car["sensors"].push_back(
        {{"name", "corner_acc_" + id}, {"kind", "acceleration"}, {"of", "corner_" + id}, {"unit", "m/s^2"}});
  }
  return parse_plant(JsonCursor::from(car, "full_car.json"));
}

}  // namespace wheelhop::test
