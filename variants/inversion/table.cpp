#include "variants/table.hpp"
#include "variants/inversion/sdi.hpp"

namespace wheelhop {

const std::vector<Entry<InversionPiece>>& inversion_table() {
  static const std::vector<Entry<InversionPiece>> table = {table_entry<InversionPiece, SdiOptions, make_sdi>(
      "sdi", "stable dynamic inversion, Sec. 2.5, eqs. (18)-(21); read-outs after Anderson & Moore 1979, ch. 7",
      "Kalman filter on the system augmented by a random-walk input")};
  return table;
}

}  // namespace wheelhop
