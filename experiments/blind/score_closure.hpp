/// \file
/// How much of a gap an answer truly removes: its plants simulated against noise-free records of the truth.
#pragma once

#include <filesystem>

#include "core/data/records.hpp"
#include "core/plant/plant.hpp"
#include "experiments/blind/score_case.hpp"

namespace wheelhop::scoring {

/// Mean of (yhat - y)^2 over floor^2 on records without noise, 0 for the truth itself; initial states are fitted. The
/// first eighth of a record does not count: where a law jumps, no fit finds the state in which the record began.
/// Infinity where a simulation fails. @param floor p, standard deviation of the noise in the blind records
double noise_free_misfit(const Plant& plant, const std::vector<const Record*>& records, ConstVectorRef floor);

/// Sets `true_closure` = 1 - misfit(answer) / misfit(re-tuned) over the records of `truth`/records.json, and
/// `beyond_closure` over those of them whose file name begins with "beyond": drives beyond the envelope of the blind
/// records. An answer that is an error or absent closes nothing, 0. Leaves them empty where the truth has no such
/// records or a diagnosis no plants. UserError for mistakes in the plant files and records.
void measure_closure(Judged& judged, const std::filesystem::path& answers, const std::filesystem::path& truth);

}  // namespace wheelhop::scoring
