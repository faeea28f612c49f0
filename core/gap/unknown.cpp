#include "core/gap/unknown.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/data/metrics.hpp"
#include "core/data/resample.hpp"
#include "core/gap/locate.hpp"
#include "core/gap/trajectory.hpp"
#include "core/plant/paths.hpp"

namespace wheelhop {
namespace {

constexpr Index kMemory = 3;     // samples back, every second
constexpr double kRidge = 1e-6;  // of the largest feature's power
constexpr Index kFade = 20;      // the twentieth at either end in which an unknown signal fades

/// Rows: every feature of the motion and the drive, each scaled to an RMS of one.
Matrix features_of(const Plant& plant, const FitRecord& record, const Trajectory& motion) {
  const Matrix drive = decimate(apply_drive_paths(plant, record.drive, 0), record.ratio);
  const Index N = record.y.cols(), E = motion.travel.rows();
  std::vector<Eigen::RowVectorXd> rows;
  const auto add = [&](Eigen::RowVectorXd row) {
    const double size = row.norm() / std::sqrt(static_cast<double>(row.size()));
    if (size > 0 && std::isfinite(size)) rows.push_back(row / size);
  };
  for (Index e = 0; e < E; ++e) {
    const Eigen::RowVectorXd x = motion.travel.row(e).array() - motion.travel.row(e).mean(), v = motion.rate.row(e);
    const double speed = 0.1 * v.norm() / std::sqrt(static_cast<double>(N)) + 1e-300;
    for (const Eigen::RowVectorXd& basic : {x, v})
      for (Index back = 0; back <= kMemory; ++back) {
        Eigen::RowVectorXd late = basic;
        late.tail(N - 2 * back) = basic.head(N - 2 * back);
        add(late);
      }
    add(x.array().square());
    add(x.array().cube());
    add(x.array().abs());
    add(x.array() * v.array());
    add(x.array().square() * v.array());
    add(v.array().square());
    add(v.array().cube());
    add(v.array().abs());
    add((v.array() / speed).tanh());
  }
  for (Index i = 0; i < drive.rows(); ++i) add(drive.row(i).array() - drive.row(i).mean());
  Matrix all(static_cast<Index>(rows.size()) + 1, N);
  for (std::size_t i = 0; i < rows.size(); ++i) all.row(static_cast<Index>(i)) = rows[i];
  all.bottomRows(1).setOnes();
  return all;
}

}  // namespace

double explained_by_states(const PlantFit& fit, const std::vector<FitRecord>& records, const std::string& location) {
  const std::vector<Trajectory> motion = trajectories(fit, records);
  double power = 0, left = 0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const UnknownSignal signal = unknown_signal(fit, records, i, location);
    if (signal.status != Status::ok) return std::numeric_limits<double>::quiet_NaN();
    const Matrix features = features_of(fit.plant, records[i], motion[i]);
    const Index first = records[i].skip + (features.cols() - records[i].skip) / kFade;
    const Index half = (features.cols() - features.cols() / kFade - first) / 2;
    const Matrix A = features.middleCols(first, half), B = features.middleCols(first + half, half);
    const Vector a = signal.value.segment(first, half), b = signal.value.segment(first + half, half);
    Matrix H = A * A.transpose();
    H.diagonal().array() += kRidge * H.diagonal().maxCoeff();
    const Vector weights = H.ldlt().solve(A * a);
    const double noise = static_cast<double>(half) * signal.noise_rms * signal.noise_rms;
    power += std::max(b.squaredNorm() - noise, 0.0);
    left += std::max((b - B.transpose() * weights).squaredNorm() - noise, 0.0);
  }
  return power > 0 ? std::clamp(1 - left / power, 0.0, 1.0) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace wheelhop
