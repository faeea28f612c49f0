#include "core/gap/where/unknown.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/data/metrics.hpp"
#include "core/data/resample.hpp"
#include "core/gap/where/locate.hpp"
#include "core/greybox/trajectory.hpp"
#include "core/plant/paths.hpp"

namespace wheelhop {
namespace {

constexpr double kWindows_s[] = {0.125, 0.25, 0.5, 2};  // over which a law that changes with time stays as it is
constexpr Index kSurrogates = 16;                       // times, the signal's own among them
constexpr double kBeyondChance = 1.2;                   // of what they explain at best, window by window,
constexpr double kBeyondChanceAcross = 2;               // and from one half to the other, where it is less than
constexpr double kNoChance = 0.04;                      // this share
constexpr double kChance = 0.0025;               // share that they explain at least, as far as a few of them tell
constexpr Index kMemory = 3;                     // samples back, every second
constexpr double kThresholds[] = {1.5, 2, 2.5};  // RMS of a motion
constexpr double kFeatureRidge = 1e-6;           // of the largest feature's power
constexpr Index kFade = 20;                      // the twentieth at either end in which an unknown signal fades

/// A travel or position [m], and its rate.
struct Moved {
  Eigen::RowVectorXd x, v;
};

/// What a law at a place reads: its element's travel, the position of a guided mass, the drive of an actuator; of
/// no place all of these.
std::vector<Moved> moved_at(const Plant& plant, const FitRecord& record, const Trajectory& motion, const Place& entry) {
  std::vector<Moved> list;
  const auto wanted = [&](const Place& place) { return entry.empty() || entry == place; };
  for (std::size_t e = 0; e < plant.elements.size(); ++e)
    if (const auto row = static_cast<Index>(e); wanted(location_of(plant.elements[e])))
      list.push_back({motion.travel.row(row), motion.rate.row(row)});
  for (std::size_t i = 0; i < plant.masses.size(); ++i)
    if (const auto row = static_cast<Index>(i); wanted(guide_place(plant.masses[i].name)))
      list.push_back({motion.position.row(row), motion.velocity.row(row)});
  const Matrix drive = decimate(apply_drive_paths(plant, record.drive, 0), record.ratio);
  for (std::size_t i = 0; i < plant.inputs.size(); ++i)
    if (wanted(actuator_of(plant, plant.inputs[i]))) {
      const Eigen::RowVectorXd u = drive.row(static_cast<Index>(i));
      Eigen::RowVectorXd rate = Eigen::RowVectorXd::Zero(u.size());
      rate.tail(u.size() - 1) =
          (u.tail(u.size() - 1) - u.head(u.size() - 1)) * plant.hold_hz() / static_cast<double>(record.ratio);
      list.push_back({u, rate});
    }
  return list;
}

/// Rows, each scaled to an RMS of one, and a constant.
Matrix stacked(const std::vector<Eigen::RowVectorXd>& rows, Index N) {
  std::vector<Eigen::RowVectorXd> kept;
  for (const Eigen::RowVectorXd& row : rows) {
    const double size = row.norm() / std::sqrt(static_cast<double>(row.size()));
    if (size > 0 && std::isfinite(size)) kept.push_back(row / size);
  }
  Matrix all(static_cast<Index>(kept.size()) + 1, N);
  for (std::size_t i = 0; i < kept.size(); ++i) all.row(static_cast<Index>(i)) = kept[i];
  all.bottomRows(1).setOnes();
  return all;
}

/// What a smooth law with some memory makes of the motion.
Matrix smooth_features(const std::vector<Moved>& moved, Index N) {
  std::vector<Eigen::RowVectorXd> rows;
  for (const Moved& own : moved) {
    const Eigen::RowVectorXd x = own.x.array() - own.x.mean(), &v = own.v;
    const double speed = 0.1 * v.norm() / std::sqrt(static_cast<double>(N)) + 1e-300;
    for (const Eigen::RowVectorXd& basic : {x, v})
      for (Index back = 0; back <= kMemory; ++back) {
        Eigen::RowVectorXd late = basic;
        late.tail(N - 2 * back) = basic.head(N - 2 * back);
        rows.push_back(late);
      }
    rows.push_back(x.array().square());
    rows.push_back(x.array().cube());
    rows.push_back(x.array().abs());
    rows.push_back(x.array() * v.array());
    rows.push_back(x.array().square() * v.array());
    rows.push_back(v.array().square());
    rows.push_back(v.array() * v.array().abs());
    rows.push_back(v.array().cube());
    rows.push_back(v.array().abs());
    rows.push_back((v.array() / speed).tanh());
  }
  return stacked(rows, N);
}

/// What a stop, a limit or a contact that opens makes of it: nothing below a threshold.
Matrix peak_features(const Moved& moved, Index N) {
  std::vector<Eigen::RowVectorXd> rows;
  for (const Eigen::RowVectorXd& of : {moved.x, moved.v}) {
    const Eigen::RowVectorXd z = of.array() - of.mean();
    const double rms = z.norm() / std::sqrt(static_cast<double>(N));
    for (const double threshold : kThresholds) {
      rows.push_back((z.array() - threshold * rms).max(0));
      rows.push_back((-z.array() - threshold * rms).max(0));
    }
  }
  return stacked(rows, N);
}

/// Share of a signal that travel and rate of one place explain window by window.
/// @param shift samples by which the motion is moved around against the signal
double explained_by_window(const Vector& value, const Moved& own, Index window, Index shift) {
  double power = 0, left = 0;
  for (Index first = 0; first + window <= value.size(); first += window) {
    const Index from = (first + shift) % (value.size() - window + 1);
    Matrix A(window, 3);
    A << own.x.segment(from, window).transpose(), own.v.segment(from, window).transpose(), Vector::Ones(window);
    A.leftCols(2).rowwise() -= A.leftCols(2).colwise().mean();
    for (Index j = 0; j < 2; ++j) A.col(j) /= std::max(A.col(j).norm(), 1e-300);
    const Vector b = value.segment(first, window);
    const Vector r = b - A * (A.transpose() * A).ldlt().solve(A.transpose() * b);
    power += (b.array() - b.mean()).square().sum();
    left += r.squaredNorm();
  }
  return power > 0 ? 1 - left / power : 0;
}

/// The same for laws that change with time, the best place's and window's: beyond what the motion of other times
/// explains on average, and 0 unless it is clearly more than the most that any of those does at its best place.
double explained_locally(const Vector& value, const std::vector<Moved>& moved, double sampling_hz) {
  Vector best = Vector::Zero(kSurrogates);  // of the signal's own time, then of other times
  for (const Moved& own : moved)
    for (const double window_s : kWindows_s) {
      const auto window = static_cast<Index>(std::llround(window_s * sampling_hz));
      if (window < 8 || window > value.size() / kSurrogates) continue;
      Vector share(kSurrogates);
      for (Index k = 0; k < kSurrogates; ++k)
        share(k) = explained_by_window(value, own, window, k * value.size() / kSurrogates);
      const double chance = share.tail(kSurrogates - 1).mean();
      best = best.cwiseMax((share.array() - chance).matrix() / (1 - chance));
    }
  return best(0) > kBeyondChance * best.tail(kSurrogates - 1).maxCoeff() && best(0) > kNoChance ? best(0) : 0;
}

/// A signal and its surrogates, moved around in time against the motion: N x kSurrogates.
Matrix moved_around(ConstVectorRef value) {
  const Index N = value.size();
  Matrix signals(N, kSurrogates);
  for (Index k = 0; k < kSurrogates; ++k) {
    const Index shift = k * N / kSurrogates;
    signals.col(k) << value.tail(N - shift), value.head(shift);
  }
  return signals;
}

/// Squares of signals above their noise that the weights of features, fitted on either half, leave of the other half:
/// one value a signal. Without features: the squares themselves.
Vector left_across_halves(const Matrix& features, const Matrix& signals, double noise) {
  const Index half = signals.rows() / 2;
  Vector left = Vector::Zero(signals.cols());
  for (const bool later : {false, true}) {
    const auto of = [&](bool second) { return signals.middleRows(second ? half : 0, half); };
    Matrix rest = of(!later);
    if (features.size() > 0) {
      const Matrix A = features.middleCols(later ? half : 0, half);
      Matrix H = A * A.transpose();
      H.diagonal().array() += kFeatureRidge * H.diagonal().maxCoeff();
      rest -= features.middleCols(later ? 0 : half, half).transpose() * H.ldlt().solve(A * of(later));
    }
    left += (rest.colwise().squaredNorm().transpose().array() - noise).max(0.0).matrix();
  }
  return left;
}

}  // namespace

double explained_by_states(const PlantFit& fit, const std::vector<FitRecord>& records, const Place& location,
                           const Place& entry) {
  const std::vector<Trajectory> motion = trajectories(fit, records);
  const double sampling_hz = fit.plant.hold_hz() / static_cast<double>(records.front().ratio);
  double locally = 0;
  Vector power = Vector::Zero(kSurrogates);
  std::vector<Vector> left;  // by each way to explain it
  for (std::size_t i = 0; i < records.size(); ++i) {
    const UnknownSignal signal = unknown_signal(fit, records, i, location);
    if (signal.status != Status::ok) return std::numeric_limits<double>::quiet_NaN();
    const std::vector<Moved> moved = moved_at(fit.plant, records[i], motion[i], entry);
    const Index N = records[i].y.cols(), first = records[i].skip + (N - records[i].skip) / kFade;
    const Index half = (N - N / kFade - first) / 2;
    const Matrix signals = moved_around(signal.value.segment(first, 2 * half));
    const double noise = static_cast<double>(half) * signal.noise_rms * signal.noise_rms;
    locally = std::max(locally, explained_locally(signal.value, moved, sampling_hz));
    power += left_across_halves({}, signals, noise);
    std::vector<Matrix> ways = {smooth_features(moved, N)};
    for (const Moved& own : moved) {  // what all places together fit by chance may hide what one explains
      ways.push_back(peak_features(own, N));
      if (moved.size() > 1) ways.push_back(smooth_features({own}, N));
    }
    left.resize(ways.size(), Vector::Zero(kSurrogates));
    for (std::size_t k = 0; k < ways.size(); ++k)
      left[k] += left_across_halves(ways[k].middleCols(first, 2 * half), signals, noise);
  }
  if (!(power.minCoeff() > 0)) return std::numeric_limits<double>::quiet_NaN();
  Vector shares = Vector::Zero(kSurrogates);
  for (const Vector& own : left) shares = shares.cwiseMax((1 - own.array() / power.array()).matrix());
  // Under a drive that comes again within a record the surrogates are as good as the signal.
  const double chance = kBeyondChanceAcross * std::max(shares.tail(kSurrogates - 1).maxCoeff(), kChance);
  const double across = shares(0) > std::min(chance, kNoChance) ? shares(0) : 0;
  return std::min(std::max(across, locally), 1.0);
}

std::vector<MotionShare> motion_shares(const PlantFit& fit, const std::vector<FitRecord>& records,
                                       const std::vector<PlaceLeftover>& places, double near) {
  std::vector<MotionShare> shares;
  if (places.empty()) return shares;
  const Place& best = places.front().location;
  const auto ask = [&](const Place& at, const Place& entry, bool attached) {
    const auto asked = [&](const MotionShare& other) {
      return other.at == at && other.entry == entry && other.attached == attached;
    };
    if (std::none_of(shares.begin(), shares.end(), asked))
      shares.push_back({at, entry, attached, explained_by_states(fit, records, at, entry)});
  };
  if (best.kind == PlaceKind::sensor) return shares;  // a sensor's error is no function of what moves
  ask(best, {}, false);
  for (const PlaceLeftover& place : places)
    if (place.leftover <= near * places.front().leftover)
      for (const Place& entry : entries_of(place)) ask(place.location, entry, false);
  if (best.kind == PlaceKind::guide)
    for (const Element& element : fit.plant.elements)
      if (element.from == best.name || element.to == best.name) ask(best, part_place(element.name), true);
  return shares;
}

}  // namespace wheelhop
