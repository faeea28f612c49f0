/// \file
/// Comparisons in words and as a table on the terminal.
#pragma once

#include <string>

#include "core/base/json.hpp"

namespace wheelhop {

/// "sdi beats hou_patton by 0.31 VAF points [0.22, 0.40] on axle_acceleration at snr_db 20; 200 of 200 pairs; p < 1e-20
/// after correction". @param comparison, pair as in compare_rows(), with p_holm and verdict
std::string sentence_of(const Json& comparison, const Json& pair);

/// @param result of compare_rows()
void print_comparison(const Json& result);

}  // namespace wheelhop
