// Channels in another unit or of another sign than the plant's.
#include <catch2/catch.hpp>

#include "core/gap/evidence/scale.hpp"
#include "core/gap/verdict/scales.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

/// A plant's outputs as a rig reads them: each times its factor, and noise.
struct Reading {
  PlantFit fit;
  std::vector<FitRecord> records;
  Reading(const Vector& factors, double noise) {
    Random random = numbers(861);
    fit.plant = plant_from(quarter_car_text);
    const Vector level = (Vector(3) << 0.01, 2, 9).finished();
    const Matrix made = level.asDiagonal() * random.normal(3, 2000);
    const Matrix read = factors.asDiagonal() * (made + noise * (level.asDiagonal() * random.normal(3, 2000)));
    records.push_back({Matrix::Zero(1, 10000), read, 5, 100, Vector::Ones(3), {}});
    fit.error.push_back(made - read);
  }
  std::vector<WrongScale> wrong() const { return wrong_scales(fit, records); }
};

}  // namespace

TEST_CASE("a channel in another unit or of the wrong sign is told with its factor, gain errors and strangers are not") {
  for (const double factor : {1e-3, 0.102, 9.81, 1e12, -1.0, -0.102}) {
    CAPTURE(factor);
    const std::vector<WrongScale> wrong = Reading((Vector(3) << 1.2, factor, 0.9).finished(), 0.3).wrong();
    REQUIRE(wrong.size() == 1);
    CHECK(wrong[0].channel == "body_acc");
    CHECK(wrong[0].reads == Approx(factor).epsilon(0.05));
    CHECK_THAT(scale_message(wrong, 3), Contains("body_acc reads") && Contains("check unit and sign"));
  }
  CHECK(Reading((Vector(3) << 0.6, 1.0, 1.9).finished(), 0.3).wrong().empty());
  CHECK(Reading((Vector(3) << 1.0, 9.81, -1.0).finished(), 2).wrong().empty());  // they do not go with the plant
  CHECK(Reading((Vector(3) << 1.0, 0.0, 1.0).finished(), 0.3).wrong().empty());
  CHECK(scale_message({}, 3).empty());
}

TEST_CASE("where all channels are off alike the message is about the drive") {
  for (const double factor : {-1.0, 1000.0}) {
    const std::vector<WrongScale> wrong = Reading(Vector::Constant(3, factor), 0.1).wrong();
    REQUIRE(wrong.size() == 3);
    CHECK_THAT(scale_message(wrong, 3), Contains("the drive's unit and sign"));
  }
  const std::vector<WrongScale> all = Reading((Vector(3) << 1000.0, -1.0, 0.1).finished(), 0.1).wrong();
  REQUIRE(all.size() == 3);
  CHECK_THAT(scale_message(all, 3), !Contains("the drive's") && Contains("travel") && Contains("wheel_acc"));
}
