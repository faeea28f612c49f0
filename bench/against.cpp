// The kernels and the whole chain beside SLICOT and LAPACK in one process, one thread.
#include <fmt/format.h>

#include <Eigen/Cholesky>

#include "bench/against.hpp"
#include "bench/data.hpp"
#include "bench/peers.hpp"
#include "bench/report.hpp"
#include "core/base/random.hpp"
#include "core/kernels/dare.hpp"
#include "core/kernels/hankel.hpp"
#include "variants/subspace/po_moesp.hpp"

namespace wheelhop::bench {
namespace {

std::string size_text(Index n) {
  if (n % 1000000 == 0) return fmt::format("{}M", n / 1000000);
  return n % 1000 == 0 ? fmt::format("{}k", n / 1000) : fmt::format("{}", n);
}

std::string case_of(Index samples, Index s) { return fmt::format("N={} s={}", size_text(samples), s); }

std::vector<HankelBlock> blocks_of(const CarRecord& record, Index s) {
  return {{record.u, s, s}, {record.u, 0, s}, {record.y, 0, s}, {record.y, s, s}};
}

peers::Record as_peer(const CarRecord& record) { return {record.u.transpose(), record.y.transpose()}; }

/// Columns of the stack in SLICOT's order [U_past; U_future; Y_past; Y_future], one a column of the matrix.
Matrix explicit_rows(const CarRecord& record, Index s) {
  const Index columns = record.u.cols() - 2 * s + 1;
  Matrix rows(8 * s, columns);
  for (Index k = 0; k < columns; ++k) {
    rows.col(k).head(2 * s) = record.u.middleCols(k, 2 * s).reshaped();
    rows.col(k).tail(6 * s) = record.y.middleCols(k, 2 * s).reshaped();
  }
  return rows;
}

/// Largest relative error of a diagonal entry, of what a row adds to those above.
double row_error(const Matrix& factor, const Matrix& reference) {
  return (factor.diagonal().cwiseAbs().array() / reference.diagonal().cwiseAbs().array() - 1).abs().maxCoeff();
}

void add_factors(Excitation excitation, Index samples, Index s, double noise) {
  const std::string what = excitation == Excitation::white ? "R factor, white drive" : "R factor, band-limited drive";
  const std::string of = case_of(samples, s);
  add_work(what, kOurs, of, [=](benchmark::State& state) {
    const CarRecord& record = car_record(excitation, samples, noise);
    const std::vector<HankelBlock> blocks = blocks_of(record, s);
    HankelFactor factor;
    for (auto _ : state) factor = hankel_factor(blocks);
    const Matrix R = hankel_factor_by(FactorMethod::extended_gram, blocks)->R;
    state.counters["method"] = static_cast<double>(factor.method);
    state.counters["product_error"] =
        (factor.R * factor.R.transpose() - R * R.transpose()).norm() / (R * R.transpose()).norm();
    state.counters["row_error"] = row_error(factor.R, R);
    // Multiply-adds of the first rows and columns of lags, two operations each.
    state.counters["gflops"] = benchmark::Counter(2.0 * 16 * 2 * static_cast<double>(s) * static_cast<double>(samples) *
                                                      1e-9 * static_cast<double>(state.iterations()),
                                                  benchmark::Counter::kIsRate);
  });
  for (const auto& [variant, feeding] : {std::pair{"SLICOT IB01MD 'C'", peers::Feeding::whole},
                                         std::pair{"SLICOT batches of 20k", peers::Feeding::batches}}) {
    if (feeding == peers::Feeding::batches && samples <= peers::kBatch) continue;
    add_work(what, variant, of, [=, feeding = feeding](benchmark::State& state) {
      const CarRecord& own = car_record(excitation, samples, noise);
      const peers::Record record = as_peer(own);
      Matrix factor;
      int warning = 0;
      for (auto _ : state)
        if (peers::slicot_factor(record, static_cast<int>(s), 'C', feeding, factor, warning) != 0)
          state.SkipWithError("IB01MD failed");
      state.counters["went_over_to_qr"] = warning;
      if (samples <= 20000 && excitation == Excitation::white) {  // else the last rows are round-off in both
        Matrix rows = explicit_rows(own, s).transpose();
        peers::lapack_qr(rows);
        state.counters["row_error"] = row_error(factor, rows.topRows(8 * s));
      }
    });
  }
  if (excitation == Excitation::white && samples <= 200000 && s == 20) {
    add_work(what, "LAPACK dgeqrf", of, [=](benchmark::State& state) {
      const Matrix rows = explicit_rows(car_record(excitation, samples, noise), s).transpose();
      for (auto _ : state) {
        Matrix copy = rows;
        peers::lapack_qr(copy);
      }
    });
    add_work(what, "LAPACK dsyrk + dpotrf", of, [=](benchmark::State& state) {
      const Matrix rows = explicit_rows(car_record(excitation, samples, noise), s);
      Matrix factor;
      for (auto _ : state) peers::lapack_gram(rows, factor);
    });
  }
}

/// Root mean square of the pole errors on several records. One record cannot tell two methods apart: the ratio of their
/// errors scatters by some per cent from record to record. Twenty records bring that below one per cent where it is
/// largest; of long ones, which scatter less and cost more, there are four.
/// @param dynamics A of a model that is identified from a record
template <class Dynamics>
double pole_error_rms(Index samples, double noise, const Dynamics& dynamics) {
  const int draws = samples <= 20000 ? 20 : 4;
  double sum = 0;
  for (int draw = 0; draw < draws; ++draw) {
    const CarRecord& record = car_record(Excitation::white, samples, noise, static_cast<std::uint64_t>(draw));
    const double error = pole_error(dynamics(record), record.model.A);
    sum += error * error;
  }
  return std::sqrt(sum / draws);
}

void add_chain(Index samples, Index s) {
  const std::string what = "linear identification (po_moesp)", of = case_of(samples, s);
  constexpr double kNoise = 0.02;
  add_work(what, kOurs, of, [=](benchmark::State& state) {
    const CarRecord& record = car_record(Excitation::white, samples, kNoise);
    PoMoespOptions options;
    options.block_rows = s;
    const auto method = make_po_moesp(options);
    LinearEstimate estimate;
    for (auto _ : state) estimate = method->identify(record.u, record.y, 4);
    if (estimate.status != Status::ok) state.SkipWithError(estimate.message.c_str());
    state.counters["pole_error"] = pole_error_rms(samples, kNoise, [&](const CarRecord& other) {
      const LinearEstimate own = method->identify(other.u, other.y, 4);
      if (own.status != Status::ok) state.SkipWithError(own.message.c_str());
      return Matrix(own.model.A);
    });
  });
  for (const auto& [variant, feeding] : {std::pair{"SLICOT IB01AD+BD+CD", peers::Feeding::whole},
                                         std::pair{"SLICOT batches of 20k", peers::Feeding::batches}}) {
    if (feeding == peers::Feeding::batches && samples <= peers::kBatch) continue;
    add_work(what, variant, of, [=, feeding = feeding](benchmark::State& state) {
      const peers::Record record = as_peer(car_record(Excitation::white, samples, kNoise));
      peers::Identified model;
      for (auto _ : state)
        if (peers::slicot_identify(record, static_cast<int>(s), 4, feeding, model) != 0)
          state.SkipWithError("SLICOT failed");
      state.counters["pole_error"] = pole_error_rms(samples, kNoise, [&](const CarRecord& other) {
        if (peers::slicot_identify(as_peer(other), static_cast<int>(s), 4, feeding, model) != 0)
          state.SkipWithError("SLICOT failed");
        return model.A;
      });
    });
  }
}

struct Riccati {
  Matrix A, C, Q, R;
};

Riccati riccati(Index n) {
  Random random(12, Stream::noise, static_cast<std::uint64_t>(n));
  const Index p = std::max<Index>(1, std::min<Index>(3, n / 2));
  Matrix A = random.normal(n, n);
  A *= 0.95 / spectral_radius(A);
  const Matrix root = random.normal(n, n);
  return {A, random.normal(p, n), root * root.transpose(), Matrix::Identity(p, p)};
}

/// Three unknown inputs put an eigenvalue of the closed loop on the unit circle: one of the random walks is not seen.
Riccati on_the_circle() {
  Riccati problem = riccati(8);
  problem.A.bottomRows(3).setZero();
  problem.A.bottomRightCorner(3, 3).setIdentity();
  problem.A.topRightCorner(5, 1).setZero();
  problem.C.rightCols(3).setZero();
  problem.Q = Matrix::Zero(8, 8);
  problem.Q.diagonal().tail(2).setOnes();
  problem.A.col(5).head(5).setZero();
  return problem;
}

/// Relative residual in long double.
double residual(const Riccati& problem, const Matrix& P) {
  using Long = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  const Long A = problem.A.cast<long double>(), C = problem.C.cast<long double>(), Q = problem.Q.cast<long double>(),
             R = problem.R.cast<long double>(), X = P.cast<long double>();
  const Long S = C * X * C.transpose() + R, K = A * X * C.transpose();
  const Long right = A * X * A.transpose() - K * S.ldlt().solve(K.transpose()) + Q;
  return static_cast<double>((right - X).norm() / X.norm());
}

void add_riccati(const std::string& of, const Riccati& problem) {
  add_work("Riccati equation", kOurs, of, [=](benchmark::State& state) {
    DareSolution solution;
    for (auto _ : state) solution = solve_dare(problem.A, problem.C, problem.Q, problem.R);
    state.counters["doublings"] = solution.doublings;
    state.counters["radius_bound"] = solution.radius_bound;
    if (solution.P.size() > 0) state.counters["residual"] = residual(problem, solution.P);
  });
  add_work("Riccati equation", "SLICOT SB02OD", of, [=](benchmark::State& state) {
    Matrix P;
    int info = 0;
    for (auto _ : state) info = peers::slicot_dare(problem.A, problem.C, problem.Q, problem.R, P);
    state.counters["info"] = info;
    if (info == 0) state.counters["residual"] = residual(problem, P);
  });
}

}  // namespace

void add_peers() {
  for (const Index samples : {2000, 20000, 200000, 2000000})
    for (const Index s : {20, 40}) {
      add_factors(Excitation::white, samples, s, 0.02);
      if (samples <= 200000) add_factors(Excitation::band_limited, samples, s, 0.02);
    }
  for (const Index samples : {2000, 20000, 200000}) add_chain(samples, 20);
  for (const Index n : {5, 7, 10, 20, 50, 100, 200}) add_riccati(fmt::format("n={:03}", n), riccati(n));
  add_riccati("on the circle", on_the_circle());
}

}  // namespace wheelhop::bench
