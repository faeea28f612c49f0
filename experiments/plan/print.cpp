#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/json.hpp"
#include "experiments/plan/plan.hpp"

namespace wheelhop {
namespace {

constexpr std::size_t kListed = 12;  // pairs and parameters that are printed; the file has all

std::string pair_name(const Plan& plan, const PlanPair& pair) {
  const PlannedEffect &a = plan.planned.effects[pair.a], &b = plan.planned.effects[pair.b];
  if (a.location == b.location) return fmt::format("{} and {} at {}", a.effect, b.effect, a.location);
  return effect_name(a) + " and " + effect_name(b);
}

std::string advice(const Plan& plan, const PlanPair& pair) {
  if (pair.item < 0) return "none of the menu";
  return fmt::format("{:.2f}  {}", std::abs(pair.item_cosine),
                     plan.menu[static_cast<std::size_t>(pair.item)].view.name);
}

void print_effects(const Plan& plan) {
  fmt::print("effects at typical size, in noise levels (RMS) when every parameter has followed inside its tolerance\n");
  std::vector<const PlannedEffect*> order;
  for (const PlannedEffect& effect : plan.planned.effects) order.push_back(&effect);
  std::stable_sort(order.begin(), order.end(), [](const PlannedEffect* a, const PlannedEffect* b) {
    return std::isfinite(b->size_sigma) ? a->size_sigma > b->size_sigma : std::isfinite(a->size_sigma);
  });
  for (const PlannedEffect* effect : order) {
    const std::size_t index = static_cast<std::size_t>(effect - plan.planned.effects.data());
    std::string note;
    if (!std::isfinite(effect->size_sigma))
      note = "leaves the domain of its laws under this drive";
    else if (!(effect->size_sigma >= visible_sigma))
      note = effect->size_sigma >= marginal_sigma ? "marginal" : "not diagnosable with this drive";
    std::string shown;
    for (const PlanItem& item : plan.menu)
      if (shown.empty() && std::find(item.shows.begin(), item.shows.end(), index) != item.shows.end())
        shown = fmt::format("; {:.1f} {}", item.view.effects[index].size_sigma, item.view.name);
    fmt::print("  {:<44} {:8.2f}   {:<22} {}{}\n", effect_name(*effect), effect->size_sigma, effect->form, note, shown);
  }
}

void print_pairs(const Plan& plan) {
  if (plan.pairs.empty()) return;
  fmt::print(
      "\n|cosine| of what is left of two effects: above {:g} this drive cannot tell them apart, above {:g} hardly; "
      "what\n"
      "remains, in noise levels, where one is taken for the other; and the test of the menu that tells them best\n",
      confused_cosine, hard_cosine);
  for (std::size_t i = 0; i < plan.pairs.size() && i < kListed; ++i)
    fmt::print("  {:<64} {:4.2f}  {:5.2f}   {}\n", pair_name(plan, plan.pairs[i]), std::abs(plan.pairs[i].cosine),
               plan.pairs[i].left_sigma, advice(plan, plan.pairs[i]));
  if (plan.pairs.size() > kListed) fmt::print("  and {} more pairs\n", plan.pairs.size() - kListed);
}

void print_menu(const Plan& plan) {
  fmt::print(
      "\nthe menu on drives of {:.3g} s, each instead of the test as planned: effects that show there and not here, "
      "pairs\n"
      "above {:g} that it separates, effects that no longer show\n",
      plan.menu_s, hard_cosine);
  for (const PlanItem& item : plan.menu) {
    if (item.view.message.empty())
      fmt::print("  {:<66} shows {:2}  separates {:2}  hides {:2}\n", item.view.name, item.shows.size(),
                 item.separates.size(), item.hides.size());
    else
      fmt::print("  {:<66} not possible: {}\n", item.view.name, item.view.message);
  }
}

/// Parameters that a chain of correlations ties together.
std::vector<std::vector<std::size_t>> known_together(const Plan& plan) {
  std::vector<std::size_t> group(plan.parameters.size());
  std::iota(group.begin(), group.end(), std::size_t{0});
  for (const ParameterPair& pair : correlated_parameters(plan)) {
    const std::size_t kept = group[pair.a], gone = group[pair.b];
    std::replace(group.begin(), group.end(), gone, kept);
  }
  std::vector<std::vector<std::size_t>> groups;
  for (std::size_t g = 0; g < group.size(); ++g) {
    std::vector<std::size_t> members;
    for (std::size_t i = 0; i < group.size(); ++i)
      if (group[i] == g) members.push_back(i);
    if (members.size() > 1) groups.push_back(std::move(members));
  }
  return groups;
}

void print_parameters(const Plan& plan) {
  fmt::print("\nparameters after the test, in tolerances (1: no better known than before)\n");
  for (std::size_t i = 0; i < plan.parameters.size() && i < 3 * kListed; ++i)
    fmt::print("  {:<55} {:5.2f}\n", plan.parameters[i], plan.planned.parameter_std(static_cast<Index>(i)));
  for (const std::vector<std::size_t>& group : known_together(plan)) {
    std::vector<std::string> names;
    for (const std::size_t i : group) names.push_back(plan.parameters[i]);
    fmt::print("  known together only: {}\n", join_names(names));
  }
}

}  // namespace

std::string effect_name(const PlannedEffect& effect) { return fmt::format("{} at {}", effect.effect, effect.location); }

std::string plan_answer(const Plan& plan) {
  std::size_t showing = 0, confused = 0;
  for (const PlannedEffect& effect : plan.planned.effects) showing += effect.size_sigma >= visible_sigma;
  for (const PlanPair& pair : plan.pairs) confused += std::abs(pair.cosine) > confused_cosine;
  std::string text = fmt::format("With this drive {} of {} effects would show", showing, plan.planned.effects.size());
  if (confused == 0) {
    text += ", and no two of them look alike";
  } else {
    const PlanPair& pair = plan.pairs.front();
    text += fmt::format("; {} cannot be told apart", pair_name(plan, pair));
    if (pair.item >= 0) text += fmt::format(" (better {})", plan.menu[static_cast<std::size_t>(pair.item)].view.name);
    if (confused > 1) text += fmt::format(", nor {} other {}", confused - 1, confused > 2 ? "pairs" : "pair");
  }
  if (plan.menu.empty() || !plan.menu.front().view.message.empty()) return text + ".";
  const PlanItem& best = plan.menu.front();
  if (best.shows.empty() && best.separates.empty()) return text + ". Nothing of the menu would do better.";
  std::string use;
  if (!best.shows.empty()) use = fmt::format("shows {} more", best.shows.size());
  if (!best.separates.empty())
    use +=
        fmt::format("{}separates {} of {} pairs", use.empty() ? "" : " and ", best.separates.size(), plan.pairs.size());
  return text + fmt::format(". Of most use next: {}, which {}.", best.view.name, use);
}

void print_plan(const Plan& plan, const std::vector<std::string>& assumed_noise) {
  fmt::print("{}\n", plan_answer(plan));
  if (!assumed_noise.empty())
    fmt::print("The noise of {} is assumed: 1 % of what the plant reads (noise_std in the record set tells it).\n",
               join_names(assumed_noise));
  fmt::print("\n");
  print_effects(plan);
  print_pairs(plan);
  print_menu(plan);
  print_parameters(plan);
}

}  // namespace wheelhop
