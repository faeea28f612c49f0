#include "variants/subspace/pi_moesp.hpp"

namespace wheelhop {
namespace {

class PiMoesp final : public HankelEstimator {
 public:
  explicit PiMoesp(const PiMoespOptions& options) : HankelEstimator(options, false) {}
  std::string name() const override { return "pi_moesp"; }
};

}  // namespace

std::unique_ptr<SubspaceEstimator> make_pi_moesp(const PiMoespOptions& options) {
  return std::make_unique<PiMoesp>(options);
}

}  // namespace wheelhop
