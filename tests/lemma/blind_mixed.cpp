// Mixed cases, which hold an effect and a wrong parameter, and sets that ask for added kinds or for sizes.
#include <algorithm>
#include <catch2/catch.hpp>
#include <set>

#include "core/base/status.hpp"
#include "experiments/rig/prepare.hpp"
#include "tests/support/plants.hpp"

using namespace wheelhop;
using Catch::Contains;
namespace {

/// Cases of a set on the quarter car after some others of class none.
std::vector<blind::CaseSpec> cases_asked(Json set, Index before = 0) {
  const Json plant = parse_json(test::quarter_car_text, "plant.json");
  Json config = {{"seed", 12}, {"sets", Json::array()}};
  if (before > 0) config["sets"].push_back({{"name", "none"}, {"plant", plant}, {"class", "none"}, {"seeds", before}});
  set.update({{"name", "asked"}, {"plant", plant}});
  config["sets"].push_back(std::move(set));
  auto cases = blind::read_cases(JsonCursor::from(config, "config.json"), {});
  cases.erase(cases.begin(), cases.begin() + before);
  return cases;
}

std::string mistake_in(const Json& set) {
  try {
    cases_asked(set);
  } catch (const UserError& error) {
    return error.what();
  }
  return "accepted";
}

Matrix observed_in(const blind::TrueSystem& system, const blind::CaseSpec& spec) {
  const blind::ObserveOptions options{.samples = spec.samples};
  return blind::observe(system,
                        blind::play(*spec.plan, blind::commands_of(spec, blind::Realisation::estimation), options),
                        options)
      .clean;
}

}  // namespace

TEST_CASE("a mixed case names an effect and a parameter, and every one of both has its turn") {
  const Json set = {{"class", "mixed"},
                    {"kinds", "all"},
                    {"effects", {"hysteresis", "coulomb_friction@guide:wheel", "bias@sensor:travel"}},
                    {"strengths", {"medium", "strong"}},
                    {"seeds", 10}};
  const auto cases = cases_asked(set);
  REQUIRE(cases.size() == 10);
  std::set<std::string> forms, parameters, strengths;
  for (const blind::CaseSpec& spec : cases) {
    REQUIRE(spec.effects.size() == 2);
    CHECK(spec.case_class == "mixed");
    forms.insert(spec.effects[0].kind->form);
    parameters.insert(spec.effects[1].kind->effect + "@" + spec.effects[1].place);
    strengths.insert(spec.strength_class);
  }
  CHECK(forms.size() == 5);  // two of hysteresis, two of a guide's friction, one bias
  CHECK(parameters == std::set<std::string>{"mass_error@body", "mass_error@wheel", "stiffness_error@suspension",
                                            "stiffness_error@tyre", "damping_error@suspension"});
  CHECK(strengths == std::set<std::string>{"medium", "strong"});
  Json fewer = set;
  fewer["parameters"] = {"mass_error@body"};
  for (const blind::CaseSpec& spec : cases_asked(fewer)) CHECK(spec.effects[1].place == "body");
}

TEST_CASE("added kinds leave the cases of older sets as they were") {
  const auto forms = [](const Json& set) {
    std::vector<std::string> out;
    for (const blind::CaseSpec& spec : cases_asked(set)) out.push_back(spec.effects.front().kind->form);
    return out;
  };
  Json set = {{"class", "single"}, {"strengths", {"medium"}}};
  CHECK(forms(set).size() == blind::effect_kinds(blind::Family::catalogue).size());
  const auto has = [&](const char* effects, const char* form) {
    set["effects"] = {effects};
    const auto list = forms(set);
    return std::find(list.begin(), list.end(), form) != list.end();
  };
  CHECK_FALSE(has("coulomb_friction", "Stribeck on a guide"));
  CHECK_FALSE(has("clock_skew", "clock of the recorder"));
  // What only they can mean, they mean without a word.
  CHECK(has("coulomb_friction@guide:wheel", "Stribeck on a guide"));
  CHECK(has("inertance", "flywheel behind a shaft"));
  CHECK(has("reading cut at its end", "reading cut at its end"));
  set["kinds"] = "all";
  CHECK(has("coulomb_friction", "Stribeck on a guide"));
  CHECK(has("coulomb_friction", "smoothed sign"));
  set = {{"class", "single"}, {"strengths", {"medium"}}, {"kinds", "added"}};
  CHECK(forms(set).size() == blind::effect_kinds(blind::Family::added).size());
}

TEST_CASE("mistakes in sets of mixed cases and of sizes are told") {
  const Json mixed = {{"class", "mixed"}};
  const auto told = [](Json set, const Json& change) {
    set.update(change);
    return mistake_in(set);
  };
  CHECK_THAT(told(mixed, {{"parameters", {"mas_error"}}}), Contains("mass_error"));
  CHECK_THAT(told(mixed, {{"parameters", {"mass_error@suspension"}}}), Contains("body"));
  CHECK_THAT(told(mixed, {{"parameters", {"bias"}}}), Contains("mass_error"));
  CHECK_THAT(told(mixed, {{"size", {0.1, 0.2}}}), Contains("$.sets[0].size"));
  CHECK_THAT(told({{"class", "single"}}, {{"size", {0, 0.2}}}), Contains("$.sets[0].size"));
  CHECK_THAT(told({{"class", "double"}}, {{"parameters", "all"}}), Contains("parameters"));
  CHECK_THAT(told({{"class", "single"}}, {{"effects", {"inertia"}}}), Contains("inertance"));
}

TEST_CASE("with an effect of no size a mixed case is the case of its parameter alone", "[slow]") {
  blind::CaseSpec spec = cases_asked({{"class", "mixed"},
                                      {"effects", {"gain of a sensor"}},
                                      {"parameters", {"damping_error@suspension"}},
                                      {"strengths", {"medium"}},
                                      {"samples", 400}})
                             .front();
  const blind::Prepared mixed = blind::prepare(spec);
  REQUIRE(mixed.unreachable.empty());
  REQUIRE(mixed.system.effects.size() == 2);
  blind::CaseSpec alone = spec;
  alone.case_class = "parameter";
  alone.effects = {spec.effects[1]};
  const blind::Prepared parameter = blind::prepare(alone);
  REQUIRE(parameter.system.effects.size() == 1);

  // The same rig with the same parameter, off by four to eight of its tolerances of 0.15.
  CHECK(mixed.system.theta == parameter.system.theta);
  CHECK(mixed.noise_relative == parameter.noise_relative);
  CHECK(mixed.system.effects[1].factors == parameter.system.effects[0].factors);
  CHECK(mixed.system.effects[1].strength == parameter.system.effects[0].strength);
  CHECK(std::abs(mixed.system.effects[1].strength) > 4 * 0.15);
  CHECK(std::abs(mixed.system.effects[1].strength) < 8 * 0.15);
  blind::TrueSystem without = mixed.system;
  without.effects[0] = {};
  const Matrix one = observed_in(without, spec);
  CHECK(one == observed_in(parameter.system, spec));
  CHECK(one != observed_in(mixed.system, spec));

  // Both leave something: the effect where every parameter is re-tuned, the parameter where it is not.
  CHECK(mixed.gap_sigma > 0.7);
  CHECK(mixed.gap_sigma < 2);
  CHECK(mixed.parameter_sigma > 0.1);
  CHECK(mixed.delivered_sigma > mixed.gap_sigma);
}

TEST_CASE("an effect of a size that was asked for has it, and its strength by the gap that it leaves", "[slow]") {
  for (const auto& [low, high] : {std::pair(1e-5, 1e-4), {1e-3, 2e-3}}) {
    CAPTURE(low, high);
    const auto cases = cases_asked(
        {{"class", "single"}, {"kinds", "all"}, {"effects", {"clock_skew"}}, {"size", {low, high}}, {"samples", 400}},
        3);
    REQUIRE(cases.size() == 2);  // two clocks, whatever the strengths
    for (const blind::CaseSpec& spec : cases) {
      const blind::Prepared prepared = blind::prepare(spec);
      REQUIRE(prepared.unreachable.empty());
      const double size = std::abs(prepared.system.effects.front().strength);
      CHECK(size >= low);
      CHECK(size <= high);
      const std::string strength = prepared.gap_sigma < 0.7 ? "weak" : prepared.gap_sigma < 2 ? "medium" : "strong";
      CHECK(prepared.spec.strength_class == strength);
    }
  }
  blind::CaseSpec fade =
      cases_asked(
          {{"class", "single"}, {"effects", {"oil that thins by work"}}, {"size", {0.9, 0.95}}, {"samples", 400}})
          .front();
  CHECK_THAT(blind::prepare(fade).unreachable, Contains("outside what is physical"));
}
