#include "core/gap/which/shares.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <stdexcept>

namespace wheelhop {

Vector shapley_values(ConstVectorRef worth) {
  const auto count = static_cast<std::size_t>(worth.size());
  std::size_t n = 0;
  while ((std::size_t{1} << n) < count) ++n;
  if ((std::size_t{1} << n) != count) throw std::invalid_argument("shapley_values: expected 2^n values");
  // |S|! (n - |S| - 1)! / n! by the number of members.
  std::vector<double> weight(n, n > 0 ? 1 / static_cast<double>(n) : 0);
  for (std::size_t s = 1; s < n; ++s) weight[s] = weight[s - 1] * static_cast<double>(s) / static_cast<double>(n - s);
  Vector values = Vector::Zero(static_cast<Index>(n));
  for (std::size_t set = 0; set < count; ++set)
    for (std::size_t i = 0; i < n; ++i) {
      if (set >> i & 1) continue;
      const auto members = static_cast<std::size_t>(std::popcount(set));
      values(static_cast<Index>(i)) +=
          weight[members] * (worth(static_cast<Index>(set | std::size_t{1} << i)) - worth(static_cast<Index>(set)));
    }
  return values;
}

Vector effect_shares(const Study& study, const Hypothesis& none, const Hypothesis& all,
                     const std::vector<Hypothesis>& known) {
  const double gap = none.stage.misfit - 1;
  if (!(gap > 0)) return {};
  const std::size_t everything = (std::size_t{1} << all.effects.size()) - 1;
  Vector worth = Vector::Zero(static_cast<Index>(everything) + 1);
  const auto of_set = [&](const Hypothesis& fitted) {
    return fitted.fit.error.empty() ? std::numeric_limits<double>::quiet_NaN() : 1 - (fitted.stage.misfit - 1) / gap;
  };
  tbb::parallel_for(std::size_t{1}, everything, [&](std::size_t members) {
    const Hypothesis* best = nullptr;
    for (const Hypothesis& other : known)
      if (std::has_single_bit(members) &&
          same_form(other.effects.back(), all.effects[static_cast<std::size_t>(std::countr_zero(members))]) &&
          (!best || other.chi2 < best->chi2))
        best = &other;
    worth(static_cast<Index>(members)) = of_set(best ? *best : fit_subset(study, none, all, members));
  });
  worth(static_cast<Index>(everything)) = of_set(all);
  return worth.allFinite() ? shapley_values(worth) : Vector();
}

}  // namespace wheelhop
