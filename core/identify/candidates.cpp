#include "core/identify/candidates.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/identify/judgements.hpp"
#include "core/identify/residual_share.hpp"
#include "core/identify/surrogate_drives.hpp"

namespace wheelhop {
namespace {

constexpr double kDiverged = std::numeric_limits<double>::infinity();

std::string percent(const Vector& nrmse) {
  std::string text;
  for (const double value : nrmse) text += fmt::format("{}{:.3g}", text.empty() ? "" : ", ", 100 * value);
  return text + " %";
}

/// Mean over the outputs of the log NRMSE over the whole records.
double log_error_on(const std::vector<Signal>& records, const Candidate& candidate, const Vector& deviation) {
  Vector squares = Vector::Zero(deviation.size());
  double samples = 0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    Matrix errors;
    if (!free_run_errors(candidate.model, candidate.x0[i], records[i], records[i].skip, errors)) return kDiverged;
    squares += errors.rowwise().squaredNorm();
    samples += static_cast<double>(errors.cols());
  }
  return mean_log((squares / samples).cwiseSqrt().cwiseQuotient(deviation));
}

}  // namespace

double mean_log(const Vector& nrmse) { return nrmse.cwiseMax(1e-300).array().log().mean(); }

bool free_run_errors(const NonlinearModel& model, const Vector& x0, const Signal& record, Index from, Matrix& errors) {
  errors = record.y.rightCols(record.samples() - from);
  return free_run_in_blocks(model, record.u, x0,
                            [&](const FreeRunBlock& block) {
                              const Index drop = std::max<Index>(from - block.first, 0), count = block.y.cols() - drop;
                              if (count > 0)
                                errors.middleCols(block.first + drop - from, count) -= block.y.rightCols(count);
                            }) < 0 &&
         all_finite(errors);
}

Comparison::Comparison(const std::vector<Signal>& records, const Split& split, Vector deviation)
    : records_(records), split_(split), deviation_(std::move(deviation)) {
  Index samples = 0;
  for (std::size_t i = 0; i < records.size(); ++i) samples += records[i].samples() - from(i);
  block_ = std::max<Index>(1, samples / kJudged.compared_blocks);
}

std::string Comparison::describe() const {
  return split_.held_out ? "the last quarter of every record for estimation"
                         : "the records themselves, which are too short to hold anything out";
}

void Comparison::score(Candidate& candidate) const {
  const Index p = deviation_.size();
  Vector squares = Vector::Zero(p), in_block = Vector::Zero(p);
  Index samples = 0, block_samples = 0;
  candidate.stopped = false;
  candidate.block_logs.clear();
  Vector share = Vector::Zero(p);
  for (std::size_t i = 0; i < records_.size(); ++i) {
    Matrix errors;
    if (!free_run_errors(candidate.model, candidate.x0[i], records_[i], from(i), errors)) candidate.stopped = true;
    share += static_cast<double>(errors.cols()) * residual_share(errors, records_[i].u.rightCols(errors.cols()));
    errors.array().colwise() /= deviation_.array();
    for (Index k = 0; k < errors.cols(); ++k) {
      in_block += errors.col(k).cwiseAbs2();
      ++samples;
      if (++block_samples < block_) continue;
      candidate.block_logs.push_back(mean_log((in_block / static_cast<double>(block_)).cwiseSqrt()));
      squares += in_block;
      in_block.setZero();
      block_samples = 0;
    }
  }
  squares += in_block;
  const Signal& longest = records_[split_.longest];
  candidate.excursion = candidate.stopped ? kDiverged
                                          : excursion(candidate.model, candidate.x0[split_.longest], longest.u,
                                                      longest.y.rightCols(longest.samples() - longest.skip));
  candidate.unexplained = candidate.stopped ? Vector::Ones(p) : Vector(share / static_cast<double>(samples));
  candidate.held_out_nrmse =
      candidate.stopped ? Vector::Constant(p, kDiverged) : Vector((squares / static_cast<double>(samples)).cwiseSqrt());
}

bool as_good_everywhere(const Vector& nrmse, const Vector& reference) {
  return (nrmse.array() <= kJudged.not_worse * reference.array()).all();
}

double allowed_excursion(const Candidate& linear) {
  return std::max(kJudged.excursion, kJudged.excursion_of_linear * linear.excursion);
}

bool admissible(const Candidate& own, const Candidate& linear) {
  return !own.stopped && as_good_everywhere(own.held_out_nrmse, linear.held_out_nrmse) &&
         std::isfinite(own.excursion) && own.excursion <= allowed_excursion(linear);
}

bool certainly_better(const Candidate& candidate, const Candidate& than) {
  const auto n = static_cast<Index>(std::min(candidate.block_logs.size(), than.block_logs.size()));
  if (n < 2) return false;
  const Vector difference =
      Eigen::Map<const Vector>(candidate.block_logs.data(), n) - Eigen::Map<const Vector>(than.block_logs.data(), n);
  const double mean = difference.mean();
  const double variance = (difference.array() - mean).square().sum() / static_cast<double>(n - 1);
  return mean + kJudged.certain * std::sqrt(variance / static_cast<double>(n)) < 0;
}

std::size_t choose(const std::vector<Candidate>& candidates) {
  std::size_t chosen = 0;
  const Candidate& linear = candidates.front();
  double least = linear.stopped ? kDiverged : mean_log(linear.held_out_nrmse) - std::log(kJudged.not_worse);
  for (std::size_t i = 1; i < candidates.size(); ++i) {
    const Candidate& own = candidates[i];
    if (!admissible(own, linear)) continue;
    if (!(mean_log(own.held_out_nrmse) < least) || !(linear.stopped || certainly_better(own, linear))) continue;
    chosen = i;
    least = mean_log(own.held_out_nrmse);
  }
  return chosen;
}

std::string reason_for(const std::vector<Candidate>& candidates, std::size_t chosen) {
  const Candidate& best = candidates[chosen];
  std::string text = fmt::format("the {} model: held-out NRMSE {}", best.name, percent(best.held_out_nrmse));
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Candidate& other = candidates[i];
    if (i == chosen) continue;
    text += other.stopped ? fmt::format("; {} diverges", other.name)
                          : fmt::format("; {} {}", other.name, percent(other.held_out_nrmse));
    if (!other.stopped && other.excursion > allowed_excursion(candidates.front()))
      text += " but runs away on other drives of the same kind";
  }
  return text;
}

std::optional<std::size_t> nearest_to_the_others(const std::vector<Candidate>& members,
                                                 const std::vector<Signal>& records, std::size_t longest,
                                                 const Vector& deviation) {
  if (members.size() < kJudged.fewest_alike) return {};
  std::vector<double> errors;
  for (const Candidate& member : members) errors.push_back(log_error_on(records, member, deviation));
  const double least = errors.empty() ? kDiverged : *std::min_element(errors.begin(), errors.end());
  std::vector<std::size_t> alike;
  std::vector<std::vector<Matrix>> outputs;
  for (std::size_t i = 0; i < members.size(); ++i) {
    if (!(errors[i] <= least + std::log(kJudged.same_fit))) continue;
    std::vector<Matrix> own = surrogate_outputs(members[i].model, members[i].x0[longest], records[longest].u);
    if (own.empty()) continue;
    alike.push_back(i);
    outputs.push_back(std::move(own));
  }
  if (alike.size() < kJudged.fewest_alike) return {};
  const auto distance = [&](std::size_t a, std::size_t b) {
    double sum = 0;
    for (std::size_t drive = 0; drive < outputs[a].size(); ++drive)
      sum += (deviation.cwiseInverse().asDiagonal() * (outputs[a][drive] - outputs[b][drive])).squaredNorm();
    return sum;
  };
  std::size_t nearest = 0;
  double least_median = kDiverged;
  for (std::size_t a = 0; a < alike.size(); ++a) {
    std::vector<double> distances;
    for (std::size_t b = 0; b < alike.size(); ++b)
      if (a != b) distances.push_back(distance(a, b));
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    if (!(*middle < least_median)) continue;
    least_median = *middle;
    nearest = a;
  }
  return alike[nearest];
}

}  // namespace wheelhop
