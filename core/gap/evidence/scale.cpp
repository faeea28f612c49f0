#include "core/gap/evidence/scale.hpp"

#include <algorithm>
#include <cmath>

namespace wheelhop {
namespace {

constexpr double kTimesOff = 2;  // times too large or too small
constexpr double kGoes = 0.8;    // correlation with the plant

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

}  // namespace wheelhop
