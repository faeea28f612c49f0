#include "core/identify/surrogate_drives.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/random.hpp"

namespace wheelhop {
namespace {

/// Judgements: pieces long enough for slow modes to answer, enough of them for new sequences, two drawn drives.
constexpr Index kPieces = 8, kFade = 4, kDrawn = 2, kLongest = 16384, kShortest = 16;

SurrogateDrive reversed(ConstMatrixRef u) { return {u.rowwise().reverse(), u.cols() - 1}; }

SurrogateDrive drawn(ConstMatrixRef u, Random& random) {
  const Index N = u.cols(), piece = N / kPieces, fade = piece / kFade, places = N - piece - fade + 1;
  SurrogateDrive drive{Matrix(u.rows(), piece * kPieces), random.integer(places)};
  for (Index j = 0, from = drive.start; j < kPieces; ++j) {
    const Index next = j == 0 ? from : random.integer(places);
    drive.u.middleCols(j * piece, piece) = u.middleCols(next, piece);
    for (Index k = 0; j > 0 && k < fade; ++k) {
      const double share = static_cast<double>(k + 1) / static_cast<double>(fade + 1);
      drive.u.col(j * piece + k) = share * u.col(next + k) + (1 - share) * u.col(from + piece + k);
    }
    from = next;
  }
  return drive;
}

}  // namespace

std::vector<SurrogateDrive> surrogate_drives(ConstMatrixRef u) {
  if (u.cols() < kShortest) return {};
  const auto read = u.leftCols(std::min(u.cols(), kLongest));
  Random random(0, Stream::bootstrap);
  std::vector<SurrogateDrive> drives{reversed(read)};
  for (Index i = 0; i < kDrawn; ++i) drives.push_back(drawn(read, random));
  return drives;
}

double excursion(const NonlinearModel& model, ConstVectorRef x0, ConstMatrixRef u, ConstMatrixRef y) {
  constexpr double diverged = std::numeric_limits<double>::infinity();
  const std::vector<SurrogateDrive> drives = surrogate_drives(u);
  const Index read = std::min(u.cols(), kLongest);
  std::vector<Vector> starts(drives.size());
  if (free_run_in_blocks(model, u.leftCols(read), x0, [&](const FreeRunBlock& block) {
        for (std::size_t i = 0; i < drives.size(); ++i)
          if (const Index k = drives[i].start - block.first; k >= 0 && k < block.x.cols()) starts[i] = block.x.col(k);
      }) >= 0)
    return diverged;
  const Vector low = y.rowwise().minCoeff(), high = y.rowwise().maxCoeff(), range = high - low;
  double worst = 0;
  for (std::size_t i = 0; i < drives.size(); ++i)
    if (free_run_in_blocks(model, drives[i].u, starts[i], [&](const FreeRunBlock& block) {
          const Vector beyond = (block.y.rowwise().maxCoeff() - high).cwiseMax(low - block.y.rowwise().minCoeff());
          worst = std::max(worst, beyond.cwiseQuotient(range).maxCoeff());
        }) >= 0)
      return diverged;
  return std::isfinite(worst) ? worst : diverged;
}

}  // namespace wheelhop
