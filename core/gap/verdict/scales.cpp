#include "core/gap/verdict/scales.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace wheelhop {
namespace {

constexpr double kAlike = 0.4;  // by which the scales of all channels may differ where the drive's is wrong: what else
                                // is missing takes from each its own

}  // namespace

bool one_scale(const std::vector<WrongScale>& wrong, std::size_t channels) {
  const auto alike = [&](const WrongScale& one) {
    return std::abs(one.reads - wrong.front().reads) < kAlike * std::abs(wrong.front().reads);
  };
  return wrong.size() == 1 ||
         (channels > 1 && wrong.size() == channels && std::all_of(wrong.begin(), wrong.end(), alike));
}

std::string scale_message(const std::vector<WrongScale>& wrong, std::size_t channels) {
  if (wrong.empty()) return "";
  if (wrong.size() > 1 && one_scale(wrong, channels))
    return fmt::format(
        "every channel reads {:.3g} times what the plant makes of the drive: check the drive's unit and sign",
        wrong.front().reads);
  std::string list;
  for (const WrongScale& one : wrong)
    list += fmt::format("{}{} reads {:.3g}", list.empty() ? "" : ", ", one.channel, one.reads);
  return list + " times what the plant makes of the drive: check unit and sign";
}

}  // namespace wheelhop
