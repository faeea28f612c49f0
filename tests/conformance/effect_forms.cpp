// Forms of effects as operations on plants: what they make of another plant, and what they are called.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string_view>

#include "core/greybox/plant_fit.hpp"
#include "tests/support/effect_cases.hpp"
#include "tests/support/systems.hpp"
#include "variants/table.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

std::map<std::string, double> least_of_parameters(const EffectCandidate& candidate) {
  std::map<std::string, double> least;
  for (const FitParameter& parameter : candidate.parameters) least[parameter.name] = parameter.least;
  return least;
}

/// Labels in any order.
std::set<std::string> names_in(const EffectCandidate& candidate) {
  std::set<std::string> names;
  for (const Label& label : candidate.labels) names.insert(label.effect.text() + "/" + label.form);
  return names;
}

/// True if two candidates at one place move the same numbers of the same plant.
bool same_law(const EffectCandidate& one, const EffectCandidate& other) {
  if (one.location != other.location || one.parameters.empty() || one.parameters.size() != other.parameters.size())
    return false;
  const std::map<std::string, double> known = least_of_parameters(other);
  for (const FitParameter& parameter : one.parameters)
    if (!known.contains(parameter.name)) return false;
  Plant moved = other.plant;
  for (const FitParameter& parameter : one.parameters)
    set_parameter(moved, parameter.name, get_parameter(one.plant, parameter.name));
  return to_json(moved) == to_json(one.plant);
}

}  // namespace

TEST_CASE("candidates of one form at one place differ by the sizes alone that a fit moves, and labels by their names") {
  for (const Case& c : cases()) {
    const std::vector<EffectCandidate> candidates = effect_candidates(c.plant, c.operation);
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const EffectCandidate& one = candidates[i];
      CAPTURE(c.plant.name, name_of(one), one.label().form);
      std::set<EffectId> effects;
      for (const Label& label : one.labels) effects.insert(label.effect);
      CHECK(effects.size() == one.labels.size());
      for (std::size_t j = i + 1; j < candidates.size(); ++j) {
        const EffectCandidate& other = candidates[j];
        // What moves the same numbers of the same law has to be known as one form.
        if (!same_form(one, other)) {
          CAPTURE(name_of(other), other.label().form);
          CHECK_FALSE(same_law(one, other));
          continue;
        }
        CHECK(names_in(other) == names_in(one));
        CHECK(other.ideal == one.ideal);
        CHECK(other.finer_by == one.finer_by);
        CHECK(other.refines == one.refines);
        CHECK(least_of_parameters(other) == least_of_parameters(one));
        CHECK(same_law(one, other));
      }
    }
  }
}

TEST_CASE("a form that adds a part adds it once, and none is applied where its place or its damper is missing") {
  for (const Case& c : cases())
    for (const EffectCandidate& candidate : effect_candidates(c.plant, c.operation)) {
      CAPTURE(c.plant.name, name_of(candidate), candidate.label().form);
      REQUIRE(in_plant(candidate, c.plant));
      const std::set<EffectId> parts = {"added_mode", "load", "crosstalk"};
      if (parts.count(candidate.label().effect)) CHECK_FALSE(in_plant(candidate, candidate.plant));
      if (!candidate.law.starts_with(to_string(candidate.location) + ".")) continue;
      Plant without = c.plant;
      const auto place = std::find_if(without.elements.begin(), without.elements.end(), [&](const Element& element) {
        return part_place(element.name) == candidate.location;
      });
      REQUIRE(place != without.elements.end());
      std::erase_if(place->laws, [](const Law& law) { return std::string_view(law.kind->name) == "viscous_damper"; });
      const std::vector<Law>& laws =
          candidate.plant.elements[static_cast<std::size_t>(place - without.elements.begin())].laws;
      CHECK(in_plant(candidate, without).has_value() == !laws.back().kind->is_correction);
      without.elements.erase(place);
      CHECK_FALSE(in_plant(candidate, without));
    }
  EffectCandidate by_hand{{{"stiffness_error", ""}}, part_place("tyre"), plant_from(quarter_car_text), {}};
  CHECK_THROWS_AS(in_plant(by_hand, by_hand.plant), std::invalid_argument);
}

TEST_CASE("two effects make the same plant in either order, with the same numbers under the names of each") {
  Random random = numbers(613);
  for (const Case& c : cases()) {
    Vector base;
    REQUIRE(plant_residual(c.plant, {c.record}, {c.rest}, base));
    // Every channel counts by its own size; c.record reads zero.
    FitRecord record = c.record;
    const Index p = c.plant.sensor_count();
    record.weight_std =
        base.reshaped(p, base.size() / p).rowwise().norm() / std::sqrt(static_cast<double>(base.size() / p));
    record.weight_std = record.weight_std.cwiseMax(1e-3 * record.weight_std.maxCoeff());
    const std::vector<EffectCandidate> all = effect_candidates(c.plant, c.operation);
    const auto drawn = [&] {
      return all[static_cast<std::size_t>(random.uniform() * static_cast<double>(all.size()))];
    };
    for (int pair = 0; pair < 60; ++pair) {
      const EffectCandidate one = drawn(), other = drawn();
      // The search gives no two effects one name, and no two of them one number of a path.
      const auto moved = least_of_parameters(one);
      const auto shared = [&](const FitParameter& own) {
        return own.name.find(':') != std::string::npos && moved.contains(own.name);
      };
      if (name_of(one) == name_of(other) || std::any_of(other.parameters.begin(), other.parameters.end(), shared))
        continue;
      CAPTURE(c.plant.name, name_of(one), one.label().form, name_of(other), other.label().form);
      std::optional<EffectCandidate> second = in_plant(other, one.plant);
      REQUIRE(second);
      for (std::size_t k = 0; k < other.parameters.size(); ++k) {
        const double typical = get_parameter(other.plant, other.parameters[k].name);
        set_parameter(second->plant, second->parameters[k].name, 1.1 * typical);
        Plant alone = other.plant;
        set_parameter(alone, other.parameters[k].name, 1.1 * typical);
        const std::optional<EffectCandidate> first = in_plant(one, alone);
        REQUIRE(first);
        Vector in_one_order, in_the_other;
        const bool runs = plant_residual(second->plant, {record}, {c.rest}, in_one_order);
        CHECK(plant_residual(first->plant, {record}, {c.rest}, in_the_other) == runs);
        // Memories choose steps of their own.
        if (runs) CHECK((in_one_order - in_the_other).norm() <= 1e-4 * in_one_order.norm());
        set_parameter(second->plant, second->parameters[k].name, typical);
      }
    }
  }
}

TEST_CASE("beside a law of its kind the numbers of a form have other names, wherever these stand") {
  std::set<std::string> seen;
  for (const Case& c : cases()) {
    const std::vector<EffectCandidate> all = effect_candidates(c.plant, c.operation);
    for (const EffectCandidate& one : all)
      for (const EffectCandidate& other : all) {
        if (one.law.empty() || one.law != other.law || name_of(one) == name_of(other)) continue;
        CAPTURE(c.plant.name, name_of(one), name_of(other), one.law);
        const std::optional<EffectCandidate> second = in_plant(other, one.plant);
        REQUIRE(second);
        REQUIRE(second->law == one.law + "[2]");
        seen.insert(other.plant.name + one.law);
        const auto same = [&](const std::string& there, const std::string& alone) {
          CHECK(there.starts_with(second->law + "."));
          CHECK(get_parameter(second->plant, there) == get_parameter(other.plant, alone));
        };
        for (std::size_t k = 0; k < other.parameters.size(); ++k)
          same(second->parameters[k].name, other.parameters[k].name);
        for (std::size_t k = 0; k < other.typical.size(); ++k) same(second->typical[k].first, other.typical[k].first);
        for (std::size_t l = 0; l < other.labels.size(); ++l) {
          const Label &there = second->labels[l], &alone = other.labels[l];
          for (std::size_t k = 0; k < alone.plausible.size(); ++k)
            same(there.plausible[k].parameter, alone.plausible[k].parameter);
          if (alone.words) same(there.words->parameter, alone.words->parameter);
        }
      }
  }
  CHECK(seen.size() >= 3);
}

TEST_CASE("a form that bends either way is named after what a fit makes of it") {
  std::set<std::string> words;
  for (const Case& c : cases())
    for (const EffectCandidate& candidate : effect_candidates(c.plant, c.operation)) {
      const Label& label = candidate.label();
      if (!label.words) {
        CHECK(form_of(label, candidate.plant) == label.form);
        continue;
      }
      CHECK(label.form == label.words->below + " or " + label.words->above);
      Plant fitted = candidate.plant;
      for (const double by : {-0.3, 0.3}) {
        set_parameter(fitted, label.words->parameter, label.words->turns_at + by);
        CHECK(form_of(label, fitted) == (by < 0 ? label.words->below : label.words->above));
        words.insert(form_of(label, fitted));
      }
    }
  CHECK(words == std::set<std::string>{"digressive", "hardening", "progressive", "softening"});
}
