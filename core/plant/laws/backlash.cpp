#include "core/plant/laws.hpp"

namespace wheelhop {

// No force of its own: `Motion` takes the gap off the travel that the other laws of the element read. Their rate stays,
// so that springs keep an energy and dampers go on working inside the gap.
LawKind backlash() {
  LawKind kind;
  kind.name = "backlash";
  kind.equation = "the other laws read x - clamp(x, -b, b) for x";
  kind.source = "clearance of a joint in series with the springs of the element";
  kind.parameters = {{.name = "gap_m",
                      .unit = "m",
                      .meaning = "half the clearance, b; 0.00005 to 0.0005 m",
                      .range = {.low = 0},
                      .typical = 0.0002}};
  kind.role = LawRole::play;
  return kind;
}

}  // namespace wheelhop
