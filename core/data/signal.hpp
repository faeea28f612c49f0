/// \file
/// The value every method works on: a uniformly sampled multi-channel record.
#pragma once

#include <string>
#include <vector>

#include "core/base/linalg.hpp"
#include "core/data/output_limits.hpp"

namespace wheelhop {

struct Channel {
  std::string name;
  std::string unit;  ///< SI unit as text, "m/s^2"; empty if the file does not say
};

/// How the samples of a channel follow from those that were read, y_k = (1 - share_k) y(before_k) + share_k y(after_k),
/// where it was read less often than its file has samples. Nothing where every sample was read.
struct SlowChannel {
  std::vector<Index> before, after;  ///< N, samples that were read
  std::vector<double> share;         ///< N, 0 of readings that are repeated
  double samples = 1;                ///< a reading, in the mean
  bool lines = false;                ///< true: straight lines from reading to reading; false: readings are repeated
  bool operator==(const SlowChannel&) const = default;
};

/// Inputs and outputs on one time grid, one column a sample. Read-only by convention once loaded.
struct Signal {
  Matrix u;                            ///< m x N inputs
  Matrix y;                            ///< p x N outputs
  double sample_time_s = 0;            ///< > 0
  Index skip = 0;                      ///< leading samples left out of every score
  std::vector<Channel> inputs;         ///< m
  std::vector<Channel> outputs;        ///< p
  std::vector<SlowChannel> slow = {};  ///< p, see slow_channels.hpp; empty: every sample of all outputs was read
  OutputLimits limits = {};            ///< at which the outputs were cut off, where a method is to know it

  Index samples() const { return u.cols(); }
  Index input_count() const { return u.rows(); }
  Index output_count() const { return y.rows(); }
};

/// What a method reads of a record or of a part of it, borrowed.
struct SignalView {
  ConstMatrixRef u, y;  ///< m x N, p x N
  double sample_time_s;
  Index skip;  ///< leading samples left out of every score
  OutputLimits limits;

  SignalView(const Signal& signal) : SignalView(signal, signal.samples()) {}
  /// @param samples of the record's start, at most signal.samples()
  SignalView(const Signal& signal, Index samples)
      : u(signal.u.leftCols(samples)),
        y(signal.y.leftCols(samples)),
        sample_time_s(signal.sample_time_s),
        skip(signal.skip),
        limits(signal.limits) {}
};

}  // namespace wheelhop
