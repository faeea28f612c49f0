#include "bench/data.hpp"

#include <map>
#include <tuple>

#include "core/base/random.hpp"
#include "core/plant/road.hpp"

namespace wheelhop::bench {
namespace {

constexpr double kHz = 200;

/// Body 300 kg and wheel 40 kg, 18 kN/m and 850 Ns/m between them, a tyre of 200 kN/m under the wheel.
LinearModel quarter_car() {
  const double body = 300, wheel = 40, k = 18000, d = 850, tyre = 200000;
  Matrix A(4, 4), B(4, 1), C(3, 4), D(3, 1);     // states: body, its velocity, wheel, its velocity
  A << 0, 1, 0, 0,                               //
      -k / body, -d / body, k / body, d / body,  //
      0, 0, 0, 1,                                //
      k / wheel, d / wheel, -(k + tyre) / wheel, -d / wheel;
  B << 0, 0, 0, tyre / wheel;
  C << -1, 0, 1, 0, A.row(1), A.row(3);
  D << 0, 0, tyre / wheel;
  Matrix both = Matrix::Zero(5, 5);
  both.topRows(4) << A, B;
  const Matrix held = matrix_exponential(both / kHz);
  return {held.topLeftCorner(4, 4), held.topRightCorner(4, 1), C, D, Vector::Zero(3)};
}

Matrix road(Excitation drive, Index samples, Random& random) {
  if (drive == Excitation::white) return random.normal(1, samples);
  const DriveOptions options = BandLimitedNoise{.cutoff_hz = 10, .order = 8};
  return make_drive(options, kHz, 0, samples, random).values.transpose();
}

}  // namespace

const CarRecord& car_record(Excitation drive, Index samples, double noise, std::uint64_t draw) {
  static std::map<std::tuple<Excitation, Index, double, std::uint64_t>, CarRecord> records;
  const auto [at, is_new] = records.try_emplace({drive, samples, noise, draw});
  CarRecord& record = at->second;
  if (!is_new) return record;
  Random random(11, Stream::road, static_cast<std::uint64_t>(samples), static_cast<std::uint64_t>(drive) + 2 * draw);
  record.model = quarter_car();
  record.u = road(drive, samples, random);
  record.u /= record.u.norm() / std::sqrt(static_cast<double>(samples));
  record.y = simulate(record.model, record.u, Vector::Zero(4)).y;
  for (Index i = 0; i < 3; ++i) record.y.row(i) /= record.y.row(i).norm() / std::sqrt(static_cast<double>(samples));
  record.y += noise * random.normal(3, samples);
  return record;
}

double pole_error(const Matrix& A, const Matrix& truth) {
  const ComplexVector found = eigenvalues(A), wanted = eigenvalues(truth);
  double worst = 0;
  for (const std::complex<double>& pole : found) worst = std::max(worst, (wanted.array() - pole).abs().minCoeff());
  return worst;
}

}  // namespace wheelhop::bench
