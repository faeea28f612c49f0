/// \file
/// Analytic forward sensitivities of the free run with respect to every parameter of a NonlinearModel.
#pragma once

#include <functional>
#include <vector>

#include "core/model/nonlinear.hpp"

namespace wheelhop {

/// Order of the parameters: A, B, Bt (column-major), x0, theta of the map, then those that touch the outputs only:
/// C, D, Dt (column-major), y0. The first group alone has state sensitivities.
struct ParameterLayout {
  Index n = 0, m = 0, p = 0, q = 0, map = 0;
  Index A() const { return 0; }
  Index B() const { return n * n; }
  Index Bt() const { return B() + n * m; }
  Index x0() const { return Bt() + n * q; }
  Index theta() const { return x0() + n; }
  Index dynamic() const { return theta() + map; }  ///< how many move the state
  Index C() const { return dynamic(); }
  Index D() const { return C() + p * n; }
  Index Dt() const { return D() + p * m; }
  Index y0() const { return Dt() + p * q; }
  Index size() const { return y0() + p; }

  /// [C D Dt y0] act on one output a row, with the same regressors [x; u; f; 1] for every output: parameter of output i
  /// and regressor j.
  Index direct(Index i, Index j) const { return C() + j * p + i; }
  Index regressors() const { return n + m + q + 1; }
};

ParameterLayout layout_of(const NonlinearModel& model);
Vector pack(const NonlinearModel& model, ConstVectorRef x0);
/// Overwrites the matrices of `model` and x0; the map is cloned, so other holders of it are not changed.
void unpack(ConstVectorRef parameters, NonlinearModel& model, Vector& x0);

/// A Jacobian row without its zeros, as a column: [dy_i/d(dynamic parameters); x; u; f; 1; y_i; zeros]. A receiver may
/// overwrite y_i by an error: one product then holds J'J, J'r and r'r.
struct SensitivityRow {
  explicit SensitivityRow(const ParameterLayout& at)
      : regressors(at.dynamic()), output(regressors + at.regressors()), size((output + 8) / 8 * 8) {}
  Index regressors, output;  ///< where they start
  Index size;                ///< a multiple of 8
};

/// Receives consecutive blocks of the free run: number of the first sample, samples K, and for each of the p outputs a
/// matrix whose first K columns are its rows (SensitivityRow).
using SensitivityBlock = std::function<void(Index first, Index count, std::vector<Matrix>& rows)>;

/// Free run with sensitivities  s_{k+1} = (A + Bt df/dx) s_k + d(x_{k+1})/d(parameters), handed out block by block so
/// that memory does not grow with N. An output beyond its limit stands there, and no parameter moves it. Returns false
/// if the run left the state guard (blocks seen so far are void). Cost O(N D (n + p) (n + q)) for D dynamic parameters.
bool free_run_sensitivities(const NonlinearModel& model, ConstMatrixRef u, ConstVectorRef x0,
                            const SensitivityBlock& receive);

}  // namespace wheelhop
