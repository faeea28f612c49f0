/// \file
/// Unknown-input observer (Hou & Patton 1998, "Optimal filtering for systems with unknown inputs", IEEE Trans.
/// Automatic Control 43), here with the direct term: with G = (Dt' R^-1 Dt)^-1 Dt' R^-1 and N R^(-1/2) Dt = 0, N
/// orthonormal,
///   x_(k+1|k) = (A - Bt G C) x_(k|k-1) + Bt G z_k + L N R^(-1/2) (z_k - C x_(k|k-1)),
///   f_k = G (z_k - C x_(k|k)),   x_(k|k) = x_(k|k-1) + M N R^(-1/2) (z_k - C x_(k|k-1)).
/// L and M are the gains of the Kalman filter of that system: N R^(-1/2) v and G v are uncorrelated by the choice of G.
/// No model of f is needed; the observer is the limit of the filtered stable dynamic inversion for Q_eta -> infinity.
///
/// Without a direct term the same holds for z_(k+1) = C A x_k + C Bt f_k + v_(k+1): f_k is known one sample late.
///
/// It exists if (1) Dt, or C Bt where Dt is zero, has rank q, and (2) the system has no zero on or outside the unit
/// circle. Where either fails, the status says which, with the numbers.
#pragma once

#include <memory>

#include "core/base/options.hpp"
#include "core/identify/pieces.hpp"

namespace wheelhop {

struct HouPattonOptions {
  double rank_tolerance = 1e-6;
  template <class V>
  void fields(V&& visit) {
    visit("rank_tolerance", rank_tolerance, Range{1e-15, 1}, "-",
          "singular values of the whitened direct term below it times the norm of [C, Dt] count as zero");
  }
};

std::unique_ptr<InputReconstructor> make_hou_patton(const HouPattonOptions& options);

}  // namespace wheelhop
