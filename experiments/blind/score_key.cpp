#include "experiments/blind/score_key.hpp"

#include <algorithm>
#include <set>

#include "core/base/json.hpp"

namespace wheelhop::scoring {
namespace {

constexpr double kMedium = 0.7, kStrong = 2;  // gaps over the noise at which a strength begins

TrueEffect read_effect(const JsonCursor& cursor) {
  TrueEffect effect;
  effect.effect = cursor.at("effect").string();
  effect.location = cursor.at("location").string();
  effect.form = cursor.string("form", "");
  if (cursor.has("catalogue_form"))
    effect.catalogue_form = cursor.at("catalogue_form").boolean();
  else if (!effect.form.empty())
    effect.catalogue_form = effect.form == "catalogue";
  effect.in_catalogue = cursor.boolean("in_catalogue", effect.effect != "unknown");
  return effect;
}

CaseKind kind_of(const JsonCursor& cursor, const std::vector<TrueEffect>& effects) {
  std::string name = effects.empty() ? "none" : effects.size() > 1 ? "double" : "single";
  if (const auto given = cursor.find("class")) {
    const bool none = given->one_of({"none", "single", "parameter", "unknown", "open", "double", "mixed"}) == "none";
    const bool mixed = given->string() == "mixed", two = mixed || given->string() == "double";
    if (none != effects.empty() || two != (effects.size() > 1))
      given->fail("a class that fits " + std::to_string(effects.size()) + " effects");
    if (mixed && (effects.size() != 2 || std::count_if(effects.begin(), effects.end(), is_wrong_parameter) != 1))
      given->fail("a class that fits the effects: of a mixed case one of two is a parameter");
    name = given->string();
  }
  if (name == "none") return CaseKind::none;
  if (name == "double") return CaseKind::twofold;
  if (name == "mixed") return CaseKind::mixed;
  if (name == "unknown" || name == "open" || !effects.front().in_catalogue) return CaseKind::unknown;
  return name == "parameter" || is_wrong_parameter(effects.front()) ? CaseKind::parameter : CaseKind::single;
}

TrueCase read_case(const JsonCursor& cursor) {
  TrueCase result;
  result.name = cursor.at("case").string();
  for (const JsonCursor& effect : cursor.at("effects").items()) result.effects.push_back(read_effect(effect));
  result.kind = kind_of(cursor, result.effects);
  result.set = cursor.string("set", "");
  result.drive = cursor.string("drive", "");
  result.plant = cursor.string("plant", "");
  if (const auto sigma = cursor.find("gap_sigma"); sigma && !sigma->raw().is_null())
    result.gap_sigma = sigma->number({.low = 0});
  if (const auto strength = cursor.find("strength_class"); strength && !strength->raw().is_null())
    result.strength = strength->string();
  else if (result.gap_sigma && result.kind != CaseKind::none)
    result.strength = *result.gap_sigma < kMedium ? "weak" : *result.gap_sigma < kStrong ? "medium" : "strong";
  return result;
}

}  // namespace

std::string to_string(CaseKind kind) {
  switch (kind) {
    case CaseKind::none: return "none";
    case CaseKind::single: return "single";
    case CaseKind::parameter: return "parameter";
    case CaseKind::unknown: return "unknown";
    case CaseKind::twofold: return "double";
    case CaseKind::mixed: return "mixed";
    default: return "left_out";
  }
}

bool is_wrong_parameter(const TrueEffect& effect) {
  return effect.effect == "mass_error" || effect.effect == "stiffness_error" || effect.effect == "damping_error";
}

std::filesystem::path key_file(const std::filesystem::path& key) {
  return std::filesystem::is_directory(key) ? key / "key.json" : key;
}

std::vector<TrueCase> load_key(const std::filesystem::path& key) {
  const JsonCursor cursor = JsonCursor::load(key_file(key));
  std::vector<TrueCase> cases;
  std::set<std::string> names;
  for (const JsonCursor& item : cursor.items()) {
    if (item.at("case").raw().is_null()) continue;
    cases.push_back(read_case(item));
    if (!names.insert(cases.back().name).second) item.at("case").fail("a case that no other entry has");
  }
  if (cases.empty()) cursor.fail("at least one case");
  return cases;
}

bool same_location(const std::string& a, const std::string& b) {
  const auto input = [](const std::string& place) { return place.starts_with("actuator:"); };
  return a == b || (a == "actuator" && input(b)) || (b == "actuator" && input(a));
}

}  // namespace wheelhop::scoring
