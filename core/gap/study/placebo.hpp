/// \file
/// Does the diagnosis name again what it has named, where that is the truth? A parametric bootstrap (Efron & Tibshirani
/// 1993, ch. 6) of the whole diagnosis.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "core/gap/diagnose.hpp"

namespace wheelhop {

/// The records of a set as a plant would have made them: the same drives, roles and repeats, outputs simulated from
/// rest in the equilibrium of the first sample, with Gaussian noise of the floor's size, and rounded to the lattice on
/// which those of the set lie. Where the set has repeats the noise has their density, channel by channel in 24 bands of
/// frequency; else it is white. Channels are independent.
/// @param floor of the set   @return no records where the plant does not follow a drive
RecordSet simulated_records(const Plant& plant, const RecordSet& set, const NoiseFloor& floor, Random& random);

struct Placebo {
  std::string why_not;  ///< nothing was simulated; empty otherwise
  Index runs = 0;
  Index same = 0;                   ///< runs that name what the diagnosis names, all of it and nothing else
  Index nothing = 0;                ///< runs that name nothing
  std::map<EffectAt, Index> names;  ///< how many runs name it
};

/// Calls work(i) for every i in [0, count), in any order, also several at once.
using ForAll = std::function<void(Index count, const std::function<void(Index)>& work)>;

/// Simulates the records from the answer's plant, again and again with other noise, and diagnoses them. For an answer
/// of no gap the runs that name something are false alarms. What no catalogue holds cannot be simulated.
/// @param repeat diagnoses a set, as the diagnosis itself was made   @param seed same seed, same runs, whatever for_all
/// does   @param for_all the loop over the runs
/// Cost: `runs` diagnoses.
Placebo placebo(const Diagnosis& diagnosis, const RecordSet& set, Index runs, std::uint64_t seed,
                const std::function<Diagnosis(const RecordSet&)>& repeat, const ForAll& for_all);

}  // namespace wheelhop
