#include "variants/table.hpp"
#include "variants/extra.hpp"
#include "variants/solver/ceres.hpp"
#include "variants/solver/ipopt.hpp"
#include "variants/solver/levenberg_marquardt.hpp"
#include "variants/solver/nlopt.hpp"
#include "variants/solver/secant_levenberg_marquardt.hpp"

namespace wheelhop {

const std::vector<Entry<SolverPiece>>& solver_table() {
  static const std::vector<Entry<SolverPiece>> table =
      with_extra({table_entry<SolverPiece, LevenbergMarquardtOptions, make_levenberg_marquardt>(
                      "levenberg_marquardt", "Levenberg 1944; Marquardt 1963; damping rule after Nielsen 1999",
                      "damped Gauss-Newton on the normal equations, scaled by diag(J'J)"),
                  table_entry<SolverPiece, SecantLevenbergMarquardtOptions, make_secant_levenberg_marquardt>(
                      "secant_levenberg_marquardt", "Broyden 1965; Levenberg 1944; Marquardt 1963",
                      "the same with a Jacobian carried along by secant updates, for costly Jacobians"),
                  table_entry<SolverPiece, CeresOptions, make_ceres>(
                      "ceres", "Ceres Solver: Agarwal, Mierle et al.",
                      "trust region on one residual block with the analytic Jacobian", ceres_unavailable),
                  table_entry<SolverPiece, IpoptOptions, make_ipopt>(
                      "ipopt", "Waechter & Biegler 2006", "interior point with the Gauss-Newton matrix as Hessian",
                      ipopt_unavailable),
                  table_entry<SolverPiece, NloptOptions, make_nlopt>(
                      "nlopt", "NLopt: Johnson",
                      "any of its local algorithms on the scalar cost, with or without gradient", nlopt_unavailable)},
                 extra_pieces().solver);
  return table;
}

}  // namespace wheelhop
