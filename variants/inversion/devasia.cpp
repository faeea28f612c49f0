#include "variants/inversion/devasia.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <optional>

#include "core/base/random.hpp"
#include "core/model/linear.hpp"

namespace wheelhop {
namespace {

constexpr double kSingular = 1e-9;     // M relative to its factors: a thousand times what their rounding leaves of zero
constexpr int kSignIterations = 100;   // of Newton; a dozen settle zeros 1e-3 from the circle
constexpr double kSignSettled = 1e-9;  // a step so small leaves an error of its square, below rounding
constexpr std::uint64_t kCombinationsCell = 1;  // of Stream::initial_guess, whose cell 0 starts maps

/// A split by moduli: columns of T span the invariant subspaces inside and outside the unit circle.
struct Split {
  Matrix T, inverse;  // n x n
  Index inside = 0;
};

/// Invariant subspaces of M by the matrix sign function of its Cayley transform (Roberts 1980). None if the iteration
/// does not settle, or settles on another number of eigenvalues inside than `inside`.
std::optional<Split> split_by_modulus(const Matrix& M, Index inside) {
  const Index n = M.rows();
  const Matrix I = Matrix::Identity(n, n);
  Matrix S = solve(M + I, M - I);  // eigenvalues with negative real part belong to the inside
  bool settled = n == 0;
  for (int i = 0; i < kSignIterations && !settled; ++i) {
    const Matrix inverse = solve(S, I);
    if (!all_finite(inverse)) return {};
    const Matrix next = 0.5 * (S + inverse);
    settled = (next - S).norm() <= kSignSettled * next.norm();
    S = next;
  }
  if (!settled || !all_finite(S)) return {};
  Split split;
  split.inside = std::llround(0.5 * (static_cast<double>(n) - S.trace()));
  if (split.inside != inside) return {};
  split.T.resize(n, n);
  split.T << svd(0.5 * (I - S)).U.leftCols(split.inside), svd(0.5 * (I + S)).U.leftCols(n - split.inside);
  split.inverse = solve(split.T, I);
  if (!all_finite(split.inverse)) return {};
  return split;
}

/// What the combinations share: whitened outputs, one inverse a W.
struct Inverter {
  const Matrix A, Bt, C, Dt;  // outputs whitened by the noise
  const Matrix z;
  const double forgotten;

  struct Result {
    Status status = Status::rank_deficient;
    std::string message;
    Matrix f;
    Index first = 0, last = 0;
    double radius = 0;  // of the zeros, as they are run
  };

  /// @param samples how many from the start of the record
  Result invert(const Matrix& W, Index samples) const {
    Result result;
    const Index n = A.rows(), q = Bt.cols();
    Matrix row = W * C, M = W * Dt;  // W C A^r, W C A^(r-1) Bt
    double size = W.norm() * Dt.norm();
    Index r = 0;
    for (; singular(M, size) && r < n; ++r) {
      if (M.norm() > kSingular * size) {
        result.message = fmt::format(
            "the squared-down system has no uniform relative degree: some of the {} unknown inputs show after {} "
            "samples, "
            "others later",
            q, r);
        return result;
      }
      M = row * Bt;
      size = row.norm() * Bt.norm();
      row = row * A;
    }
    if (singular(M, size)) {
      result.message = fmt::format("no output combination answers the {} unknown inputs within {} samples", q, n);
      return result;
    }
    if (samples <= r) {
      result.message = fmt::format("{} samples are too few for a relative degree of {}", samples, r);
      return result;
    }
    const Matrix feedback = solve(M, row), zeros = A - Bt * feedback;
    const Matrix v = solve(M, Matrix(W * z.middleCols(r, samples - r)));
    double nearest = std::numeric_limits<double>::infinity(), slowest_in = 0, slowest_out = 0;
    Index inside = 0;
    for (const auto& zero : eigenvalues(zeros)) {
      const double modulus = std::abs(zero);
      nearest = std::min(nearest, std::abs(modulus - 1));
      inside += modulus < 1;
      if (modulus < 1) slowest_in = std::max(slowest_in, modulus);
      if (modulus > 1) slowest_out = std::max(slowest_out, 1 / modulus);
    }
    const auto forgets = [this](double modulus) {
      return modulus <= 0 ? 0.0 : modulus < 1 ? std::log(forgotten) / std::log(modulus) : 1e18;
    };
    const double start = forgets(slowest_in), end = forgets(slowest_out), known = static_cast<double>(samples - r);
    result.radius = std::max(slowest_in, slowest_out);
    if (!(start + end < known) || !(nearest > 0)) {
      result.status = Status::not_stabilisable;
      result.message = fmt::format(
          "a zero of the squared-down system lies {:.2g} from the unit circle: its start is forgotten after {:.0f} "
          "samples, the record has {}",
          nearest, start + end, samples);
      return result;
    }
    const std::optional<Split> split = split_by_modulus(zeros, inside);
    if (!split) {
      result.status = Status::failed;
      result.message = fmt::format(
          "the zeros of the squared-down system cannot be told apart by their modulus; the nearest lies {:.2g} from "
          "the "
          "unit circle",
          nearest);
      return result;
    }
    result.f = run(*split, zeros, feedback, v, samples);
    result.first = static_cast<Index>(start);
    result.last = samples - r - static_cast<Index>(end);
    result.status = all_finite(result.f) ? Status::ok : Status::not_finite;
    result.message = result.status == Status::ok ? "" : "the reconstructed input is not finite";
    return result;
  }

  /// Squared output residual a trustworthy sample and channel, in units of the noise; infinity without an inverse.
  double residual(const Result& result) const {
    if (result.status != Status::ok || result.first >= result.last) return std::numeric_limits<double>::infinity();
    const LinearModel system{A, Bt, C, Dt, Vector::Zero(C.rows())};
    const Matrix rest = z.leftCols(result.f.cols()) - simulate(system, result.f, Vector::Zero(A.rows())).y;
    return rest.middleCols(result.first, result.last - result.first).squaredNorm() /
           static_cast<double>(result.last - result.first);
  }

 private:
  static bool singular(const Matrix& M, double size) {
    const Vector s = svd(M).s;
    return !(s(s.size() - 1) > kSingular * size);
  }

  Matrix run(const Split& split, const Matrix& zeros, const Matrix& feedback, const Matrix& v, Index samples) const {
    const Index n = A.rows(), inside = split.inside, known = v.cols();
    const Matrix dynamics = split.inverse * zeros * split.T, driven = split.inverse * Bt * v;
    Matrix w = Matrix::Zero(n, known);
    const Matrix forward = dynamics.topLeftCorner(inside, inside);
    for (Index k = 0; k + 1 < known; ++k)
      w.col(k + 1).head(inside) = forward * w.col(k).head(inside) + driven.col(k).head(inside);
    const Index outside = n - inside;
    if (outside > 0) {
      const Matrix backward = solve(dynamics.bottomRightCorner(outside, outside), Matrix::Identity(outside, outside));
      Vector last = Vector::Zero(outside);
      for (Index k = known - 1; k >= 0; --k) {
        last = backward * (last - driven.col(k).tail(outside));
        w.col(k).tail(outside) = last;
      }
    }
    Matrix f(Bt.cols(), samples);
    f.leftCols(known) = v - feedback * split.T * w;
    if (known < samples) f.rightCols(samples - known).colwise() = Vector(f.col(known - 1));
    return f;
  }
};

class Devasia final : public InputReconstructor {
 public:
  explicit Devasia(const DevasiaOptions& options) : options_(options) {}
  std::string name() const override { return "devasia"; }

  Reconstruction reconstruct(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef Bt, ConstMatrixRef Dt, ConstMatrixRef z,
                             ConstVectorRef noise_std) const override {
    const Index q = Bt.cols(), p = C.rows();
    Reconstruction result;
    if (!all_finite(z) || !all_finite(noise_std) || !(noise_std.minCoeff() > 0)) {
      result.status = Status::not_finite;
      result.message = "the residual or its noise is not finite";
      return result;
    }
    // Only the ratio of the noise levels may matter: relative to their mean.
    const Vector weight = noise_std.mean() * noise_std.cwiseInverse();
    const Inverter inverter{
        A, Bt, weight.asDiagonal() * C, weight.asDiagonal() * Dt, weight.asDiagonal() * z, options_.forgotten};
    Matrix W;
    if (options_.square_down == "channel") {
      if (options_.channel + q > p) {
        result.status = Status::rank_deficient;
        result.message =
            fmt::format("channel {} and the {} after it are not among {} outputs", options_.channel, q - 1, p);
        return result;
      }
      W = Matrix::Identity(p, p).middleRows(options_.channel, q);
    } else if (options_.square_down == "direct_term") {
      W = Dt.isZero(0) ? Matrix((inverter.C * Bt).transpose()) : Matrix(inverter.Dt.transpose());
    } else {
      W = best_combination(inverter, q, p);
    }
    Inverter::Result found = inverter.invert(W, z.cols());
    result.status = found.status;
    result.message = std::move(found.message);
    result.spectral_radius = found.radius;
    if (result.status != Status::ok) return result;
    result.f = std::move(found.f);
    result.first = found.first;
    result.last = found.last;
    return result;
  }

 private:
  /// The random combination whose f leaves least of the outputs.
  Matrix best_combination(const Inverter& inverter, Index q, Index p) const {
    if (p == q) return Matrix::Identity(p, p);
    Random random(static_cast<std::uint64_t>(options_.seed), Stream::initial_guess, kCombinationsCell);
    Matrix best;
    double least = std::numeric_limits<double>::infinity();
    const Index probe = std::min<Index>(inverter.z.cols(), options_.probe_samples);
    for (Index i = 0; i < options_.combinations; ++i) {
      Matrix W = random.normal(q, p);
      W.rowwise().normalize();
      const double left = inverter.residual(inverter.invert(W, probe));
      if (i > 0 && !(left < least)) continue;
      least = left;
      best = std::move(W);
    }
    return best;
  }

  DevasiaOptions options_;
};

}  // namespace

std::unique_ptr<InputReconstructor> make_devasia(const DevasiaOptions& options) {
  return std::make_unique<Devasia>(options);
}

}  // namespace wheelhop
