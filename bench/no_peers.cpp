// A build without SLICOT or LAPACK times our kernels alone.
#include <cstdio>

#include "bench/against.hpp"

namespace wheelhop::bench {

void add_peers() {
  std::fputs("bench: without peers; they need the Debian packages libslicot-dev and libopenblas-serial-dev\n", stderr);
}

}  // namespace wheelhop::bench
