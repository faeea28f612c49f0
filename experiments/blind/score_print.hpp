/// \file
/// The scores of a blind test as tables on stdout.
#pragma once

#include "experiments/blind/score_table.hpp"

namespace wheelhop::scoring {

/// A value that meets its target; false for n = 0.
bool is_met(const Target& target, const Score& score);
/// "all", "clear" or a strength; null where no case is of it.
const Group* find_group(const std::vector<Group>& groups, const std::string& name);

void print_scores(const std::vector<Judged>& judged, const std::vector<Group>& groups);

}  // namespace wheelhop::scoring
