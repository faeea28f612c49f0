/// \file
/// What one core can do at most, measured.
#pragma once

namespace wheelhop::bench {

/// Fused multiply-adds in registers, in 10^9 floating-point operations a second, by the widest vectors there are.
double peak_gflops();

/// Bytes moved by a(i) = b(i) + s c(i) over arrays far larger than the caches, in 10^9 a second (McCalpin's triad).
double triad_gb_per_s();

}  // namespace wheelhop::bench
