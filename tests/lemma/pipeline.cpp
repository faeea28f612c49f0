// What the steps of the pipeline owe each other.
#include "core/identify/pipeline.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/data/metrics.hpp"
#include "tests/support/systems.hpp"
#include "variants/inversion/sdi.hpp"
#include "variants/solver/levenberg_marquardt.hpp"
#include "variants/subspace/pi_moesp.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// Stable dynamic inversion that vouches for [first, last) alone and has `spoil` times random numbers in f at samples
/// before `first` - 300, where they are forgotten before `first`, and from `last` on.
class PartlyTrusted final : public InputReconstructor {
 public:
  PartlyTrusted(Index first, Index last, double spoil) : first_(first), last_(last), spoil_(spoil) {}
  std::string name() const override { return "partly_trusted"; }
  Reconstruction reconstruct(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef Bt, ConstMatrixRef Dt, ConstMatrixRef z,
                             ConstVectorRef noise_std) const override {
    Reconstruction found = sdi_->reconstruct(A, C, Bt, Dt, z, noise_std);
    Random random = numbers(411);
    for (Index k = 0; k < found.f.cols(); ++k)
      if (k < first_ - 300 || k >= last_) found.f.col(k) += spoil_ * random.normal(found.f.rows(), 1);
    found.first = first_;
    found.last = last_;
    return found;
  }

 private:
  Index first_, last_;
  double spoil_;
  std::shared_ptr<const InputReconstructor> sdi_ = make_sdi({.input_variance = 10});
};

}  // namespace

TEST_CASE("pipeline: no step is fitted to samples that the inversion does not vouch for") {
  const Index samples = 2400;
  Random random = numbers(410);
  const NonlinearModel truth = random_nonlinear(3, 2, 4, 1, random);
  const Matrix raw = random.normal(2, samples);
  const Matrix response = free_run(truth, raw, Vector::Zero(3)).y;
  Signal record;
  record.sample_time_s = 0.005;
  record.u = rms(raw).cwiseInverse().asDiagonal() * raw;
  record.y = rms(response).cwiseInverse().asDiagonal() * response;
  const auto subspace = make_pi_moesp({});
  const auto solver = make_levenberg_marquardt({});
  const auto passes_with = [&](Index first, Index last, double spoil) {
    const PartlyTrusted inversion(first, last, spoil);
    const Pieces pieces{
        *subspace, inversion, [](Index in, Index out) { return make_mlp(in, out, {.hidden_units = 4}); }, *solver, {}};
    Random guesses = numbers(412);
    return run_passes(record, {.order = 3, .passes = 2, .map_starts = 1, .map_iterations = 10}, pieces, guesses).passes;
  };
  const auto same_to = [&](double tolerance, const std::vector<Pass>& a, const std::vector<Pass>& b) {
    REQUIRE(a.size() == 2);
    REQUIRE(b.size() == 2);
    for (std::size_t i = 0; i < 2; ++i) {
      CAPTURE(i, a[i].message, b[i].message);
      REQUIRE(a[i].model.map);
      REQUIRE(b[i].model.map);
      CHECK(std::abs(a[i].map_residual - b[i].map_residual) <= tolerance * a[i].map_residual);
      CHECK(relative_difference(a[i].model.linear.A, b[i].model.linear.A) <= tolerance);
      CHECK(relative_difference(a[i].model.Bt, b[i].model.Bt) <= tolerance);
      CHECK(relative_difference(a[i].x0, b[i].x0) <= tolerance);
      CHECK((a[i].training_vaf - b[i].training_vaf).norm() <= tolerance * 100);
    }
  };
  const std::vector<Pass> whole = passes_with(0, samples, 0);
  same_to(0, passes_with(0, 2000, 0), passes_with(0, 2000, 5));
  same_to(1e-6, passes_with(400, samples, 0), passes_with(400, samples, 5));
  // A part of the record gives the model of the whole, and a state at its start from which the free run is as good.
  REQUIRE(whole.size() == 2);
  const std::vector<Pass> part = passes_with(400, 2000, 5);
  REQUIRE(part.size() == 2);
  REQUIRE(part[1].model.map);
  CHECK((part[1].training_vaf - whole[1].training_vaf).minCoeff() > -1);
}
