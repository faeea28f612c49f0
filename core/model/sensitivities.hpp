/// \file
/// Analytic forward sensitivities of the free run with respect to every parameter of a NonlinearModel.
#pragma once

#include <functional>

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
};

ParameterLayout layout_of(const NonlinearModel& model);
Vector pack(const NonlinearModel& model, ConstVectorRef x0);
/// Overwrites the matrices of `model` and x0; the map is cloned, so other holders of it are not changed.
void unpack(ConstVectorRef parameters, NonlinearModel& model, Vector& x0);

/// Receives consecutive blocks of the free run: first sample, y (p x K) and J (P x (p K); the column of output i at the
/// block's sample k is p k + i), the derivative of y with respect to the packed parameters.
using SensitivityBlock = std::function<void(Index first, ConstMatrixRef y, ConstMatrixRef J)>;

/// Free run with sensitivities  s_{k+1} = (A + Bt df/dx) s_k + d(x_{k+1})/d(parameters), handed out block by block so
/// that memory does not grow with N. Returns false if the run left the state guard (blocks seen so far are void).
/// Cost O(N P (n^2 + p n)).
bool free_run_sensitivities(const NonlinearModel& model, ConstMatrixRef u, ConstVectorRef x0,
                            const SensitivityBlock& receive);

}  // namespace wheelhop
