/// \file
/// The scores of a blind test: rates, means and medians over groups of cases, and the targets they are held to.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "experiments/blind/score_calibration.hpp"
#include "experiments/blind/score_case.hpp"

namespace wheelhop::scoring {

struct Score {
  std::string key, meaning;
  double value = 0;          ///< NaN for n = 0
  long n = 0;                ///< cases that count
  std::optional<Rate> rate;  ///< where the score is one
};

/// Cases that are scored together: all, those at 0.7 of the noise and above ("clear"), and those that share a strength,
/// a kind, a set, an effect (single ones), a drive or a plant.
struct Group {
  std::string by, name;
  long cases = 0;
  std::vector<Score> scores;
  Calibration calibration;

  const Score& score(const std::string& key) const;
};

/// In a fixed order; groups by a property that no case states are left out.
std::vector<Group> score_groups(const std::vector<Judged>& judged);

/// What a score should reach, both ends included.
struct Target {
  std::string group, score;  ///< group by its name: "all", "clear" or "weak"
  double low, high;
};
const std::vector<Target>& targets();

}  // namespace wheelhop::scoring
