#include "experiments/decide/decide.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/base/status.hpp"
#include "core/gap/diagnose.hpp"
#include "experiments/diagnose/answer.hpp"
#include "experiments/run/standard_output.hpp"

namespace wheelhop {
namespace {

/// Sets thresholds by "NAME=VALUE". UserError on an unknown name, or a value that is no number.
void apply(const std::vector<std::string>& settings, Thresholds& thresholds) {
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    const std::string name = setting.substr(0, equals);
    const Json value =
        equals == std::string::npos ? Json() : parse_json(setting.substr(equals + 1), "--set " + setting);
    const Json list = Json::array({{{"name", name}, {"value", value}}});
    thresholds = thresholds_from(JsonCursor::from(list, "--set " + setting), thresholds);
  }
}

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

}  // namespace

Json verdict_json(const Evidence& evidence, const Verdict& verdict) {
  Json suspects = Json::array(), locations = Json::array();
  for (const Suspect& suspect : verdict.suspects)
    suspects.push_back({{"effect", suspect.effect},
                        {"location", suspect.location},
                        {"form", suspect.form},
                        {"probability", suspect.probability},
                        {"misfit", number(suspect.misfit)},
                        {"closure", number(suspect.closure.value)}});
  for (const LocationProbability& place : verdict.locations)
    locations.push_back({{"location", place.location}, {"probability", place.probability}});
  const Closure closure = closure_of(evidence, verdict);
  return {{"schema", "wheelhop.verdict/1"},
          {"answer", is<Insufficient>(verdict) && verdict.row == "0" ? "" : answer(evidence, verdict, {})},
          {"decided_by", {{"row", verdict.row}, {"because", verdict.why}}},
          {"outcome", outcome_of(verdict)},
          {"named", verdict.named},
          {"ambiguous_with", verdict.ambiguous_with},
          {"message", verdict.message},
          {"locations", locations},
          {"effects", suspects},
          {"closure", number(closure.value)},
          {"closure_ci90", {number(closure.low), number(closure.high)}}};
}

int run_decide(const DecideRequest& request) {
  require_standard_output();
  const JsonCursor file = JsonCursor::load(request.diagnosis);
  if (!file.is_object()) file.fail("a diagnosis, or its evidence");
  const auto inside = file.find("evidence");
  const Evidence evidence = evidence_from(inside ? *inside : file);
  Thresholds thresholds;
  if (inside)
    if (const auto list = file.find("thresholds")) thresholds = thresholds_from(*list);
  apply(request.settings, thresholds);
  fmt::print("{}\n", verdict_json(evidence, decide(evidence, thresholds)).dump(2));
  return 0;
}

}  // namespace wheelhop
