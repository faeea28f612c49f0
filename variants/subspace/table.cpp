#include "variants/table.hpp"
#include "variants/extra.hpp"
#include "variants/subspace/cva.hpp"
#include "variants/subspace/n4sid.hpp"
#include "variants/subspace/pi_moesp.hpp"
#include "variants/subspace/po_moesp.hpp"

namespace wheelhop {

const std::vector<Entry<SubspacePiece>>& subspace_table() {
  static const std::vector<Entry<SubspacePiece>> table = with_extra(
      {table_entry<SubspacePiece, PiMoespOptions, make_pi_moesp>(
           "pi_moesp", "Verhaegen 1993; Haverkamp & Verhaegen 1997; eqs. (6)-(11)",
           "MOESP with past inputs as instruments, B and D by least squares on the simulated outputs; stays unbiased "
           "where a nonlinearity feeds back"),
       table_entry<SubspacePiece, PoMoespOptions, make_po_moesp>(
           "po_moesp", "Verhaegen 1994",
           "MOESP with past inputs and outputs as instruments; for linear plants with noise: where a nonlinearity "
           "feeds "
           "back, past outputs are correlated with its force and are no valid instruments"),
       table_entry<SubspacePiece, N4sidOptions, make_n4sid>(
           "n4sid", "Van Overschee & De Moor 1996, figs. 4.6 and 4.8",
           "states from oblique projections on past inputs and outputs, with a rank decision; as po_moesp not valid "
           "where "
           "a nonlinearity feeds back"),
       table_entry<SubspacePiece, CvaOptions, make_cva>(
           "cva", "Larimore 1990",
           "canonical correlations of past and future; as po_moesp not valid where a nonlinearity feeds back")},
      extra_pieces().subspace);
  return table;
}

}  // namespace wheelhop
