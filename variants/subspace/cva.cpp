#include "variants/subspace/cva.hpp"

namespace wheelhop {
namespace {

class Cva final : public HankelEstimator {
 public:
  explicit Cva(const CvaOptions& options)
      : HankelEstimator(options.hankel, true), rank_tolerance_(options.rank_tolerance) {}
  std::string name() const override { return "cva"; }

 protected:
  ColumnSpace column_space(const HankelRq& rq) const override {
    // The rows of Q are orthonormal: along them the instruments are white, but for directions that are round-off.
    const Svd instruments = svd(rq.Rww());
    const Index used = used_directions(instruments.s, rank_tolerance_);
    Matrix outputs(rq.outputs(), rq.instruments() + rq.outputs());  // Y_future beyond [1; U_future]
    outputs << rq.R32(), rq.R33();
    const Svd future = svd(outputs);
    const Index kept = used_directions(future.s, rank_tolerance_);
    const Matrix basis = future.U.leftCols(kept);
    const Matrix along = rq.R32() * instruments.V.leftCols(used);
    const Matrix whitened = basis * future.s.head(kept).cwiseInverse().asDiagonal() * (basis.transpose() * along);
    return {whitened, basis * future.s.head(kept).asDiagonal() * basis.transpose(), used,
            instruments.s(0) / instruments.s(used - 1)};
  }

 private:
  double rank_tolerance_;
};

}  // namespace

std::unique_ptr<SubspaceEstimator> make_cva(const CvaOptions& options) { return std::make_unique<Cva>(options); }

}  // namespace wheelhop
