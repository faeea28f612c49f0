#include "core/identify/delivery.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/data/metrics.hpp"
#include "core/identify/free_run_problem.hpp"

namespace wheelhop {
namespace {

/// An offset larger than so many standard deviations is taken out before anything is scaled by its RMS. Judgement:
/// smaller ones change an RMS by less than half, and the constant row of Remark 1 and y0 take them.
constexpr double kLargeOffset = 1;
/// A candidate may be worse than the linear model by so much in an output: what two fits of one model differ by on
/// another record. Judgement.
constexpr double kNotWorse = 1.02;
/// Below this share of the linear model's error nothing is gained by another form of the direct term. Judgement.
constexpr double kWellExplained = 0.1;

/// Orders below are not tried again with the nonlinearity: a mass on a spring has two states.
constexpr Index kLowestOrder = 2;
/// Judgement: a lower order is taken where it is worse by no more than this in any output.
constexpr double kSameOrder = 1.03;

constexpr double kDiverged = std::numeric_limits<double>::infinity();

struct Moments {
  Vector mean, deviation;
};

Moments moments(const std::vector<Signal>& records, Matrix Signal::*rows) {
  const Index r = (records.front().*rows).rows();
  Vector sum = Vector::Zero(r), squares = Vector::Zero(r);
  double samples = 0;
  for (const Signal& record : records) {
    sum += (record.*rows).rowwise().sum();
    samples += static_cast<double>(record.samples());
  }
  const Vector mean = sum / samples;
  for (const Signal& record : records) squares += ((record.*rows).colwise() - mean).rowwise().squaredNorm();
  return {mean, (squares / samples).cwiseSqrt()};
}

Vector large_offsets(const Moments& of) {
  return (of.mean.array().abs() > kLargeOffset * of.deviation.array()).select(of.mean, 0);
}

/// RMS of a channel about its offset.
Vector scale_of(const Moments& of, const Vector& offset) {
  return ((of.mean - offset).array().square() + of.deviation.array().square()).sqrt();
}

/// All records in the units of the models; outputs about their offsets, which y0 takes up at the end.
struct Scaled {
  std::vector<Signal> records;
  Vector y_offset;     // in units of y_scale
  Vector y_deviation;  // in units of y_scale
};

Scaled scale(const std::vector<Signal>& records, Channels& channels) {
  const Moments of_u = moments(records, &Signal::u), of_y = moments(records, &Signal::y);
  channels.u_offset = large_offsets(of_u);
  channels.u_scale = scale_of(of_u, channels.u_offset);
  const Vector y_offset = large_offsets(of_y);
  channels.y_scale = scale_of(of_y, y_offset);
  channels.delay.assign(static_cast<std::size_t>(of_u.mean.size()), 0);
  const auto y_scale = channels.y_scale.cwiseInverse().asDiagonal();
  Scaled result{records, y_scale * y_offset, y_scale * of_y.deviation};
  for (Signal& record : result.records) {
    record.u = channels.u_scale.cwiseInverse().asDiagonal() * (record.u.colwise() - channels.u_offset);
    record.y = y_scale * (record.y.colwise() - y_offset);
  }
  return result;
}

/// Inputs as they act; outputs and skipped samples from the sample on at which all inputs are known.
void delay_inputs(Signal& record, const std::vector<Index>& delay) {
  const Index last = longest(delay);
  if (last == 0) return;
  record.u = delayed(record.u, delay);
  record.y = Matrix(record.y.rightCols(record.y.cols() - last));
  record.skip = std::max<Index>(0, record.skip - last);
}

Signal first_part(const Signal& record, Index samples) {
  Signal part = record;
  part.u = record.u.leftCols(samples);
  part.y = record.y.leftCols(samples);
  return part;
}

/// What the candidates are fitted to and compared on.
struct Split {
  std::size_t fitted = 0;  // record
  Index samples = 0;       // of it, from its start
  bool rest_held_out = false, others_held_out = false;
};

Split split(const std::vector<Signal>& records, const RecordNeeds& needs) {
  Split result;
  for (std::size_t i = 1; i < records.size(); ++i)
    if (records[i].samples() > records[result.fitted].samples()) result.fitted = i;
  const Index whole = records[result.fitted].samples();
  const auto part = static_cast<Index>(kFittedShare * static_cast<double>(whole));
  result.others_held_out = records.size() > 1;
  result.rest_held_out = !result.others_held_out && part >= needs.samples && part > records[result.fitted].skip;
  result.samples = result.rest_held_out ? part : whole;
  return result;
}

class Comparison {
 public:
  Comparison(const std::vector<Signal>& records, const Split& split, Vector deviation, Index initial_state_samples)
      : records_(records), split_(split), deviation_(std::move(deviation)), span_(initial_state_samples) {}

  std::string describe() const {
    if (split_.others_held_out)
      return fmt::format("{} other record(s) for estimation", static_cast<Index>(records_.size()) - 1);
    if (split_.rest_held_out)
      return fmt::format("samples [{}, {}) of the record for estimation", split_.samples, own().samples());
    return "the record itself, which is too short to hold anything out";
  }

  /// NRMSE by output about the mean.
  Vector score(Candidate& candidate) const {
    const Index p = deviation_.size();
    Vector squares = Vector::Zero(p);
    double samples = 0;
    const auto add = [&](const Signal& record, const Vector& x0, Index from) {
      const FreeRun run = free_run(candidate.model, record.u, x0);
      candidate.stopped = candidate.stopped || run.status != Status::ok || !all_finite(run.y);
      const Index kept = record.samples() - from;
      squares += (record.y - run.y).rightCols(kept).rowwise().squaredNorm();
      samples += static_cast<double>(kept);
    };
    // What is fitted must run as well.
    add(own(), candidate.x0, split_.rest_held_out ? split_.samples : own().skip);
    if (split_.others_held_out) {
      squares.setZero();
      samples = 0;
    }
    for (std::size_t i = 0; i < records_.size(); ++i)
      if (i != split_.fitted) add(records_[i], state_of(candidate.model, records_[i]), records_[i].skip);
    if (candidate.stopped) return Vector::Constant(p, kDiverged);
    return (squares / samples).cwiseSqrt().cwiseQuotient(deviation_);
  }

  Vector state_of(const NonlinearModel& model, const Signal& record) const {
    const Index span = span_ > 0 ? span_ : initial_state_span(model.linear, record.samples());
    return estimate_initial_state(model, record.u, record.y, span);
  }

 private:
  const Signal& own() const { return records_[split_.fitted]; }

  const std::vector<Signal>& records_;
  Split split_;
  Vector deviation_;
  Index span_;
};

double mean_log(const Vector& nrmse) { return nrmse.cwiseMax(1e-300).array().log().mean(); }

bool as_good_everywhere(const Vector& nrmse, const Vector& reference) {
  return (nrmse.array() <= kNotWorse * reference.array()).all();
}

std::string percent(const Vector& nrmse) {
  std::string text;
  for (const double value : nrmse) text += fmt::format("{}{:.3g}", text.empty() ? "" : ", ", 100 * value);
  return text + " %";
}

/// The linear model unless another one is better by more than kNotWorse and in no output worse.
std::size_t choose(const std::vector<Candidate>& candidates) {
  std::size_t chosen = 0;
  double least =
      candidates.front().stopped ? kDiverged : mean_log(candidates.front().held_out_nrmse) - std::log(kNotWorse);
  for (std::size_t i = 1; i < candidates.size(); ++i) {
    const Vector& own = candidates[i].held_out_nrmse;
    if (candidates[i].stopped || !as_good_everywhere(own, candidates.front().held_out_nrmse)) continue;
    if (!(mean_log(own) < least)) continue;
    chosen = i;
    least = mean_log(own);
  }
  return chosen;
}

std::string reason_for(const Delivery& result) {
  const Candidate& chosen = result.candidates[result.chosen];
  std::string text = fmt::format("the {} model: held-out NRMSE {}", chosen.name, percent(chosen.held_out_nrmse));
  for (std::size_t i = 0; i < result.candidates.size(); ++i) {
    const Candidate& other = result.candidates[i];
    if (i == result.chosen) continue;
    text += other.stopped ? fmt::format("; {} diverges", other.name)
                          : fmt::format("; {} {}", other.name, percent(other.held_out_nrmse));
  }
  return text;
}

/// The chosen candidate on all records.
void fit_to_all(const std::vector<Signal>& records, const Comparison& comparison, Index fitted, Index iterations,
                const Solver& solver, const Candidate& from, NonlinearModel& model, std::vector<Vector>& x0) {
  model = from.model;
  std::vector<FittedRecord> fits;
  for (std::size_t i = 0; i < records.size(); ++i)
    fits.push_back({records[i].u, records[i].y, records[i].skip,
                    static_cast<Index>(i) == fitted ? from.x0 : comparison.state_of(model, records[i])});
  const auto keep_states = [&] {
    x0.clear();
    for (const FittedRecord& fit : fits) x0.push_back(fit.x0);
  };
  keep_states();
  if (iterations == 0) return;
  const Vector weight_std = Vector::Ones(records.front().output_count());
  const Refinement refined = refine(model, fits, weight_std, solver, iterations);
  Candidate trial{from.name, refined.model, fits[static_cast<std::size_t>(fitted)].x0, false, {}};
  if (!from.model.map && !(spectral_radius(refined.model.linear.A) < 1)) return;
  trial.held_out_nrmse = comparison.score(trial);
  if (trial.stopped || !as_good_everywhere(trial.held_out_nrmse, from.held_out_nrmse)) return;
  model = refined.model;
  keep_states();
}

Split find_split(const std::vector<Signal>& records, const DeliveryOptions& options, const Pieces& pieces) {
  const Signal& first = records.front();
  return split(records,
               options.search ? RecordNeeds{} : pieces.subspace.needs(first.input_count(), first.output_count()));
}

/// The pipeline's runs on the fitted part and the candidates they give.
struct Trials {
  const Signal fitted;
  const Comparison& comparison;
  const DeliveryOptions& options;
  const Pieces& pieces;
  Random& random;
  std::vector<PipelineResult> runs = {};
  std::vector<Candidate> candidates = {};
  std::vector<std::size_t> run_of = {};  // of every candidate
  std::size_t chosen = 0;

  Trials(Signal part, const Comparison& compare, const DeliveryOptions& wanted, const Pieces& borrowed, Random& guesses)
      : fitted(std::move(part)), comparison(compare), options(wanted), pieces(borrowed), random(guesses) {}

  void add(std::string name, const NonlinearModel& model, const Vector& x0) {
    Candidate candidate{std::move(name), model, x0, false, {}};
    candidate.held_out_nrmse = comparison.score(candidate);
    candidates.push_back(std::move(candidate));
    run_of.push_back(runs.size() - 1);
  }

  /// One run of the pipeline. @param linear found before, or none: by the piece @return false without a linear model
  bool run(const LinearEstimate* linear, bool direct_term, const std::string& suffix) {
    PipelineOptions pipeline = options.pipeline;
    pipeline.direct_term = direct_term;
    std::optional<KnownPoles> known;
    if (linear) {
      pipeline.order = linear->order_used;
      pipeline.linear_iterations = 0;  // it is refined already
      known.emplace(*linear, options.search->block_rows);
    }
    const Pieces used{known ? static_cast<const SubspaceEstimator&>(*known) : pieces.subspace, pieces.inversion,
                      pieces.make_map, pieces.solver, pieces.make_ridge};
    runs.push_back(run_scaled_pipeline(fitted, pipeline, used, random));
    const PipelineResult& found = runs.back();
    if (found.linear.status != Status::ok) return false;
    if (candidates.empty()) add("linear", without_map(found.linear.model), found.linear.x0);
    const bool refined = found.refinement.solution.iterations > 0;
    if (found.best >= 0) {
      const Pass& best = found.passes[static_cast<std::size_t>(found.best)];
      add("unrefined" + suffix, best.model, best.x0);
    }
    if (refined) add("refined" + suffix, found.model, found.x0);
    return true;
  }

  double score(std::size_t i) const { return mean_log(candidates[i].held_out_nrmse); }

  /// All runs that the options ask for. @return false without a linear model
  bool run_all(const std::optional<LinearSearch>& search) {
    const LinearEstimate* linear = search ? &search->estimate : nullptr;
    bool direct_term = options.pipeline.direct_term;
    if (!run(linear, direct_term, "")) return false;
    chosen = choose(candidates);
    if (options.pipeline.nonlinearities == 0) return true;
    if (options.choose_direct_term && !(score(chosen) < score(0) + std::log(kWellExplained))) {
      run(linear, !direct_term, direct_term ? " without direct term" : " with direct term");
      const std::size_t now = choose(candidates);
      if (run_of[now] != run_of[chosen]) direct_term = !direct_term;
      chosen = now;
    }
    if (search && options.pipeline.order == 0 && candidates[chosen].model.map) lower_orders(*search, direct_term);
    return true;
  }

  /// What looked like further modes may have been the nonlinearity: the smallest order that does as well with it.
  void lower_orders(const LinearSearch& search, bool direct_term) {
    const Candidate best = candidates[chosen];
    for (const OrderTrial& trial : search.orders) {
      if (trial.order() >= best.model.order()) return;
      if (trial.order() < kLowestOrder) continue;
      const std::size_t before = candidates.size();
      run(&trial.estimate, direct_term, fmt::format(" of order {}", trial.order()));
      for (std::size_t i = before; i < candidates.size(); ++i) {
        const Candidate& own = candidates[i];
        if (own.stopped || !(own.held_out_nrmse.array() <= kSameOrder * best.held_out_nrmse.array()).all()) continue;
        chosen = i;
        return;
      }
    }
  }
};

}  // namespace

Index initial_state_span(const LinearModel& model, Index samples) {
  double slowest = 0;  // samples to turn through a radian or to fall by e, whichever is shorter
  for (const std::complex<double>& pole : eigenvalues(model.A)) {
    const double rate = std::abs(std::log(pole));
    if (std::isfinite(rate) && rate > 0) slowest = std::max(slowest, 1 / rate);
  }
  constexpr double three_periods = 6 * 3.14159265358979323846;
  const auto span = static_cast<Index>(std::min(three_periods * slowest, static_cast<double>(samples)));
  return std::max<Index>(std::min(std::max<Index>(span, 100), samples / 4), 1);
}

Delivery deliver(const std::vector<Signal>& records, const DeliveryOptions& options, const Pieces& pieces,
                 Random& random) {
  Delivery result;
  Scaled scaled = scale(records, result.channels);
  Split parts = find_split(scaled.records, options, pieces);
  if (options.search) {
    const Signal& record = scaled.records[parts.fitted];
    result.search = search_linear(record.u.leftCols(parts.samples), record.y.leftCols(parts.samples),
                                  options.pipeline.order, *options.search, pieces.solver);
    if (result.search->estimate.status != Status::ok) {
      result.status = result.search->estimate.status;
      result.message = result.search->estimate.message;
      return result;
    }
    result.channels.delay = result.search->delay;
    for (Signal& late : scaled.records) delay_inputs(late, result.channels.delay);
    parts.samples -= longest(result.channels.delay);
  }
  const Comparison comparison(scaled.records, parts, scaled.y_deviation, options.initial_state_samples);
  result.held_out = comparison.describe();
  Trials trials(first_part(scaled.records[parts.fitted], parts.samples), comparison, options, pieces, random);
  if (!trials.run_all(result.search)) {
    result.pipeline = std::move(trials.runs.front());
    result.status = result.pipeline.status;
    result.message = result.pipeline.message;
    return result;
  }
  result.candidates = std::move(trials.candidates);
  result.chosen = trials.chosen;
  result.pipeline = std::move(trials.runs[trials.run_of[result.chosen]]);
  const Candidate& chosen = result.candidates[result.chosen];
  result.status = chosen.stopped ? Status::outside_domain : Status::ok;
  if (chosen.stopped) result.message = "the free run of every candidate diverges";
  result.reason = reason_for(result);
  const auto on_all = [&](const Candidate& candidate, NonlinearModel& model, std::vector<Vector>& x0) {
    fit_to_all(scaled.records, comparison, static_cast<Index>(parts.fitted), options.pipeline.refine_iterations,
               pieces.solver, candidate, model, x0);
  };
  on_all(chosen, result.model, result.x0);
  NonlinearModel linear = result.model;
  std::vector<Vector> states;
  if (chosen.model.map) on_all(result.candidates.front(), linear, states);
  result.linear = linear.linear;
  result.model.linear.y0 += scaled.y_offset;
  result.linear.y0 += scaled.y_offset;
  return result;
}

}  // namespace wheelhop
