#include "core/identify/uncertainty.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/identify/judgements.hpp"
#include "core/model/sensitivities.hpp"

namespace wheelhop {
namespace {

/// Directions of the scaled H below this share of the largest are not determined; the coordinates of the states never
/// are.
constexpr double kUndetermined = 1e-11;
/// Parameters of the model and the initial state of the first record as packed, then the other initial states.
struct Places {
  ParameterLayout at;
  std::size_t record;

  Index operator()(Index j) const {
    if (record == 0 || j < at.x0() || j >= at.x0() + at.n) return j;
    return at.size() + (static_cast<Index>(record) - 1) * at.n + j - at.x0();
  }
};

/// What the sensitivities over all records add up to.
struct Sums {
  std::vector<Matrix> G;  // J_i' J_i by output
  Matrix H;               // their sum, and the prior of the map
  Matrix scores;          // J_b' r_b, a column each block
  Index samples = 0;      // times outputs
  Index blocks = 0;       // that hold samples
};

/// Residual variances by output; empty where a free run leaves the state guard.
Vector residual_variances(const NonlinearModel& model, const std::vector<StartedRecord>& records) {
  const StateStatistics statistics = state_statistics(model, records);
  if (!statistics.known()) return {};
  return statistics.residual_std.cwiseAbs2().cwiseMax(1e-24);  // round-off
}

bool add_up(const NonlinearModel& model, const std::vector<StartedRecord>& records, double variance, Sums& sums) {
  const ParameterLayout at = layout_of(model);
  const SensitivityRow row(at);
  const Index P = at.size() + (static_cast<Index>(records.size()) - 1) * at.n, D = at.dynamic();
  Index counted = 0, seen = 0;
  for (const StartedRecord& record : records) counted += record.u.cols() - record.skip;
  const Index length =
      std::max(kJudged.shortest_block, (counted + kJudged.scatter_blocks - 1) / kJudged.scatter_blocks);
  sums.blocks = (counted + length - 1) / length;
  sums.samples = counted * at.p;
  sums.G.assign(static_cast<std::size_t>(at.p), Matrix::Zero(P, P));
  sums.scores = Matrix::Zero(P, sums.blocks);
  for (std::size_t i = 0; i < records.size(); ++i) {
    const StartedRecord& record = records[i];
    const Places place{at, i};
    std::vector<Matrix> products(static_cast<std::size_t>(at.p), Matrix::Zero(row.size, row.size));
    const auto receive = [&](Index first, Index count, const std::vector<Matrix>& rows) {
      for (Index from = std::max(first, record.skip); from < first + count;) {
        const Index number = seen + from - record.skip, block = number / length;
        const Index to = std::min(first + count, from + (block + 1) * length - number);
        for (Index output = 0; output < at.p; ++output) {
          const auto own = rows[static_cast<std::size_t>(output)].middleCols(from - first, to - from);
          products[static_cast<std::size_t>(output)].selfadjointView<Eigen::Lower>().rankUpdate(own);
          const Vector score = own * (own.row(row.output) - record.y.row(output).segment(from, to - from)).transpose();
          for (Index j = 0; j < D; ++j) sums.scores(place(j), block) += score(j);
          for (Index j = 0; j < at.regressors(); ++j)
            sums.scores(at.direct(output, j), block) += score(row.regressors + j);
        }
        from = to;
      }
    };
    if (!free_run_sensitivities(model, record.u, record.x0, receive)) return false;
    seen += record.u.cols() - record.skip;
    for (Index output = 0; output < at.p; ++output) {
      const Matrix full = products[static_cast<std::size_t>(output)].selfadjointView<Eigen::Lower>();
      Matrix& G = sums.G[static_cast<std::size_t>(output)];
      std::vector<Index> from, to;
      for (Index j = 0; j < D; ++j) from.push_back(j), to.push_back(place(j));
      for (Index j = 0; j < at.regressors(); ++j)
        from.push_back(row.regressors + j), to.push_back(at.direct(output, j));
      G(to, to) += full(from, from);
    }
  }
  sums.H = Matrix::Zero(P, P);
  for (const Matrix& G : sums.G) sums.H += G;
  if (model.map) sums.H.diagonal().segment(at.theta(), at.map) += variance * model.map->precision();
  return true;
}

/// H^+ with the columns at unit length, and what it leaves out.
struct PseudoInverse {
  Matrix inverse;
  Matrix undetermined;  // P x k, orthonormal in the scaled parameters
  Vector scale;         // P, parameters over scaled ones
};

PseudoInverse pseudo_inverse(const Matrix& H) {
  PseudoInverse result;
  result.scale = H.diagonal().unaryExpr([](double d) { return d > 0 ? 1 / std::sqrt(d) : 1.0; });
  const SymmetricEigen eigen = symmetric_eigen(result.scale.asDiagonal() * H * result.scale.asDiagonal());
  const Index dropped = (eigen.values.array() <= kUndetermined * eigen.values.maxCoeff()).count();
  const Index kept = eigen.values.size() - dropped;  // the values ascend
  const Matrix V = result.scale.asDiagonal() * eigen.vectors.rightCols(kept);
  result.inverse = V * eigen.values.tail(kept).cwiseInverse().asDiagonal() * V.transpose();
  result.undetermined = eigen.vectors.leftCols(dropped);
  return result;
}

Eigen::MatrixXcd response(const LinearModel& model, double frequency) {
  const std::complex<double> z = std::polar(1.0, frequency);
  const Eigen::MatrixXcd M =
      z * Eigen::MatrixXcd::Identity(model.order(), model.order()) - model.A.cast<std::complex<double>>();
  return model.C.cast<std::complex<double>>() * M.partialPivLu().solve(model.B.cast<std::complex<double>>()) +
         model.D.cast<std::complex<double>>();
}

/// Poles and responses as one column of complex numbers.
class Characteristics {
 public:
  Characteristics(const NonlinearModel& model, const std::vector<double>& frequencies, const std::vector<Index>& delay)
      : frequencies_(frequencies), delay_(delay), poles_(eigenvalues(linearised_at_rest(model).A)) {}

  Index poles() const { return static_cast<Index>(poles_.size()); }

  /// The poles in the order of those of the model at the start.
  Eigen::VectorXcd of(const NonlinearModel& model) const {
    const LinearModel at_rest = linearised_at_rest(model);
    std::vector<std::complex<double>> left;
    for (const auto& pole : eigenvalues(at_rest.A)) left.push_back(pole);
    std::vector<std::complex<double>> values;
    for (const std::complex<double>& pole : poles_) {
      const auto nearest = std::min_element(left.begin(), left.end(), [&](const auto& a, const auto& b) {
        return std::abs(a - pole) < std::abs(b - pole);
      });
      values.push_back(*nearest);
      left.erase(nearest);
    }
    for (const double frequency : frequencies_) {
      Eigen::MatrixXcd at = response(at_rest, frequency);
      for (std::size_t i = 0; i < delay_.size(); ++i)
        at.col(static_cast<Index>(i)) *= std::polar(1.0, -frequency * static_cast<double>(delay_[i]));
      values.insert(values.end(), at.data(), at.data() + at.size());
    }
    return Eigen::Map<const Eigen::VectorXcd>(values.data(), static_cast<Index>(values.size()));
  }

 private:
  const std::vector<double>& frequencies_;
  const std::vector<Index>& delay_;
  ComplexVector poles_;
};

/// Standard deviation of a real function whose slope on theta is a row.
class Spread {
 public:
  Spread(const Sums& sums, const Vector& variance) {
    pseudo_ = pseudo_inverse(sums.H);
    const Matrix& inverse = pseudo_.inverse;
    moved_ = inverse * sums.scores;
    Matrix noise = Matrix::Zero(inverse.rows(), inverse.cols());
    for (std::size_t i = 0; i < sums.G.size(); ++i) noise += variance(static_cast<Index>(i)) * sums.G[i];
    white_ = inverse * noise * inverse;
    const auto N = static_cast<double>(sums.samples), P = static_cast<double>(sums.H.rows());
    freedom_ = N / (N - P);
  }

  /// Infinity where the records do not determine the function.
  double operator()(const Eigen::RowVectorXd& slope) const {
    const Eigen::RowVectorXd scaled = slope * pseudo_.scale.asDiagonal();
    if ((scaled * pseudo_.undetermined).norm() > kJudged.moves_along * scaled.norm())
      return std::numeric_limits<double>::infinity();
    const double white = slope.dot(slope * white_), coloured = (slope * moved_).squaredNorm();
    return std::sqrt(freedom_ * std::max({white, coloured, 0.0}));
  }

  /// Root of the sum of the variances of functions whose slopes J are given by G = J' J.
  double of_sum(const Matrix& G) const {
    const double white = G.cwiseProduct(white_).sum(), coloured = (G * moved_).cwiseProduct(moved_).sum();
    return std::sqrt(freedom_ * std::max({white, coloured, 0.0}));
  }

 private:
  PseudoInverse pseudo_;
  Matrix white_, moved_;
  double freedom_ = 1;
};

}  // namespace

std::vector<double> response_frequencies(Index samples) {
  constexpr int count = 40;
  constexpr double pi = 3.14159265358979323846, highest = 0.9 * pi;
  const double lowest = std::min(2 * pi * 5 / static_cast<double>(samples), 0.5 * highest);
  std::vector<double> frequencies;
  for (int i = 0; i < count; ++i) frequencies.push_back(lowest * std::pow(highest / lowest, i / (count - 1.0)));
  return frequencies;
}

LinearModel linearised_at_rest(const NonlinearModel& model) {
  LinearModel at_rest = model.linear;
  if (!model.map) return at_rest;
  const StaticMap& map = *model.map;
  const Index d = map.inputs(), n = model.order();
  const Vector xi = Vector::Zero(d);
  Vector phi(map.features()), w(map.features()), by_xi(d), by_alpha(map.inner_parameters());
  map.basis(xi.data(), phi.data());
  Matrix slope = map.L;
  for (Index i = 0; i < map.outputs(); ++i) {
    w = map.W.row(i);
    map.slopes(xi.data(), phi.data(), w.data(), by_xi.data(), by_alpha.data());
    slope.row(i) += by_xi.transpose();
  }
  at_rest.A += model.Bt * slope.leftCols(n);
  at_rest.B += model.Bt * slope.rightCols(d - n);
  at_rest.C += model.Dt * slope.leftCols(n);
  at_rest.D += model.Dt * slope.rightCols(d - n);
  return at_rest;
}

ModelUncertainty model_uncertainty(const NonlinearModel& model, const std::vector<StartedRecord>& records,
                                   const std::vector<double>& frequencies, const std::vector<Index>& delay) {
  ModelUncertainty result;
  const Vector variance = residual_variances(model, records);
  Sums sums;
  if (variance.size() == 0 || !add_up(model, records, variance.mean(), sums)) return result;
  if (sums.samples <= sums.H.rows() || !all_finite(sums.H)) return result;
  const Spread spread(sums, variance);
  const Characteristics characteristics(model, frequencies, delay);
  const Eigen::VectorXcd values = characteristics.of(model);

  const ParameterLayout at = layout_of(model);
  const Vector theta = pack(model, records.front().x0);
  Eigen::MatrixXcd slopes = Eigen::MatrixXcd::Zero(values.size(), sums.H.rows());
  NonlinearModel moved = model;
  Vector x0;
  for (Index j = 0; j < at.size(); ++j) {
    if (j >= at.x0() && j < at.x0() + at.n) continue;
    const double step = 1e-6 * std::max(1.0, std::abs(theta(j)));
    const auto at_step = [&](double by) {
      Vector there = theta;
      there(j) += by;
      unpack(there, moved, x0);
      return characteristics.of(moved);
    };
    slopes.col(j) = (at_step(step) - at_step(-step)) / (2 * step);
  }

  const auto real_std = [&](Index i) { return spread(slopes.row(i).real()); };
  const auto along = [&](Index i, std::complex<double> direction) {  // of Re(conj(direction) value)
    return spread(Eigen::RowVectorXd((std::conj(direction) * slopes.row(i)).real()));
  };
  for (Index i = 0; i < characteristics.poles(); ++i) {
    UncertainPole pole{values(i), 0, 0, 0, 0};
    const std::complex<double> lambda = std::log(pole.pole);
    pole.frequency = std::abs(lambda);
    if (pole.frequency > 0 && std::isfinite(pole.frequency)) {
      pole.damping = -lambda.real() / pole.frequency;
      // d lambda = dz / z, d|lambda| = Re(conj(lambda) d lambda) / |lambda|; damping = -cos(arg lambda).
      const std::complex<double> unit = lambda / pole.frequency;
      const Eigen::RowVectorXcd by_theta = slopes.row(i) / pole.pole;
      pole.frequency_std = spread(Eigen::RowVectorXd((std::conj(unit) * by_theta).real()));
      pole.damping_std = spread(Eigen::RowVectorXd((std::conj(unit) * by_theta).imag() * unit.imag())) / pole.frequency;
    }
    result.poles.push_back(pole);
  }
  const Index p = at.p, m = at.m;
  for (std::size_t k = 0; k < frequencies.size(); ++k) {
    const Index first = characteristics.poles() + static_cast<Index>(k) * p * m;
    UncertainResponse own{frequencies[k], Eigen::MatrixXcd(p, m), Matrix(p, m), Matrix(p, m), Matrix(p, m)};
    for (Index e = 0; e < p * m; ++e) {
      const std::complex<double> value = values(first + e);
      own.value(e) = value;
      own.real_std(e) = real_std(first + e);
      own.imaginary_std(e) = along(first + e, {0, 1});
      own.magnitude_std(e) = std::abs(value) > 0 ? along(first + e, value / std::abs(value)) : own.real_std(e);
    }
    result.responses.push_back(std::move(own));
  }
  result.output_std.resize(p);
  const double samples = static_cast<double>(sums.samples) / static_cast<double>(p);
  for (Index i = 0; i < p; ++i)
    result.output_std(i) = spread.of_sum(sums.G[static_cast<std::size_t>(i)]) / std::sqrt(samples);
  result.blocks = sums.blocks;
  return result;
}

}  // namespace wheelhop
