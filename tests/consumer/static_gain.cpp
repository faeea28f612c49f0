// A piece from outside the tree, as variants/extra.hpp describes it: the input that explains a residual if the plant
// had no dynamics, f = (Dt' R^-1 Dt)^-1 Dt' R^-1 z.
#include "variants/extra.hpp"

namespace {

using namespace wheelhop;

struct StaticGainOptions {
  double gain = 1;
  template <class V>
  void fields(V&& visit) {
    visit("gain", gain, Range{0, 10}, "-", "what f is multiplied by");
  }
};

class StaticGain final : public InputReconstructor {
 public:
  explicit StaticGain(const StaticGainOptions& options) : options_(options) {}
  std::string name() const override { return "static_gain"; }
  Reconstruction reconstruct(ConstMatrixRef, ConstMatrixRef, ConstMatrixRef, ConstMatrixRef Dt, ConstMatrixRef z,
                             ConstVectorRef noise_std) const override {
    Reconstruction result;
    if (!all_finite(z) || !all_finite(noise_std)) {
      result.status = Status::not_finite;
      result.message = "the residual or its noise is not finite";
      return result;
    }
    result.status = Status::rank_deficient;
    result.message = "the direct term has no full column rank";
    const LeastSquares fit =
        least_squares(noise_std.cwiseInverse().asDiagonal() * Dt, noise_std.cwiseInverse().asDiagonal() * z);
    if (fit.rank < Dt.cols()) return result;
    result.status = Status::ok;
    result.message.clear();
    result.f = options_.gain * fit.x;
    result.last = z.cols();
    return result;
  }

 private:
  StaticGainOptions options_;
};

InversionPiece make_static_gain(const StaticGainOptions& options) { return std::make_shared<StaticGain>(options); }

}  // namespace

void add_pieces_static_gain(wheelhop::ExtraPieces& extra) {
  extra.inversion.push_back(wheelhop::table_entry<InversionPiece, StaticGainOptions, make_static_gain>(
      "static_gain", "least squares", "the input of a plant without dynamics"));
}
