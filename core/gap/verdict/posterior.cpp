#include "core/gap/verdict/posterior.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

namespace wheelhop {
namespace {

constexpr std::array<double, 7> kNearer = {0.1, 0.15, 0.22, 0.33, 0.5, 0.7, 1};  // s of it, each as probable

double log_mean_exp(const Vector& x) {
  const double most = x.maxCoeff();
  return most + std::log((x.array() - most).exp().mean());
}

constexpr double kNoise = 1;  // leftover of a place where noise alone is left: derived, since that is its unit

/// True of a single that closes the gap by itself.
bool closes(const Evidence& evidence, double chi2, const Thresholds& thresholds) {
  return !(chi2 > (1 + negligible(evidence, thresholds)) * evidence.samples);
}

/// Parameters join the contest if nothing else can, or if re-tuning stopped at its end: one that is free inside its
/// tolerance, and a wide one, would have been tuned to the floor.
bool parameters_alone(const Evidence& evidence, const Thresholds& thresholds) {
  return gap_left(evidence) <= negligible(evidence, thresholds) || evidence.singles.empty();
}

/// True of one effect, or one set of effects, in whatever forms.
bool same_set(const RankedCandidate& a, const RankedCandidate& b) {
  return a.set.empty() ? a.name() == b.name() : a.set == b.set;
}

/// Log of the sum of exp(odds) over the sets of a group, each in its most probable form.
double log_sum_of_sets(const std::vector<RankedCandidate>& list, std::vector<std::size_t> members,
                       const std::vector<double>& odds) {
  std::stable_sort(members.begin(), members.end(), [&](std::size_t a, std::size_t b) { return odds[a] > odds[b]; });
  double sum = 0;
  for (auto own = members.begin(); own != members.end(); ++own)
    if (std::none_of(members.begin(), own, [&](std::size_t other) { return same_set(list[other], list[*own]); }))
      sum += std::exp(odds[*own] - odds[members.front()]);
  return odds[members.front()] + std::log(sum);
}

/// What an explanation shares with those that differ from it by the laws of instruments alone: its other effects,
/// and those of instruments without their names, at their places. Empty where it has no effect of an instrument.
std::vector<EffectAt> beside_instruments(const RankedCandidate& own) {
  std::vector<EffectAt> parts = own.set.empty() ? std::vector<EffectAt>{own.name()} : own.set;
  bool any = false;
  for (EffectAt& part : parts) {
    if (!is_path(part.place)) continue;
    any = true;
    part.effect = {};
  }
  if (!any) return {};
  std::sort(parts.begin(), parts.end());
  return parts;
}

}  // namespace

Vector leave_prior_out_z(ConstVectorRef theta, ConstMatrixRef covariance) {
  Vector z(theta.size());
  for (Index i = 0; i < z.size(); ++i) {
    const double left = std::max(1 - covariance(i, i), 1e-6);
    z(i) = theta(i) / left / std::sqrt(covariance(i, i) / left + 1);
  }
  return z;
}

Vector standing_out(ConstVectorRef theta, ConstMatrixRef covariance, double colour, const Thresholds& thresholds) {
  const Index count = theta.size();
  // The posterior's precision is what the data tell and the tolerances' own, 1.
  const Matrix precision = covariance.topLeftCorner(count, count).inverse();
  const Matrix told = (precision - Matrix::Identity(count, count)) / colour;
  const Vector pull = precision * theta / colour;
  const auto log_evidence = [&](Index wrong) {
    Vector of_scales(static_cast<Index>(kNearer.size()));
    for (Index i = 0; i < of_scales.size(); ++i) {
      Vector std = Vector::Constant(count, kNearer[static_cast<std::size_t>(i)]);
      if (wrong >= 0) std(wrong) = thresholds.wrong_by;
      const Matrix scaled = std.asDiagonal() * told * std.asDiagonal();
      const Eigen::LLT<Matrix> llt(Matrix::Identity(count, count) + scaled);
      const Vector pulled = std.cwiseProduct(pull);
      of_scales(i) = 0.5 * pulled.dot(llt.solve(pulled)) - llt.matrixLLT().diagonal().array().log().sum();
    }
    return log_mean_exp(of_scales);
  };
  Vector log_p(count + 1);  // the last one: none
  for (Index i = 0; i < count; ++i)
    log_p(i) = log_evidence(i) + std::log(thresholds.one_wrong / static_cast<double>(count));
  log_p(count) = log_evidence(-1) + std::log(1 - thresholds.one_wrong);
  const Vector p = (log_p.array() - log_p.maxCoeff()).exp();
  return (p.head(count) / p.sum()).cwiseMin(thresholds.limit);
}

std::vector<RankedCandidate> unranked(const std::vector<CandidateEvidence>& candidates, const Thresholds& thresholds) {
  std::vector<RankedCandidate> list;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const CandidateEvidence& own = candidates[i];
    list.push_back({own.last().effect, own.last().location, i, false, own.chi2, own.prior_chi2,
                    own.log_plausibility - thresholds.occam * static_cast<double>(own.parameters)});
    if (own.effects.size() < 2) continue;
    for (const EffectEvidence& effect : own.effects) list.back().set.push_back(effect.name());
    std::sort(list.back().set.begin(), list.back().set.end());
  }
  return list;
}

RankedCandidate unranked(const FreedEvidence& freed, std::size_t index,
                         const std::vector<ToleranceEvidence>& tolerances, const Thresholds& thresholds) {
  const ToleranceEvidence& own = tolerances[freed.tolerance];
  return {own.effect,
          own.location,
          index,
          true,
          freed.chi2,
          freed.prior_chi2,
          -thresholds.occam * static_cast<double>(tolerances.size()) +
              log_size_prior(freed.theta[freed.tolerance], thresholds) - log_size_prior(0, thresholds)};
}

void rank(std::vector<RankedCandidate>& list, const Weighing& weighing, const Thresholds& thresholds) {
  if (list.empty()) return;
  double best = list.front().chi2;
  for (const RankedCandidate& own : list) best = std::min(best, own.chi2);
  const double floor = (1 + thresholds.floor_error) * weighing.floor_chi2;
  const double of_gap = best <= floor ? thresholds.of_gap_closed : thresholds.of_gap;
  const double gap = std::max(weighing.gap, 0.0);
  const double of_noise =
      std::max(weighing.colour, weighing.dispersion) + thresholds.of_remains * std::max(best - floor, 0.0);
  const double of_all = of_noise + of_gap * gap, of_instruments = of_noise + thresholds.of_gap_instruments * gap;
  // What a form leaves beyond the floor's own error has an unknown size. With no preference for a scale the evidence of
  // n independent errors of form goes as size^-n.
  const auto log_left = [&](const RankedCandidate& own) {
    return std::log(std::max(own.chi2 - own.prior_chi2 - floor, 0.0) + thresholds.floor_error * weighing.floor_chi2);
  };
  const auto log_odds = [&](const RankedCandidate& own, double temperature) {
    return -0.5 * thresholds.errors_of_form * log_left(own) - (own.chi2 - own.prior_chi2 - best) / (2 * temperature) -
           own.prior_chi2 / (2 * std::sqrt(temperature / weighing.dispersion)) + own.log_prior;
  };
  std::vector<double> odds;
  std::map<std::vector<EffectAt>, std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < list.size(); ++i) {
    odds.push_back(log_odds(list[i], of_all));
    if (const std::vector<EffectAt> key = beside_instruments(list[i]); !key.empty()) groups[key].push_back(i);
  }
  for (const auto& [key, members] : groups) {
    std::vector<double> exact(list.size());
    for (const std::size_t i : members) exact[i] = log_odds(list[i], of_instruments);
    const double moved = log_sum_of_sets(list, members, odds) - log_sum_of_sets(list, members, exact);
    for (const std::size_t i : members) odds[i] = exact[i] + moved;
  }
  std::vector<std::size_t> order(list.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return odds[a] > odds[b]; });
  std::vector<RankedCandidate> distinct;
  double sum = 0;
  for (const std::size_t i : order) {
    const auto same = [&](const RankedCandidate& other) { return same_set(other, list[i]); };
    if (std::any_of(distinct.begin(), distinct.end(), same)) continue;
    distinct.push_back(list[i]);
    distinct.back().probability = std::exp(odds[i] - odds[order.front()]);
    sum += distinct.back().probability;
  }
  for (RankedCandidate& own : distinct) own.probability = std::min(own.probability / sum, thresholds.limit);
  list = std::move(distinct);
}

Vector probabilities_by_leftover(ConstVectorRef left, Index blocks, double limit) {
  if (left.size() == 0) return {};
  const double best = left.minCoeff(), exponent = -0.5 * static_cast<double>(blocks);
  const Vector p = (exponent * (left / best).array().log()).exp();
  return (p / p.sum()).cwiseMin(limit);
}

double leftover_ratio(const std::vector<PlaceLeftover>& places, const Place& location) {
  const auto matches = [&](const Place& entry) {
    return entry == location || without_guide(entry) == location ||
           (location.kind == PlaceKind::timebase &&
            entry.kind == PlaceKind::actuator);  // its clock enters with the drive
  };
  for (const PlaceLeftover& place : places)
    if (matches(place.location) || std::any_of(place.same.begin(), place.same.end(), matches))
      return std::max(place.leftover, kNoise) / std::max(places.front().leftover, kNoise);
  return 1;
}

double chance_of(const Evidence& evidence) { return std::max(evidence.noise.colour, evidence.dispersion); }

double negligible(const Evidence& evidence, const Thresholds& thresholds) {
  return std::max(thresholds.too_small, thresholds.floor_errors * evidence.noise.power_error);
}

double gap_left(const Evidence& evidence) { return evidence.retuned_chi2 / evidence.samples - 1; }

namespace {

/// The single effects, weighed by what an unknown signal at their places leaves. Not yet ranked.
std::vector<RankedCandidate> unranked_singles(const Evidence& evidence, const Thresholds& thresholds) {
  std::vector<RankedCandidate> list = unranked(evidence.singles, thresholds);
  for (RankedCandidate& own : list)
    own.log_prior -= thresholds.place_weight * std::log(std::max(leftover_ratio(evidence.places, own.location), 1.0));
  return list;
}

}  // namespace

Contest contest_of(const Evidence& evidence, const Thresholds& thresholds) {
  Contest contest;
  const double notice = thresholds.notice * chance_of(evidence);
  contest.ranked = unranked_singles(evidence, thresholds);
  for (const RankedCandidate& own : contest.ranked)
    contest.effect_seen = contest.effect_seen || evidence.retuned_chi2 - own.chi2 > notice;
  const bool alone = parameters_alone(evidence, thresholds);
  for (std::size_t i = 0; i < evidence.freed.size(); ++i) {
    const FreedEvidence& freed = evidence.freed[i];
    if (!alone && !(evidence.retuned_stopped && closes(evidence, freed.chi2, thresholds))) continue;
    const double of_priors = evidence.retuned_prior_chi2 - freed.prior_chi2;
    const double fall = of_priors + (evidence.retuned_chi2 - freed.chi2 - of_priors) / chance_of(evidence);
    contest.parameter_seen =
        contest.parameter_seen || fall >= thresholds.out_of_tolerance * thresholds.out_of_tolerance;
    contest.ranked.push_back(unranked(freed, i, evidence.tolerances, thresholds));
  }
  double best = evidence.retuned_chi2;
  for (const RankedCandidate& own : contest.ranked) best = std::min(best, own.chi2);
  contest.weighing = {evidence.noise.colour, evidence.retuned_chi2 - best, evidence.samples, evidence.dispersion};
  rank(contest.ranked, contest.weighing, thresholds);
  return contest;
}

Contest contest_of_closing_effects(const Evidence& evidence, const Contest& all, const Thresholds& thresholds) {
  Contest contest = all;
  // From the singles themselves: of a parameter and an effect of one name the ranking has kept the more probable.
  contest.ranked = unranked_singles(evidence, thresholds);
  std::erase_if(contest.ranked, [&](const RankedCandidate& own) { return !closes(evidence, own.chi2, thresholds); });
  rank(contest.ranked, contest.weighing, thresholds);
  return contest;
}

bool asks_left_at_place(const Evidence& evidence, const CandidateEvidence& set, const Thresholds& thresholds) {
  const double gap = evidence.retuned_chi2 - evidence.samples, remains = set.chi2 - evidence.samples;
  if (!std::isnan(set.left_at_place) || !(remains > thresholds.notice * chance_of(evidence)) ||
      remains > thresholds.worth_second * gap)
    return false;
  return set.effects.size() > 1 || (remains < (1 - thresholds.worth_pair) * gap &&
                                    !(leftover_ratio(evidence.places, set.last().location) > thresholds.elsewhere));
}

bool enters_elsewhere(const Evidence& evidence, const CandidateEvidence& set, const Thresholds& thresholds) {
  // Of an effect that masks a gap from elsewhere the remains lie anywhere.
  const bool mask =
      set.effects.size() == 1 && leftover_ratio(evidence.places, set.last().location) > thresholds.elsewhere;
  return set.left_at_place > thresholds.elsewhere && !mask;
}

bool bends_elsewhere(const Evidence& evidence, const CandidateEvidence& set, const Thresholds& thresholds) {
  for (std::size_t i = 0; i < std::min(set.theta.size(), evidence.tolerances.size()); ++i)
    if (std::abs(set.theta[i]) > thresholds.not_home &&
        std::none_of(set.effects.begin(), set.effects.end(),
                     [&](const EffectEvidence& effect) { return effect.location == evidence.tolerances[i].location; }))
      return true;
  return false;
}

bool within_form(const Evidence& evidence, const CandidateEvidence& set, const Thresholds& thresholds) {
  const double gap = evidence.retuned_chi2 - evidence.samples;
  return !(set.chi2 - evidence.samples > thresholds.worth_second * gap) &&
         !enters_elsewhere(evidence, set, thresholds) && !bends_elsewhere(evidence, set, thresholds);
}

bool worth_another(const Evidence& evidence, const CandidateEvidence& set, const Thresholds& thresholds) {
  const double gap = evidence.retuned_chi2 - evidence.samples, remains = set.chi2 - evidence.samples;
  if (!(remains > thresholds.notice * chance_of(evidence))) return false;
  if (set.effects.size() == 1 && !(remains < (1 - thresholds.worth_pair) * gap)) return false;
  return remains > thresholds.much_left * evidence.samples || !within_form(evidence, set, thresholds);
}

bool differs_in_kind(const CandidateEvidence& set, std::size_t which) {
  const EffectEvidence& own = set.effects[which];
  for (std::size_t i = 0; i < set.effects.size(); ++i) {
    const EffectEvidence& other = set.effects[i];
    if (i == which || other.location != own.location) continue;
    // A wrong factor of an instrument looks nothing like a delay or a lag of it, and its form has no error.
    if (is_path(own.location) && (own.effect == "gain_error") != (other.effect == "gain_error")) continue;
    if (!(own.elastic && other.dissipative) && !(own.dissipative && other.elastic)) return false;
  }
  return true;
}

bool effect_needed(const Evidence& evidence, const CandidateEvidence& set, std::size_t which, double chi2_without,
                   const Thresholds& thresholds, bool home) {
  // At one place another effect may be no more than what the first one's form does not fit, unless it is of the other
  // kind: it has to do better. Of one that brings parameters home only the priors count: what the set leaves of the
  // residuals is taken off.
  const double form = home ? std::max(set.chi2 - set.prior_chi2 - evidence.samples, 0.0) : 0.0;
  const double remains = chi2_without - evidence.samples - form;
  return chi2_without - set.chi2 >
         std::max((differs_in_kind(set, which) ? thresholds.second : thresholds.second_there) * remains,
                  thresholds.notice * chance_of(evidence));
}

bool brings_home(const Evidence& evidence, const CandidateEvidence& before, const CandidateEvidence& set,
                 const Thresholds& thresholds) {
  return bends_elsewhere(evidence, before, thresholds) && !bends_elsewhere(evidence, set, thresholds);
}

std::vector<RankedCandidate> ranked_sets(const Evidence& evidence, const std::vector<CandidateEvidence>& sets,
                                         const CandidateEvidence& before, const Thresholds& thresholds) {
  std::vector<RankedCandidate> list = unranked(sets, thresholds);
  rank(list, {evidence.noise.colour, before.chi2 - evidence.samples, evidence.samples, evidence.dispersion},
       thresholds);
  return list;
}

std::string others_out(const Evidence& evidence, const FreedEvidence& freed, const Thresholds& thresholds) {
  const ToleranceEvidence& own = evidence.tolerances[freed.tolerance];
  std::string list;
  const auto shapes_it = [&](const ToleranceEvidence& other) {
    return !is_parameter_error(own.effect) && other.location == own.location;
  };
  for (std::size_t i = 0; i < freed.z.size(); ++i)
    if (i != freed.tolerance && !shapes_it(evidence.tolerances[i]) && std::abs(freed.z[i]) > thresholds.not_home)
      list += fmt::format("{}{} ({:+.1f} tolerances)", list.empty() ? "" : ", ", evidence.tolerances[i].parameter,
                          freed.theta[i]);
  return list;
}

double log_size_prior(double size, const Thresholds& thresholds) {
  const double relative = size / thresholds.wrong_by;
  return -std::log(thresholds.wrong_by) - std::log1p(relative * relative);
}

std::vector<double> probabilities_beside(const Evidence& evidence, const CandidateEvidence& candidate,
                                         const Thresholds& thresholds) {
  const double parameters = static_cast<double>(std::max<std::size_t>(evidence.tolerances.size(), 1));
  const double colour = std::sqrt(evidence.noise.colour);
  std::vector<double> log_weights, wrong;
  for (const FreedEvidence& freed : candidate.freed) {
    const double remains = freed.chi2 - (1 + thresholds.floor_error) * evidence.samples;
    const double inexact = colour + std::max(remains, 0.0) / evidence.dispersion / thresholds.directions;
    const double theta = freed.theta[freed.tolerance];
    const double of_tolerances = freed.std_of_tolerances * freed.std_of_tolerances;
    const double of_noise = std::max(freed.std * freed.std - of_tolerances, 0.0);
    const double wald = theta * theta / (1 + of_tolerances + inexact * of_noise);
    const double ratio = std::max(candidate.chi2 - freed.chi2, 0.0) / evidence.dispersion;
    const double of_priors = candidate.prior_chi2 - freed.prior_chi2;
    const double of_records = (candidate.chi2 - freed.chi2 - of_priors) / evidence.dispersion;
    log_weights.push_back(0.5 * (of_priors + of_records / inexact) + log_size_prior(theta, thresholds));
    wrong.push_back(1 / (1 + std::exp(-0.5 * std::min(wald, ratio) + std::log(parameters / thresholds.one_wrong) +
                                      std::log(thresholds.wrong_by))));
  }
  if (log_weights.empty()) return wrong;
  const double most = *std::max_element(log_weights.begin(), log_weights.end());
  double sum = 0;
  for (const double own : log_weights) sum += std::exp(own - most);
  for (std::size_t i = 0; i < wrong.size(); ++i) wrong[i] *= std::exp(log_weights[i] - most) / sum;
  return wrong;
}

bool parameter_explains(const Evidence& evidence, const FreedEvidence& freed, const Thresholds& thresholds) {
  return closes(evidence, freed.chi2, thresholds) && others_out(evidence, freed, thresholds).empty();
}

}  // namespace wheelhop
