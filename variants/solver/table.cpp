#include "variants/table.hpp"
#include "variants/solver/levenberg_marquardt.hpp"
#include "variants/solver/secant_levenberg_marquardt.hpp"

namespace wheelhop {

const std::vector<Entry<SolverPiece>>& solver_table() {
  static const std::vector<Entry<SolverPiece>> table = {
      table_entry<SolverPiece, LevenbergMarquardtOptions, make_levenberg_marquardt>(
          "levenberg_marquardt", "Levenberg 1944; Marquardt 1963; damping rule after Nielsen 1999",
          "damped Gauss-Newton on the normal equations, scaled by diag(J'J)"),
      table_entry<SolverPiece, SecantLevenbergMarquardtOptions, make_secant_levenberg_marquardt>(
          "secant_levenberg_marquardt", "Broyden 1965; Levenberg 1944; Marquardt 1963",
          "the same with a Jacobian carried along by secant updates, for costly Jacobians")};
  return table;
}

}  // namespace wheelhop
