#include "variants/table.hpp"
#include "variants/subspace/pi_moesp.hpp"

namespace wheelhop {

const std::vector<Entry<SubspacePiece>>& subspace_table() {
  static const std::vector<Entry<SubspacePiece>> table = {table_entry<SubspacePiece, PiMoespOptions, make_pi_moesp>(
      "pi_moesp", "Verhaegen 1993; Haverkamp & Verhaegen 1997; eqs. (6)-(11)",
      "MOESP with past inputs as instruments, B and D by least squares on the simulated outputs")};
  return table;
}

}  // namespace wheelhop
