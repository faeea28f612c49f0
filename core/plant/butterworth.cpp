#include "core/plant/butterworth.hpp"

#include <cmath>
#include <numbers>

namespace wheelhop {

std::vector<Biquad> butterworth_lowpass(Index order, double cutoff_hz, double rate_hz) {
  const double w = std::tan(std::numbers::pi * cutoff_hz / rate_hz);  // prewarped, in units of twice the rate
  std::vector<Biquad> sections;
  if (order % 2 == 1) sections.push_back({w / (1 + w), w / (1 + w), 0, (w - 1) / (w + 1), 0});
  for (Index k = 0; k < order / 2; ++k) {
    // Angle of the pole pair from the negative real axis; its quality is 1 / (2 cos).
    const double angle =
        std::numbers::pi * (static_cast<double>(2 * k + 1 + order % 2)) / static_cast<double>(2 * order);
    const double damping = 2 * std::cos(angle);
    const double scale = 1 / (1 + damping * w + w * w);
    const double b = w * w * scale;
    sections.push_back({b, 2 * b, b, 2 * (w * w - 1) * scale, (1 - damping * w + w * w) * scale});
  }
  return sections;
}

void filter(const std::vector<Biquad>& sections, VectorRef x) {
  for (const Biquad& s : sections) {
    double state_1 = 0, state_2 = 0;  // transposed direct form II
    for (Index i = 0; i < x.size(); ++i) {
      const double in = x(i);
      const double out = s.b0 * in + state_1;
      state_1 = s.b1 * in - s.a1 * out + state_2;
      state_2 = s.b2 * in - s.a2 * out;
      x(i) = out;
    }
  }
}

}  // namespace wheelhop
