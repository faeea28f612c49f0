#include <algorithm>
#include <cmath>

#include "core/gap/plan/plan.hpp"

namespace wheelhop {
namespace {

constexpr double kCorrelated = 0.9;
constexpr double kWorthTest = 1.5;  // growth of 1 - cosine^2 that is worth another test

double at(const Matrix& M, std::size_t i, std::size_t j) { return M(static_cast<Index>(i), static_cast<Index>(j)); }

/// What remains of the smaller of two effects where the other is taken for it, in noise levels.
double left_sigma(const PlanView& view, std::size_t a, std::size_t b, double cosine) {
  return std::min(view.effects[a].size_sigma, view.effects[b].size_sigma) * std::sqrt(1 - cosine * cosine);
}

bool shows(const PlanView& view, std::size_t effect) { return view.effects[effect].size_sigma >= visible_sigma; }

/// Both show, and more of one remains beside the other: as a share, and enough to be noticed.
/// @param cosine between them here   @param before as planned
bool tells_better(const PlanView& view, std::size_t a, std::size_t b, double cosine, double before) {
  if (!shows(view, a) || !shows(view, b)) return false;
  return left_sigma(view, a, b, cosine) >= marginal_sigma && 1 - cosine * cosine > kWorthTest * (1 - before * before);
}

void rank(std::vector<PlanItem>& menu) {
  const auto use = [](const PlanItem& item) {
    return static_cast<long>(item.shows.size() + item.separates.size()) - static_cast<long>(item.hides.size());
  };
  std::stable_sort(menu.begin(), menu.end(), [&](const PlanItem& a, const PlanItem& b) {
    if (a.view.message.empty() != b.view.message.empty()) return a.view.message.empty();
    return use(a) > use(b);
  });
}

/// The item of the menu in which two effects differ most, -1 if none tells them better.
/// @param number of the pair in the list of cosines
int best_item(const Plan& plan, std::size_t a, std::size_t b, std::size_t number) {
  int best = -1;
  double least = 2;
  for (std::size_t i = 0; i < plan.menu.size(); ++i) {
    const PlanItem& item = plan.menu[i];
    if (!item.view.message.empty()) continue;
    const double cosine = item.cosines[number];
    if (!tells_better(item.view, a, b, cosine, at(plan.planned.cosine, a, b)) || std::abs(cosine) >= least) continue;
    best = static_cast<int>(i);
    least = std::abs(cosine);
  }
  return best;
}

}  // namespace

std::vector<PlanPair> pairs_of(const PlanView& view) {
  std::vector<PlanPair> pairs;
  const auto noticeable = [&](std::size_t i) { return view.effects[i].size_sigma >= marginal_sigma; };
  for (std::size_t i = 0; i < view.effects.size(); ++i)
    for (std::size_t j = i + 1; j < view.effects.size(); ++j) {
      const double cosine = at(view.cosine, i, j);
      if (noticeable(i) && noticeable(j) && std::abs(cosine) > hard_cosine)
        pairs.push_back({i, j, cosine, left_sigma(view, i, j, cosine)});
    }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const PlanPair& a, const PlanPair& b) { return std::abs(a.cosine) > std::abs(b.cosine); });
  return pairs;
}

PlanItem judged(PlanView view, std::vector<double> cosines, const Plan& plan) {
  PlanItem item{std::move(view), std::move(cosines)};
  for (std::size_t i = 0; i < plan.planned.effects.size(); ++i) {
    if (shows(item.view, i) && !shows(plan.planned, i)) item.shows.push_back(i);
    if (!shows(item.view, i) && shows(plan.planned, i)) item.hides.push_back(i);
  }
  for (std::size_t p = 0; p < plan.pairs.size(); ++p) {
    const PlanPair& pair = plan.pairs[p];
    if (shows(item.view, pair.a) && shows(item.view, pair.b) && std::abs(item.cosines[p]) <= hard_cosine)
      item.separates.push_back(p);
  }
  return item;
}

void choose(Plan& plan, std::vector<PlanItem> menu) {
  plan.menu = std::move(menu);
  rank(plan.menu);
  for (std::size_t p = 0; p < plan.pairs.size(); ++p) {
    PlanPair& pair = plan.pairs[p];
    pair.item = best_item(plan, pair.a, pair.b, p);
    pair.item_cosine = pair.item < 0 ? at(plan.planned.cosine, pair.a, pair.b)
                                     : plan.menu[static_cast<std::size_t>(pair.item)].cosines[p];
  }
}

std::vector<ParameterPair> correlated_parameters(const Plan& plan) {
  std::vector<ParameterPair> pairs;
  for (std::size_t i = 0; i < plan.parameters.size(); ++i)
    for (std::size_t j = i + 1; j < plan.parameters.size(); ++j) {
      const double correlation = at(plan.planned.parameter_cosine, i, j);
      if (std::abs(correlation) > kCorrelated) pairs.push_back({i, j, correlation});
    }
  std::stable_sort(pairs.begin(), pairs.end(), [](const ParameterPair& a, const ParameterPair& b) {
    return std::abs(a.correlation) > std::abs(b.correlation);
  });
  return pairs;
}

SeparatingTest separating_test(const Plant& plant, const std::vector<FitRecord>& records, const EffectCandidate& a,
                               const EffectCandidate& b) {
  // Two forms of one family are asked about as two effects.
  std::vector<EffectCandidate> both = {a, b};
  both[0].labels.front().effect = EffectId(a.label().effect.text() + " (1)");
  both[1].labels.front().effect = EffectId(b.label().effect.text() + " (2)");
  const Plan plan = plan_test(plant, records, 1, both, {.menu_s = 20, .compared = {{0, 1}}});
  SeparatingTest best;
  if (plan.status != Status::ok) return best;
  best.planned_cosine = best.cosine = plan.planned.cosine(0, 1);
  const std::size_t number = plan.pairs.size();  // of the pair among the cosines
  if (const int item = best_item(plan, 0, 1, number); item >= 0) {
    const PlanItem& found = plan.menu[static_cast<std::size_t>(item)];
    best.cosine = found.cosines[number];
    best.test = found.view.name;
  }
  return best;
}

}  // namespace wheelhop
