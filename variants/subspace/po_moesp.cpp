#include "variants/subspace/po_moesp.hpp"

namespace wheelhop {
namespace {

class PoMoesp final : public HankelEstimator {
 public:
  explicit PoMoesp(const PoMoespOptions& options) : HankelEstimator(options, true) {}
  std::string name() const override { return "po_moesp"; }
};

}  // namespace

std::unique_ptr<SubspaceEstimator> make_po_moesp(const PoMoespOptions& options) {
  return std::make_unique<PoMoesp>(options);
}

}  // namespace wheelhop
