/// \file
/// From evidence to a verdict: pure, without simulation, in microseconds.
///
/// The decision table. Rows are tried from the top; the first whose condition holds gives the answer. Words in italics
/// of the columns are thresholds (see thresholds.hpp); chi2 counts over the noise's colour where it is compared with
/// `notice`; the gap left is the re-tuned plant's reduced chi-square - 1. `too_small` is `negligible` of posterior.hpp.
///
/// | row | condition                                                                          | answer         |
/// |-----|------------------------------------------------------------------------------------|----------------|
/// | 0   | the plant cannot follow the drives, or two channels are exchanged                  | Insufficient   |
/// | 1   | no candidate gains `notice`, no parameter `out_of_tolerance`^2, and                |                |
/// | 1a  |   gap left <= `too_small`, and one parameter stands out (P > `stands_out`), alone  | Parameters     |
/// | 1b  |   a converter's rounding makes `rounded` of the floor                              | Rounding       |
/// | 1c  |   gap left <= `too_small`                                                          | NoGap          |
/// | 1d  |   otherwise                                                                        | row 4          |
/// | 2   | a parameter is the most probable, and of those at the head of the ranking, down to |                |
/// |     | `considered`, the first with which                                                 |                |
/// | 2a  |   free the gap closes, all others within `not_home`                                | Parameters     |
/// | 2b  |   otherwise, and no effect alone closes the gap                                    | row 4          |
/// | 3   | an effect is the most probable; sets grow from it as long as another effect        |                |
/// |     | removes `grows` of what is left; named is the largest set of which each effect     |                |
/// |     | removes `second` of what the others leave; of what may be the error of a form      |                |
/// |     | (at most `worth_second` of the gap, entering at its place, and bending nothing     |                |
/// |     | elsewhere by `not_home`) further effects have to                                   |                |
/// |     | leave less than `of_rest`, and count only at other places, or if one is elastic    |                |
/// |     | and the other dissipative, or where less than `of_rest`^2 is left; then            |                |
/// | 3a  |   a defining size is odd, but the effect explains the gap (`explains_well`)        | AtPlace, there |
/// | 3b  |   it explains too little, its place is wrong, or its size odd; and                 |                |
/// |     |   gap left <= `too_small`, no parameter bent beyond `out_of_tolerance`             | NoGap          |
/// | 3c  |   likewise, it is quantisation, and a converter's rounding is seen                 | Rounding       |
/// | 3d  |   likewise, otherwise                                                              | row 4          |
/// | 3e  |   otherwise                                                                        | Effects        |
/// | 3f  |   likewise, and one parameter is wrong beside it (P > `stands_out`), with which    | Effects and a  |
/// |     |   free all others lie within `not_home`, but for those of an element where an      | parameter      |
/// |     |   effect acts, which the error of its form bends                                   |                |
/// | 4   | something unknown, at the place where an unknown signal explains most, and         |                |
/// | 4a  |   one channel alone: no place is told                                              | Insufficient   |
/// | 4b  |   two places explain all, one does not                                             | AtTwoPlaces    |
/// | 4c  |   it acts on a mass, and nothing that moves explains it                            | Exogenous      |
/// | 4d  |   otherwise, at the entry whose motion explains most of it                         | AtPlace        |
/// | 5   | gross faults of instruments were corrected: they are named before the answer of    | Instruments    |
/// |     | rows 1 to 4, and are the answer where these have no name                           |                |
#pragma once

#include "core/gap/verdict/thresholds.hpp"
#include "core/gap/verdict/verdict.hpp"

namespace wheelhop {

Verdict decide(const Evidence& evidence, const Thresholds& thresholds = {});

/// Row 4 alone, for an answer that was withdrawn. @param verdict what is known of suspects so far
Verdict decide_place(const Evidence& evidence, const Thresholds& thresholds, Verdict verdict);
/// Rows 1b and 3b: the number of the lattice whose rounding makes most of the floor; -1 for none.
Index rounding_seen(const Evidence& evidence, const Thresholds& thresholds);
/// The answer of rounding there.
Verdict decide_rounding(const Evidence& evidence, const Thresholds& thresholds, std::size_t lattice, Verdict verdict);
/// Locations by the sum of the probabilities that speak for each, at most `limit`, in descending order.
std::vector<LocationProbability> locations_of(const std::vector<std::pair<Place, double>>& speaking, double limit);

}  // namespace wheelhop
