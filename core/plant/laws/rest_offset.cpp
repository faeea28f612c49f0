#include "core/plant/laws.hpp"

namespace wheelhop {

// No force of its own: `Motion` moves the point about which the other laws of the element work. What they pull with at
// rest there is carried by the load that moved it, so that the equilibrium stays where it was.
LawKind rest_offset() {
  LawKind kind;
  kind.name = "rest_offset";
  kind.equation = "the other laws give F(x + x_0) - F(x_0)";
  kind.source = "ride height: a load that the springs carry beyond the one for which travel is zero";
  kind.parameters = {
      {.name = "offset_m", .unit = "m", .meaning = "shift x_0 of the working point; 0.005 to 0.02 m", .typical = 0.01}};
  kind.role = LawRole::offset;
  return kind;
}

}  // namespace wheelhop
