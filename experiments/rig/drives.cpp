#include "experiments/rig/drives.hpp"

#include <cmath>

namespace wheelhop::blind {
namespace {

/// Lines of a drive without period: one in each of so many intervals a hertz.
constexpr double lines_per_hz = 16;

}  // namespace

const std::vector<std::string>& drive_names() {
  static const std::vector<std::string> names = {"multisine", "iso8608", "band_limited_10hz"};
  return names;
}

Command make_command(const DriveShape& shape, Random& random) {
  const bool periodic = shape.name == "multisine", flat = shape.name == "band_limited_10hz";
  const double from = flat ? 0.05 : shape.from_hz, to = flat ? 10 : shape.to_hz;
  const double spacing = periodic ? 1 / shape.period_s : 1 / lines_per_hz;
  Command command;
  double power = 0;
  for (double line = std::ceil(from / spacing - 1e-9); line * spacing <= to + 1e-9; ++line) {
    Cosine c;
    c.frequency_hz = spacing * (periodic ? line : line + random.uniform() - 0.5);
    c.amplitude = flat ? 1 : 1 / c.frequency_hz;
    c.phase = two_pi * random.uniform();
    power += 0.5 * c.amplitude * c.amplitude;
    command.push_back(c);
  }
  for (Cosine& c : command) c.amplitude *= shape.rms / std::sqrt(power);
  return command;
}

Vector sample_command(const Command& command, double start_s, double step_s, Index count) {
  using Array = Eigen::ArrayXd;
  const auto lines = static_cast<Index>(command.size());
  Array w(lines), phase(lines), amplitude(lines);
  for (Index i = 0; i < lines; ++i) {
    const Cosine& c = command[static_cast<std::size_t>(i)];
    w(i) = two_pi * c.frequency_hz;
    phase(i) = c.phase;
    amplitude(i) = c.amplitude;
  }
  const Array turn_re = (w * step_s).cos(), turn_im = (w * step_s).sin();
  Array angle(lines), re(lines), im(lines), next(lines);
  Vector values(count);
  // Phasors are set anew every so often: rounding of repeated products stays below 1e-13.
  constexpr Index stretch = 512;
  for (Index k = 0; k < count; ++k) {
    if (k % stretch == 0) {
      angle = w * (start_s + static_cast<double>(k) * step_s) + phase;
      re = amplitude * angle.cos();
      im = amplitude * angle.sin();
    }
    values(k) = re.sum();
    next = re * turn_re - im * turn_im;
    im = re * turn_im + im * turn_re;
    re = next;
  }
  return values;
}

}  // namespace wheelhop::blind
