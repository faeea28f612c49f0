#include "core/identify/surrogate_drives.hpp"

#include <algorithm>
#include <limits>

#include "core/base/random.hpp"
#include "core/identify/judgements.hpp"

namespace wheelhop {
namespace {

constexpr Index kFade = 4;         // of a piece, over which it goes over into the next one
constexpr Index kLongest = 16384;  // samples that are read: a bound on the time
constexpr Index kShortest = 16;    // samples of a piece

/// Where the part of a record that is read begins: at the one of largest variance, of those that overlap by half.
Index liveliest(ConstMatrixRef u) {
  Index best = 0;
  double most = -1;
  for (Index first = 0; u.cols() > kLongest && first + kLongest <= u.cols(); first += kLongest / 2) {
    const auto part = u.middleCols(first, kLongest);
    const double variance = (part.colwise() - Vector(part.rowwise().mean())).squaredNorm();
    if (!(variance > most)) continue;
    most = variance;
    best = first;
  }
  return best;
}

SurrogateDrive reversed(ConstMatrixRef u) { return {u.rowwise().reverse(), u.cols() - 1}; }

SurrogateDrive drawn(ConstMatrixRef u, Random& random) {
  const Index N = u.cols(), piece = N / kJudged.drive_pieces, fade = std::max<Index>(1, piece / kFade),
              places = N - piece - fade + 1;
  SurrogateDrive drive{Matrix(u.rows(), piece * kJudged.drive_pieces), random.integer(places)};
  for (Index j = 0, from = drive.start; j < kJudged.drive_pieces; ++j) {
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
  const Index first = liveliest(u);
  const auto read = u.middleCols(first, std::min(u.cols(), kLongest));
  Random random(0, Stream::bootstrap);
  std::vector<SurrogateDrive> drives{reversed(read)};
  for (Index i = 0; i < kJudged.drawn_drives; ++i) drives.push_back(drawn(read, random));
  for (SurrogateDrive& drive : drives) drive.start += first;
  return drives;
}

std::vector<Matrix> surrogate_outputs(const NonlinearModel& model, ConstVectorRef x0, ConstMatrixRef u) {
  const std::vector<SurrogateDrive> drives = surrogate_drives(u);
  std::vector<Vector> starts(drives.size());
  const auto seen = [&](const FreeRunBlock& block) {
    for (std::size_t i = 0; i < drives.size(); ++i)
      if (const Index k = drives[i].start - block.first; k >= 0 && k < block.x.cols()) starts[i] = block.x.col(k);
  };
  if (free_run_in_blocks(model, u, x0, seen) >= 0) return {};
  std::vector<Matrix> outputs;
  for (std::size_t i = 0; i < drives.size(); ++i) {
    FreeRun run = free_run(model, drives[i].u, starts[i]);
    if (run.status != Status::ok || !all_finite(run.y)) return {};
    outputs.push_back(std::move(run.y));
  }
  return outputs;
}

double excursion(const NonlinearModel& model, ConstVectorRef x0, ConstMatrixRef u, ConstMatrixRef y) {
  const std::vector<Matrix> outputs = surrogate_outputs(model, x0, u);
  if (outputs.empty()) return u.cols() < kShortest ? 0 : std::numeric_limits<double>::infinity();
  const Vector low = y.rowwise().minCoeff(), high = y.rowwise().maxCoeff(), range = high - low;
  double worst = 0;
  for (const Matrix& output : outputs) {
    const Vector beyond = (output.rowwise().maxCoeff() - high).cwiseMax(low - output.rowwise().minCoeff());
    worst = std::max(worst, beyond.cwiseQuotient(range).maxCoeff());
  }
  return worst;
}

}  // namespace wheelhop
