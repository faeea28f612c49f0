#include "variants/subspace/pi_moesp.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/identify/input_matrices.hpp"
#include "core/identify/realisation.hpp"
#include "core/kernels/hankel.hpp"

namespace wheelhop {
namespace {

class PiMoesp final : public SubspaceEstimator {
 public:
  explicit PiMoesp(const PiMoespOptions& options) : options_(options) {
    if (options_.past_block_rows == 0) options_.past_block_rows = options_.block_rows;
  }
  std::string name() const override { return "pi_moesp"; }

  LinearEstimate identify(ConstMatrixRef u, ConstMatrixRef y, Index order) const override {
    const Index s = options_.block_rows, past = options_.past_block_rows, m = u.rows(), p = y.rows();
    LinearEstimate estimate;
    estimate.order_given = order;
    if (!all_finite(u) || !all_finite(y)) {
      estimate.status = Status::not_finite;
      estimate.message = "the record holds numbers that are not finite";
      return estimate;
    }
    estimate.status = Status::rank_deficient;
    if (order >= s || order > m * past) {
      estimate.message =
          fmt::format("order {} needs block_rows above it and at least as many past inputs (s = {})", order, s);
      return estimate;
    }
    const Index rows = 1 + m * (s + past) + p * s, needed = rows + s + past - 1;
    if (u.cols() < needed) {
      estimate.message = fmt::format("{} samples are too few for {} block rows: {} are needed", u.cols(), s, needed);
      return estimate;
    }
    const HankelRq rq = hankel_rq(u, y, s, past);  // eq. (11), constant row of Remark 1
    const Svd decomposition = svd(rq.R32());
    estimate.singular_values = decomposition.s;
    const OrderChoice choice = order_from_gap(decomposition.s, std::min(options_.max_order, s - 1));
    estimate.order_used = order > 0 ? order : choice.order;
    const Index n = estimate.order_used;
    if (n == 0 || n >= decomposition.s.size() || !(decomposition.s(n - 1) > 1e-10 * decomposition.s(0))) {
      estimate.message = fmt::format("the record does not carry order {}: the instruments explain {} directions", n,
                                     (decomposition.s.array() > 1e-10 * decomposition.s(0)).count());
      return estimate;
    }
    // Past inputs that the future inputs determine to round-off (a constant, a few sines) instrument nothing: R32 is
    // then what noise and round-off make of it, whatever its singular values look like.
    const double input_size = rq.R.topLeftCorner(1 + m * (s + past), 1 + m * (s + past)).norm();
    const Index exciting = (svd(rq.R22()).s.array() > 1e-12 * input_size).count();
    if (exciting < n) {
      estimate.message =
          fmt::format("the input excites {} directions beyond {} block rows, order {} needs {}", exciting, s, n, n);
      return estimate;
    }
    estimate.gap = decomposition.s(n - 1) / decomposition.s(n);
    const Matrix gamma = decomposition.U.leftCols(n) * decomposition.s.head(n).cwiseSqrt().asDiagonal();
    const ObservabilityPair pair = shift_invariance(gamma, p);
    estimate.stabilised = pair.stabilised;
    const InputMatrices rest = estimate_input_matrices(pair.A, pair.C, u, y, m);
    estimate.model = rest.model;
    estimate.x0 = rest.x0;
    estimate.condition = rest.condition;
    estimate.spectral_radius = spectral_radius(pair.A);
    const bool finite = all_finite(rest.model.A) && all_finite(rest.model.B) && all_finite(rest.model.C) &&
                        all_finite(rest.model.D) && all_finite(rest.x0);
    estimate.status = finite ? Status::ok : Status::not_finite;
    return estimate;
  }

 private:
  PiMoespOptions options_;
};

}  // namespace

std::unique_ptr<SubspaceEstimator> make_pi_moesp(const PiMoespOptions& options) {
  return std::make_unique<PiMoesp>(options);
}

}  // namespace wheelhop
