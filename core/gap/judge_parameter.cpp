#include "core/gap/judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace wheelhop {
namespace {

constexpr double kStandsOut = 0.75;  // probability from which one parameter among nearer ones is named
constexpr double kNotHome = 4;       // surprise from which one wrong parameter is not all that is wrong

/// Parameters that are out of their tolerances although that of the rival is free, as "NAME (-7.4 tolerances)", or
/// nothing. Where a law's bend is wrong, all that shapes its element bends with it.
std::string others_out(const GapCase& c, const PlantFit& fit, const Rival& rival) {
  if (fit.covariance.size() == 0) return "";
  const Vector t = surprises(fit, static_cast<Index>(c.study.tolerances.size()));
  std::string list;
  std::string element = rival.location;
  if (element.starts_with(kGuide)) element = guide_element(element.substr(std::strlen(kGuide)));
  const auto shapes_it = [&](const std::string& name) {
    return !rival.effect.ends_with("_error") && name.starts_with(element + ".");
  };
  for (std::size_t i = 0; i < c.study.tolerances.size(); ++i)
    if (i != rival.hypothesis && !shapes_it(c.study.tolerances[i].name) &&
        std::abs(t(static_cast<Index>(i))) > kNotHome)
      list += fmt::format("{}{} ({:+.1f} tolerances)", list.empty() ? "" : ", ", c.study.tolerances[i].name,
                          fit.theta(static_cast<Index>(i)));
  return list;
}

}  // namespace

bool name_parameter(const GapCase& c, const Rival& rival, Diagnosis& diagnosis) {
  std::vector<FitParameter> free = c.study.tolerances;
  free[rival.hypothesis].prior_std = 0;
  Hypothesis answer = fit_from(c.study, c.retuned, free);
  if (!answer.fit.error.empty()) linearise(answer.fit, free, c.study.data.fitted);
  const Hypothesis& best = answer.fit.error.empty() ? c.retuned : answer;
  diagnosis.outcome = rival.effect.ends_with("_error") ? GapOutcome::parameter : GapOutcome::effect;
  diagnosis.named = {rival.name()};
  diagnosis.corrected = best.stage;
  diagnosis.plant = best.fit.plant;
  diagnosis.closure = c.closure_between(c.delivered.stage, best.stage);
  const FittedParameter fitted = fitted_parameters(best.fit, free, 0)[rival.hypothesis];
  diagnosis.suspects = {
      {rival.effect, rival.location, "", rival.probability, best.stage.misfit, diagnosis.closure, {fitted}}};
  const std::string out = others_out(c, best.fit, rival);
  if (out.empty() && best.chi2 < (1 + kTooSmall) * c.floor_chi2()) return true;
  diagnosis.suspects.front().probability *= 1 - kHeld;
  diagnosis.suspects.front().closure = c.closure_between(c.retuned.stage, best.stage);
  if (!out.empty()) diagnosis.message = rival.effect + " at " + rival.location + " would need " + out + " as well";
  return false;
}

bool name_standing_out(const GapCase& c, Diagnosis& diagnosis) {
  if (c.delivered.chi2 - c.retuned.chi2 < kNotice * diagnosis.floor.colour) return false;
  const auto count = static_cast<Index>(c.study.tolerances.size());
  if (count == 0 || c.retuned.fit.covariance.size() == 0) return false;
  const Vector probabilities = standing_out(c.retuned.fit, count, diagnosis.floor.colour);
  std::vector<Rival> rivals;
  for (std::size_t i = 0; i < c.study.tolerances.size(); ++i) {
    rivals.push_back(parameter_rival(c.study, c.retuned, i));
    rivals.back().probability = probabilities(static_cast<Index>(i));
  }
  std::stable_sort(rivals.begin(), rivals.end(),
                   [](const Rival& a, const Rival& b) { return a.probability > b.probability; });
  if (rivals.front().probability < kStandsOut) return false;
  Diagnosis named = diagnosis;
  if (!name_parameter(c, rivals.front(), named)) return false;
  const FittedParameter& parameter = named.suspects.front().parameters.front();
  named.message = fmt::format("{} is {:+.1f} tolerances off, and the others lie nearer to what the plant file says",
                              parameter.name, c.retuned.fit.theta(static_cast<Index>(rivals.front().hypothesis)));
  add_locations(rivals, named);
  add_ambiguous(rivals, named);
  diagnosis = std::move(named);
  return true;
}

}  // namespace wheelhop
