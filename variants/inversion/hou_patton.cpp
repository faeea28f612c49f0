#include "variants/inversion/hou_patton.hpp"

#include <fmt/format.h>

#include <Eigen/QR>

#include "core/kernels/kalman.hpp"

namespace wheelhop {
namespace {

/// z_k = C x_k + D f_k + v_k with cov v = I; `late` samples after the z that was measured.
struct Whitened {
  Matrix C, D, z;
  Index late = 0;
};

class HouPatton final : public InputReconstructor {
 public:
  explicit HouPatton(const HouPattonOptions& options) : options_(options) {}
  std::string name() const override { return "hou_patton"; }

  Reconstruction reconstruct(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef Bt, ConstMatrixRef Dt, ConstMatrixRef z,
                             ConstVectorRef noise_std) const override {
    const Index q = Bt.cols(), p = C.rows(), samples = z.cols();
    Reconstruction result;
    if (!all_finite(z) || !all_finite(noise_std) || !(noise_std.minCoeff() > 0)) {
      result.status = Status::not_finite;
      result.message = "the residual or its noise is not finite";
      return result;
    }
    const auto whiten = noise_std.cwiseInverse().asDiagonal();
    Whitened out{whiten * C, whiten * Dt, whiten * z, 0};
    if (Dt.isZero(0)) {  // exactly: no direct term was asked for
      out = {whiten * (C * A), whiten * (C * Bt), whiten * z.rightCols(std::max<Index>(samples - 1, 0)), 1};
    }
    result.status = Status::rank_deficient;
    const Index rank = rank_of(out);
    if (rank < q) {
      result.message = fmt::format("existence condition 1: {} has rank {}, the {} unknown inputs need {}",
                                   out.late == 0 ? "Dt" : "C Bt", rank, q, q);
      return result;
    }
    if (out.z.cols() < 1) {
      result.message = "the residual is too short";
      return result;
    }
    const Eigen::HouseholderQR<Matrix> qr(out.D);
    const Matrix Q = qr.householderQ() * Matrix::Identity(p, p), N = Q.rightCols(p - q).transpose();
    const Matrix R = qr.matrixQR().topRows(q).triangularView<Eigen::Upper>();
    const Matrix G = solve(R, Q.leftCols(q).transpose());  // of the whitened outputs
    const Matrix inner = A - Bt * G * out.C, into = Bt * G;
    Matrix gain = Matrix::Zero(A.rows(), p), update = gain;  // L N, M N
    result.spectral_radius = spectral_radius(inner);
    if (p > q) {
      const KalmanFilter filter =
          design_kalman_filter(inner, N * out.C, into * into.transpose(), Matrix::Identity(p - q, p - q));
      result.spectral_radius = filter.spectral_radius;
      result.status = filter.status;
      result.message = filter.status == Status::not_stabilisable
                           ? "existence condition 2 (a zero on or outside the unit circle): " + filter.message
                           : "Riccati equation: " + filter.message;
      if (filter.status != Status::ok) return result;
      gain = filter.K * N;
      update = filter.P * (N * out.C).transpose() * filter.S_inverse * N;
    } else if (!(result.spectral_radius < 1)) {
      result.status = Status::not_stabilisable;
      result.message =
          fmt::format("existence condition 2: a zero of modulus {:.6g}, and no further output to observe it",
                      result.spectral_radius);
      return result;
    }
    const Matrix GC = G * out.C;
    result.f = run(inner - gain * out.C, into + gain, GC - GC * update * out.C, G - GC * update, out, samples);
    result.delay = out.late;
    result.first = out.late;
    result.last = samples;
    result.status = all_finite(result.f) ? Status::ok : Status::not_finite;
    result.message = result.status == Status::ok ? "" : "the reconstructed input is not finite";
    return result;
  }

 private:
  Index rank_of(const Whitened& out) const {
    const double size = std::hypot(out.C.norm(), out.D.norm());
    return (svd(out.D).s.array() > options_.rank_tolerance * size).count();
  }

  /// x_(k+1) = closed x + into z,  f = by_z z - by_x x.
  static Matrix run(const Matrix& closed, const Matrix& into, const Matrix& by_x, const Matrix& by_z,
                    const Whitened& out, Index samples) {
    Matrix f = Matrix::Zero(by_z.rows(), samples);
    Vector x = Vector::Zero(closed.rows()), next(x.size());
    const Matrix direct = by_z * out.z, driven = into * out.z;
    for (Index k = 0; k < out.z.cols(); ++k) {
      f.col(k + out.late) = direct.col(k) - by_x * x;
      next.noalias() = closed * x;
      x = next + driven.col(k);
    }
    return f;
  }

  HouPattonOptions options_;
};

}  // namespace

std::unique_ptr<InputReconstructor> make_hou_patton(const HouPattonOptions& options) {
  return std::make_unique<HouPatton>(options);
}

}  // namespace wheelhop
