// Where a gap lies: an error made in one band, one stretch of time or one working range is found there and nowhere
// else.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "core/gap/evidence/envelope.hpp"
#include "core/gap/evidence/profile.hpp"
#include "core/plant/dataset.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/solver/levenberg_marquardt.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

constexpr Index kLong = 6000, kStepsEach = 5, kSkip = 200;
constexpr double kT = 0.005;

/// A run whose error is white noise of the floor's size and `added` (in floors), the motion a slow swing of all
/// elements.
struct ProfileCase {
  PlantFit fit;
  std::vector<FitRecord> records;
  std::vector<Trajectory> motion;
  ProfileOptions options;

  explicit ProfileCase(std::uint64_t cell, Index count = 1) {
    Random random = numbers(cell);
    fit.plant = plant_from(quarter_car_text);
    const Vector floor = (Vector(3) << 1e-4, 0.02, 0.3).finished();
    for (Index i = 0; i < count; ++i) {
      records.push_back({Matrix::Zero(1, kLong * kStepsEach),
                         20 * floor.asDiagonal() * random.normal(3, kLong),
                         kStepsEach,
                         kSkip,
                         floor,
                         {}});
      fit.error.push_back(floor.asDiagonal() * random.normal(3, kLong));
      Trajectory swing;
      swing.travel.resize(2, kLong);
      swing.rate.resize(2, kLong);
      for (Index k = 0; k < kLong; ++k) {
        const double angle = 2 * std::numbers::pi * 0.37 * kT * static_cast<double>(k);
        swing.travel.col(k) << 0.02 * std::sin(angle), 0.001 * std::sin(5.3 * angle);
        swing.rate.col(k) << 0.05 * std::cos(angle), 0.01 * std::cos(5.3 * angle);
      }
      motion.push_back(swing);
    }
    options.band_edges_hz = {0, 0.5, 3, 8, 20, 100};
  }
  void add(Index channel, Index k, double floors) {
    fit.error[0](channel, k) += floors * records[0].weight_std(channel);
  }
  GapProfile found() const { return profile(fit, records, motion, options); }
};

template <class Part>
void check_sums(const std::vector<Part>& parts, double gap) {
  double shares = 0, excesses = 0;
  for (const Part& part : parts) {
    CHECK(part.share >= 0);
    shares += part.share;
    excesses += part.excess;
  }
  CHECK(shares == Approx(1));
  CHECK(excesses == Approx(gap).epsilon(1e-9));
}

}  // namespace

TEST_CASE("a tone in one channel is found in its band and channel, shares sum to 1 and excesses to the gap") {
  ProfileCase one(801, 2);
  for (Index k = 0; k < kLong; ++k)
    one.add(1, k, 4 * std::sin(2 * std::numbers::pi * 11.3 * kT * static_cast<double>(k)));
  const GapProfile found = one.found();
  check_sums(found.bands, found.misfit - 1);
  check_sums(found.time, found.misfit - 1);
  CHECK(found.channel_misfit.mean() == Approx(found.misfit));
  CHECK(found.bands[3].share > 0.97);  // 8 to 20 Hz
  CHECK(found.bands[3].channel_share(1) > 0.97);
  CHECK(found.channel_misfit(1) == Approx(1 + 4 * 4 / 2.0 / 2).epsilon(0.05));  // in one record of two
  CHECK(found.channel_misfit(0) == Approx(1).epsilon(0.05));
  CHECK(found.floor_nrmse(0) == Approx(1 / 20.0).epsilon(0.05));
  CHECK(found.nrmse(1) == Approx(std::sqrt(found.channel_misfit(1)) * found.floor_nrmse(1)).epsilon(1e-9));
  double of_first = 0;
  for (const TimeShare& slice : found.time) of_first += slice.record == 0 ? slice.share : 0;
  CHECK(of_first > 0.97);
  CHECK(found.time.size() == 20);
  CHECK(found.time[0].from_s == Approx(kSkip * kT));
  CHECK(found.time[19].to_s == Approx(kLong * kT));
}

TEST_CASE("a constant error stands in the lowest band") {
  ProfileCase one(802);
  for (Index k = 0; k < kLong; ++k) one.add(0, k, 3);
  CHECK(one.found().bands[0].channel_share(0) > 0.97);
}

TEST_CASE("a burst is found in its tenth of the time") {
  ProfileCase one(803);
  Random random = numbers(804);
  for (Index k = 3200; k < 3400; ++k) one.add(2, k, 8 * random.normal());
  const GapProfile found = one.found();
  for (std::size_t s = 0; s < found.time.size(); ++s) {
    const bool inside = found.time[s].from_s < 3200 * kT && found.time[s].to_s > 3400 * kT;
    CHECK((found.time[s].share > 0.9) == inside);
  }
}

TEST_CASE("an error made at the far end of one element's travel is found there, with its ratio to the time") {
  ProfileCase one(805);
  Random random = numbers(806);
  for (Index k = 0; k < kLong; ++k)
    if (one.motion[0].travel(0, k) > 0.0197) one.add(1, k, 6 * random.normal());
  const GapProfile found = one.found();
  double shares = 0, times = 0;
  for (const RegionShare& region : found.regions)
    if (region.variable == "suspension.travel") {
      shares += region.share;
      times += region.time_share;
    }
  CHECK(shares == Approx(1));
  CHECK(times == Approx(1));
  const std::vector<RegionShare> out = standing_out(found);
  REQUIRE(out.size() >= 1);
  CHECK(out[0].variable == "suspension.travel");
  CHECK(out[0].to == Approx(0.02).epsilon(0.01));
  CHECK(out[0].share > 3 * out[0].time_share);
}

TEST_CASE("noise that is coloured as between repeats leaves no gap in any band") {
  ProfileCase one(807);
  RecordSet set;
  set.sampling_hz = 1 / kT;
  Random random = numbers(808);
  const auto coloured = [&] {
    Matrix noise = random.normal(3, kLong);
    for (Index k = 1; k < kLong; ++k) noise.col(k) = 0.9 * noise.col(k - 1) + std::sqrt(1 - 0.81) * noise.col(k);
    return noise;
  };
  for (int r = 0; r < 3; ++r) {
    Record record{"r" + std::to_string(r) + ".csv", "estimation", "drive", 0, {}};
    record.signal.sample_time_s = kT;
    record.signal.inputs = {{"road", "m"}};
    record.signal.u = Matrix::Ones(1, kLong);
    record.signal.y = coloured();
    set.records.push_back(record);
  }
  one.fit.error[0] = one.records[0].weight_std.asDiagonal() * coloured();
  one.options.noise_shares = noise_shares(set, one.options.band_edges_hz);
  REQUIRE(one.options.noise_shares.rows() == 3);
  for (const BandShare& band : one.found().bands) CHECK(std::abs(band.excess) < 0.1);
  one.options.noise_shares = {};
  CHECK(one.found().bands[1].excess > 0.2);  // taken for white it would be a gap at low frequency
}

TEST_CASE("bands keep the modes of any plant apart") {
  const std::vector<double> car = band_edges(plant_from(quarter_car_text), 100);
  REQUIRE(car.size() == 6);  // below the body's mode, the body's, between, the wheel's, above
  CHECK((car[1] < 1.2 && car[2] > 1.3 && car[2] < 3 && car[3] > 4 && car[3] < 10 && car[4] > 13));
  for (const Plant& plant : {plant_from(one_mass_text), plant_from(chain_text), full_car()}) {
    const std::vector<double> edges = band_edges(plant, 50);
    CHECK(edges.front() == 0);
    CHECK(edges.back() == 50);
    CHECK(std::is_sorted(edges.begin(), edges.end()));
    CHECK(edges.size() >= 4);
  }
}

TEST_CASE("trajectories: travel and rate are those of the simulation, a rate the derivative of its travel") {
  const Plant plant = plant_from(quarter_car_text);
  FitRecord record{Matrix(1, 4000 * kStepsEach), Matrix::Zero(3, 4000), kStepsEach, 0, Vector::Ones(3), {}};
  for (Index k = 0; k < record.drive.cols(); ++k)
    record.drive(0, k) = 0.01 * std::sin(2 * std::numbers::pi * 1.5 * 1e-3 * static_cast<double>(k));
  const GeneratedRecord made = generate_record(plant, record.drive, 200);
  record.y = made.signal.y;
  const PlantFit fit = fit_plant(plant, {}, {record}, *make_levenberg_marquardt({}), {4});
  const Trajectory motion = trajectories(fit, {record}).front();
  REQUIRE(motion.travel.rows() == 2);
  const Index settled = 400;  // samples
  CHECK(relative_error(motion.travel.row(0).tail(settled), made.signal.y.row(0).tail(settled)) < 1e-3);
  for (Index e = 0; e < 2; ++e) {
    const Matrix derivative =
        (motion.travel.row(e).tail(settled) - motion.travel.row(e).segment(4000 - settled - 2, settled)) / (2 * kT);
    CHECK(relative_error(motion.rate.row(e).segment(4000 - settled - 1, settled), derivative) < 0.02);
  }
}

TEST_CASE("closure is told apart inside and beyond what training has seen, and a plant that errs beyond is flagged") {
  ProfileCase train(809), held(810);
  const MotionEnvelope envelope = motion_envelope(train.motion, train.records);
  CHECK(envelope.high(0) == Approx(0.02).epsilon(1e-3));
  Random random = numbers(811);
  ProfileCase after = held;
  for (Index k = 0; k < kLong; ++k) {
    held.add(0, k, 5 * random.normal());
    if (k >= 3000 && k < 3800) {  // two seconds and more, further out, where the new plant is worse than the old one
      held.motion[0].travel(0, k) *= 1.5;
      after.add(0, k, 15 * random.normal());
    }
  }
  const BeyondEnvelope found = beyond_envelope(held.fit, after.fit, held.records, envelope, held.motion, 100, {100});
  CHECK(found.inside.value > 0.8);
  CHECK(found.outside.value < -1);
  CHECK(found.flagged);
  CHECK(found.time_share > 0.02);
  CHECK(found.time_share < 0.3);
  REQUIRE(found.excursions.size() == 1);
  CHECK(found.excursions[0].variable == "suspension.travel");
  CHECK(found.excursions[0].beyond == Approx(0.25).epsilon(0.05));  // of the whole width
  const BeyondEnvelope within = beyond_envelope(held.fit, after.fit, held.records, envelope, train.motion, 100, {100});
  CHECK(within.time_share == 0);
  CHECK(std::isnan(within.outside.value));
  CHECK_FALSE(within.flagged);
}

TEST_CASE("a correction that opens a gap beyond training, where there was none, is flagged") {
  ProfileCase train(809);
  const MotionEnvelope envelope = motion_envelope(train.motion, train.records);
  for (const double worse : {0.0, 3.0}) {  // of the floor
    ProfileCase held(816);
    held.fit.error[0] *= 0.9;
    Random random = numbers(817);
    ProfileCase after = held;
    for (Index k = 0; k < kLong; ++k) {
      const bool beyond = k >= 3000 && k < 3800;
      if (k < 3000) held.add(0, k, 5 * random.normal());
      if (beyond) after.add(0, k, worse * random.normal());
      if (beyond) held.motion[0].travel(0, k) *= 1.5;
    }
    const BeyondEnvelope found = beyond_envelope(held.fit, after.fit, held.records, envelope, held.motion, 100, {100});
    REQUIRE(found.time_share > 0);
    CHECK(std::isnan(found.outside.value));
    CHECK(found.inside.value > 0.9);
    CHECK(found.flagged == (worse > 0));
  }
}

TEST_CASE("a plant that may err more beyond what training has seen is flagged, one that surely errs less is not") {
  ProfileCase train(809);
  const MotionEnvelope envelope = motion_envelope(train.motion, train.records);
  for (const double worse : {1.3, 0.2}) {  // of the old plant's error, in the second half of the time beyond
    ProfileCase held(813);
    Random random = numbers(814);
    ProfileCase after = held;
    for (Index k = 0; k < kLong; ++k) {
      const double error = 5 * random.normal();
      const bool beyond = k >= 3000 && k < 3800;
      held.add(0, k, error);
      after.add(0, k, (beyond ? (k < 3400 ? 0.2 : worse) : 0.95) * error);
      if (beyond) held.motion[0].travel(0, k) *= 1.5;
    }
    const BeyondEnvelope found = beyond_envelope(held.fit, after.fit, held.records, envelope, held.motion, 100, {100});
    CHECK(found.inside.value < 0.2);
    CHECK(found.outside.value > 0);
    CHECK(found.flagged == (worse > 1));
  }
}
