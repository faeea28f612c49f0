#include "core/identify/linear_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/data/metrics.hpp"
#include "core/identify/free_run_problem.hpp"
#include "core/identify/input_matrices.hpp"
#include "core/identify/judgements.hpp"
#include "core/identify/pole_search.hpp"

namespace wheelhop {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Mean over the outputs of the log error: free of scale, and the likelihood of errors of unknown size.
double log_error(ConstVectorRef error) { return error.cwiseMax(1e-300).array().log().mean(); }

struct Fit {
  LinearModel model;
  Vector x0;
  Vector error;  // p, RMS of the free run's error on the samples fitted
  Index stride = 0;
  double score() const { return log_error(error); }
};

bool finite(const LinearModel& model, const Vector& x0) {
  return all_finite(model.A) && all_finite(model.B) && all_finite(model.C) && all_finite(model.D) &&
         all_finite(model.y0) && all_finite(x0);
}

Vector free_run_error(const LinearModel& model, const Vector& x0, ConstMatrixRef u, ConstMatrixRef y, Index from) {
  return rms(y - simulated_outputs(model, u, x0), from);
}

std::optional<Fit> with_inputs(const PoleSet& set, ConstMatrixRef u, ConstMatrixRef y) {
  InputMatrices rest = estimate_input_matrices(set.A, set.C, u, y, u.rows());
  Fit fit{std::move(rest.model), std::move(rest.x0), {}, set.stride};
  if (!finite(fit.model, fit.x0)) return {};
  fit.error = free_run_error(fit.model, fit.x0, u, y, 0);
  if (!all_finite(fit.error)) return {};
  return fit;
}

std::optional<Fit> best_of(const std::vector<PoleSet>& sets, ConstMatrixRef u, ConstMatrixRef y) {
  std::optional<Fit> best;
  for (const PoleSet& set : sets)
    if (std::optional<Fit> fit = with_inputs(set, u, y); fit && (!best || fit->score() < best->score()))
      best = std::move(fit);
  return best;
}

/// States of unit covariance along the record.
void whiten(Fit& fit, ConstMatrixRef u) {
  const Matrix root = symmetric_sqrt(covariance_of(simulate(fit.model, u, fit.x0).x));
  const Matrix T = solve(root, Matrix::Identity(root.rows(), root.cols()));
  if (!all_finite(T)) return;
  fit.model = similarity_transform(fit.model, T);
  fit.x0 = T * fit.x0;
}

/// By simulation error, every output weighted by its own. Stands as it was where that leads nowhere.
void improve(Fit& fit, ConstMatrixRef u, ConstMatrixRef y, const Solver& solver, Index iterations) {
  whiten(fit, u);
  for (Index round = 0; round < 2; ++round) {
    const Vector weight_std = fit.error.cwiseMax(1e-9);
    const Refinement refined =
        refine(without_map(fit.model), fit.x0, u, y, weight_std, 0, solver, (iterations + 1) / 2);
    if (refined.solution.status != Status::ok && refined.solution.status != Status::iteration_limit) return;
    Fit trial{refined.model.linear, refined.x0, {}, fit.stride};
    if (!finite(trial.model, trial.x0) || !(spectral_radius(trial.model.A) < 1)) return;
    trial.error = free_run_error(trial.model, trial.x0, u, y, 0);
    if (!all_finite(trial.error) || !(trial.score() < fit.score())) return;
    fit = std::move(trial);
    whiten(fit, u);
  }
}

LinearEstimate estimate_of(Fit fit, Index order_given) {
  LinearEstimate estimate;
  estimate.status = Status::ok;
  estimate.order_given = order_given;
  estimate.order_used = fit.model.order();
  estimate.spectral_radius = spectral_radius(fit.model.A);
  estimate.model = std::move(fit.model);
  estimate.x0 = std::move(fit.x0);
  estimate.factor = "block averages";
  return estimate;
}

struct OrderSearch {
  std::vector<OrderTrial> trials;
  Index order = 0;
  std::optional<Fit> fit;  // of that order, on the fitted part
  double score = kInfinity;
};

OrderSearch search_orders(ConstMatrixRef u, ConstMatrixRef y, Index order, const LinearSearchOptions& options,
                          const Solver& solver) {
  const Index N = std::min(u.cols(), kJudged.order_samples);
  const auto fitted = static_cast<Index>(kJudged.fitted_share * static_cast<double>(N));
  const auto u_fit = u.leftCols(fitted), y_fit = y.leftCols(fitted);
  PoleSearchOptions poles;
  poles.block_rows = options.block_rows;
  poles.lowest_order = order > 0 ? order : 1;
  poles.highest_order = order > 0 ? order : options.max_order;
  const auto sets = pole_sets(u_fit, y_fit, poles);
  OrderSearch result;
  std::vector<Fit> fits;
  double least = kInfinity;
  Index useful = poles.lowest_order;
  for (std::size_t i = 0; i < sets.size(); ++i) {
    const Index n = poles.lowest_order + static_cast<Index>(i);
    if (n > useful + kJudged.orders_beyond && !fits.empty()) break;
    std::optional<Fit> fit = best_of(sets[i], u_fit, y_fit);
    if (!fit) continue;
    improve(*fit, u_fit, y_fit, solver, options.iterations);
    const Vector held_out = free_run_error(fit->model, fit->x0, u.leftCols(N), y.leftCols(N), fitted);
    if (!all_finite(held_out)) continue;
    const double score = log_error(held_out);
    if (score < least - std::log(kJudged.order_margin) / 2) useful = n;
    least = std::min(least, score);
    result.trials.push_back({fit->stride, held_out, estimate_of(*fit, order)});
    fits.push_back(std::move(*fit));
  }
  if (fits.empty()) return result;
  const auto best = std::min_element(result.trials.begin(), result.trials.end(), [](const auto& a, const auto& b) {
    return log_error(a.held_out_error) < log_error(b.held_out_error);
  });
  std::size_t chosen = 0;
  while (!(result.trials[chosen].held_out_error.array() <= kJudged.order_margin * best->held_out_error.array()).all())
    ++chosen;
  result.order = result.trials[chosen].order();
  result.score = log_error(result.trials[chosen].held_out_error);
  result.fit = std::move(fits[chosen]);
  return result;
}

/// A model without delays is as good where its error is, and its order is no higher: poles at zero stand for delays.
bool prefers_no_delay(const OrderSearch& plain, const OrderSearch& late) {
  if (!late.fit) return true;
  if (!plain.fit) return false;
  const double margin = std::log(kJudged.delay_margin);
  return plain.order <= late.order ? plain.score < late.score + margin : plain.score < late.score - margin;
}

/// The delays in [0, span] of every input that the poles explain best, one input after the other.
struct DelayFit {
  std::vector<Index> delay;
  double score = kInfinity;
};

/// @param from where the search begins; empty: no delays
DelayFit fit_delays(const PoleSet& set, ConstMatrixRef u, ConstMatrixRef y, Index span,
                    const std::vector<Index>& from = {}) {
  const Index m = u.rows(), kept = u.cols() - span;
  DelayFit result{std::vector<Index>(static_cast<std::size_t>(m), 0), kInfinity};
  if (!from.empty()) result.delay = from;
  Matrix acting(m, kept);
  for (Index i = 0; i < m; ++i)
    acting.row(i) = u.row(i).segment(span - result.delay[static_cast<std::size_t>(i)], kept);
  const auto late = y.rightCols(kept);
  for (Index sweep = 0; sweep < std::min<Index>(m, 2); ++sweep)
    for (Index i = 0; i < m; ++i) {
      Vector scores(span + 1);
      for (Index d = 0; d <= span; ++d) {
        acting.row(i) = u.row(i).segment(span - d, kept);
        const std::optional<Fit> fit = with_inputs(set, acting, late);
        scores(d) = fit ? fit->score() : kInfinity;
      }
      Index d = 0;
      result.score = scores.minCoeff();
      while (d < span && !(scores(d) <= result.score + std::log(kJudged.same_delay))) ++d;
      result.delay[static_cast<std::size_t>(i)] = d;
      acting.row(i) = u.row(i).segment(span - d, kept);
    }
  return result;
}

/// The delays once more, near those found, with the poles that were found with them.
std::vector<Index> delays_by_poles(const Fit& found, ConstMatrixRef u, ConstMatrixRef y, std::vector<Index> delay,
                                   Index most) {
  const Index N = std::min(u.cols(), kJudged.delay_samples), room = std::min(most, 2 * kJudged.delay_room);
  std::vector<Index> taken_out, left;
  for (const Index d : delay) {
    taken_out.push_back(std::max<Index>(0, d - kJudged.delay_room));
    left.push_back(d - taken_out.back());
  }
  const Index last = longest(taken_out);
  const DelayFit fit = fit_delays({found.model.A, found.model.C, found.stride}, delayed(u.leftCols(N), taken_out),
                                  y.leftCols(N).rightCols(N - last), room, left);
  for (std::size_t i = 0; i < taken_out.size(); ++i) taken_out[i] += fit.delay[i];
  return taken_out;
}

DelayFit best_delays(ConstMatrixRef u, ConstMatrixRef y, Index order, Index span, const std::vector<Index>& gaps,
                     Index block_rows) {
  DelayFit best;
  for (const Index gap : gaps) {
    PoleSearchOptions poles;
    poles.gap = gap;
    poles.block_rows = block_rows;
    poles.lowest_order = poles.highest_order = order;
    const std::vector<PoleSet> sets = pole_sets(u, y, poles).front();
    for (const PoleSet& set : sets) {
      DelayFit fit = fit_delays(set, u, y, span);
      if (fit.score < best.score) best = std::move(fit);
    }
  }
  return best;
}

std::vector<Index> find_delays(ConstMatrixRef u, ConstMatrixRef y, Index order, const LinearSearchOptions& options) {
  const std::vector<Index> none(static_cast<std::size_t>(u.rows()), 0);
  const Index N = std::min(u.cols(), kJudged.delay_samples), span = std::min(options.max_delay, N / 10);
  if (span == 0) return none;
  const Index n = order > 0 ? order : kJudged.delay_order;
  const auto u_part = u.leftCols(N), y_part = y.leftCols(N);
  DelayFit found = best_delays(u_part, y_part, n, span, {0, span / 4, span}, options.block_rows);
  if (found.delay.empty()) return none;
  // Around them once more, with most of the delay taken out.
  std::vector<Index> taken_out = found.delay;
  for (Index& d : taken_out) d = std::max<Index>(0, d - kJudged.delay_room);
  const Index room = std::min(span, 2 * kJudged.delay_room), last = longest(taken_out);
  const DelayFit near =
      best_delays(delayed(u_part, taken_out), y_part.rightCols(N - last), n, room, {0, room}, options.block_rows);
  if (near.delay.empty()) return found.delay;
  for (std::size_t i = 0; i < taken_out.size(); ++i) taken_out[i] += near.delay[i];
  return taken_out;
}

}  // namespace

Index longest(const std::vector<Index>& delay) {
  return delay.empty() ? 0 : *std::max_element(delay.begin(), delay.end());
}

Matrix delayed(ConstMatrixRef u, const std::vector<Index>& delay) {
  const Index last = longest(delay), kept = u.cols() - last;
  Matrix acting(u.rows(), kept);
  for (Index i = 0; i < u.rows(); ++i)
    acting.row(i) = u.row(i).segment(last - delay[static_cast<std::size_t>(i)], kept);
  return acting;
}

LinearSearch search_linear(ConstMatrixRef u, ConstMatrixRef y, Index order, const LinearSearchOptions& options,
                           const Solver& solver) {
  LinearSearch result;
  result.delay.assign(static_cast<std::size_t>(u.rows()), 0);
  const std::vector<Index> delay = find_delays(u, y, order, options);
  OrderSearch orders;
  LinearSearchOptions without_delays = options;
  if (const Index last = longest(delay); last > 0) {
    result.delay = delay;
    orders = search_orders(delayed(u, delay), y.rightCols(y.cols() - last), order, options, solver);
    if (orders.fit) without_delays.max_order = std::min(options.max_order, orders.order + kJudged.orders_beyond);
  }
  if (OrderSearch plain = search_orders(u, y, order, without_delays, solver); prefers_no_delay(plain, orders)) {
    orders = std::move(plain);
    result.delay.assign(static_cast<std::size_t>(u.rows()), 0);
  }
  if (orders.fit && options.max_delay >= kJudged.delay_room) {
    const std::vector<Index> again = delays_by_poles(*orders.fit, u, y, result.delay, options.max_delay);
    if (again != result.delay) {
      OrderSearch other =
          search_orders(delayed(u, again), y.rightCols(y.cols() - longest(again)), order, options, solver);
      if (other.fit && !prefers_no_delay(orders, other)) {
        orders = std::move(other);
        result.delay = again;
      }
    }
  }
  result.orders = std::move(orders.trials);
  if (!orders.fit) {
    result.estimate.status = Status::rank_deficient;
    result.estimate.message = fmt::format("the record of {} samples carries no linear model{}", u.cols(),
                                          order > 0 ? fmt::format(" of order {}", order) : std::string());
    return result;
  }
  const Matrix acting = delayed(u, result.delay);
  const auto late = y.rightCols(acting.cols());
  Fit fit = std::move(*orders.fit);
  const LinearModel& model = fit.model;
  if (std::optional<Fit> whole = with_inputs({model.A, model.C, fit.stride}, acting, late)) fit = std::move(*whole);
  fit.error = free_run_error(fit.model, fit.x0, acting, late, 0);
  improve(fit, acting, late, solver, options.iterations);
  result.estimate = estimate_of(std::move(fit), order);
  return result;
}

RecordNeeds KnownPoles::needs(Index inputs, Index outputs) const {
  const Index n = found_.order_used;
  return {2 * (inputs * n + n + outputs * (inputs + 1)), n, fmt::format("order {}", n)};
}

LinearEstimate KnownPoles::identify(ConstMatrixRef u, ConstMatrixRef y, Index order) const {
  if (u.rows() == found_.model.input_count() && (order == 0 || order == found_.order_used)) return found_;
  PoleSearchOptions poles;
  poles.block_rows = block_rows_;
  poles.lowest_order = poles.highest_order = order > 0 ? order : found_.order_used;
  std::vector<PoleSet> sets = pole_sets(u, y, poles).front();
  if (poles.lowest_order == found_.order_used) sets.push_back({found_.model.A, found_.model.C, 1});
  if (std::optional<Fit> fit = best_of(sets, u, y)) return estimate_of(std::move(*fit), order);
  LinearEstimate none;
  none.status = Status::rank_deficient;
  none.order_given = order;
  none.message = fmt::format("{} samples carry no linear model of order {}", u.cols(), poles.lowest_order);
  return none;
}

}  // namespace wheelhop
