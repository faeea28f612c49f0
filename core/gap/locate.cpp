#include "core/gap/locate.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/data/spectra.hpp"
#include "core/gap/probe.hpp"
#include "core/plant/linearise.hpp"

namespace wheelhop {
namespace {

constexpr double kSameDirection = 0.9999;
constexpr Index kCompared = 12;          // frequencies at which two places are compared
constexpr double kHannLinesApart = 1.5;  // independent values of a Hann spectrum lie so many lines apart
constexpr Index kNearbyLines = 4;        // either side, over which the unknown signal's spectrum is smooth
constexpr double kOverChance = 2;        // its power has to be so many times the noise's there, more than chance makes
constexpr double kAboveTypical = 10;     // and may be so many times that of the lines where it is seen best

/// A force of one Newton at a place, through the plant linearised over its motion.
struct Probe {
  Place place;
  LinearPlant linear;
};

/// True if at every frequency an unknown signal at either place does what one at the other would.
bool enter_alike(const LinearPlant& a, const LinearPlant& b, double highest_hz) {
  for (Index k = 1; k <= kCompared; ++k) {
    const double f = highest_hz * static_cast<double>(k) / static_cast<double>(kCompared);
    const ComplexVector one = force_response(a, f), other = force_response(b, f);
    if (!(std::abs(one.dot(other)) > kSameDirection * one.norm() * other.norm())) return false;
  }
  return true;
}

std::vector<Probe> probes_of(const PlantFit& fit, double highest_hz) {
  const Plant& plant = fit.plant;
  std::vector<Probe> probes;
  const auto add = [&](const std::string& from, const std::string& to, const std::string& location) {
    Probe probe{{location, {}, 0}, linearise_with_force(fit, from, to)};
    if (probe.linear.A.size() == 0) return;
    for (Probe& other : probes)
      if (enter_alike(probe.linear, other.linear, highest_hz)) {
        other.place.same.push_back(location);
        return;
      }
    probes.push_back(std::move(probe));
  };
  for (const Element& element : plant.elements) {
    add(element.from, element.to, element.name);
    for (const PlantInput& input : plant.inputs)
      if (!probes.empty() && probes.back().place.location == element.name && drives(input, element))
        probes.back().place.same.push_back(actuator_of(plant, input));
  }
  for (const Mass& mass : plant.masses) add("ground", mass.name, "guide:" + mass.name);
  return probes;
}

/// g^+ z with Wiener's weight. @param z p x lines, of which `used` count; `noise` is the power of each
/// @param noise_power what noise makes of the result, sum of squares as fft counts them   @return 1 x lines
ComplexMatrix divide_out(const LinearPlant& linear, const Vector& weight, const ComplexMatrix& z, Index used,
                         double line_hz, double noise, double& noise_power) {
  ComplexMatrix f = ComplexMatrix::Zero(1, z.cols());
  Vector visible(used), power(used);
  for (Index k = 0; k < used; ++k) {
    const ComplexVector g = weight.asDiagonal() * force_response(linear, line_hz * static_cast<double>(k));
    visible(k) = std::isfinite(g.squaredNorm()) ? g.squaredNorm() / noise : 0;
    if (visible(k) > 0) f(0, k) = g.dot(z.col(k)) / g.squaredNorm();
    power(k) = std::norm(f(0, k));
  }
  // Mean power of the signal where it can be seen best: each line's |f|^2 - 1 / visible has a variance of that squared.
  const double typical = ((power.cwiseProduct(visible) - Vector::Ones(used)).dot(visible)) / visible.squaredNorm();
  noise_power = 0;
  ComplexMatrix out = ComplexMatrix::Zero(1, z.cols());
  for (Index k = 0; k < used; ++k) {
    const Index from = std::max<Index>(k - kNearbyLines, 0), count = std::min(k + kNearbyLines + 1, used) - from;
    if (!(visible.segment(from, count).minCoeff() > 0) || !(typical > 0)) continue;
    const double own = power.segment(from, count).mean();
    const double quiet = visible.segment(from, count).cwiseInverse().mean();
    const double gain = std::max(0.0, 1 - kOverChance * quiet / own) * typical / (typical + quiet / kAboveTypical);
    out(0, k) = gain * f(0, k);
    noise_power += 2 * gain * gain / visible(k);
  }
  return out;
}

/// What the places are asked about, a record's lines in the band that the drive excites.
struct Spectra {
  /// A channel each, lines x (1 + columns of the Jacobian): first what is measured beyond the fit, then what a unit of
  /// each parameter and initial state adds to it. Scaled so that sums of |.|^2 over lines are chi2 for white noise.
  std::vector<ComplexMatrix> channels;
  double line_hz = 0;
  Index lines() const { return channels.front().rows(); }
};

/// @param first row of the Jacobian at which the record begins
Spectra spectra_of(const PlantFit& fit, const std::vector<FitRecord>& records, std::size_t i, Index first) {
  const Index p = fit.plant.sensor_count(), kept = fit.error[i].cols() - records[i].skip;
  const double sampling_hz = fit.plant.hold_hz() / static_cast<double>(records[i].ratio);
  Spectra spectra;
  spectra.line_hz = sampling_hz / static_cast<double>(kept);
  const double band_hz = std::min(excited_band_hz(fit.plant, records[i]), 0.4 * sampling_hz);
  const auto lines = std::min<Index>(kept / 2 + 1, static_cast<Index>(band_hz / spectra.line_hz) + 1);
  // White noise of variance 1 has a power of 6 / N a line, of which 4/3 values are independent.
  const double scale = std::sqrt(2 / kHannLinesApart * static_cast<double>(kept) / 6);
  spectra.channels.assign(static_cast<std::size_t>(p), ComplexMatrix(lines, 1 + fit.jacobian.cols()));
  const auto fill = [&](const Matrix& values, Index column) {
    const ComplexMatrix spectrum = scale * hann_spectrum(values).leftCols(lines);
    for (Index j = 0; j < p; ++j)
      spectra.channels[static_cast<std::size_t>(j)].col(column) = spectrum.row(j).transpose();
  };
  fill(residual_of(fit, records, i).rightCols(kept), 0);
  for (Index c = 0; c < fit.jacobian.cols(); ++c)
    fill(fit.jacobian.col(c).segment(first, p * kept).reshaped(p, kept), 1 + c);
  return spectra;
}

Matrix gram(const ComplexMatrix& X) { return (X.adjoint() * X).real(); }

/// min over d of |z - J d|^2 and the priors of the parameters, which the fit has moved by `moved` from their means.
/// @param H Gram matrix of [z, J]
double left_at_best(const Matrix& H, const PlantFit& fit) {
  const Index M = H.rows() - 1, states = fit.state_scale.size();
  if (M == 0) return H(0, 0);
  Vector moved(M);
  moved.head(fit.theta.size()) = fit.theta;
  for (std::size_t i = 0; i < fit.initial_states.size(); ++i) {
    const Index from = states * static_cast<Index>(i);
    moved.segment(fit.theta.size() + from, states) =
        fit.initial_states[i].cwiseQuotient(fit.state_scale) - fit.states_at_rest.segment(from, states);
  }
  Matrix A = H.bottomRightCorner(M, M);
  A.diagonal() += fit.precision;
  const Vector pull = fit.precision.cwiseProduct(moved), b = H.col(0).tail(M) - pull;
  return H(0, 0) + moved.dot(pull) - b.dot(Eigen::LDLT<Matrix>(A).solve(b));
}

/// Gram matrices of [z, J] over the channels, and what of them an unknown signal at each place takes.
struct Explained {
  Matrix all;
  std::vector<Matrix> sensors, probes;
  double freedom = 0;  ///< of what remains: one of p channels' went into the signal
};

Explained explained_at(const std::vector<Probe>& probes, const PlantFit& fit, const std::vector<FitRecord>& records) {
  const Index p = fit.plant.sensor_count(), columns = 1 + fit.jacobian.cols();
  Explained sum;
  sum.all = Matrix::Zero(columns, columns);
  sum.sensors.assign(static_cast<std::size_t>(p), sum.all);
  sum.probes.assign(probes.size(), sum.all);
  Index first = 0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Spectra spectra = spectra_of(fit, records, i, first);
    first += p * (fit.error[i].cols() - records[i].skip);
    sum.freedom += static_cast<double>(p - 1) * 2 * static_cast<double>(spectra.lines()) / kHannLinesApart;
    for (Index j = 0; j < p; ++j) {
      const Matrix own = gram(spectra.channels[static_cast<std::size_t>(j)]);
      sum.sensors[static_cast<std::size_t>(j)] += own;
      sum.all += own;
    }
    const Vector weight = records[i].weight_std.cwiseInverse();
    for (std::size_t k = 0; k < probes.size(); ++k) {
      ComplexMatrix explained = ComplexMatrix::Zero(spectra.lines(), columns);
      for (Index line = 0; line < spectra.lines(); ++line) {
        const ComplexVector g =
            (weight.asDiagonal() * force_response(probes[k].linear, spectra.line_hz * static_cast<double>(line)))
                .normalized();
        if (!g.allFinite()) continue;
        for (Index j = 0; j < p; ++j)
          explained.row(line) += std::conj(g(j)) * spectra.channels[static_cast<std::size_t>(j)].row(line);
      }
      sum.probes[k] += gram(explained);
    }
  }
  return sum;
}

}  // namespace

std::vector<Place> locate(const PlantFit& fit, const std::vector<FitRecord>& records) {
  std::vector<Place> places;
  const Index p = fit.plant.sensor_count();
  if (p < 2 || fit.error.size() != records.size()) return places;
  const double highest_hz = 0.4 * fit.plant.hold_hz() / static_cast<double>(records.front().ratio);
  std::vector<Probe> probes = probes_of(fit, highest_hz);
  const Explained explained = explained_at(probes, fit, records);
  for (Index j = 0; j < p; ++j)
    places.push_back(
        {"sensor:" + fit.plant.sensors[static_cast<std::size_t>(j)].name,
         {},
         left_at_best(explained.all - explained.sensors[static_cast<std::size_t>(j)], fit) / explained.freedom});
  for (std::size_t k = 0; k < probes.size(); ++k) {
    probes[k].place.leftover = left_at_best(explained.all - explained.probes[k], fit) / explained.freedom;
    places.push_back(std::move(probes[k].place));
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const Place& a, const Place& b) { return a.leftover < b.leftover; });
  return places;
}

UnknownSignal unknown_signal(const PlantFit& fit, const std::vector<FitRecord>& records, std::size_t i,
                             const std::string& location) {
  UnknownSignal result;
  result.location = location;
  const FitRecord& record = records[i];
  const double sample_time_s = static_cast<double>(record.ratio) / fit.plant.hold_hz();
  const Index N = record.y.cols(), kept = N - record.skip;
  result.value = Vector::Zero(N);
  const auto scored_rms = [&] { return result.value.tail(kept).norm() / std::sqrt(static_cast<double>(kept)); };
  for (Index j = 0; j < fit.plant.sensor_count(); ++j) {
    const Sensor& sensor = fit.plant.sensors[static_cast<std::size_t>(j)];
    if (location != "sensor:" + sensor.name) continue;
    result.status = Status::ok;
    result.unit = sensor.unit;
    result.value.tail(kept) = -fit.error[i].row(j).tail(kept).transpose();
    result.rms = scored_rms();
    result.noise_rms = record.weight_std(j);
    result.band_hz = 0.5 / sample_time_s;
    return result;
  }
  std::string from, to;
  const LinearPlant linear =
      ends_of(fit.plant, location, from, to) ? linearise_with_force(fit, from, to) : LinearPlant{};
  if (linear.A.size() == 0) {
    result.message = "no force stands for the place \"" + location + "\"";
    return result;
  }
  Matrix z = Matrix::Zero(record.y.rows(), 2 * N);
  z.leftCols(kept) = residual_of(fit, records, i).rightCols(kept);
  // What the plant still swings with from before the record, and goes on with behind it, is no force at its ends.
  z.leftCols(kept) *= fade_window(kept).asDiagonal();
  result.unit = "N";
  result.band_hz = std::min(excited_band_hz(fit.plant, record), 0.4 / sample_time_s);
  const double line_hz = 1 / (2 * static_cast<double>(N) * sample_time_s);
  const Index used = std::min<Index>(N, static_cast<Index>(result.band_hz / line_hz)) + 1;
  double noise_power = 0;
  const Vector weight = record.weight_std.cwiseInverse();
  const ComplexMatrix f = divide_out(linear, weight, fft(z), used, line_hz, static_cast<double>(kept), noise_power);
  if (!(f.squaredNorm() > 0)) {
    result.status = Status::rank_deficient;
    result.message = "no channel tells a force at \"" + location + "\" from noise";
    return result;
  }
  // A force input pushes its second node away from the first, a law pulls it near.
  result.value.tail(kept) = -inverse_fft(f, 2 * N).row(0).head(kept).transpose();
  result.status = Status::ok;
  result.rms = scored_rms();
  result.noise_rms = std::sqrt(noise_power / (2 * static_cast<double>(N) * static_cast<double>(kept)));
  return result;
}

}  // namespace wheelhop
