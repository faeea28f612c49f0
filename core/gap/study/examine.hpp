/// \file
/// The three stages of a diagnosis under the magnifying glass: as delivered, re-tuned, with effect, each with its
/// errors on the held-out records and the profile of its gap.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/base/place.hpp"
#include "core/gap/evidence/envelope.hpp"
#include "core/gap/evidence/profile.hpp"
#include "core/gap/evidence/split.hpp"
#include "core/gap/evidence/tone.hpp"
#include "core/gap/study/ceiling.hpp"
#include "core/gap/where/locate.hpp"

namespace wheelhop {

struct StageExamination {
  bool ran = false;  ///< false if the plant cannot follow the held-out records; nothing else counts then
  PlantFit fit;      ///< of initial states alone
  std::vector<Trajectory> motion;
  GapProfile profile;
  Repeatability repeats;
  Drift drift;
  LineSplit lines;
  Tone tone;
};

inline constexpr std::array<const char*, 3> kStageNames = {"as_delivered", "retuned", "with_effect"};

struct Examination {
  bool held_out = true;            ///< false: there is no validation record, and the records are the fitted ones
  std::vector<std::string> names;  ///< of the records
  std::vector<FitRecord> records;  ///< held out
  double sample_time_s = 0;
  std::array<StageExamination, 3> stages;
  bool beyond_known = false;  ///< false without held-out records, without a gap, or where a stage did not run
  BeyondEnvelope beyond;      ///< of the step from the telling stage to the plant with the effect
  UnknownSignal unknown;      ///< at the place asked for, over the first record
  Trajectory unknown_motion;  ///< of the plant that it is missing in, over that record
  Matrix unknown_outputs;     ///< and what that plant simulates there, p x N
  Ceiling ceiling;            ///< there; `location` empty if it was not asked for
};

/// Number of the stage that tells most of what is missing: the re-tuned one, whose gap no parameter explains, or the
/// plant as delivered where re-tuning leaves next to nothing. -1 if neither has a gap.
int telling_stage(const Examination& examination);

struct ExamineOptions {
  double block_s = 2;
  Index draws = 2000;
  Index iterations = 12;
  Place ceiling = {};                  ///< place whose ceilings are wanted; empty: of none
  const StaticMap* map = nullptr;      ///< two inputs, one output: the family of the static map; not null if they are
  const Solver* map_solver = nullptr;  ///< of that map
};

/// @param plants as delivered, re-tuned, with effect   @param set which the diagnosis was made of   @param floor of it
/// @param bare the plant in which something is missing, and @param place where to reconstruct it; empty: nowhere
/// Cost: four to seven simulations of the held-out records a stage, one of the fitted ones, and ceiling_at. UserError
/// as fit_record.
Examination examine(const std::array<Plant, 3>& plants, const RecordSet& set, const NoiseFloor& floor,
                    const Plant& bare, const Place& place, const Solver& solver, const ExamineOptions& options,
                    Random& random);

}  // namespace wheelhop
