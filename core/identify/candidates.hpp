/// \file
/// Models that may be delivered: what is known of each, and which of them is the best.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/data/signal.hpp"
#include "core/model/nonlinear.hpp"

namespace wheelhop {

struct Candidate {
  std::string name;  ///< "linear", "unrefined", "refined", and what is particular about the run
  std::string form;  ///< what is particular about the run
  NonlinearModel model;
  std::vector<Vector> x0;          ///< of every record
  bool stopped = false;            ///< its free run left the state guard on one of them
  double excursion = 0;            ///< beyond the range of the measured outputs, on other drives: excursion()
  Vector held_out_nrmse;           ///< p, of the motion about the mean; infinity where it stopped
  Vector unexplained;              ///< p, residual_share() on the held-out parts; 1 where it stopped
  std::vector<double> block_logs;  ///< mean over the outputs of the log NRMSE, by block of the held-out parts
};

/// What the candidates are fitted to and compared on.
struct Split {
  std::size_t longest = 0;     ///< record that the pipeline runs on
  std::vector<Index> samples;  ///< fitted ones of every record, from its start
  bool held_out = false;       ///< the rest; else nothing is
};

/// The candidates' free runs on the held-out parts.
class Comparison {
 public:
  /// @param records, split borrowed   @param deviation p, of the outputs about their means
  Comparison(const std::vector<Signal>& records, const Split& split, Vector deviation);

  std::string describe() const;
  /// Fills what is known of a candidate from its free runs.
  void score(Candidate& candidate) const;

 private:
  Index from(std::size_t i) const { return split_.held_out ? split_.samples[i] : records_[i].skip; }

  const std::vector<Signal>& records_;
  const Split& split_;
  Vector deviation_;
  Index block_;
};

/// Mean over the outputs of the log of their errors.
double mean_log(const Vector& nrmse);

/// y - y_hat of the samples [from, N), p x (N - from). @return false where the free run leaves the state guard
bool free_run_errors(const NonlinearModel& model, const Vector& x0, const Signal& record, Index from, Matrix& errors);

/// Whether no output is worse than a reference by more than two fits of one model differ by on another record.
bool as_good_everywhere(const Vector& nrmse, const Vector& reference);

/// How far the outputs on other drives may leave the range of the measured ones: by half of it, or twice as far as
/// those of the linear candidate do.
double allowed_excursion(const Candidate& linear);

/// Whether a candidate may be delivered in place of the linear one.
bool admissible(const Candidate& own, const Candidate& linear);

/// Whether a candidate's errors are below those of another by more than chance: the mean of the differences of their
/// logs over the blocks by two standard errors.
bool certainly_better(const Candidate& candidate, const Candidate& than);

/// The linear candidate, which is the first one, unless another one is admissible and better by more than 2 % and by
/// more than chance.
std::size_t choose(const std::vector<Candidate>& candidates);

/// Why one of the candidates is taken: its errors and those of the others.
std::string reason_for(const std::vector<Candidate>& candidates, std::size_t chosen);

/// Of models that fit the records nearly as well as the best of them the one whose outputs on other drives have the
/// least median distance to those of the others: where the record leaves open how a model goes on, most minima agree
/// and one that does not is likely wrong. Empty where fewer than three fit.
/// @param longest record whose drive is taken   @param deviation p, of the outputs about their means
std::optional<std::size_t> nearest_to_the_others(const std::vector<Candidate>& members,
                                                 const std::vector<Signal>& records, std::size_t longest,
                                                 const Vector& deviation);

}  // namespace wheelhop
