// The diagnosis of simulated records: they look like those measured, and the count is what was named.
#include "core/gap/study/placebo.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/plant/dataset.hpp"
#include "tests/support/places.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/solver/levenberg_marquardt.hpp"
#include "variants/table.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

constexpr Index kLength = 2500;
constexpr double kMemory = 0.9;

/// Two repeats and a validation record of a plant, with noise that each sample remembers.
RecordSet measured(const Plant& truth) {
  RecordSet set;
  set.sampling_hz = 250;
  Random random = numbers(871);
  Matrix drive(1, 2 * kLength);
  for (int which = 0; which < 3; ++which) {
    Vector poles = Vector::Zero(4);
    for (Index k = 0; which != 1 && k < drive.cols(); ++k) {
      double value = 100 * random.normal();
      for (double& pole : poles) value = pole += 0.1 * (value - pole);
      drive(0, k) = value;
    }
    Record record{"r" + std::to_string(which) + ".csv", which < 2 ? "estimation" : "validation",
                  which < 2 ? "drive" : "", 0, generate_record(truth, drive, 250).signal};
    Matrix& y = record.signal.y;
    const Vector std = 0.02 * y.rowwise().norm() / std::sqrt(static_cast<double>(kLength));
    Vector noise = random.normal(3, 1);
    for (Index k = 0; k < kLength; ++k) {
      noise = kMemory * noise + std::sqrt(1 - kMemory * kMemory) * random.normal(3, 1);
      y.col(k) += std.cwiseProduct(noise);
    }
    set.records.push_back(std::move(record));
  }
  return set;
}

/// Correlation of neighbouring samples of the difference of two repeats.
double memory_of(const RecordSet& set, Index channel) {
  const Vector d = (set.records[0].signal.y.row(channel) - set.records[1].signal.y.row(channel)).transpose();
  return d.head(d.size() - 1).dot(d.tail(d.size() - 1)) / d.squaredNorm();
}

void one_by_one(Index count, const std::function<void(Index)>& work) {
  for (Index i = 0; i < count; ++i) work(i);
}

void backwards(Index count, const std::function<void(Index)>& work) {
  while (count > 0) work(--count);
}

}  // namespace

// Noise of this memory is worth 260 independent samples a record: its size is known to 4 %.
TEST_CASE("simulated records have the drives, the response, and the size and colour of the noise of those measured") {
  const Plant plant = plant_from(one_mass_text);
  const RecordSet set = measured(plant);
  const NoiseFloor floor = noise_floor(set);
  Random random = numbers(872), same = numbers(872), other = numbers(873);
  const RecordSet made = simulated_records(plant, set, floor, random);
  REQUIRE(made.records.size() == 3);
  const NoiseFloor again = noise_floor(made);
  for (Index i = 0; i < 3; ++i) {
    CHECK(again.std(i) == Approx(floor.std(i)).epsilon(0.15));
    CHECK(memory_of(made, i) == Approx(memory_of(set, i)).margin(0.07));
  }
  CHECK(memory_of(set, 0) > 0.8);
  for (std::size_t r = 0; r < 3; ++r) {
    CHECK(same_bits(made.records[r].signal.u, set.records[r].signal.u));
    CHECK(made.records[r].repeat_of == set.records[r].repeat_of);
    CHECK(relative_error(made.records[r].signal.y, set.records[r].signal.y) < 0.05);
  }
  CHECK(same_bits(made.records[2].signal.y, simulated_records(plant, set, floor, same).records[2].signal.y));
  CHECK_FALSE(same_bits(made.records[2].signal.y, simulated_records(plant, set, floor, other).records[2].signal.y));

  // Readings on a lattice stay on it, and its rounding is not counted twice.
  RecordSet rounded = set;
  const double step = 4 * floor.std(0);
  for (Record& record : rounded.records)
    record.signal.y.row(0) = step * (record.signal.y.row(0).array() / step).round();
  const NoiseFloor coarse = noise_floor(rounded);
  const RecordSet lattice = simulated_records(plant, rounded, coarse, random);
  CHECK(lattice_step(lattice.records[0].signal.y.row(0)) == Approx(step));
  CHECK(noise_floor(lattice).std(0) == Approx(coarse.std(0)).epsilon(0.15));
}

TEST_CASE("the placebo of a true answer names it again, the same whenever it runs, and of no gap it names nothing",
          "[slow]") {
  const Plant nominal = plant_from(one_mass_text);
  const auto solver = make_levenberg_marquardt({});
  const auto diagnosed = [&](const RecordSet& set) {
    DiagnoseOptions options{.iterations = 6};
    options.effort.searches = 0;  // for a second effect
    return diagnose(nominal, set, effect_candidates, {*solver, *solver, *solver}, options, 874);
  };
  Plant wrong = nominal;
  set_parameter(wrong, "sensor:v.gain", 1.3);
  for (const Plant& truth : {wrong, nominal}) {
    const RecordSet set = measured(truth);
    const Diagnosis diagnosis = diagnosed(set);
    const std::vector<EffectAt>& named = diagnosis.verdict.named;
    REQUIRE(named.empty() == (get_parameter(truth, "sensor:v.gain") == 1));
    const Placebo first = placebo(diagnosis, set, 2, 5, diagnosed, one_by_one);
    CHECK(first.why_not.empty());
    CHECK(first.runs == 2);
    CHECK(first.same == 2);
    CHECK(first.nothing == (named.empty() ? 2 : 0));
    CHECK(first.names == (named.empty() ? std::map<EffectAt, Index>{} : std::map<EffectAt, Index>{{named[0], 2}}));
    const Placebo again = placebo(diagnosis, set, 2, 5, diagnosed, backwards);
    CHECK(again.names == first.names);
    CHECK(again.nothing == first.nothing);
  }
}

TEST_CASE("what comes back is counted name by name, what the catalogue does not hold is not simulated") {
  const Plant plant = plant_from(one_mass_text);
  const RecordSet set = measured(plant);
  Diagnosis diagnosis;
  diagnosis.plant = plant;
  diagnosis.floor = noise_floor(set);
  diagnosis.verdict.answer = Effects{2, 0, false};
  diagnosis.verdict.named = {"a@spring"_effect, "b@spring"_effect};
  const EffectAt a = "a@spring"_effect, b = "b@spring"_effect, c = "c@m"_effect;
  std::vector<std::vector<EffectAt>> answers = {{b, a}, {a}, {}, {c, a}};
  std::size_t next = 0;
  const auto told = [&](const RecordSet&) {
    Diagnosis again;
    again.verdict.named = answers[next++];
    return again;
  };
  const Placebo row = placebo(diagnosis, set, 4, 1, told, one_by_one);
  CHECK(row.same == 1);
  CHECK(row.names == std::map<EffectAt, Index>{{a, 3}, {b, 1}, {c, 1}});
  CHECK(row.nothing == 1);
  for (const Answer& place : std::vector<Answer>{AtPlace{}, AtTwoPlaces{}, Exogenous{}, Insufficient{}}) {
    diagnosis.verdict.answer = place;
    const Placebo none = placebo(diagnosis, set, 4, 1, told, one_by_one);
    CHECK(none.runs == 0);
    CHECK_FALSE(none.why_not.empty());
  }
}
