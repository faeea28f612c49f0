#include "core/identify/pieces.hpp"

#include <algorithm>

namespace wheelhop {

Reconstruction without_delay(Reconstruction late) {
  const Index samples = late.f.cols(), delay = std::min(late.delay, samples);
  if (delay == 0) return late;
  const Matrix on_time = late.f.rightCols(samples - delay);
  late.f.leftCols(samples - delay) = on_time;
  if (delay < samples) late.f.rightCols(delay).colwise() = Vector(on_time.rightCols(1));
  late.first = std::max<Index>(late.first - delay, 0);
  late.last = std::max<Index>(late.last - delay, 0);
  late.delay = 0;
  return late;
}

}  // namespace wheelhop
