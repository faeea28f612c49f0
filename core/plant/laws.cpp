#include "core/plant/laws.hpp"

#include <algorithm>
#include <cmath>

#include "core/plant/rotary.hpp"

namespace wheelhop {

LawKind linear_spring();
LawKind viscous_damper();
LawKind inerter();
LawKind hardening_spring();
LawKind polynomial_spring();
LawKind bending_spring();
LawKind coulomb_friction();
LawKind bouc_wen();
LawKind maxwell_branch();
LawKind damper_mount();
LawKind asymmetric_damper();
LawKind digressive_damper();
LawKind power_law_damper();
LawKind position_dependent_damper();
LawKind fading_damper();
LawKind cavitating_damper();
LawKind bump_stop();
LawKind backlash();
LawKind liftoff();
LawKind rest_offset();

const std::vector<LawKind>& law_table() {
  static const std::vector<LawKind> table = {linear_spring(),     viscous_damper(),
                                             inerter(),           hardening_spring(),
                                             polynomial_spring(), bending_spring(),
                                             coulomb_friction(),  bouc_wen(),
                                             maxwell_branch(),    damper_mount(),
                                             asymmetric_damper(), digressive_damper(),
                                             power_law_damper(),  position_dependent_damper(),
                                             fading_damper(),     cavitating_damper(),
                                             bump_stop(),         backlash(),
                                             liftoff(),           rest_offset()};
  return table;
}

std::vector<std::string> law_names() {
  std::vector<std::string> names;
  for (const LawKind& kind : law_table()) names.push_back(kind.name);
  return names;
}

const LawKind* find_law(std::string_view name) {
  for (const LawKind& kind : law_table())
    if (kind.name == name) return &kind;
  return nullptr;
}

std::vector<std::string> Law::parameter_names() const {
  std::vector<std::string> names;
  if (kind->parameters.front().is_list) {
    for (std::size_t k = 0; k < values.size(); ++k)
      names.push_back(kind->parameters.front().name + "_" + std::to_string(k + 1));
  } else {
    for (const LawParameter& parameter : kind->parameters) names.push_back(parameter.name);
  }
  return names;
}

namespace {

std::string key_of(const std::string& name, bool rotary) { return rotary ? rotary_name(name) : name; }
std::string key_of(const LawParameter& parameter, bool rotary) { return key_of(parameter.name, rotary); }

Schedule parse_schedule(const JsonCursor& cursor, const Law& law, bool rotary) {
  if (law.kind->role != LawRole::force)
    cursor.fail("a law that gives a force of its own: \"" + law.kind->name + "\" acts on masses or other laws");
  Schedule schedule;
  schedule.by = cursor.at("by").string();
  if (schedule.by.empty()) cursor.at("by").fail("the name of an input of kind \"schedule\"");
  const JsonCursor slopes = cursor.at("slopes");
  const std::vector<std::string> names = law.parameter_names();
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto slope = slopes.find(key_of(names[k], rotary));
    if (!slope) continue;
    if (!std::isfinite(law.values[k])) slope->fail("no slope of a number that the law does not give");
    schedule.slopes.emplace_back(k, slope->number());
  }
  slopes.done();
  if (schedule.slopes.empty()) slopes.fail("a slope of one of the law's numbers at least");
  schedule.tolerance = parse_tolerance(cursor);
  cursor.done();
  return schedule;
}

}  // namespace

Law parse_law(const JsonCursor& cursor, bool rotary) {
  Law law;
  law.kind = find_law(cursor.at("law").one_of(law_names()));
  for (const LawParameter& parameter : law.kind->parameters) {
    if (parameter.is_list) {
      const JsonCursor list = cursor.at(key_of(parameter, rotary));
      law.values = list.numbers();
      if (law.values.empty() || law.values.size() > 15) list.fail("an array of 1 to 15 numbers");
    } else if (parameter.required) {
      law.values.push_back(cursor.at(key_of(parameter, rotary)).number(parameter.range));
    } else {
      // Not `number(key, fallback, range)`: the fallback may be infinite, which stands for "none".
      const auto member = cursor.find(key_of(parameter, rotary));
      law.values.push_back(member ? member->number(parameter.range) : parameter.fallback);
    }
  }
  law.tolerance = parse_tolerance(cursor);
  if (const auto schedule = cursor.find("scheduled")) law.schedule = parse_schedule(*schedule, law, rotary);
  cursor.done();
  if (law.kind->check) {
    const std::string expected = law.kind->check(law.values);
    if (!expected.empty()) cursor.fail(expected);
  }
  return law;
}

Json to_json(const Law& law, bool rotary) {
  Json out = Json::object();
  out["law"] = law.kind->name;
  if (law.kind->parameters.front().is_list) {
    out[key_of(law.kind->parameters.front(), rotary)] = law.values;
  } else {
    for (std::size_t k = 0; k < law.values.size(); ++k)
      if (std::isfinite(law.values[k])) out[key_of(law.kind->parameters[k], rotary)] = law.values[k];
  }
  out["tolerance"] = law.tolerance;
  if (law.scheduled()) {
    Json slopes = Json::object();
    const std::vector<std::string> names = law.parameter_names();
    for (const auto& [k, slope] : law.schedule.slopes) slopes[key_of(names[k], rotary)] = slope;
    out["scheduled"] = {{"by", law.schedule.by}, {"slopes", slopes}, {"tolerance", law.schedule.tolerance}};
  }
  return out;
}

double decay(const Law& law, double v) {
  const double yielded[max_law_states] = {std::copysign(1.0, v)};
  MemorySlopes slopes;
  if (law.states() == 0 || !law.kind->memory.slopes(law.values, 0, v, yielded, slopes)) return 0;
  double fastest = 0;
  for (int i = 0; i < law.states(); ++i)
    fastest = std::max(fastest, std::abs(slopes.dz_dz[static_cast<std::size_t>(max_law_states * i + i)]));
  return fastest;
}

double parse_tolerance(const JsonCursor& cursor) {
  const auto member = cursor.find("tolerance");
  if (!member) return default_tolerance;
  const double value = member->number();
  if (!(value > 0 && value <= 1)) member->fail("a relative standard deviation above 0 and at most 1");
  return value;
}

}  // namespace wheelhop
