/// \file
/// The uniform grid that a column of instants stands for.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/linalg.hpp"

namespace wheelhop {

/// The largest `scatter` that may be asked for: beyond it a lost sample could hide in it.
inline constexpr double most_scatter = 0.4;

struct TimeRequest {
  std::optional<double> sampling_hz;        ///< the rate that the instants have to be at; none: to be found
  double unit_s = 1;                        ///< what the numbers of the instants are counted in
  std::optional<double> scatter;            ///< how far from the grid instants may lie, in periods; none: what is usual
  bool may_lose = false;                    ///< lost samples are let pass, and told
  std::string name = "t";                   ///< of the column
  std::string file;                         ///< for messages
  std::function<std::string(Index)> place;  ///< where the file holds an instant, "line 7"
};

/// `count` samples are missing before instant `before`.
struct LostSamples {
  Index before = 0, count = 0;
};

struct TimeGrid {
  double sampling_hz = 0;
  std::vector<LostSamples> lost;
  double scatter = 0;  ///< largest distance from the grid in periods; 0 where the resolution of the file explains it
};

/// The grid of N >= 2 instants `t`, which count in units of `unit_s`.
///
/// Instants count as a grid if their distances from it spread over less than 1e-4 of a period, or over less than what
/// rounding can explain: to as many decimals or significant digits as the column shows, or to float32 where every value
/// is one. Else if they scatter like noise (none is farther off than six times their RMS) with an RMS of at most 2 % of
/// a period, or by at most `scatter`: then the samples are taken to lie on the grid. A rate that is to be found is the
/// one with the fewest digits, in Hz or as a period in s, that fits as well. A rate that is asked for may differ by
/// 1e-4 of it. Samples are lost where more than one period passes between instants and the rest is a grid. UserError
/// naming the place: not increasing, not uniform, lost samples (with all places) where they may not be; or both rates
/// where they differ.
TimeGrid fit_time_grid(ConstVectorRef t, const TimeRequest& request);

}  // namespace wheelhop
