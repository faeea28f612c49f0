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

constexpr double kWindow_s = 2;  // over which a law that changes with time stays as it is
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

/// Share of a signal that two regressors of one element explain window by window, the best element's.
/// @param window_freedom independent values of the signal a window
double explained_locally(const Vector& value, const Trajectory& motion, Index window, double window_freedom) {
  double best = 0;
  for (Index e = 0; e < motion.travel.rows(); ++e) {
    double power = 0, left = 0;
    for (Index first = 0; first + window <= value.size(); first += window) {
      Matrix A(window, 3);
      A << motion.travel.row(e).segment(first, window).transpose(),
          motion.rate.row(e).segment(first, window).transpose(), Vector::Ones(window);
      A.leftCols(2).rowwise() -= A.leftCols(2).colwise().mean();
      for (Index j = 0; j < 2; ++j) A.col(j) /= std::max(A.col(j).norm(), 1e-300);
      const Vector b = value.segment(first, window);
      const Vector r = b - A * (A.transpose() * A).ldlt().solve(A.transpose() * b);
      power += (b.array() - b.mean()).square().sum();
      left += r.squaredNorm();
    }
    if (power > 0) best = std::max(best, 1 - left / power / std::max(1 - 2 / window_freedom, 0.1));
  }
  return best;
}

}  // namespace

double explained_by_states(const PlantFit& fit, const std::vector<FitRecord>& records, const std::string& location) {
  const std::vector<Trajectory> motion = trajectories(fit, records);
  const double sampling_hz = fit.plant.hold_hz() / static_cast<double>(records.front().ratio);
  double power = 0, left = 0, locally = 0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const UnknownSignal signal = unknown_signal(fit, records, i, location);
    if (signal.status != Status::ok) return std::numeric_limits<double>::quiet_NaN();
    const Matrix features = features_of(fit.plant, records[i], motion[i]);
    const Index first = records[i].skip + (features.cols() - records[i].skip) / kFade;
    const Index half = (features.cols() - features.cols() / kFade - first) / 2;
    const Matrix A = features.middleCols(first, half), B = features.middleCols(first + half, half);
    const Vector a = signal.value.segment(first, half), b = signal.value.segment(first + half, half);
    const auto window = static_cast<Index>(std::llround(kWindow_s * sampling_hz));
    locally = std::max(locally, explained_locally(signal.value, motion[i], window, 2 * signal.band_hz * kWindow_s));
    Matrix H = A * A.transpose();
    H.diagonal().array() += kRidge * H.diagonal().maxCoeff();
    const Vector weights = H.ldlt().solve(A * a);
    const double noise = static_cast<double>(half) * signal.noise_rms * signal.noise_rms;
    power += std::max(b.squaredNorm() - noise, 0.0);
    left += std::max((b - B.transpose() * weights).squaredNorm() - noise, 0.0);
  }
  if (!(power > 0)) return std::numeric_limits<double>::quiet_NaN();
  return std::clamp(std::max(1 - left / power, locally), 0.0, 1.0);
}

}  // namespace wheelhop
