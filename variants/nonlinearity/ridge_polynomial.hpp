/// \file
/// Polynomial of one direction, a ridge function: phi_k = T_k(alpha'xi), T_k the Chebyshev polynomials of degree 2
/// (odd: 3) and up; the constant is b and the linear term belongs to the linear system. Hardening: phi_k = s^k with
/// W >= 0, an element that only stiffens (absolutely monotone, Bernstein 1928; f and s may be taken negative).
#pragma once

#include "core/base/options.hpp"
#include "core/model/static_map.hpp"

namespace wheelhop {

struct RidgePolynomialOptions {
  Index degree = 7;
  bool odd = false;
  bool hardening = false;
  template <class V>
  void fields(V&& visit) {
    visit("degree", degree, Range{3, 60}, "-", "highest power");
    visit("odd", odd, "odd powers alone: an element that pushes as it pulls");
    visit("hardening", hardening, "plain powers, none with a negative weight: an element that only stiffens");
  }
};

/// alpha (d values) is scaled so that |alpha'xi| <= 1 on the data. Beyond 1.5 the polynomial goes on as its tangent.
std::unique_ptr<StaticMap> make_ridge_polynomial(Index inputs, Index outputs, const RidgePolynomialOptions& options);

}  // namespace wheelhop
