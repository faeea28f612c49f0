#include "core/data/instant.hpp"

#include <chrono>
#include <cmath>

namespace wheelhop {
namespace {

/// Takes what it expects from the front of a text.
class InstantReader {
 public:
  explicit InstantReader(std::string_view text) : rest_(text) {}
  bool done() const { return rest_.empty(); }
  char front() const { return rest_.empty() ? '\0' : rest_.front(); }
  bool take(char c) {
    if (front() != c) return false;
    rest_.remove_prefix(1);
    return true;
  }
  /// A whole number of so many digits.
  bool number(std::size_t least, std::size_t most, std::int64_t& value, std::size_t* digits = nullptr) {
    std::size_t count = 0;
    value = 0;
    for (; count < most && front() >= '0' && front() <= '9'; ++count) {
      value = 10 * value + (front() - '0');
      rest_.remove_prefix(1);
    }
    if (digits) *digits = count;
    return count >= least;
  }

 private:
  std::string_view rest_;
};

bool set_day(Instant& instant, std::int64_t year, std::int64_t month, std::int64_t day) {
  const std::chrono::year_month_day date{std::chrono::year(static_cast<int>(year)),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (!date.ok()) return false;
  instant.dated = true;
  instant.day = std::chrono::sys_days(date).time_since_epoch().count();
  return true;
}

bool take_date(InstantReader& text, Instant& instant) {
  std::int64_t first = 0, second = 0, third = 0;
  std::size_t digits = 0;
  if (!text.number(1, 4, first, &digits)) return false;
  const char mark = text.front();
  if ((mark != '-' && mark != '/' && mark != '.') || !text.take(mark)) return false;
  if (!text.number(1, 2, second) || !text.take(mark)) return false;
  if (digits == 4) return mark != '.' && text.number(1, 2, third) && set_day(instant, first, second, third);
  if (digits > 2 || mark == '-' || !text.number(4, 4, third)) return false;
  if (mark == '.') return set_day(instant, third, second, first);
  instant.day_or_month = first <= 12 && second <= 12 && first != second;
  return first > 12 ? set_day(instant, third, second, first) : set_day(instant, third, first, second);
}

bool take_time(InstantReader& text, Instant& instant) {
  std::int64_t hour = 0, minute = 0, second = 0;
  if (!text.number(1, 2, hour) || !text.take(':') || !text.number(2, 2, minute) || hour > 23 || minute > 59)
    return false;
  if (text.take(':') && (!text.number(2, 2, second) || second > 60)) return false;
  instant.ticks = (hour * 60 + minute) * 60 + second;
  if (!text.take('.') && !text.take(',')) return true;
  std::int64_t fraction = 0;
  std::size_t digits = 0;
  if (!text.number(1, 9, fraction, &digits)) return false;
  instant.decimals = static_cast<int>(digits);
  for (std::size_t i = 0; i < digits; ++i) instant.ticks *= 10;
  instant.ticks += fraction;
  return true;
}

bool take_zone(InstantReader& text) {
  if (text.take('Z') || text.done()) return true;
  std::int64_t hours = 0, minutes = 0;
  if (!text.take('+') && !text.take('-')) return false;
  if (!text.number(2, 2, hours)) return false;
  if (text.done()) return true;
  text.take(':');
  return text.number(2, 2, minutes);
}

}  // namespace

std::optional<Instant> find_instant(std::string_view text) {
  Instant instant;
  InstantReader dated(text);
  if (take_date(dated, instant)) {
    if (!dated.take('T')) do {
        if (!dated.take(' ')) return {};
      } while (dated.front() == ' ');
    if (take_time(dated, instant) && take_zone(dated) && dated.done()) return instant;
    return {};
  }
  instant = {};
  InstantReader bare(text);
  if (take_time(bare, instant) && take_zone(bare) && bare.done()) return instant;
  return {};
}

double seconds_since(const Instant& instant, std::int64_t day) {
  std::int64_t unit = 1;
  for (int i = 0; i < instant.decimals; ++i) unit *= 10;
  const std::int64_t days = instant.dated ? instant.day - day : 0;
  // Exact up to 9e15 units, so that the quotient is the double nearest to the decimal number.
  return (static_cast<double>(days) * 86400 * static_cast<double>(unit) + static_cast<double>(instant.ticks)) /
         static_cast<double>(unit);
}

}  // namespace wheelhop
