/// \file
/// The fast screen: which effect could explain what a fitted plant leaves, by one simulation each.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/gap/which/effect.hpp"

namespace wheelhop {

struct Screened {
  std::size_t candidate = 0;  ///< index into the list asked about
  double gain = 0;            ///< expected fall of the cost 1/2 r'r; 0 where the candidate cannot be simulated
  double strength = 0;        ///< least-squares strength, in units of the candidate's typical size
  Vector retuning;            ///< by how much the base's parameters would follow an effect of typical size, in scales
  std::vector<InitialState> initial_states = {};  ///< of the first records, where known better than by the base
};

/// What candidates change, seen in one screen and good enough for the next: a second effect is looked for in what the
/// first one leaves, with regressors of the plant without it. Keys as of keys_of().
using Changes = std::map<std::string, Eigen::VectorXf>;
/// Effect, location, form, and number among candidates that share these.
std::vector<std::string> keys_of(const std::vector<EffectCandidate>& candidates);

/// For each candidate the change c of the residual that its typical size makes, from the states of the base fit; what
/// re-tuning could do as well is projected out: s = c'c - c'J (J'J + P)^-1 J'c, strength = -c'r / s, gain = (c'r)^2 /
/// (2 s). Candidates whose size is not proportional, or is one-sided, gain nothing with a negative strength. Of a
/// proportional one whose change is larger than twice the residual, that of a size at which it is as large is asked as
/// well, and taken where it gains more.
/// @param base of fit_plant, over the same records   @return in descending order of gain
/// Cost: one simulation of every record a candidate, shared out over the threads.
/// @param known changes that are taken from there instead of from simulations
/// @param found if given, those that were simulated
std::vector<Screened> screen(const PlantFit& base, const std::vector<FitRecord>& records,
                             const std::vector<EffectCandidate>& candidates, const Changes& known = {},
                             Changes* found = nullptr);

}  // namespace wheelhop
