#include "core/gap/where/locate.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/data/slow_channels.hpp"
#include "core/data/spectra.hpp"
#include "core/gap/where/probe.hpp"
#include "core/plant/linearise.hpp"
#include "core/plant/rotary.hpp"

namespace wheelhop {
namespace {

constexpr double kSameDirection = 0.9999;
constexpr Index kCompared = 12;          // frequencies at which two places are compared
constexpr double kOwnDirection = 0.03;   // of a unit vector, what a second place has to add to the first one's
constexpr double kFloorError = 0.5;      // of the noise, by which the floor in the band may be wrong
constexpr double kLinearised = 0.02;     // of the gap, what linearising may leave at the right place
constexpr double kQuietest = 0.1;        // of the mean density, taken for the noise where it has still less in the band
constexpr std::size_t kPaired = 8;       // best places of which every pair is tried
constexpr double kHannLinesApart = 1.5;  // independent values of a Hann spectrum lie so many lines apart
constexpr Index kNearbyLines = 4;        // either side, over which the unknown signal's spectrum is smooth
constexpr double kOverChance = 2;        // its power has to be so many times the noise's there, more than chance makes
constexpr double kHalved = 0.5;          // of what the best place leaves, what two places may leave of it to be told
constexpr double kAboveTypical = 10;     // and may be so many times that of the lines where it is seen best

/// A place as an unknown signal shows there.
struct Entry {
  PlaceLeftover place;
  Index sensor = -1;   ///< channel that a sensor's unknown is in, alone
  LinearPlant linear;  ///< of any other place: a force there through the plant, linearised over its motion
};

/// Weights of the channels at a frequency, with what slow channels make of it. @param weight p, one over the noise
ComplexVector shown(const FitRecord& record, const Vector& weight, double cycles) {
  ComplexVector out = weight.cast<std::complex<double>>();
  for (std::size_t i = 0; i < record.slow.size(); ++i)
    out(static_cast<Index>(i)) *= response_of(record.slow[i], cycles);
  return out;
}

/// Direction of the channels in which it shows at a frequency, a unit vector in units of the noise; not finite where a
/// pole of the plant lies there.
ComplexVector direction(const Entry& entry, const ComplexVector& weight, double frequency_hz) {
  if (entry.sensor >= 0) return Vector::Unit(weight.size(), entry.sensor).cast<std::complex<double>>();
  return (weight.asDiagonal() * force_response(entry.linear, frequency_hz)).normalized();
}

/// True if at every frequency an unknown signal at either place does what one at the other would.
bool enter_alike(const LinearPlant& a, const LinearPlant& b, double highest_hz) {
  for (Index k = 1; k <= kCompared; ++k) {
    const double f = highest_hz * static_cast<double>(k) / static_cast<double>(kCompared);
    const ComplexVector one = force_response(a, f), other = force_response(b, f);
    if (!(std::abs(one.dot(other)) > kSameDirection * one.norm() * other.norm())) return false;
  }
  return true;
}

/// True of an accelerometer that feels a force at a place directly.
bool feels(const Plant& plant, const Place& sensor, const Place& location) {
  ForcePlace place;
  if (!force_place_of(plant, location, place)) return false;
  return std::any_of(plant.sensors.begin(), plant.sensors.end(), [&](const Sensor& own) {
    return sensor == sensor_place(own.name) && own.kind == SensorKind::acceleration &&
           (own.to == place.from || own.to == place.to);
  });
}

std::vector<Entry> all_entries(const PlantFit& fit, const std::vector<FitRecord>& records) {
  const Plant& plant = fit.plant;
  const double highest_hz = 0.4 * plant.hold_hz() / static_cast<double>(records.front().ratio);
  std::vector<Entry> entries;
  for (std::size_t j = 0; j < plant.sensors.size(); ++j)
    entries.push_back({{sensor_place(plant.sensors[j].name), {}, 0}, static_cast<Index>(j), {}});
  const auto known = [](const PlaceLeftover& place, const Place& location) {
    return place.location == location || std::find(place.same.begin(), place.same.end(), location) != place.same.end();
  };
  const auto add = [&](const ForcePlace& place, const Place& location) {
    Entry entry{{location, {}, 0}, -1, linearise_with_force(fit, place)};
    if (entry.linear.A.size() == 0) return;
    for (Entry& other : entries)
      if (other.sensor < 0 && enter_alike(entry.linear, other.linear, highest_hz)) {
        if (!known(other.place, location)) other.place.same.push_back(location);  // a guide that is an element
        return;
      }
    entries.push_back(std::move(entry));
  };
  for (const Element& element : plant.elements) {
    const Place location = location_of(element);
    add({element.from, element.to, element.name}, location);
    for (const PlantInput& input : plant.inputs)
      if (!entries.empty() && entries.back().place.location == location && drives(input, element))
        entries.back().place.same.push_back(actuator_of(plant, input));
  }
  for (const Mass& mass : plant.masses) add({"ground", mass.name}, guide_place(mass.name));
  return entries;
}

/// g^+ z with Wiener's weight. @param z p x lines, of which `used` count; `noise` is the power of each
/// @param noise_power what noise makes of the result, sum of squares as fft counts them   @return 1 x lines
/// @param weight of shown(), p x used
ComplexMatrix divide_out(const LinearPlant& linear, const ComplexMatrix& weight, const ComplexMatrix& z, Index used,
                         double line_hz, double noise, double& noise_power) {
  ComplexMatrix f = ComplexMatrix::Zero(1, z.cols());
  Vector visible(used), power(used);
  for (Index k = 0; k < used; ++k) {
    const ComplexVector g = weight.col(k).asDiagonal() * force_response(linear, line_hz * static_cast<double>(k));
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
  /// A channel each, lines x (1 + stored columns of the Jacobian): first what is measured beyond the fit, then what a
  /// unit of each parameter, and of the record's own initial state, adds to it. Scaled so that sums of |.|^2 over lines
  /// are chi2 for white noise.
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

/// Noise density of each channel below a frequency, over that of white noise of the same power. Never so low that what
/// no plant tells would count.
/// @param share of the whole band, 0 ... 1
Vector density_below(const Matrix& noise_shares, Index p, double share) {
  if (noise_shares.size() == 0) return Vector::Ones(p);
  const auto bands = std::max<Index>(1, std::llround(share * static_cast<double>(noise_shares.cols())));
  const Vector mean = noise_shares.leftCols(bands).rowwise().mean();
  return (mean * static_cast<double>(noise_shares.cols())).cwiseMax(kQuietest);
}

Matrix gram(const ComplexMatrix& X) { return (X.adjoint() * X).real(); }

/// min over d of |z - J d|^2 and the priors of the parameters, from whose means the fit lies as far as it says.
/// @param grams of [z, J], one a record, of its stored columns
double left_at_best(const std::vector<Matrix>& grams, const PlantFit& fit) {
  const BlockAngular layout(1 + fit.layout.common(), fit.layout.own(), fit.layout.groups(), {});
  Matrix H = Matrix::Zero(layout.columns(), layout.columns());
  for (std::size_t i = 0; i < grams.size(); ++i) layout.add_of_group(grams[i], static_cast<Index>(i), H);
  const Index M = H.rows() - 1;
  if (M == 0) return H(0, 0);
  Matrix A = H.bottomRightCorner(M, M);
  A.diagonal() += fit.precision;
  const Vector pull = fit.precision.cwiseProduct(fit.deviation), b = H.col(0).tail(M) - pull;
  return H(0, 0) + fit.deviation.dot(pull) - b.dot(Eigen::LDLT<Matrix>(A).solve(b));
}

/// What unknown signals at each set of places leave, over the noise, in the order of the sets.
/// @param sets numbers of entries, fewer than there are channels
std::vector<double> leftovers(const std::vector<Entry>& entries, const std::vector<std::vector<std::size_t>>& sets,
                              const PlantFit& fit, const std::vector<FitRecord>& records, const Matrix& noise_shares) {
  const Index p = fit.plant.sensor_count(), columns = 1 + fit.jacobian.cols();
  // Gram matrices of [z, J], one a record: for each set, what it leaves.
  std::vector<std::vector<Matrix>> left_of(sets.size());
  double freedom = 0;  // of one channel
  Index first = 0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    Spectra spectra = spectra_of(fit, records, i, first);
    first += p * (fit.error[i].cols() - records[i].skip);
    freedom += 2 * static_cast<double>(spectra.lines()) / kHannLinesApart;
    const double nyquist_hz = 0.5 * fit.plant.hold_hz() / static_cast<double>(records[i].ratio);
    const double share = spectra.line_hz * static_cast<double>(spectra.lines()) / nyquist_hz;
    const Vector level = density_below(noise_shares, p, share).cwiseSqrt();
    Matrix all = Matrix::Zero(columns, columns);
    for (Index j = 0; j < p; ++j) {
      ComplexMatrix& channel = spectra.channels[static_cast<std::size_t>(j)];
      channel /= level(j);
      all += gram(channel);
    }
    const Vector weight = records[i].weight_std.cwiseProduct(level).cwiseInverse();
    std::vector<ComplexMatrix> directions(entries.size(), ComplexMatrix(p, spectra.lines()));
    for (Index line = 0; line < spectra.lines(); ++line) {
      const double frequency_hz = spectra.line_hz * static_cast<double>(line);
      const ComplexVector seen = shown(records[i], weight, 0.5 * frequency_hz / nyquist_hz);
      for (std::size_t e = 0; e < entries.size(); ++e)
        directions[e].col(line) = direction(entries[e], seen, frequency_hz);
    }
    for (std::size_t k = 0; k < sets.size(); ++k) {
      std::vector<ComplexMatrix> explained(sets[k].size(), ComplexMatrix::Zero(spectra.lines(), columns));
      for (Index line = 0; line < spectra.lines(); ++line) {
        std::vector<ComplexVector> basis;
        for (const std::size_t number : sets[k]) {
          ComplexVector own = directions[number].col(line);
          for (const ComplexVector& other : basis) own -= other.dot(own) * other;
          if (!(own.norm() > kOwnDirection)) continue;
          basis.push_back(own.normalized());
          for (Index j = 0; j < p; ++j)
            explained[basis.size() - 1].row(line) +=
                std::conj(basis.back()(j)) * spectra.channels[static_cast<std::size_t>(j)].row(line);
        }
      }
      Matrix taken = Matrix::Zero(columns, columns);
      for (const ComplexMatrix& part : explained) taken += gram(part);
      left_of[k].push_back(all - taken);
    }
  }
  std::vector<double> left;
  for (std::size_t k = 0; k < sets.size(); ++k)
    left.push_back(left_at_best(left_of[k], fit) /
                   (freedom * static_cast<double>(p - static_cast<Index>(sets[k].size()))));
  return left;
}

}  // namespace

std::vector<PlaceLeftover> locate(const PlantFit& fit, const std::vector<FitRecord>& records,
                                  const Matrix& noise_shares) {
  std::vector<PlaceLeftover> places;
  if (fit.plant.sensor_count() < 2 || fit.error.size() != records.size()) return places;
  std::vector<Entry> entries = all_entries(fit, records);
  std::vector<std::vector<std::size_t>> each;
  for (std::size_t k = 0; k < entries.size(); ++k) each.push_back({k});
  const std::vector<double> left = leftovers(entries, each, fit, records, noise_shares);
  for (std::size_t k = 0; k < entries.size(); ++k) {
    entries[k].place.leftover = left[k];
    places.push_back(std::move(entries[k].place));
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const PlaceLeftover& a, const PlaceLeftover& b) { return a.leftover < b.leftover; });
  return places;
}

std::vector<PairLeftover> locate_two(const PlantFit& fit, const std::vector<FitRecord>& records,
                                     const std::vector<PlaceLeftover>& places, const Matrix& noise_shares) {
  std::vector<PairLeftover> pairs;
  if (fit.plant.sensor_count() < 3 || places.empty()) return pairs;
  const std::vector<Entry> entries = all_entries(fit, records);
  std::vector<std::size_t> best;  // in the order of the places
  for (std::size_t i = 0; i < std::min(places.size(), kPaired); ++i)
    best.push_back(static_cast<std::size_t>(
        std::find_if(entries.begin(), entries.end(),
                     [&](const Entry& entry) { return entry.place.location == places[i].location; }) -
        entries.begin()));
  std::vector<std::vector<std::size_t>> sets;
  for (std::size_t i = 0; i < best.size(); ++i)
    for (std::size_t j = i + 1; j < best.size(); ++j) {
      sets.push_back({best[i], best[j]});
      pairs.push_back({{places[i].location, places[j].location}, 0});
    }
  const std::vector<double> left = leftovers(entries, sets, fit, records, noise_shares);
  for (std::size_t k = 0; k < pairs.size(); ++k) pairs[k].leftover = left[k];
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const PairLeftover& a, const PairLeftover& b) { return a.leftover < b.leftover; });
  return pairs;
}

bool explains_all(double leftover, double misfit) {
  return leftover - 1 < std::max(kFloorError, kLinearised * (misfit - 1));
}

Located locate_needed(const PlantFit& fit, const std::vector<FitRecord>& records, const Matrix& noise_shares) {
  Located located;
  located.places = locate(fit, records, noise_shares);
  if (located.places.empty()) return located;
  const PlaceLeftover& best = located.places.front();
  if (explains_all(best.leftover, fit.misfit)) {
    located.needed = 1;
    return located;
  }
  located.pairs = locate_two(fit, records, located.places, noise_shares);
  if (located.pairs.empty()) return located;
  const PairLeftover& pair = located.pairs.front();
  if (!explains_all(pair.leftover, fit.misfit) || pair.leftover - 1 > kHalved * (best.leftover - 1)) return located;
  // Of a force that jumps within a sample the accelerometers upon it show what no force held over samples does.
  const auto of_best = [&](const Place& location) {
    return location == best.location || feels(fit.plant, location, best.location);
  };
  located.needed = of_best(pair.locations[0]) && of_best(pair.locations[1]) ? 1 : 2;
  return located;
}

UnknownSignal unknown_signal(const PlantFit& fit, const std::vector<FitRecord>& records, std::size_t i,
                             const Place& location) {
  UnknownSignal result;
  result.location = location;
  const FitRecord& record = records[i];
  const double sample_time_s = static_cast<double>(record.ratio) / fit.plant.hold_hz();
  const Index N = record.y.cols(), kept = N - record.skip;
  result.value = Vector::Zero(N);
  const auto scored_rms = [&] { return result.value.tail(kept).norm() / std::sqrt(static_cast<double>(kept)); };
  for (Index j = 0; j < fit.plant.sensor_count(); ++j) {
    const Sensor& sensor = fit.plant.sensors[static_cast<std::size_t>(j)];
    if (location != sensor_place(sensor.name)) continue;
    result.status = Status::ok;
    result.unit = sensor.unit;
    result.value.tail(kept) = -fit.error[i].row(j).tail(kept).transpose();
    result.rms = scored_rms();
    result.noise_rms = record.weight_std(j);
    result.band_hz = 0.5 / sample_time_s;
    return result;
  }
  ForcePlace place;
  const LinearPlant linear =
      force_place_of(fit.plant, location, place) ? linearise_with_force(fit, place) : LinearPlant{};
  if (linear.A.size() == 0) {
    result.message = "no force stands for the place \"" + to_string(location) + "\"";
    return result;
  }
  Matrix z = Matrix::Zero(record.y.rows(), 2 * N);
  z.leftCols(kept) = residual_of(fit, records, i).rightCols(kept);
  // What the plant still swings with from before the record, and goes on with behind it, is no force at its ends.
  z.leftCols(kept) *= fade_window(kept).asDiagonal();
  result.unit = force_unit(fit.plant, location);
  result.band_hz = std::min(excited_band_hz(fit.plant, record), 0.4 / sample_time_s);
  const double line_hz = 1 / (2 * static_cast<double>(N) * sample_time_s);
  const Index used = std::min<Index>(N, static_cast<Index>(result.band_hz / line_hz)) + 1;
  double noise_power = 0;
  ComplexMatrix weight(record.y.rows(), used);
  for (Index k = 0; k < used; ++k)
    weight.col(k) = shown(record, record.weight_std.cwiseInverse(), line_hz * static_cast<double>(k) * sample_time_s);
  const ComplexMatrix f = divide_out(linear, weight, fft(z), used, line_hz, static_cast<double>(kept), noise_power);
  if (!(f.squaredNorm() > 0)) {
    result.status = Status::rank_deficient;
    result.message = "no channel tells a force at \"" + to_string(location) + "\" from noise";
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
