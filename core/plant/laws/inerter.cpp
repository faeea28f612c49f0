#include "core/plant/laws.hpp"

namespace wheelhop {

// No force of its own: what it does depends on the accelerations that the forces give, and goes with the masses. It
// acts beside the other laws of its element, across their clearance and with its contact lifted too.
LawKind inerter() {
  LawKind kind;
  kind.name = "inerter";
  kind.equation = "F = b a, a the acceleration of the travel";
  kind.source = "M. C. Smith 2002, IEEE Trans. Automatic Control 47, 1648; fluid moved by a hydraulic mount";
  kind.parameters = {{.name = "inertance_kg",
                      .unit = "kg",
                      .meaning = "inertance b; of a hydraulic mount or an inerter in a strut 1 to 100 kg",
                      .range = {.low = 0},
                      .typical = 10}};
  kind.role = LawRole::inertance;
  return kind;
}

}  // namespace wheelhop
