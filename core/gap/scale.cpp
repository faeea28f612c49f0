#include "core/gap/scale.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace wheelhop {
namespace {

constexpr double kTimesOff = 2;  // times too large or too small
constexpr double kGoes = 0.8;    // correlation with the plant
constexpr double kAlike = 0.4;   // by which the scales of all channels may differ where the drive's is wrong: what else
                                 // is missing takes from each its own

}  // namespace

std::vector<WrongScale> wrong_scales(const PlantFit& fit, const std::vector<FitRecord>& records) {
  const Index p = fit.plant.sensor_count();
  Vector both = Vector::Zero(p), measured = both, made = both;
  for (std::size_t i = 0; i < fit.error.size(); ++i) {
    const Index kept = records[i].y.cols() - records[i].skip;
    const Matrix y = records[i].y.rightCols(kept), y_plant = y + fit.error[i].rightCols(kept);
    both += y.cwiseProduct(y_plant).rowwise().sum();
    measured += y.rowwise().squaredNorm();
    made += y_plant.rowwise().squaredNorm();
  }
  std::vector<WrongScale> wrong;
  for (Index j = 0; j < p; ++j) {
    const double correlation = both(j) / std::sqrt(measured(j) * made(j)), reads = both(j) / made(j);
    if (std::abs(correlation) > kGoes && !(reads > 1 / kTimesOff && reads < kTimesOff))
      wrong.push_back({fit.plant.sensors[static_cast<std::size_t>(j)].name, reads});
  }
  return wrong;
}

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
