/// \file
/// Before a test: which effects a drive could show, which it would confuse, and what in a small menu would tell them
/// apart. From plant, drives and noise alone.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "core/base/place.hpp"
#include "core/gap/which/effect.hpp"

namespace wheelhop {

inline constexpr double visible_sigma = 1;       ///< noise levels (RMS) from which an effect shows
inline constexpr double marginal_sigma = 0.5;    ///< below: not diagnosable with the drive
inline constexpr double confused_cosine = 0.85;  ///< |cosine| above which two effects cannot be told apart
inline constexpr double hard_cosine = 0.7;       ///< ... above which it is hard

/// An effect at a place, by the form that shows most.
struct PlannedEffect {
  EffectId effect;
  Place location;
  std::string form;
  double size_sigma = 0;  ///< RMS that it leaves when all parameters have followed, over the noise; NaN: not simulated
};

/// What one test would show.
struct PlanView {
  std::string name;     ///< "as planned", or what differs: "at 1.5 x the level"
  std::string message;  ///< why it cannot be run; empty if it can
  std::vector<PlannedEffect> effects;
  /// Between what is left of every two effects: that of their most similar forms, among forms that show at least half
  /// as much as the best. In [-1, 1], symmetric. Empty in an item of the menu.
  Matrix cosine;
  Vector parameter_std;     ///< a tolerance parameter, posterior in tolerances
  Matrix parameter_cosine;  ///< their correlations
};

/// Two effects that look alike in the planned test, and the item of the menu in which they differ most.
struct PlanPair {
  std::size_t a = 0, b = 0;  ///< indices into the effects
  double cosine = 0;
  double left_sigma = 0;  ///< RMS that remains where one is taken for the other, over the noise; of the smaller
  int item = -1;          ///< -1: in none do both show and clearly more of one remain beside the other
  double item_cosine = 0;
};

/// An item of the menu, run alone instead of the planned test.
struct PlanItem {
  PlanView view;
  std::vector<double> cosines = {};     ///< between the two effects of each pair of the plan, then of those compared
  std::vector<std::size_t> shows = {};  ///< effects that show here and not as planned
  std::vector<std::size_t> hides = {};  ///< the other way round
  std::vector<std::size_t> separates =
      {};  ///< of the pairs with |cosine| > hard_cosine: those at or below it here, both showing
};

struct Plan {
  Status status = Status::ok;
  std::string message;
  std::vector<std::string> parameters;  ///< names, in the order of the views
  PlanView planned;
  double menu_s = 0;            ///< seconds of each drive that the menu was computed on
  std::vector<PlanPair> pairs;  ///< |cosine| > hard_cosine, neither below marginal_sigma; most alike first
  std::vector<PlanItem> menu;   ///< most useful first: by effects shown and pairs separated, less effects hidden
};

using EffectPair = std::array<std::size_t, 2>;  ///< indices into the effects

/// Effects that look alike in a test, most alike first; no item of a menu is chosen yet.
std::vector<PlanPair> pairs_of(const PlanView& view);

/// What an item of the menu does for the pairs of a plan. @param cosines as `PlanItem` holds them
PlanItem judged(PlanView view, std::vector<double> cosines, const Plan& plan);

/// Puts the menu in its order, and says for each pair which item tells it best.
void choose(Plan& plan, std::vector<PlanItem> menu);

/// Two parameters that the planned test tells together only.
struct ParameterPair {
  std::size_t a = 0, b = 0;  ///< indices into the parameters
  double correlation = 0;
};
/// |correlation| > 0.9, strongest first.
std::vector<ParameterPair> correlated_parameters(const Plan& plan);

struct PlanOptions {
  double menu_s = 40;  ///< of all drives together: the menu is computed on the first part of longer ones
  std::vector<EffectPair> compared = {};  ///< pairs of which every item tells its cosine, alike or not
};

using PlanStep = std::function<void(const std::string&)>;

/// Noise of every output: by name where `known` tells, else 1 % of the RMS that the output has under the drives (the
/// largest among outputs of its unit, if it does not move itself).
/// @param assumed out, the outputs of the second kind
/// Status of the nominal simulation. UserError if nothing is known of an output in whose unit none moves.
Status plan_noise(const Plant& plant, std::vector<FitRecord> records, const std::map<std::string, double>& known,
                  Vector& std, std::vector<std::string>& assumed, std::string& message);

/// @param records drives, with weight_std (p) the noise of the mean of the repeats; y is not read
/// @param repeats of each drive, for the item of the menu that changes it
/// @param candidates every effect at every place of `plant`   @param step called with what is being computed
/// Status: outside_domain if the plant cannot follow the planned drives. Cost: one simulation of the drives for each
/// candidate, parameter and initial state, and for each of the half dozen drives of the menu.
Plan plan_test(const Plant& plant, const std::vector<FitRecord>& records, Index repeats,
               const std::vector<EffectCandidate>& candidates, const PlanOptions& options = {},
               const PlanStep& step = {});

struct SeparatingTest {
  std::string test;           ///< what differs, as in a view; empty if nothing of the menu separates them better
  double cosine = 0;          ///< there
  double planned_cosine = 0;  ///< under the drives given
};

/// The item of the menu in which two candidates that a record cannot tell apart differ most, both showing.
/// @param records as in plan_test, or those of a fit: y is not read
SeparatingTest separating_test(const Plant& plant, const std::vector<FitRecord>& records, const EffectCandidate& a,
                               const EffectCandidate& b);

}  // namespace wheelhop
