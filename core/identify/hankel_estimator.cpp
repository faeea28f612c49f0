#include "core/identify/hankel_estimator.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/identify/input_matrices.hpp"
#include "core/identify/realisation.hpp"

namespace wheelhop {

Index used_directions(ConstVectorRef directions, double tolerance) {
  if (directions.size() == 0 || !(directions(0) > 0)) return 0;
  return (directions.array() >= tolerance * directions(0)).count();
}

HankelEstimator::HankelEstimator(HankelOptions options, bool past_outputs)
    : options_(options), past_outputs_(past_outputs) {
  if (options_.past_block_rows == 0) options_.past_block_rows = options_.block_rows;
}

RecordNeeds HankelEstimator::needs(Index inputs, Index outputs) const {
  const Index s = options_.block_rows, past = options_.past_block_rows;
  const Index rows = 1 + inputs * (s + past) + outputs * (past_outputs_ ? s + past : s);
  return {rows + s + past - 1, s + past, fmt::format("{} + {} block rows", s, past)};
}

LinearEstimate HankelEstimator::identify(ConstMatrixRef u, ConstMatrixRef y, Index order) const {
  const Index s = options_.block_rows, past = options_.past_block_rows, m = u.rows(), p = y.rows();
  LinearEstimate estimate;
  estimate.order_given = order;
  if (!all_finite(u) || !all_finite(y)) {
    estimate.status = Status::not_finite;
    estimate.message = "the record holds numbers that are not finite";
    return estimate;
  }
  estimate.status = Status::rank_deficient;
  if (order >= s) {
    estimate.message = fmt::format("order {} needs more than {} block rows; there are {}", order, order, s);
    return estimate;
  }
  if (order > m * past) {
    estimate.message = fmt::format("order {} needs as many past inputs; {} past block rows of {} inputs are {}", order,
                                   past, m, m * past);
    return estimate;
  }
  if (const RecordNeeds least = needs(m, p); u.cols() < least.samples) {
    estimate.message =
        fmt::format("{} samples are too few for {}: {} are needed", u.cols(), least.because, least.samples);
    return estimate;
  }
  const HankelRq rq = hankel_rq(u, y, s, past, past_outputs_);  // eq. (11), constant row of Remark 1
  estimate.factor = to_string(rq.method);
  estimate.factor_error = rq.error;
  // Past inputs that the future inputs determine to round-off (a constant, a few sines) instrument nothing: R32 is
  // then what noise and round-off make of it, whatever its singular values look like.
  const double input_size = rq.R.topLeftCorner(1 + m * (s + past), 1 + m * (s + past)).norm();
  const Index exciting = (singular_values(rq.R22()).array() > 1e-12 * input_size).count();
  if (exciting == 0) {
    estimate.message = fmt::format("the input excites nothing beyond {} block rows", s);
    return estimate;
  }
  const ColumnSpace space = column_space(rq);
  const Vector values = singular_values(space.weighted);
  estimate.singular_values = values;
  estimate.instruments = space.instruments;
  estimate.instrument_condition = space.instrument_condition;
  const OrderChoice choice = order_from_gap(values, std::min(options_.max_order, s - 1));
  estimate.order_used = order > 0 ? order : choice.order;
  const Index n = estimate.order_used;
  if (n == 0 || n >= values.size() || !(values(n - 1) > 1e-10 * values(0))) {
    estimate.message = fmt::format("the record does not carry order {}: the instruments explain {} directions", n,
                                   (values.array() > 1e-10 * values(0)).count());
    return estimate;
  }
  if (exciting < n) {
    estimate.message =
        fmt::format("the input excites {} directions beyond {} block rows, order {} needs {}", exciting, s, n, n);
    return estimate;
  }
  estimate.gap = values(n - 1) / values(n);
  Matrix gamma = leading_left_vectors(space.weighted, n) * values.head(n).cwiseSqrt().asDiagonal();
  if (space.unweight.size() > 0) gamma = space.unweight * gamma;
  const std::string undetermined = recover(rq, gamma, u, y, estimate);
  estimate.spectral_radius = spectral_radius(estimate.model.A);
  const LinearModel& model = estimate.model;
  const bool finite = all_finite(model.A) && all_finite(model.B) && all_finite(model.C) && all_finite(model.D) &&
                      all_finite(estimate.x0);
  if (!finite) {
    estimate.status = Status::not_finite;
    estimate.message = "the estimated matrices are not finite";
  } else if (undetermined.empty()) {
    estimate.status = Status::ok;
  } else {
    estimate.message = undetermined;
  }
  return estimate;
}

ColumnSpace HankelEstimator::column_space(const HankelRq& rq) const {
  const Vector directions = singular_values(rq.Rww());
  return {rq.R32(), {}, directions.size(), directions(0) / directions(directions.size() - 1)};
}

std::string HankelEstimator::recover(const HankelRq& rq, ConstMatrixRef gamma, ConstMatrixRef u, ConstMatrixRef y,
                                     LinearEstimate& estimate) const {
  const ObservabilityPair pair = shift_invariance(gamma, rq.p);
  estimate.stabilised = pair.stabilised;
  return simulated_outputs(pair.A, pair.C, u, y, estimate);
}

std::string HankelEstimator::simulated_outputs(const Matrix& A, const Matrix& C, ConstMatrixRef u, ConstMatrixRef y,
                                               LinearEstimate& estimate) {
  InputMatrices rest = estimate_input_matrices(A, C, u, y, u.rows());
  estimate.model = std::move(rest.model);
  estimate.x0 = std::move(rest.x0);
  estimate.condition = rest.condition;
  const Index n = A.rows(), p = C.rows(), m = u.rows(), unknowns = n * m + n + p * m + p;
  if (rest.rank == unknowns) return "";
  return fmt::format("the record determines {} of the {} numbers in B, D, x0 and y0: are inputs collinear?", rest.rank,
                     unknowns);
}

}  // namespace wheelhop
