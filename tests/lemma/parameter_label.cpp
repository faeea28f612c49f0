// What an error of a plant's number is called, for every number that there is.
#include <catch2/catch.hpp>
#include <map>
#include <set>

#include "core/gap/verdict/evidence.hpp"
#include "core/gap/which/parameter_label.hpp"
#include "core/greybox/plant_fit.hpp"
#include "tests/support/places.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/table.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

TEST_CASE("a wrong parameter is called by what it belongs to: slopes, paths, laws with a memory") {
  Plant plant = plant_from(quarter_car_text);
  plant.elements[0].laws.push_back({find_law("maxwell_branch"), {2e4, 0.3}});
  set_parameter(plant, "actuator:road.delay_s", 0.002);
  set_parameter(plant, "sensor:travel.gain", 1.1);
  set_parameter(plant, "sensor:body_acc.lag.time_constant_s", 0.001);
  std::map<std::string, std::string> called;
  for (const FitParameter& parameter : tolerance_parameters(plant)) {
    const ParameterLabel label = label_of(plant, parameter.name);
    called[parameter.name] = to_string(EffectAt{label.effect, label.location});
  }
  const std::map<std::string, std::string> right = {
      {"body.mass_kg", "mass_error@body"},
      {"suspension.hardening_spring.stiffness_n_per_m", "stiffness_error@suspension"},
      {"suspension.hardening_spring.alpha_per_m2", "spring_nonlinearity@suspension"},
      {"suspension.viscous_damper.damping_ns_per_m", "damping_error@suspension"},
      {"suspension.maxwell_branch.relaxation_s", "series_compliance@suspension"},
      {"actuator:road.delay_s", "time_delay@actuator"},
      {"sensor:travel.gain", "gain_error@sensor:travel"},
      {"sensor:body_acc.lag.time_constant_s", "sensor_lag@sensor:body_acc"}};
  for (const auto& [name, error] : right) {
    CAPTURE(name);
    CHECK(called[name] == error);
  }
}

TEST_CASE("every number of a path has an error with a name of its own, whatever the parts of a plant are called") {
  const std::map<std::string, std::string> of_both = {{"gain", "gain_error"},
                                                      {"delay_s", "time_delay"},
                                                      {"rate_limit", "rate_limit"},
                                                      {"saturation", "saturation"},
                                                      {"saturation_sharpness", "saturation"}};
  const std::set<std::string> lags = {"lag.time_constant_s", "lag.cutoff_hz", "lag.damping_ratio"};
  std::map<std::string, std::string> of_drive = of_both, of_sensor = of_both;
  of_drive.insert({{"offset", "bias"}, {"sampling_phase", "time_delay"}});
  of_sensor.insert({{"bias", "bias"},
                    {"drift_per_s", "drift"},
                    {"drift_settling_per_s", "drift"},
                    {"high_pass_hz", "high_pass"},
                    {"quantum", "quantisation"}});
  for (const std::string& lag : lags) {
    of_drive[lag] = "actuator_lag";
    of_sensor[lag] = "sensor_lag";
  }
  // Parts that are called as numbers are.
  Plant plant = plant_from(quarter_car_text);
  plant.elements[0].name = "mass_kg_of_bouc_wen";
  plant.inputs[0].name = plant.elements[1].from = "gain_lag";
  plant.sensors[0].name = "quantum";
  std::set<std::string> met;
  const auto check = [&](const Place& place, const std::string& prefix,
                         const std::map<std::string, std::string>& words) {
    return [&, place, prefix](const char* key, const std::string&, auto&, double, Range) {
      CAPTURE(prefix, key);
      REQUIRE(words.count(key) == 1);
      met.insert(prefix + key);
      Plant own = plant;
      set_parameter(own, prefix + key, 0.5);
      const ParameterLabel label = label_of(own, prefix + key);
      CHECK(label.effect.text() == words.at(key));
      CHECK(label.location == place);
    };
  };
  visit_drive_path(plant.inputs[0].path, "m", check("actuator"_at, "actuator:gain_lag.", of_drive));
  visit_sensor_path(plant.sensors[0].path, "m", check("sensor:quantum"_at, "sensor:quantum.", of_sensor));
  CHECK(met.size() == of_drive.size() + of_sensor.size());
  plant.clock_skew = 1e-5;
  plant.sensors[1].path.crosstalk = {{"quantum", 0.1}};
  plant.elements[0].laws.push_back({find_law("rest_offset"), {0.01}});
  const auto named = [&](const std::string& parameter) { return label_of(plant, parameter).effect; };
  CHECK(named("timebase.clock_skew") == "clock_skew");
  CHECK(named("sensor:body_acc.crosstalk.quantum") == "crosstalk");
  CHECK(named("mass_kg_of_bouc_wen.viscous_damper.damping_ns_per_m") == "damping_error");
  CHECK(named("mass_kg_of_bouc_wen.hardening_spring.stiffness_n_per_m") == "stiffness_error");
  for (const char* shape : {"alpha_per_m2", "beta_m", "travel_limit_m"})
    CHECK(named(std::string("mass_kg_of_bouc_wen.hardening_spring.") + shape) == "spring_nonlinearity");
  CHECK(named("mass_kg_of_bouc_wen.rest_offset.offset_m") == "static_offset");
}

TEST_CASE("every number of a law that an effect adds has an error that the catalogue knows") {
  std::set<EffectId> known = {"mass_error", "stiffness_error", "damping_error"};
  for (const Entry<EffectPiece>& family : effect_table()) known.insert(EffectId(family.name));
  const Plant plant = plant_from(quarter_car_text);
  Operation operation;
  FitRecord record{0.003 * numbers(844).normal(1, 2000), Matrix::Zero(3, 400), 5, 0, Vector::Ones(3), {}};
  REQUIRE(operation_of(plant, {record}, {}, operation));
  for (const EffectCandidate& candidate : effect_candidates(plant, operation))
    for (const PlantParameter& parameter : plant_parameters(candidate.plant)) {
      CAPTURE(parameter.name);
      CHECK(known.count(label_of(candidate.plant, parameter.name).effect) == 1);
    }
}
