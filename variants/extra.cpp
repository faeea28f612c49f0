#include "variants/extra.hpp"

namespace wheelhop {

ExtraPieces& extra_pieces() {
  static ExtraPieces all;
  return all;
}

}  // namespace wheelhop
