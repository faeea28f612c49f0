/// \file
/// Full multivariate polynomial of a total degree, the nonlinearity of polynomial nonlinear state-space models (PNLSS:
/// Paduart, Lauwers, Swevers, Smolders, Schoukens & Pintelon 2010, Automatica 46): all products of powers of the d
/// inputs of total degree 2 to D; constant and linear terms are b and the linear system's. As basis of that space stand
/// products of the Hermite polynomials He_a(xi_j) / sqrt(a!), orthonormal for independent Gaussian inputs of unit
/// variance: plain powers would be nearly collinear.
#pragma once

#include "core/base/options.hpp"
#include "core/model/static_map.hpp"

namespace wheelhop {

struct PolynomialOptions {
  Index degree = 3;
  bool odd = false;
  template <class V>
  void fields(V&& visit) {
    visit(
        "degree", degree, Range{2, 15}, "-",
        "highest total degree D; (d + D)! / (d! D!) - d - 1 terms, 50 for five inputs and degree 3, 246 for degree 5");
    visit("odd", odd, "terms of odd total degree alone");
  }
};

/// UserError if the polynomial has more than 5000 terms.
std::unique_ptr<StaticMap> make_polynomial(Index inputs, Index outputs, const PolynomialOptions& options);

/// How many terms such a polynomial has; infinity beyond the range of a double.
double polynomial_terms(Index inputs, const PolynomialOptions& options);

}  // namespace wheelhop
