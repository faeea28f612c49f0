/// \file
/// Benchmarks beside peers.
#pragma once

namespace wheelhop::bench {

/// Registers the kernels and the whole linear identification beside SLICOT and LAPACK. Without their libraries: ours
/// alone is not compared, and nothing is registered.
void add_peers();

}  // namespace wheelhop::bench
