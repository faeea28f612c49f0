#include "variants/table.hpp"
#include "variants/extra.hpp"
#include "variants/inversion/devasia.hpp"
#include "variants/inversion/hou_patton.hpp"
#include "variants/inversion/sdi.hpp"

namespace wheelhop {

const std::vector<Entry<InversionPiece>>& inversion_table() {
  static const std::vector<Entry<InversionPiece>> table = with_extra(
      {table_entry<InversionPiece, SdiOptions, make_sdi>(
           "sdi", "stable dynamic inversion, Sec. 2.5, eqs. (18)-(21); read-outs after Anderson & Moore 1979, ch. 7",
           "Kalman filter on the system augmented by a random-walk input"),
       table_entry<InversionPiece, DevasiaOptions, make_devasia>(
           "devasia", "Devasia, Chen & Paden 1996",
           "stable non-causal inversion: squared down to as many outputs as unknown inputs, unstable zeros backward in "
           "time; takes all of the noise along"),
       table_entry<InversionPiece, HouPattonOptions, make_hou_patton>(
           "hou_patton", "Hou & Patton 1998",
           "unknown-input observer: the filter that assumes nothing of the input; one sample late without a direct "
           "term")},
      extra_pieces().inversion);
  return table;
}

}  // namespace wheelhop
