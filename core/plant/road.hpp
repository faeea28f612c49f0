/// \file
/// Drives: what moves the road (or pushes a mass). Made for displacement inputs and usable for forces as well: levels
/// (`rms`, `amplitude`, `height`) are in the unit of the input. All are made at the hold rate of the plant, with
/// `lead` samples before the record in which the plant settles.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "core/base/options.hpp"
#include "core/base/random.hpp"

namespace wheelhop {

/// White Gaussian noise through a Butterworth low-pass.
struct BandLimitedNoise {
  double rms = 0.0155;
  double cutoff_hz = 10;
  Index order = 8;
  template <class V>
  void fields(V&& visit) {
    visit("rms", rms, Range{0, 1e9}, "unit of the input", "root mean square of the record, met exactly");
    visit("cutoff_hz", cutoff_hz, Range{1e-3, 1e6}, "Hz", "frequency of 3 dB loss of the low-pass");
    visit("order", order, Range{1, 16}, "-", "order of the Butterworth low-pass");
  }
};

/// Periodic sum of cosines with random phases on chosen lines of 1 / period.
struct Multisine {
  double rms = 0.0155;
  double from_hz = 0.1;
  double to_hz = 30;
  double period_s = 20;
  bool odd_lines_only = true;
  Index detection_group = 4;
  double slope = 0;
  template <class V>
  void fields(V&& visit) {
    visit("rms", rms, Range{0, 1e9}, "unit of the input", "root mean square of one period, met exactly");
    visit("from_hz", from_hz, Range{0, 1e6}, "Hz", "lowest excited frequency");
    visit("to_hz", to_hz, Range{1e-3, 1e6}, "Hz", "highest excited frequency");
    visit("period_s", period_s, Range{1e-3, 1e5}, "s", "period; a whole number of hold intervals");
    visit("odd_lines_only", odd_lines_only, "leave the even lines empty: what fills them is an even nonlinearity");
    visit("detection_group", detection_group, Range{0, 1000}, "-",
          "one random line of each group of so many stays empty to show odd nonlinearities; 0: none, at least 2");
    visit("slope", slope, Range{-4, 4}, "-", "amplitudes fall as frequency to the power -slope");
  }
};

/// Sine whose frequency moves from one end of a band to the other over the record.
struct Sweep {
  double amplitude = 0.01;
  double from_hz = 0.5;
  double to_hz = 20;
  std::string progress = "logarithmic";
  template <class V>
  void fields(V&& visit) {
    visit("amplitude", amplitude, Range{0, 1e9}, "unit of the input", "peak value");
    visit("from_hz", from_hz, Range{1e-3, 1e6}, "Hz", "frequency at the start of the record");
    visit("to_hz", to_hz, Range{1e-3, 1e6}, "Hz", "frequency at its end");
    visit("progress", progress, Choices{{"linear", "logarithmic"}}, "how the frequency moves");
  }
};

/// Random road of ISO 8608: Gd(n) = Gd(n0) (n / n0)^-2, Gd(n0) = 16e-6 * 4^k m^3 for class A (k = 0) to H (k = 7).
struct Iso8608 {
  std::string road_class = "C";
  double speed_m_per_s = 20;
  double from_cycles_per_m = 0.01;
  double to_cycles_per_m = 10;
  template <class V>
  void fields(V&& visit) {
    visit("class", road_class, Choices{{"A", "B", "C", "D", "E", "F", "G", "H"}}, "road class of ISO 8608");
    visit("speed_m_per_s", speed_m_per_s, Range{0.1, 200}, "m/s", "speed of the vehicle");
    visit("from_cycles_per_m", from_cycles_per_m, Range{1e-4, 100}, "1/m", "longest wave, as spatial frequency");
    visit("to_cycles_per_m", to_cycles_per_m, Range{1e-4, 100}, "1/m", "shortest wave, as spatial frequency");
  }
};

/// One haversine hump: height/2 (1 - cos(2 pi s / length)).
struct Bump {
  double height = 0.05;
  double length_m = 1;
  double speed_m_per_s = 5;
  double start_s = 1;
  template <class V>
  void fields(V&& visit) {
    visit("height", height, Range{-1e9, 1e9}, "unit of the input", "height of the hump");
    visit("length_m", length_m, Range{1e-3, 1e4}, "m", "length of the hump");
    visit("speed_m_per_s", speed_m_per_s, Range{0.01, 200}, "m/s", "speed at which it is crossed");
    visit("start_s", start_s, Range{0, 1e6}, "s", "time of the record at which it begins");
  }
};

/// Random steps, as of the voltage of a damper that is set from outside: levels drawn evenly from low to high, each
/// held for a while. With hold_s as long as the record it is one level.
struct Steps {
  double low = 0;
  double high = 1;
  double hold_s = 1;
  template <class V>
  void fields(V&& visit) {
    visit("low", low, Range{-1e9, 1e9}, "unit of the input", "lowest level");
    visit("high", high, Range{-1e9, 1e9}, "unit of the input", "highest level; \"low\" for a constant");
    visit("hold_s", hold_s, Range{1e-3, 1e6}, "s", "time for which each level is held");
  }
};

using DriveOptions = std::variant<BandLimitedNoise, Multisine, Sweep, Iso8608, Bump, Steps>;

/// What `wheelhop list` shows of one generator.
struct DriveEntry {
  std::string name, source;
  std::vector<OptionInfo> options;
};
std::vector<DriveEntry> drive_table();

/// Reads `{"name": GENERATOR, OPTION: value, ...}`. UserError on unknown names and on what the hold rate cannot carry
/// (frequencies from half the hold rate on, a period of no whole number of intervals), or a road for an input that is
/// not in metres. @param unit of the input
DriveOptions parse_drive(const JsonCursor& cursor, double hold_hz, const std::string& unit);
Json to_json(const DriveOptions& options);

struct Drive {
  Vector values;  ///< lead + samples, at the hold rate
  /// Lines of 1 / period of a multisine (line 1 = one cycle a period); empty for other drives.
  std::vector<Index> excited_lines, odd_detection_lines, even_detection_lines;
  Index period_samples = 0;  ///< of a multisine; 0 for other drives
};

/// A drive at `hold_hz`. `lead` samples come first: noise and road simply begin earlier, a multisine is continued
/// backwards, sweep and bump stand at zero, steps at their first level.
/// Cost: O(lead + samples) (noise, sweep, bump, steps), O(period * lines) (multisine), one FFT (road).
Drive make_drive(const DriveOptions& options, double hold_hz, Index lead, Index samples, Random& random);

}  // namespace wheelhop
