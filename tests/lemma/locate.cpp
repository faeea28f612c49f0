// Where a gap enters, without a catalogue: the place of an unknown force leaves the noise, every other place more.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "core/gap/locate.hpp"
#include "core/plant/dataset.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/solver/levenberg_marquardt.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

std::vector<Place> places_of(const Plant& nominal, const Plant& truth) {
  const Index samples = 3000, ratio = 5;
  Random random = numbers(621);
  FitRecord record;
  record.drive.resize(nominal.input_count(), samples * ratio);
  Matrix poles = Matrix::Zero(nominal.input_count(), 4);
  for (Index k = 0; k < record.drive.cols(); ++k)
    for (Index i = 0; i < nominal.input_count(); ++i) {
      double value = random.normal();
      for (Index stage = 0; stage < 4; ++stage) value = poles(i, stage) += 0.06 * (value - poles(i, stage));
      record.drive(i, k) = 0.004 * value;  // a travel in which the spring is nearly linear
    }
  record.ratio = ratio;
  const GeneratedRecord made = generate_record(truth, record.drive, 200);
  REQUIRE(made.status == Status::ok);
  record.weight_std = 0.01 * made.signal.y.rowwise().norm() / std::sqrt(static_cast<double>(samples));
  record.y = made.signal.y + record.weight_std.asDiagonal() * random.normal(made.signal.y.rows(), samples);
  const PlantFit fit = fit_plant(nominal, {}, {record}, *make_levenberg_marquardt({}), {6});
  REQUIRE(fit.error.size() == 1);
  return locate(fit, {record});
}

}  // namespace

TEST_CASE("Lemma 3: a force missing between two masses, at the tyre or in a sensor is found at its own place") {
  const Plant nominal = plant_from(quarter_car_text);
  {
    Plant truth = nominal;
    truth.elements[0].laws.push_back({find_law("asymmetric_damper"), {850, 0.3}});
    const std::vector<Place> places = places_of(nominal, truth);
    REQUIRE(places.size() >= 5);
    CHECK(places[0].location == "suspension");
    CHECK(places[0].leftover < 3);  // 1, and what linearising and holding the force over a sample leave
    CHECK(places[1].leftover > 2 * places[0].leftover);
  }
  {
    Plant truth = nominal;
    set_parameter(truth, "actuator:road.gain", 1.08);
    const std::vector<Place> places = places_of(nominal, truth);
    CHECK(places[0].location == "tyre");
    CHECK(places[1].leftover > 2 * places[0].leftover);
    // The record cannot tell a tyre from what drives it, nor from the ground under the wheel.
    CHECK(std::find(places[0].same.begin(), places[0].same.end(), "actuator") != places[0].same.end());
    CHECK(std::find(places[0].same.begin(), places[0].same.end(), "guide:wheel") != places[0].same.end());
  }
  Plant truth = nominal;
  set_parameter(truth, "sensor:body_acc.gain", 1.1);
  const std::vector<Place> places = places_of(nominal, truth);
  CHECK(places[0].location == "sensor:body_acc");
  CHECK(places[0].leftover == Approx(1).epsilon(0.2));
}

TEST_CASE("in a chain of three masses the element is found among its neighbours") {
  const Plant nominal = plant_from(chain_text);
  for (std::size_t e = 0; e < nominal.elements.size(); ++e) {
    Plant truth = nominal;
    truth.elements[e].laws.push_back({find_law("viscous_damper"), {6}});
    const std::vector<Place> places = places_of(nominal, truth);
    CAPTURE(nominal.elements[e].name, places[0].location, places[0].leftover, places[1].location);
    CHECK(places[0].location == nominal.elements[e].name);
  }
}
