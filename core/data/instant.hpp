/// \file
/// Instants written as date and time of day.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace wheelhop {

/// A time of day with its date, if there is one.
struct Instant {
  bool dated = false;
  std::int64_t day = 0;       ///< since 1970-01-01; of a date whose day and month may be exchanged: month first
  bool day_or_month = false;  ///< 03/04/2024: which is the day cannot be told
  std::int64_t ticks = 0;     ///< of the day, in units of 10^-decimals s
  int decimals = 0;           ///< of the second, as written
};

/// Reads "2024-01-05T10:11:12.345", "2024-01-05 10:11:12,345", "2024/01/05 ...", "05.01.2024 ...", "01/05/2024 ..." or
/// "10:11:12.345": seconds with up to nine decimals or none, a "Z" or a distance from UTC ("+01:00") behind it, which
/// does not matter between instants. None if it is nothing of that kind or no such date exists.
std::optional<Instant> find_instant(std::string_view text);

/// Seconds from the midnight that begins `day` to the instant: the double nearest to its decimals. A time without a
/// date counts from its own midnight.
double seconds_since(const Instant& instant, std::int64_t day);

}  // namespace wheelhop
