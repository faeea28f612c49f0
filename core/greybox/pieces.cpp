#include "core/greybox/pieces.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/data/slow_channels.hpp"
#include "core/plant/linearise.hpp"

namespace wheelhop {
namespace {

// Judgements, see `piece_samples`.
constexpr double kIntegrates = 1;                         // of |s| T
constexpr double kSettles = 4.6;                          // e-folds to 1 %
constexpr Index kMost = 4, kLeast = 32, kOtherwise = 16;  // of the longest record
constexpr Index kFewest = 64;                             // samples

Index samples_of(const Record& record) { return record.signal.samples() - record.signal.skip; }

}  // namespace

Index piece_samples(const Plant& plant, const RecordSet& set) {
  Index longest = 0;
  for (const Record& record : set.records) longest = std::max(longest, samples_of(record));
  const LinearPlant model = linearise(plant);
  if (longest < kMost * kFewest || model.A.size() == 0) return 0;
  const double record_s = static_cast<double>(longest) / set.sampling_hz;
  bool integrates = false;
  double settles = 0;  // 1/s
  for (const std::complex<double>& pole : eigenvalues(model.A)) {
    if (std::abs(pole) * record_s < kIntegrates)
      integrates = true;
    else if (pole.real() < 0)
      settles = settles == 0 ? -pole.real() : std::min(settles, -pole.real());
  }
  if (!integrates) return 0;
  const Index wanted =
      settles > 0 ? static_cast<Index>(std::min(kSettles / settles * set.sampling_hz, 1e9)) : longest / kOtherwise;
  return std::max(std::clamp(wanted, longest / kLeast, longest / kMost), kFewest);
}

RecordSet in_pieces(RecordSet set, Index samples) {
  if (samples <= 0) return set;
  std::vector<Record> pieces;
  for (const Record& whole : set.records) {
    const Index count = std::max<Index>(samples_of(whole) / samples, 1), all = samples_of(whole);
    for (Index k = 0; k < count; ++k) {
      // The first one keeps the samples that no score counts.
      const Index begin = k == 0 ? 0 : whole.signal.skip + k * all / count,
                  end = whole.signal.skip + (k + 1) * all / count;
      Record piece = whole;
      piece.signal.u = whole.signal.u.middleCols(begin, end - begin);
      piece.signal.y = whole.signal.y.middleCols(begin, end - begin);
      if (k > 0) piece.signal.skip = 0;
      if (k > 0) piece.start = {};
      piece.continues = k > 0;
      piece.signal.slow = part_of(whole.signal.slow, begin, end - begin);
      piece.first += begin;
      piece.rows = end - begin;
      const std::string number = fmt::format("#{}", k + 1);
      piece.repeat_of = (whole.repeat_of.empty() ? whole.file : whole.repeat_of) + number;
      if (count > 1)
        piece.file += fmt::format(", {:.4g} to {:.4g} s", static_cast<double>(begin) / set.sampling_hz,
                                  static_cast<double>(end) / set.sampling_hz);
      pieces.push_back(std::move(piece));
    }
  }
  set.records = std::move(pieces);
  return set;
}

}  // namespace wheelhop
