#include "variants/inversion/sdi.hpp"

#include <fmt/format.h>

#include <Eigen/LU>

#include <cmath>
#include <vector>

#include "core/kernels/kalman.hpp"

namespace wheelhop {
namespace {

constexpr Index kProbeSamples = 4000;

class Sdi final : public InputReconstructor {
 public:
  explicit Sdi(const SdiOptions& options) : options_(options) {}
  std::string name() const override { return "sdi"; }

  Reconstruction reconstruct(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef Bt, ConstMatrixRef Dt, ConstMatrixRef z,
                             ConstVectorRef noise_std) const override {
    const Index n = A.rows(), q = Bt.cols(), p = C.rows();
    Matrix Aa = Matrix::Zero(n + q, n + q), Ca(p, n + q);  // eq. (19), eq. (20) with the direct term
    Aa.topLeftCorner(n, n) = A;
    Aa.topRightCorner(n, q) = Bt;
    Aa.bottomRightCorner(q, q).diagonal().setConstant(options_.input_pole);
    Ca << C, Dt;
    const Vector variances = noise_std.array().square();
    const double scale = variances.mean();
    const Matrix R = Matrix(variances.asDiagonal()) / scale;
    const Vector x0 = Vector::Zero(n + q);
    // Q_eta over a decade is all the read-outs notice, so a part of the record is enough to choose it.
    const Index probe = std::min<Index>(z.cols(), kProbeSamples);
    const double samples = static_cast<double>(probe * p);

    Reconstruction best;
    best.message = "the input noise variance has no admissible value";
    double best_criterion = -std::numeric_limits<double>::infinity();
    KalmanFilter filter;
    for (const double ratio : candidates()) {
      Matrix Q = Matrix::Zero(n + q, n + q);
      Q.bottomRightCorner(q, q).diagonal().setConstant(ratio);
      KalmanFilter candidate = design_kalman_filter(Aa, Ca, Q, R);
      if (candidate.status != Status::ok) {
        best.status = candidate.status;
        best.message = fmt::format("Riccati equation at Q_eta/R_v = {:g}: {}", ratio, candidate.message);
        continue;
      }
      const FilterRun trial = run_filter(candidate, z.leftCols(probe), x0);
      // The common scale of Q and R drops out: only their ratio matters for f, so it is concentrated out.
      const double log_det = -std::log(candidate.S_inverse.determinant()) * static_cast<double>(probe);
      const double criterion = -0.5 * (samples * std::log(std::max(trial.quadratic / samples, 1e-300)) + log_det);
      if (!(criterion > best_criterion)) continue;
      best_criterion = criterion;
      best.input_variance = ratio;
      filter = std::move(candidate);
    }
    if (!std::isfinite(best_criterion)) return best;
    FilterRun run = run_filter(filter, z, x0);
    best.log_likelihood = best_criterion;
    best.spectral_radius = filter.spectral_radius;
    best.first = 0;
    best.last = z.cols();
    if (options_.read_out == "predictor")
      best.f = run.x.bottomRows(q);
    else if (options_.read_out == "smoothed")
      best.f = smoothed_states(filter, std::move(run)).bottomRows(q);
    else
      best.f =
          fixed_lag_states(filter, std::move(run), options_.read_out == "filtered" ? 0 : options_.lag).bottomRows(q);
    best.status = all_finite(best.f) ? Status::ok : Status::not_finite;
    best.message = best.status == Status::ok ? "" : "the residual is not finite";
    return best;
  }

 private:
  std::vector<double> candidates() const {
    if (options_.input_variance > 0) return {options_.input_variance};
    std::vector<double> grid;
    for (int exponent = -4; exponent <= 6; ++exponent) grid.push_back(std::pow(10.0, exponent));
    return grid;
  }

  SdiOptions options_;
};

}  // namespace

std::unique_ptr<InputReconstructor> make_sdi(const SdiOptions& options) { return std::make_unique<Sdi>(options); }

}  // namespace wheelhop
