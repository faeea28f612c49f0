/// \file
/// One answer of a blind test held against the truth.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/base/json.hpp"
#include "experiments/blind/score_key.hpp"

namespace wheelhop::scoring {

/// What a diagnosis file says, as far as it is scored.
struct Answer {
  std::string error;  ///< why there is no diagnosis; empty where there is one
  bool absent = false;
  std::vector<std::string> left_out;
  std::string verdict, outcome, location, commit;
  std::vector<std::string> same_locations;  ///< the location and those that no record can tell from it
  std::vector<std::string> named, ambiguous_with;
  std::vector<std::string> ranking;   ///< named, then ambiguous, then every suspect: distinct, best first
  std::optional<double> probability;  ///< of the first named effect
  std::optional<double> closure, closure_low, closure_high;
  bool beyond_flagged = false;
  std::string plant, retuned;                         ///< files of plants beside the answer; may be empty
  std::vector<std::pair<std::string, double>> floor;  ///< standard deviation of the noise by channel

  /// named and ambiguous_with, each once.
  std::vector<std::string> reported_set() const;
};

/// The answer to a case in a folder of answers. One that is missing is absent, one that says `error` or does not read
/// has `error`; both count as wrong everywhere.
Answer load_answer(const std::filesystem::path& folder, const std::string& name);

/// An answer held against its truth. Every member is a plain fact; which cases a score counts is the table's business.
struct Judged {
  TrueCase truth;  ///< the kind is left_out where the answer was made so
  Answer answer;
  bool where = false;            ///< location named = a true one
  bool where_in_set = false;     ///< a true one is among those that no record can tell from the one named
  bool alarm = false;            ///< a gap is claimed
  bool flagged = false;          ///< unknown@... is named
  bool first = false;            ///< the first name is a true effect at its place
  bool in_first_two = false;     ///< a true effect is first or second of the ranking
  bool in_set = false;           ///< every true effect is in the reported set
  bool all_named = false;        ///< every true effect is named, in any order
  bool effect_named = false;     ///< of a mixed case: the effect of the catalogue is named
  bool parameter_named = false;  ///< of a mixed case: the wrong parameter is named
  int extras = 0;                ///< names that are no true effect; of an unknown truth, unknown@... is none
  std::string fault;             ///< why the case counts as wrong; empty where it is right

  // Measured on noise-free records: empty where there are none (or no plant files), -infinity where a run fails.
  std::optional<double> true_closure, beyond_closure;
};

Judged judge(const TrueCase& truth, Answer answer);

/// True if "effect@location" of an answer is a true effect; where no family is right, "unknown" is its name.
bool is_named(const TrueEffect& effect, CaseKind kind, const std::string& name);

/// Pairs of (true effect, named effect) by id for a confusion matrix: true effects that are named first, the rest in
/// order; "none" for no gap and for no name, "error" for an answer that is one or is absent.
std::vector<std::pair<std::string, std::string>> confusions(const Judged& judged);

}  // namespace wheelhop::scoring
