#include "core/plant/laws.hpp"

namespace wheelhop {

// No force of its own: `Motion` bounds the sum of the other laws of the element.
LawKind liftoff() {
  LawKind kind;
  kind.name = "liftoff";
  kind.equation = "sum of the other laws <= static load";
  kind.source = "a tyre presses on the road and cannot pull";
  kind.parameters = {{.name = "static_load_n",
                      .unit = "N",
                      .meaning = "load at rest, of which travel x > 0 relieves the element [road, wheel]; 3000 to "
                                 "5000 N, the weight above the tyre",
                      .range = {.low = 0},
                      .typical = 4000}};
  kind.role = LawRole::contact;
  return kind;
}

}  // namespace wheelhop
