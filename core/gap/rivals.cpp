#include "core/gap/rivals.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

namespace wheelhop {
namespace {

constexpr double kOfGap = 0.01;       // a of `weigh`
constexpr double kNotSurprising = 1;  // of a parameter: without its prior it would be no better
constexpr double kParameter = 1.5;    // what one more parameter has to bring, in log p
constexpr double kFloorKnown = 1.05;  // of the floor, within which it is not told from what is left
constexpr double kOfRemains = 0.05;   // b
constexpr double kOneWrong = 0.2;     // prior probability that one parameter stands out
constexpr double kWrong = 3;          // tolerances, by which it then is off
constexpr std::array<double, 7> kNearer = {0.1, 0.15, 0.22, 0.33, 0.5, 0.7, 1};  // s, each as probable

/// Stiffness and damping of all elements together, at a travel and rate.
std::array<double, 2> slopes_at(const Plant& plant, double x, double v) {
  std::array<double, 2> sum = {0, 0};
  for (const Element& element : plant.elements)
    for (const Law& law : element.laws) {
      double k = 0, d = 0;
      if (law.states() > 0 || !law.slopes(x, v, k, d)) continue;
      sum[0] += k;
      sum[1] += d;
    }
  return sum;
}

struct ErrorOf {
  std::string_view part;    ///< of a parameter's name
  std::string_view effect;  ///< id
};

/// Parameters of drive and sensor paths, and of laws with a memory, which have no slopes at rest.
constexpr ErrorOf kNamed[] = {{"mass_kg", "mass_error"},
                              {".gain", "gain_error"},
                              {".crosstalk", "crosstalk"},
                              {".offset", "bias"},
                              {".bias", "bias"},
                              {".drift", "drift"},
                              {".quantum", "quantisation"},
                              {".delay_s", "time_delay"},
                              {".sampling_phase", "time_delay"},
                              {".rate_limit", "rate_limit"},
                              {".saturation", "saturation"},
                              {".clock_skew", "clock_skew"},
                              {".bouc_wen", "hysteresis"},
                              {".maxwell_branch", "series_compliance"},
                              {".damper_mount", "series_compliance"},
                              {".cavitating_damper", "cavitation"},
                              {".fading_damper", "damper_fade"},
                              {".inerter", "inertance"}};

/// What an error of a parameter is called: what it changes at rest, or how it bends a law away from there.
std::string error_id(const Plant& plant, const PlantParameter& parameter) {
  constexpr double away = 1e-3;  // m, m/s
  if (parameter.name.find(".lag.") != std::string::npos)
    return parameter.location.starts_with("sensor:") ? "sensor_lag" : "actuator_lag";
  for (const ErrorOf& named : kNamed)
    if (parameter.name.find(named.part) != std::string::npos) return std::string(named.effect);
  Plant moved = plant;
  set_parameter(moved, parameter.name, 1.1 * parameter.value);
  const auto rest = slopes_at(plant, 0, 0), moved_rest = slopes_at(moved, 0, 0);
  if (rest[1] != moved_rest[1]) return "damping_error";
  if (rest[0] != moved_rest[0]) return "stiffness_error";
  const auto there = slopes_at(plant, away, away), moved_there = slopes_at(moved, away, away);
  if (there[0] != moved_there[0]) return "spring_nonlinearity";
  return there[1] != moved_there[1] ? "damper_nonlinearity" : "stiffness_error";
}

double log_mean_exp(const Vector& x) {
  const double most = x.maxCoeff();
  return most + std::log((x.array() - most).exp().mean());
}

}  // namespace

Vector surprises(const PlantFit& fit, Index count) {
  Vector t(count);
  for (Index i = 0; i < count; ++i) {
    const double left = std::max(1 - fit.covariance(i, i), 1e-6);
    t(i) = fit.theta(i) / left / std::sqrt(fit.covariance(i, i) / left + 1);
  }
  return t;
}

Vector standing_out(const PlantFit& fit, Index count, double colour) {
  // The posterior's precision is what the data tell and the tolerances' own, 1.
  const Matrix precision = fit.covariance.topLeftCorner(count, count).inverse();
  const Matrix told = (precision - Matrix::Identity(count, count)) / colour;
  const Vector pull = precision * fit.theta.head(count) / colour;
  const auto log_evidence = [&](Index wrong) {
    Vector of_scales(static_cast<Index>(kNearer.size()));
    for (Index i = 0; i < of_scales.size(); ++i) {
      Vector std = Vector::Constant(count, kNearer[static_cast<std::size_t>(i)]);
      if (wrong >= 0) std(wrong) = kWrong;
      const Matrix scaled = std.asDiagonal() * told * std.asDiagonal();
      const Eigen::LLT<Matrix> llt(Matrix::Identity(count, count) + scaled);
      const Vector pulled = std.cwiseProduct(pull);
      of_scales(i) = 0.5 * pulled.dot(llt.solve(pulled)) - llt.matrixLLT().diagonal().array().log().sum();
    }
    return log_mean_exp(of_scales);
  };
  Vector log_p(count + 1);  // the last one: none
  for (Index i = 0; i < count; ++i) log_p(i) = log_evidence(i) + std::log(kOneWrong / static_cast<double>(count));
  log_p(count) = log_evidence(-1) + std::log(1 - kOneWrong);
  const Vector p = (log_p.array() - log_p.maxCoeff()).exp();
  return (p.head(count) / p.sum()).cwiseMin(kLimit);
}

std::vector<Rival> rivals_of(const std::vector<Hypothesis>& hypotheses) {
  std::vector<Rival> rivals;
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    const EffectCandidate& last = hypotheses[i].effects.back();
    const double occam = kParameter * static_cast<double>(hypotheses[i].parameters.size());
    rivals.push_back({last.effect, last.location, i, false, hypotheses[i].chi2, hypotheses[i].prior_chi2,
                      hypotheses[i].plausibility - occam});
  }
  return rivals;
}

Rival parameter_rival(const Study& study, const Hypothesis& retuned, std::size_t i) {
  const std::vector<PlantParameter> parameters = plant_parameters(study.nominal);
  const auto known = std::find_if(parameters.begin(), parameters.end(),
                                  [&](const PlantParameter& p) { return p.name == study.tolerances[i].name; });
  const double occam = kParameter * static_cast<double>(study.tolerances.size());
  return {error_id(study.nominal, *known), known->location, i, true, retuned.chi2, retuned.prior_chi2, -occam};
}

std::vector<Rival> parameter_rivals(const Study& study, const Hypothesis& retuned, double moved) {
  const Vector t = surprises(retuned.fit, static_cast<Index>(study.tolerances.size()));
  std::vector<Rival> rivals;
  for (std::size_t i = 0; i < study.tolerances.size(); ++i) {
    if (std::abs(t(static_cast<Index>(i))) < kNotSurprising) continue;
    if (std::abs(retuned.fit.theta(static_cast<Index>(i))) < moved) continue;
    rivals.push_back(parameter_rival(study, retuned, i));
  }
  tbb::parallel_for(std::size_t{0}, rivals.size(), [&](std::size_t k) {
    std::vector<FitParameter> free = study.tolerances;
    free[rivals[k].hypothesis].prior_std = 0;
    const Hypothesis fitted = fit_from(study, retuned, free);
    if (fitted.fit.error.empty() || fitted.chi2 > retuned.chi2) return;
    rivals[k].chi2 = fitted.chi2;
    rivals[k].prior_chi2 = fitted.prior_chi2;
  });
  return rivals;
}

void weigh(std::vector<Rival>& rivals, const Weighing& weighing) {
  if (rivals.empty()) return;
  double best = rivals.front().chi2, sum = 0;
  for (const Rival& rival : rivals) best = std::min(best, rival.chi2);
  const double temperature = weighing.colour + kOfGap * std::max(weighing.gap, 0.0) +
                             kOfRemains * std::max(best - kFloorKnown * weighing.floor_chi2, 0.0);
  const auto log_odds = [&](const Rival& rival) {
    return -(rival.chi2 - rival.prior_chi2 - best) / (2 * temperature) -
           rival.prior_chi2 / (2 * std::sqrt(temperature)) + rival.plausibility;
  };
  std::stable_sort(rivals.begin(), rivals.end(),
                   [&](const Rival& a, const Rival& b) { return log_odds(a) > log_odds(b); });
  std::vector<Rival> distinct;
  for (Rival& rival : rivals) {
    const auto same = [&](const Rival& other) { return other.name() == rival.name(); };
    if (std::any_of(distinct.begin(), distinct.end(), same)) continue;
    rival.probability = std::exp(log_odds(rival) - log_odds(distinct.empty() ? rival : distinct.front()));
    sum += rival.probability;
    distinct.push_back(std::move(rival));
  }
  for (Rival& rival : distinct) rival.probability = std::min(rival.probability / sum, kLimit);
  rivals = std::move(distinct);
}

}  // namespace wheelhop
