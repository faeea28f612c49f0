// Plant files: what is read, what is refused and in which words, and what every law of the table must satisfy.
#include "core/plant/plant.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "core/base/random.hpp"
#include "core/base/status.hpp"
#include "tests/support/places.hpp"
#include "tests/support/plants.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;
using Catch::EndsWith;

namespace {

/// Message that reading the quarter car ends in after `edit`.
std::string refusal(const std::function<void(Json&)>& edit, const std::string& base = quarter_car_text) {
  Json plant = parse_json(base, "plant.json");
  edit(plant);
  try {
    parse_plant(JsonCursor::from(plant, "plant.json"));
  } catch (const UserError& error) {
    return error.what();
  }
  return "accepted";
}

/// A valid value for each parameter of a law.
Law sample_law(const LawKind& kind) {
  Law law{.kind = &kind, .values = {}};
  for (const LawParameter& parameter : kind.parameters) {
    if (parameter.is_list) {
      law.values = {900, -300, 40000};
    } else if (parameter.typical != 0) {
      law.values.push_back(parameter.typical);
    } else if (parameter.unit == "m") {
      law.values.push_back(parameter.name == "travel_limit_m" ? 0.08 : 0.03);
    } else {
      law.values.push_back(std::min(700.0, parameter.range.high));
    }
  }
  return law;
}

}  // namespace

TEST_CASE("the plant file of the contract reads as it stands, and every plant reads back what it writes") {
  const Plant plant = plant_from(quarter_car_text);
  CHECK(plant.masses[0].tolerance == 0.03);
  CHECK(plant.masses[1].tolerance == 0.05);
  CHECK(plant.inputs[0].interpolation == "band_limited");
  CHECK(plant.elements[0].laws[1].tolerance == 0.15);
  CHECK(plant.node_names() == std::vector<std::string>{"body", "wheel", "road", "ground"});
  CHECK(plant.sensors[1].from == "ground");
  for (const Plant& p : {plant, plant_from(one_mass_text), plant_from(chain_text), full_car()}) {
    const Json written = to_json(p);
    const Json again = to_json(parse_plant(JsonCursor::from(written, "again.json")));
    CHECK(again == written);
  }
}

TEST_CASE("the preset of the paper is a plant file") {
  const Plant plant = load_plant(std::string(WHEELHOP_SOURCE) + "/experiments/configs/paper_plant.json");
  CHECK(get_parameter(plant, "suspension.hardening_spring.travel_limit_m") == 0.09);
  REQUIRE(plant.sensor_count() == 3);
  CHECK(plant.sensors[0].name == "suspension_displacement");
  CHECK(plant.sensors[1].name == "chassis_acceleration");
  CHECK(plant.sensors[2].name == "axle_acceleration");
}

TEST_CASE("a misspelt or unknown name is answered with its place and the known names") {
  CHECK_THAT(refusal([](Json& p) { p["elements"][1]["between"][0] = "raod"; }),
             Contains("plant.json") && Contains("$.elements[1].between[0]") && Contains("raod") && Contains("road") &&
                 Contains("ground") && Contains("body"));
  CHECK_THAT(refusal([](Json& p) { p["elements"][0]["laws"][0]["law"] = "hardning_spring"; }),
             Contains("$.elements[0].laws[0].law") && Contains("hardening_spring") && Contains("viscous_damper") &&
                 Contains("polynomial_spring"));
  CHECK_THAT(refusal([](Json& p) {
               Json& law = p["elements"][1]["laws"][0];
               law["stifness_n_per_m"] = law["stiffness_n_per_m"];
               law.erase("stiffness_n_per_m");
             }),
             Contains("$.elements[1].laws[0]") && Contains("stiffness_n_per_m"));
  CHECK_THAT(refusal([](Json& p) { p["elements"][1]["laws"][0]["colour"] = 3; }),
             Contains("colour") && Contains("stiffness_n_per_m"));
  CHECK_THAT(refusal([](Json& p) { p["sensors"][0]["between"][1] = "bod"; }),
             Contains("$.sensors[0].between[1]") && Contains("bod") && Contains("body"));
  CHECK_THAT(refusal([](Json& p) { p["sensors"][1]["of"] = "roof"; }),
             Contains("$.sensors[1].of") && Contains("body") && Contains("wheel"));
  CHECK_THAT(refusal([](Json& p) { p["sensors"][1]["kind"] = "strain"; }),
             Contains("$.sensors[1].kind") && Contains("acceleration"));
  CHECK_THAT(refusal([](Json& p) { p["inputs"][0]["on"] = "carbody"; }, one_mass_text),
             Contains("$.inputs[0].on") && Contains("carbody"));
  CHECK_THAT(refusal([](Json& p) { p["inputs"][0]["interpolation"] = "spline"; }),
             Contains("$.inputs[0].interpolation") && Contains("band_limited"));
  CHECK_THAT(refusal([](Json& p) { p["wheels"] = 4; }), Contains("wheels") && Contains("masses"));
  CHECK_THAT(refusal([](Json& p) { p.erase("masses"); }), Contains("masses"));
}

TEST_CASE("a unit that is not the channel's is answered with the unit expected") {
  CHECK_THAT(refusal([](Json& p) { p["inputs"][0]["unit"] = "mm"; }),
             Contains("$.inputs[0].unit") && Contains("\"m\"") && Contains("mm"));
  CHECK_THAT(refusal([](Json& p) { p["inputs"][0]["unit"] = "kN"; }, one_mass_text), Contains("\"N\""));
  CHECK_THAT(refusal([](Json& p) { p["sensors"][1]["unit"] = "g"; }),
             Contains("$.sensors[1].unit") && Contains("\"m/s^2\""));
  CHECK_THAT(refusal([](Json& p) { p["sensors"][1].erase("unit"); }), Contains("unit"));
}

TEST_CASE("a graph that cannot move, or only seems to, is refused where it is wrong") {
  CHECK_THAT(refusal([](Json& p) { p["elements"][0]["between"][1] = "wheel"; }),
             Contains("$.elements[0].between") && Contains("two different nodes"));
  CHECK_THAT(refusal([](Json& p) { p["elements"][1]["between"][1] = "ground"; }),
             Contains("$.elements[1].between") && Contains("a mass at one end"));
  CHECK_THAT(refusal([](Json& p) { p["elements"][1]["between"] = {"road"}; }), Contains("$.elements[1].between"));
  CHECK_THAT(refusal([](Json& p) { p["masses"][0]["mass_kg"] = 0; }),
             Contains("$.masses[0].mass_kg") && Contains("massless"));
  CHECK_THAT(refusal([](Json& p) { p["masses"][0]["mass_kg"] = -3; }), Contains("$.masses[0].mass_kg"));
  CHECK_THAT(refusal([](Json& p) {
               p["masses"].push_back({{"name", "engine"}, {"mass_kg", 90}});
             }),
             Contains("$.masses[2].name") && Contains("nothing is attached"));
  CHECK_THAT(refusal([](Json& p) { p["elements"][0]["laws"] = Json::array(); }),
             Contains("$.elements[0].laws") && Contains("at least one law"));
  for (const char* list : {"masses", "sensors"})
    CHECK_THAT(refusal([&](Json& p) { p[list] = Json::array(); }),
               Contains(std::string("$.") + list) && Contains("at least one"));
  CHECK_THAT(refusal([](Json& p) { p["inputs"][1]["hold_hz"] = 500; }, chain_text),
             Contains("$.inputs[1].hold_hz") && Contains("same instants"));
  CHECK_THAT(refusal([](Json& p) { p["inputs"][0]["hold_hz"] = 0; }), Contains("$.inputs[0].hold_hz"));
  CHECK_THAT(refusal([](Json& p) {
               p["sensors"][1]["between"] = {"road", "body"};
               p["sensors"][1].erase("of");
             }),
             Contains("$.sensors[1].between[0]"));
  CHECK_THAT(refusal([](Json& p) {
               p["sensors"][1]["between"] = {"wheel", "body"};
             }),
             Contains("$.sensors[1]") && Contains("either \"of\""));
  CHECK_THAT(refusal([](Json& p) {
               p["points"] = {{{"name", "seat"}, {"weights", {{"boddy", 1}}}}};
             }),
             Contains("boddy") && Contains("body"));
}

TEST_CASE("a name that stands for two things is refused, among channels as among places") {
  CHECK_THAT(refusal([](Json& p) { p["masses"][1]["name"] = "body"; }), Contains("$.masses[1].name"));
  CHECK_THAT(refusal([](Json& p) { p["elements"][1]["name"] = "suspension"; }), Contains("$.elements[1].name"));
  CHECK_THAT(refusal([](Json& p) { p["elements"][1]["name"] = "wheel"; }), Contains("$.elements[1].name"));
  CHECK_THAT(refusal([](Json& p) { p["masses"][1]["name"] = "ground"; }), Contains("$.masses[1].name"));
  CHECK_THAT(refusal([](Json& p) { p["sensors"][2]["name"] = "body_acc"; }),
             Contains("$.sensors[2].name") && Contains("taken"));
  CHECK_THAT(refusal([](Json& p) { p["sensors"][2]["name"] = "road"; }), Contains("$.sensors[2].name"));
  CHECK_THAT(refusal([](Json& p) { p["sensors"][2]["name"] = "t"; }), Contains("$.sensors[2].name"));
  CHECK_THAT(refusal([](Json& p) { p["inputs"][0]["name"] = "t"; }), Contains("$.inputs[0].name"));
  for (const char* bad : {"", "a,b", "sensor:x", "x@y", "x.y", " x", "x\"y"})
    CHECK_THAT(refusal([&](Json& p) { p["sensors"][2]["name"] = bad; }), Contains("$.sensors[2].name"));
}

TEST_CASE("numbers outside their range are refused with it") {
  for (const double bad : {0.0, -0.1, 1.5}) {
    CHECK_THAT(refusal([&](Json& p) { p["masses"][0]["tolerance"] = bad; }), Contains("$.masses[0].tolerance"));
    CHECK_THAT(refusal([&](Json& p) { p["elements"][0]["laws"][1]["tolerance"] = bad; }),
               Contains("$.elements[0].laws[1].tolerance"));
  }
  CHECK(refusal([](Json& p) { p["masses"][0]["tolerance"] = 1; }) == "accepted");
  CHECK_THAT(refusal([](Json& p) { p["elements"][1]["laws"][0]["stiffness_n_per_m"] = -1; }),
             Contains("stiffness_n_per_m"));
  CHECK_THAT(refusal([](Json& p) { p["elements"][1]["laws"][0]["stiffness_n_per_m"] = "stiff"; }),
             Contains("stiffness_n_per_m") && Contains("number"));
  CHECK_THAT(refusal([](Json& p) { p["elements"][0]["laws"][0].erase("travel_limit_m"); }),
             Contains("$.elements[0].laws[0]") && Contains("travel_limit_m"));
  CHECK_THAT(refusal([](Json& p) { p["elements"][0]["laws"][0]["coefficients"] = Json::array(); }, one_mass_text),
             Contains("coefficients"));
}

TEST_CASE("a hardening spring without end stop is a pure cubic with no limit of travel") {
  Json plant = parse_json(quarter_car_text, "plant.json");
  Json& law = plant["elements"][0]["laws"][0];
  law.erase("beta_m");
  for (const bool with_limit : {true, false}) {
    if (!with_limit) law.erase("travel_limit_m");
    const Plant cubic = parse_plant(JsonCursor::from(plant, "plant.json"));
    double f = 0;
    REQUIRE(cubic.elements[0].laws[0].force(0.5, 0, f));
    CHECK(f == Approx(18000 * (0.5 + 1500 * 0.125)));
    CHECK(to_json(cubic)["elements"][0]["laws"][0].contains("travel_limit_m") == with_limit);
  }
}

TEST_CASE("every law of the table is the gradient of its energy or turns its work into heat, with exact slopes") {
  Random random(9, Stream::parameters);
  for (const LawKind& kind : law_table()) {
    INFO(kind.name);
    CHECK_FALSE(kind.equation.empty());
    CHECK_FALSE(kind.source.empty());
    REQUIRE_FALSE(kind.parameters.empty());
    for (const LawParameter& parameter : kind.parameters) {
      CHECK_FALSE(parameter.unit.empty());
      CHECK_FALSE(parameter.meaning.empty());
    }
    const Law law = sample_law(kind);
    const Law again = parse_law(JsonCursor::from(to_json(law), "law.json"));
    CHECK(again.values == law.values);
    CHECK(again.kind == law.kind);
    CHECK(law.parameter_names().size() == law.values.size());
    if (law.states() > 0) continue;  // their own laws stand in lemma/plant_laws.cpp
    double f = 1;
    REQUIRE(law.force(0, 0, f));
    CHECK(f == 0);
    CHECK(law.energy(0) == 0);
    for (int trial = 0; trial < 50; ++trial) {
      const double x = 0.07 * (2 * random.uniform() - 1), v = random.normal(), h = 1e-6;
      const auto force = [&](double at_x, double at_v) {
        double value = 0;
        REQUIRE(law.force(at_x, at_v, value));
        return value;
      };
      double df_dx = 0, df_dv = 0;
      REQUIRE(law.slopes(x, v, df_dx, df_dv));
      CHECK(df_dx == Approx((force(x + h, v) - force(x - h, v)) / (2 * h)).epsilon(1e-6).margin(1e-4));
      CHECK(df_dv == Approx((force(x, v + h) - force(x, v - h)) / (2 * h)).epsilon(1e-6).margin(1e-6));
      const double gradient = (law.energy(x + h) - law.energy(x - h)) / (2 * h);
      CHECK(force(x, v) * v == Approx(gradient * v + law.dissipation(x, v)).epsilon(1e-6).margin(1e-5));
      if (!kind.is_correction) CHECK(law.dissipation(x, v) >= 0);
      if (kind.is_linear) CHECK(force(2 * x, 2 * v) == Approx(2 * force(x, v)));
    }
  }
}

TEST_CASE("parameters are found by name, moved, and carry tolerance and unit") {
  Plant plant = plant_from(quarter_car_text);
  const std::vector<PlantParameter> list = plant_parameters(plant);
  REQUIRE(list.size() == 8);
  CHECK(list[0].name == "body.mass_kg");
  CHECK(list[0].tolerance == 0.03);
  CHECK(list[0].handle.place == "body"_at);
  CHECK(list[0].handle.owner == ParameterOwner::mass);
  CHECK(list[2].handle.owner == ParameterOwner::law);
  CHECK(list[2].handle.law == find_law("hardening_spring"));
  for (const PlantParameter& parameter : list) CHECK_THAT(parameter.name, EndsWith("." + parameter.handle.number));
  CHECK(list[2].name == "suspension.hardening_spring.stiffness_n_per_m");
  CHECK(list[2].tolerance == 0.1);
  CHECK(list[2].unit == "N/m");
  for (const PlantParameter& parameter : list) {
    CHECK(get_parameter(plant, parameter.name) == parameter.value);
    set_parameter(plant, parameter.name, 2 * parameter.value);
    CHECK(get_parameter(plant, parameter.name) == 2 * parameter.value);
  }
  CHECK(plant.masses[1].mass_kg == 80);
  CHECK(plant.elements[0].laws[1].values[0] == 1700);
  CHECK_THROWS_WITH(get_parameter(plant, "body.mass"), Contains("body.mass_kg") && Contains("did you mean"));
  CHECK_THROWS_WITH(plant.node("roof"), Contains("roof") && Contains("wheel"));

  plant.elements[1].laws.push_back(plant.elements[1].laws[0]);
  set_parameter(plant, "tyre.linear_spring[2].stiffness_n_per_m", 5);
  CHECK(plant.elements[1].laws[1].values[0] == 5);
  CHECK(plant.elements[1].laws[0].values[0] == 400000);
}
