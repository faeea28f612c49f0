#include "experiments/run/memory.hpp"

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace wheelhop {

void keep_freed_memory() {
#ifdef __GLIBC__
  // Judgements: more than the work of one record takes, and the largest threshold that glibc accepts.
  constexpr int kKept = 256 << 20, kSeparate = 32 << 20;
  mallopt(M_TRIM_THRESHOLD, kKept);
  mallopt(M_MMAP_THRESHOLD, kSeparate);
#endif
}

}  // namespace wheelhop
