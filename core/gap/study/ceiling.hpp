/// \file
/// How far a gap could shrink at one place at all: by any signal there, and by a static map of the place's own motion,
/// which is what the paper's neural network can be.
#pragma once

#include <string>
#include <vector>

#include "core/base/place.hpp"
#include "core/gap/evidence/profile.hpp"
#include "core/model/static_map.hpp"

namespace wheelhop {

/// Shares of the gap on the held-out records, 1 - (J_after - 1) / (J_before - 1), over the inner nine tenths of each.
struct Ceiling {
  Place location;              ///< as asked for
  std::string why_not;         ///< there is none; empty where there is one
  double signal = 0;           ///< any signal at the place, one a record
  double static_map = 0;       ///< a map f(x, v) of travel and rate there, fitted on the training records
  std::vector<Vector> mapped;  ///< that map's force over each held-out record, N
};

/// Pieces that are handed in.
struct CeilingPieces {
  const StaticMap& map;        ///< the family: two inputs, one output
  const Solver& map_solver;    ///< of its inner parameters
  const Solver& plant_solver;  ///< of initial states
};

/// Both ceilings at a place.
///
/// Any signal: unknown_signal is applied to the plant, then that of what it leaves until this pays no more, and what
/// then still lies along the response g of the linearised plant is projected out, (I - g g^+) z. The floor is lowered
/// by the one channel's freedom in p that this takes.
///
/// Static map: the inner parameters by variable projection on those signals of the training records over travel and
/// rate of the place, in the motion of the plant under them (not the plant's own, in which a sharp law would be
/// smeared); the linear weights by the outputs of the training records. On the held-out records the map reads the
/// motion under their own unknown signal: a map in free run knows it less well, hence a ceiling. What is between the
/// two ceilings has memory or comes from outside.
/// @param bare plants in which something is missing (re-tuning may have bent one of them); for each share the best
/// @param location as unknown_signal; sensors and the time base have no motion of their own, and no ceiling
/// @param before of the held-out records, against which the shares count; none where it leaves a gap below 0.1
/// @param noise how the noise lies over frequency
/// Cost a plant: about twenty free runs a record, and the fit of the map to 3000 samples.
Ceiling ceiling_at(const std::vector<Plant>& bare, const std::vector<FitRecord>& fitted,
                   const std::vector<FitRecord>& held_out, const Place& location, const PlantFit& before,
                   const CeilingPieces& pieces, const ProfileOptions& noise, Random& random);

}  // namespace wheelhop
