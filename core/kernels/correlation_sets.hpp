/// \file
/// The functions behind add_correlations(), by instruction set; `count` is a multiple of 8.
#pragma once

#include <cstddef>

namespace wheelhop {

using PlainCorrelations = void(const double* const* fixed, std::ptrdiff_t fixed_count, const double* moving,
                               std::ptrdiff_t lags, std::ptrdiff_t count, double* sums);
using ExtendedCorrelations = void(const double* const* fixed, std::ptrdiff_t fixed_count, const double* moving,
                                  std::ptrdiff_t lags, std::ptrdiff_t count, double* high, double* low);

PlainCorrelations plain_avx2, plain_avx512, plain_portable;
ExtendedCorrelations extended_avx2, extended_avx512, extended_portable;

}  // namespace wheelhop
