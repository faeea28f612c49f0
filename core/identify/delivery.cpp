#include "core/identify/delivery.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/identify/free_run_problem.hpp"
#include "core/identify/judgements.hpp"
#include "core/identify/residual_share.hpp"
#include "core/model/sensitivities.hpp"

namespace wheelhop {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

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
  return (of.mean.array().abs() > kJudged.large_offset * of.deviation.array()).select(of.mean, 0);
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

Scaled scale(std::vector<Signal> records, Channels& channels) {
  const Moments of_u = moments(records, &Signal::u), of_y = moments(records, &Signal::y);
  channels.u_offset = large_offsets(of_u);
  channels.u_scale = scale_of(of_u, channels.u_offset);
  const Vector y_offset = large_offsets(of_y);
  channels.y_scale = scale_of(of_y, y_offset);
  channels.delay.assign(static_cast<std::size_t>(of_u.mean.size()), 0);
  const auto y_scale = channels.y_scale.cwiseInverse().asDiagonal();
  for (Signal& record : records) {
    record.u.colwise() -= channels.u_offset;
    record.u.array().colwise() /= channels.u_scale.array();
    record.y.colwise() -= y_offset;
    record.y.array().colwise() /= channels.y_scale.array();
    if (!record.limits.any()) continue;
    record.limits.low -= y_offset;
    record.limits.high -= y_offset;
    record.limits = over(record.limits, channels.y_scale);
  }
  return {std::move(records), y_scale * y_offset, y_scale * of_y.deviation};
}

/// Inputs as they act; outputs and skipped samples from the sample on at which all inputs are known.
void delay_inputs(Signal& record, const std::vector<Index>& delay) {
  const Index last = longest(delay);
  if (last == 0) return;
  record.u = delayed(record.u, delay);
  record.y = Matrix(record.y.rightCols(record.y.cols() - last));
  record.skip = std::max<Index>(0, record.skip - last);
}

Split split(const std::vector<Signal>& records, const RecordNeeds& needs) {
  Split result;
  for (std::size_t i = 1; i < records.size(); ++i)
    if (records[i].samples() > records[result.longest].samples()) result.longest = i;
  const auto part_of = [](const Signal& record) {
    return static_cast<Index>(kJudged.fitted_share * static_cast<double>(record.samples()));
  };
  const Signal& longest_record = records[result.longest];
  result.held_out = part_of(longest_record) >= needs.samples;
  for (const Signal& record : records) {
    result.held_out = result.held_out && part_of(record) > record.skip;
    result.samples.push_back(part_of(record));
  }
  if (!result.held_out)
    for (std::size_t i = 0; i < records.size(); ++i) result.samples[i] = records[i].samples();
  return result;
}

/// Refinement over the first `samples` of every record; false where it leads nowhere.
bool refine_on(const std::vector<Signal>& records, const std::vector<Index>& samples, Index iterations,
               const Solver& solver, NonlinearModel& model, std::vector<Vector>& x0) {
  std::vector<FittedRecord> fits;
  for (std::size_t i = 0; i < records.size(); ++i)
    fits.push_back({records[i].u.leftCols(samples[i]), records[i].y.leftCols(samples[i]), records[i].skip, x0[i]});
  const Vector weight_std = Vector::Ones(records.front().output_count());
  Refinement refined = refine(model, fits, weight_std, solver, iterations);
  const Status status = refined.solution.status;
  if (status != Status::ok && status != Status::iteration_limit) return false;
  if (!model.map && !(spectral_radius(refined.model.linear.A) < 1)) return false;
  model = std::move(refined.model);
  for (std::size_t i = 0; i < records.size(); ++i) x0[i] = fits[i].x0;
  return true;
}

/// residual_share() over whole records, but for what no score counts.
Vector unexplained_by(const NonlinearModel& model, const std::vector<Vector>& x0, const std::vector<Signal>& records) {
  Vector sum = Vector::Zero(records.front().output_count());
  double samples = 0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Signal& record = records[i];
    Matrix errors;
    free_run_errors(model, x0[i], record, record.skip, errors);
    const auto kept = static_cast<double>(errors.cols());
    sum += kept * residual_share(errors, record.u.rightCols(errors.cols()));
    samples += kept;
  }
  return sum / samples;
}

Split find_split(const std::vector<Signal>& records, const DeliveryOptions& options, const Pieces& pieces) {
  const Signal& first = records.front();
  return split(records,
               options.search ? RecordNeeds{} : pieces.subspace.needs(first.input_count(), first.output_count()));
}

/// The pipeline's runs on the fitted part and the candidates they give.
struct Trials {
  const SignalView fitted;
  const std::vector<Signal>& records;
  const Split& split;
  const Comparison& comparison;
  const DeliveryOptions& options;
  const Pieces& pieces;
  Random& random;
  std::vector<PipelineResult> runs = {};
  std::vector<Candidate> candidates = {};
  std::vector<std::size_t> run_of = {};       // of every candidate
  std::vector<Candidate> of_all_starts = {};  // where there are several
  std::size_t chosen = 0;
  bool widened = false;  // the one chosen has more features than the map that was given

  Trials(const std::vector<Signal>& all, const Split& parts, const Comparison& compare, const DeliveryOptions& wanted,
         const Pieces& borrowed, Random& guesses)
      : fitted(all[parts.longest], parts.samples[parts.longest]),
        records(all),
        split(parts),
        comparison(compare),
        options(wanted),
        pieces(borrowed),
        random(guesses) {}

  /// @param on_all fitted to the other records as well
  Candidate scored(std::string name, const NonlinearModel& model, const Vector& x0, bool on_all) const {
    Candidate candidate;
    candidate.name = std::move(name);
    candidate.model = model;
    const StateStatistics known =
        records.size() > 1 ? state_statistics(model, {{fitted.u, fitted.y, fitted.skip, x0}}) : StateStatistics{};
    for (std::size_t i = 0; i < records.size(); ++i)
      candidate.x0.push_back(i == split.longest ? x0 : state_of(model, i, known));
    if (on_all && records.size() > 1)
      refine_on(records, split.samples, options.pipeline.refine_iterations, pieces.solver, candidate.model,
                candidate.x0);
    comparison.score(candidate);
    return candidate;
  }

  void add(Candidate candidate, std::size_t run) {
    candidates.push_back(std::move(candidate));
    run_of.push_back(run);
  }

  Vector state_of(const NonlinearModel& model, std::size_t i, const StateStatistics& known) const {
    const Index wanted = options.initial_state_samples;
    const Index samples = wanted > 0 ? wanted : initial_state_span(model.linear, records[i].samples());
    return estimate_initial_state(model, records[i].u, records[i].y, std::min(samples, split.samples[i]), 0, known);
  }

  /// The best candidate of one kind among the starts.
  struct Best {
    std::optional<Candidate> candidate;
    std::size_t run = 0;
  };

  void keep_better(Best& best, Candidate candidate) const {
    const auto worth = [&](const Candidate& own) {
      return std::tuple(admissible(own, candidates.front()), certainly_better(own, candidates.front()),
                        own.stopped ? -kInfinity : -mean_log(own.held_out_nrmse));
    };
    if (best.candidate && !(worth(candidate) > worth(*best.candidate))) return;
    best = {std::move(candidate), runs.size() - 1};
  }

  /// One run of the pipeline. @param linear found before, or none: by the piece @return false without a linear model
  bool run(const LinearEstimate* linear, PipelineOptions pipeline, const std::string& suffix) {
    std::optional<KnownPoles> known;
    if (linear) {
      pipeline.order = linear->order_used;
      pipeline.linear_iterations = 0;  // it is refined already
      known.emplace(*linear, options.search->block_rows);
    }
    const Pieces used{known ? static_cast<const SubspaceEstimator&>(*known) : pieces.subspace, pieces.inversion,
                      pieces.make_map, pieces.solver, pieces.make_ridge};
    Best unrefined, refined;
    Index starts = 1;
    for (Index start = 0; start < starts; ++start) {
      runs.push_back(run_scaled_pipeline(fitted, pipeline, used, random));
      const PipelineResult& found = runs.back();
      if (found.linear.status != Status::ok) return false;
      if (pipeline.nonlinearities > 0) starts = wanted_starts(found.linear.order_used);
      if (candidates.empty())
        add(scored("linear", without_map(found.linear.model, fitted.limits), found.linear.x0, true), runs.size() - 1);
      const auto enter = [&](Best& best, Candidate candidate) {
        candidate.form = suffix;
        if (starts > 1) of_all_starts.push_back(candidate);
        keep_better(best, std::move(candidate));
      };
      if (found.best >= 0) {
        const Pass& best = found.passes[static_cast<std::size_t>(found.best)];
        enter(unrefined, scored("unrefined" + suffix, best.model, best.x0, false));
      }
      if (found.refinement.solution.iterations > 0)
        enter(refined, scored("refined" + suffix, found.model, found.x0, true));
    }
    for (Best* best : {&unrefined, &refined})
      if (best->candidate) add(std::move(*best->candidate), best->run);
    return true;
  }

  Index wanted_starts(Index order) const {
    Index samples = 0;
    for (const Index own : split.samples) samples += own;
    return options.starts > 0 ? options.starts : starts_for(samples, order);
  }

  double score(std::size_t i) const { return mean_log(candidates[i].held_out_nrmse); }

  bool leaves_noise(std::size_t i) const { return candidates[i].unexplained.maxCoeff() < kJudged.noise_share; }

  /// All runs that the options ask for. @return false without a linear model
  bool run_all(const std::optional<LinearSearch>& search) {
    const LinearEstimate* linear = search ? &search->estimate : nullptr;
    PipelineOptions pipeline = options.pipeline;
    if (!run(linear, pipeline, "")) return false;
    chosen = choose(candidates);
    if (options.pipeline.nonlinearities == 0) return true;
    const bool well_explained = score(chosen) < score(0) + std::log(kJudged.well_explained);
    if (options.choose_direct_term && !well_explained && !leaves_noise(chosen)) {
      PipelineOptions other = pipeline;
      other.direct_term = !pipeline.direct_term;
      run(linear, other, other.direct_term ? " with direct term" : " without direct term");
      const std::size_t now = choose(candidates);
      if (run_of[now] != run_of[chosen]) pipeline = other;
      chosen = now;
    }
    if (search && options.pipeline.order == 0) {
      if (!leaves_noise(chosen)) other_orders(*search, pipeline);
      if (candidates[chosen].model.map) lower_orders(*search, pipeline);
    }
    if (has_alternative_map(chosen) && !leaves_noise(chosen)) map_as_given(search, pipeline);
    wider_maps();
    return true;
  }

  /// Where the model leaves more than noise and the records are long enough for more parameters: its refinement goes
  /// on, then with twice the features, as long as that brings something.
  void wider_maps() {
    double samples = 0;
    for (const Index fitted_samples : split.samples) samples += static_cast<double>(fitted_samples);
    for (Index growth = 0; growth <= kJudged.most_growth && !leaves_noise(chosen); ++growth) {
      Candidate own = candidates[chosen];
      if (!own.model.map || own.stopped || has_alternative_map(chosen) || options.pipeline.refine_iterations == 0)
        return;
      if (growth > 0) {
        std::shared_ptr<const StaticMap> wider = own.model.map->widened(own.model.map->features(), random);
        if (!wider) return;
        own.model.map = std::move(wider);
      }
      if (samples < kJudged.samples_per_parameter * static_cast<double>(pack(own.model, own.x0.front()).size())) return;
      if (!refine_on(records, split.samples, kJudged.growth_iterations * options.pipeline.refine_iterations,
                     pieces.solver, own.model, own.x0))
        return;
      own.name = fmt::format("refined{} with {} features", own.form, own.model.map->features());
      comparison.score(own);
      add(std::move(own), run_of[chosen]);
      const std::size_t last = candidates.size() - 1;
      const double gain = score(chosen) - score(last);
      const bool enough = gain > (growth > 0 ? std::log(kJudged.same_order) : 0);
      if (admissible(candidates[last], candidates.front()) && enough) {
        chosen = last;
        widened = growth > 0;
      } else if (growth > 0) {
        return;
      }
    }
  }

  /// The linear model's order was chosen where a nonlinearity hides modes: higher ones as long as they bring something,
  /// and lower ones where no nonlinearity is found with those.
  void other_orders(const LinearSearch& search, const PipelineOptions& pipeline) {
    const Index n = search.estimate.order_used;
    const auto helps = [&](const OrderTrial& trial) {
      const double before = score(chosen);
      run(&trial.estimate, pipeline, fmt::format(" of order {}", trial.order()));
      chosen = choose(candidates);
      return score(chosen) < before - std::log(kJudged.same_order);
    };
    Index idle = 0;
    for (const OrderTrial& trial : search.orders)
      if (trial.order() > n && idle < kJudged.idle_orders && !leaves_noise(chosen)) idle = helps(trial) ? 0 : idle + 1;
    for (auto trial = search.orders.rbegin(); trial != search.orders.rend(); ++trial)
      if (trial->order() < n && trial->order() >= kJudged.lowest_order && !candidates[chosen].model.map) helps(*trial);
  }

  /// Whether a polynomial took the place of the map that was given.
  bool has_alternative_map(std::size_t i) const {
    const StaticMap* map = candidates[i].model.map.get();
    return map && map->name() != pieces.make_map(map->inputs(), map->outputs())->name();
  }

  /// A polynomial of high degree runs away outside the records, where the map that it took the place of does not. Where
  /// neither leaves noise alone, that one if it is nearly as good.
  void map_as_given(const std::optional<LinearSearch>& search, PipelineOptions pipeline) {
    pipeline.ridge_degree = 0;
    const LinearEstimate* linear = nullptr;
    if (search) {
      linear = &search->estimate;
      for (const OrderTrial& trial : search->orders)
        if (trial.order() == candidates[chosen].model.order() && trial.order() != linear->order_used)
          linear = &trial.estimate;
    }
    const std::size_t before = candidates.size(), polynomial = chosen;
    run(linear, pipeline, " with the map as given");
    for (std::size_t i = before; i < candidates.size(); ++i) {
      const Candidate& own = candidates[i];
      if (!admissible(own, candidates.front())) continue;
      if (score(i) < score(polynomial) + std::log(kJudged.robust_map) &&
          (chosen == polynomial || score(i) < score(chosen)))
        chosen = i;
    }
  }

  /// The first candidate with a nonlinearity of that order; their number where there is none.
  std::size_t first_of_order(Index order) const {
    std::size_t i = 1;
    while (i < candidates.size() && candidates[i].model.order() != order) ++i;
    return i;
  }

  /// What looked like further modes may have been the nonlinearity: the lowest order that does as well with it.
  void lower_orders(const LinearSearch& search, const PipelineOptions& pipeline) {
    const Candidate best = candidates[chosen];
    const double margin = leaves_noise(chosen) ? kJudged.same_order : kJudged.same_order_beyond_noise;
    for (const OrderTrial& trial : search.orders) {
      if (trial.order() >= best.model.order()) return;
      if (trial.order() < kJudged.lowest_order) continue;
      const std::size_t before = first_of_order(trial.order());
      if (before == candidates.size()) run(&trial.estimate, pipeline, fmt::format(" of order {}", trial.order()));
      for (std::size_t i = before; i < candidates.size(); ++i) {
        const Candidate& own = candidates[i];
        if (own.model.order() != trial.order()) break;
        if (!admissible(own, candidates.front()) ||
            !(own.held_out_nrmse.array() <= margin * best.held_out_nrmse.array()).all())
          continue;
        chosen = i;
        return;
      }
    }
  }
};

std::vector<StartedRecord> started(const std::vector<Signal>& records, const std::vector<Vector>& x0) {
  std::vector<StartedRecord> result;
  for (std::size_t i = 0; i < records.size(); ++i)
    result.push_back({records[i].u, records[i].y, records[i].skip, x0[i]});
  return result;
}

}  // namespace

Index starts_for(Index samples, Index order) {
  const double relative = kJudged.start_samples / static_cast<double>(std::max<Index>(samples, 1));
  const Index by_order = kJudged.start_work / std::max<Index>(samples * order * order, 1);
  const auto most = static_cast<double>(std::min(by_order, kJudged.most_starts));
  return std::max<Index>(1, static_cast<Index>(std::min(relative * relative, most)));
}

Delivery deliver(std::vector<Signal> records, const DeliveryOptions& options, const Pieces& pieces, Random& random) {
  Delivery result;
  if (options.cut_off_outputs) {
    std::vector<ConstMatrixRef> outputs;
    for (const Signal& record : records) outputs.emplace_back(record.y);
    result.limits = find_output_limits(outputs);
    for (Signal& record : records) record.limits = result.limits;
  }
  Scaled scaled = scale(std::move(records), result.channels);
  Split parts = find_split(scaled.records, options, pieces);
  if (options.search) {
    const Index samples = parts.samples[parts.longest];
    const Signal& record = scaled.records[parts.longest];
    result.search = search_linear(record.u.leftCols(samples), record.y.leftCols(samples), options.pipeline.order,
                                  *options.search, pieces.solver);
    if (result.search->estimate.status != Status::ok) {
      result.status = result.search->estimate.status;
      result.message = result.search->estimate.message;
      return result;
    }
    result.channels.delay = result.search->delay;
    for (Signal& late : scaled.records) delay_inputs(late, result.channels.delay);
    for (Index& fitted : parts.samples) fitted -= longest(result.channels.delay);
    for (std::size_t i = 0; i < parts.samples.size(); ++i)
      if (parts.samples[i] <= scaled.records[i].skip) {
        result.status = Status::rank_deficient;
        result.message = fmt::format(
            "record {} is too short for an input that acts {} samples late: leave it out or give it more "
            "samples",
            i + 1, longest(result.channels.delay));
        return result;
      }
  }
  const Comparison comparison(scaled.records, parts, scaled.y_deviation);
  result.held_out = comparison.describe();
  Trials trials(scaled.records, parts, comparison, options, pieces, random);
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
  result.reason = reason_for(result.candidates, result.chosen);
  const double allowed = allowed_excursion(result.candidates.front());
  const auto on_all = [&](const Candidate& candidate) {
    Candidate trial = candidate;
    std::vector<Index> whole;
    for (const Signal& record : scaled.records) whole.push_back(record.samples());
    const Index iterations = options.pipeline.refine_iterations;
    if (iterations == 0 || !refine_on(scaled.records, whole, iterations, pieces.solver, trial.model, trial.x0))
      return candidate;
    comparison.score(trial);
    const bool better = as_good_everywhere(trial.held_out_nrmse, candidate.held_out_nrmse) &&
                        trial.excursion <= std::max(allowed, candidate.excursion);
    return trial.stopped || !better ? candidate : trial;
  };
  Candidate delivered = on_all(chosen);
  if (chosen.model.map && !trials.widened && chosen.unexplained.maxCoeff() >= kJudged.noise_share) {
    std::vector<Candidate> members;
    for (const Candidate& other : trials.of_all_starts) {
      if (other.form != chosen.form || !admissible(other, result.candidates.front())) continue;
      members.push_back(on_all(other));
      if (!admissible(members.back(), result.candidates.front())) members.pop_back();
    }
    if (const auto nearest = nearest_to_the_others(members, scaled.records, parts.longest, scaled.y_deviation)) {
      delivered = members[*nearest];
      result.reason += fmt::format(
          "; of {} fits of this form to all records the one nearest to the others on other drives", members.size());
    }
  }
  result.model = std::move(delivered.model);
  result.x0 = std::move(delivered.x0);
  const std::vector<StartedRecord> all = started(scaled.records, result.x0);
  result.states = state_statistics(result.model, all);
  result.uncertainty =
      model_uncertainty(result.model, all, response_frequencies(all[parts.longest].u.cols()), result.channels.delay);
  result.linear = result.model.linear;
  result.linear_states = result.states;
  if (chosen.model.map) {
    const Candidate linear = on_all(result.candidates.front());
    result.linear = linear.model.linear;
    result.linear_states = state_statistics(linear.model, started(scaled.records, linear.x0));
  }
  result.unexplained = unexplained_by(result.model, result.x0, scaled.records);
  result.model.linear.y0 += scaled.y_offset;
  result.linear.y0 += scaled.y_offset;
  result.model.limits = over(result.limits, result.channels.y_scale);
  return result;
}

}  // namespace wheelhop
