#include "core/gap/study/placebo.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/data/slow_channels.hpp"
#include "core/data/spectra.hpp"
#include "core/gap/evidence/profile.hpp"
#include "core/plant/dataset.hpp"

namespace wheelhop {
namespace {

constexpr Index kBands = 24;

/// White noise shaped to the given shares of power in bands of equal width. @param shares p x bands; empty: white
/// @return p x N, of unit variance on average
Matrix noise_of(const Matrix& shares, Index p, Index samples, Random& random) {
  const Matrix white = random.normal(p, samples);
  if (shares.size() == 0) return white;
  ComplexMatrix spectrum = fft(white);
  const Index lines = spectrum.cols(), bands = shares.cols();
  for (Index k = 0; k < lines; ++k)
    spectrum.col(k).array() *=
        (static_cast<double>(bands) * shares.col(std::min(k * bands / lines, bands - 1))).array().sqrt();
  return inverse_fft(spectrum, samples);
}

std::vector<EffectAt> in_order(std::vector<EffectAt> names) {
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

RecordSet simulated_records(const Plant& plant, const RecordSet& set, const NoiseFloor& floor, Random& random) {
  RecordSet simulated = set;
  Matrix shares;
  if (floor.source == FloorSource::repeats) {
    std::vector<double> edges;
    for (Index b = 0; b <= kBands; ++b)
      edges.push_back(0.5 * set.sampling_hz * static_cast<double>(b) / static_cast<double>(kBands));
    shares = noise_shares(prediction_errors(plant, set), edges);
  }
  for (Record& record : simulated.records) {
    Matrix& y = record.signal.y;
    const Matrix measured = y;
    const GeneratedRecord made = simulate_record(plant, record.signal);
    if (made.status != Status::ok) return {};
    y = made.signal.y;
    const Matrix noise = noise_of(shares, y.rows(), y.cols(), random);
    for (Index i = 0; i < y.rows(); ++i) {
      const double step = lattice_step(measured.row(i));
      const double rounding = step / std::sqrt(12.0);  // which the floor holds already
      y.row(i) += std::sqrt(std::max(floor.std(i) * floor.std(i) - rounding * rounding, 0.0)) * noise.row(i);
      if (step > 0) y.row(i) = measured(i, 0) + step * ((y.row(i).array() - measured(i, 0)) / step).round();
    }
    as_logged(record.signal.slow, y);
  }
  return simulated;
}

Placebo placebo(const Diagnosis& diagnosis, const RecordSet& set, Index runs, std::uint64_t seed,
                const std::function<Diagnosis(const RecordSet&)>& repeat, const ForAll& for_all) {
  Placebo result;
  if (is_place(diagnosis.verdict)) result.why_not = "what is outside the catalogue cannot be simulated";
  if (is<Insufficient>(diagnosis.verdict)) result.why_not = "there is no answer to simulate";
  if (!result.why_not.empty()) return result;
  std::vector<std::optional<std::vector<EffectAt>>> named(static_cast<std::size_t>(runs));
  for_all(runs, [&](Index run) {
    Random random(seed, Stream::noise, static_cast<std::uint64_t>(run));
    const RecordSet simulated = simulated_records(diagnosis.plant, set, diagnosis.floor, random);
    if (!simulated.records.empty()) named[static_cast<std::size_t>(run)] = repeat(simulated).verdict.named;
  });
  for (const auto& again : named) {
    if (!again) {
      result.why_not = "the plant with the answer cannot follow the drives from rest";
      return result;
    }
    ++result.runs;
    if (in_order(*again) == in_order(diagnosis.verdict.named)) ++result.same;
    if (again->empty()) ++result.nothing;
    for (const EffectAt& name : *again) ++result.names[name];
  }
  return result;
}

}  // namespace wheelhop
