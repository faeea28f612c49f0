// Records of plants that never forget, in pieces.
#include <catch2/catch.hpp>

#include "core/data/metrics.hpp"
#include "core/gap/which/hypothesis.hpp"
#include "core/greybox/pieces.hpp"
#include "core/plant/dataset.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/solver/levenberg_marquardt.hpp"
#include "variants/table.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// A slide that nothing holds, as of a servo axis.
Plant slide(double mass_kg, double damping_ns_per_m) {
  Plant plant = plant_from(one_mass_text);
  plant.masses[0].mass_kg = mass_kg;
  plant.elements[0].laws = {{find_law("viscous_damper"), {damping_ns_per_m}}};
  return plant;
}

/// A motor that turns a load by a shaft with play, as masses that slide.
const std::string drive_text = R"({
  "name": "drive",
  "masses": [{"name": "motor", "mass_kg": 0.02}, {"name": "load", "mass_kg": 0.05}],
  "inputs": [{"name": "push", "kind": "force", "unit": "N", "on": "motor", "hold_hz": 500}],
  "elements": [
    {"name": "shaft", "between": ["load", "motor"], "laws": [{"law": "linear_spring", "stiffness_n_per_m": 80},
      {"law": "viscous_damper", "damping_ns_per_m": 0.05}, {"law": "backlash", "gap_m": 0.01}]},
    {"name": "bearing", "between": ["ground", "motor"], "laws": [{"law": "viscous_damper", "damping_ns_per_m": 0.12}]},
    {"name": "drag", "between": ["ground", "load"], "laws": [{"law": "viscous_damper", "damping_ns_per_m": 0.1}]}],
  "sensors": [{"name": "motor_speed", "kind": "velocity", "of": "motor", "unit": "m/s"},
              {"name": "load_speed", "kind": "velocity", "of": "load", "unit": "m/s"}]})";

RecordSet records_of(const Plant& plant, std::vector<Index> lengths, Index skip, Random& random) {
  RecordSet set;
  set.sampling_hz = 100;
  for (const Index length : lengths) {
    Record record;
    record.file = "r" + std::to_string(set.records.size()) + ".csv";
    record.role = set.records.empty() ? "estimation" : "validation";
    record.signal.u = random.normal(plant.input_count(), length);
    record.signal.y = random.normal(plant.sensor_count(), length);
    record.signal.sample_time_s = 0.01;
    record.signal.skip = skip;
    set.records.push_back(std::move(record));
  }
  return set;
}

}  // namespace

TEST_CASE("records stay whole where springs hold every mass, and are cut where a force moves one for good") {
  Random random = numbers(6501);
  for (const char* text : {quarter_car_text.c_str(), one_mass_text.c_str(), chain_text.c_str(), shaken_text.c_str()}) {
    const Plant plant = plant_from(text);
    CHECK(piece_samples(plant, records_of(plant, {6000, 3000}, 0, random)) == 0);
  }
  for (int trial = 0; trial < 20; ++trial) {
    const double settles_s = 0.05 * std::pow(40, random.uniform());  // to 1/e
    const Plant plant = slide(10, 10 / settles_s);
    const RecordSet set = records_of(plant, {6000, 3000}, 0, random);
    const Index samples = piece_samples(plant, set);
    CAPTURE(settles_s, samples);
    CHECK(samples >= 6000 / 32);
    CHECK(samples <= 6000 / 4);
    if (samples > 6000 / 32 && samples < 6000 / 4)
      CHECK(static_cast<double>(samples) == Approx(100 * 4.6 * settles_s).margin(1));
  }
  const Plant free = slide(10, 0);  // nothing settles
  CHECK(piece_samples(free, records_of(free, {6400}, 0, random)) == 400);
  CHECK(piece_samples(free, records_of(free, {200}, 0, random)) == 0);  // too short to tell anything
}

TEST_CASE("pieces are the record, in its order, each sample once, and repeat a drive only where records do") {
  Random random = numbers(6502);
  const Plant plant = slide(3, 8);
  for (int trial = 0; trial < 20; ++trial) {
    const auto drawn = [&](Index low, Index high) {
      return low + static_cast<Index>(random.uniform() * static_cast<double>(high - low));
    };
    RecordSet whole = records_of(plant, {drawn(100, 900), drawn(100, 900)}, drawn(0, 50), random);
    if (trial % 2 == 1) whole.records[0].repeat_of = whole.records[1].repeat_of = "drive";
    const RecordSet cut = in_pieces(whole, drawn(30, 200));
    std::size_t next = 0;
    for (const Record& record : whole.records) {
      Index filled = 0;
      for (; next < cut.records.size() && cut.records[next].file.starts_with(record.file); ++next) {
        const Record& piece = cut.records[next];
        CHECK(piece.role == record.role);
        CHECK(piece.first == filled);
        CHECK(piece.continues == (filled > 0));
        CHECK(piece.signal.skip == (filled == 0 ? record.signal.skip : 0));
        CHECK(piece.signal.u == record.signal.u.middleCols(filled, piece.signal.samples()));
        CHECK(piece.signal.y == record.signal.y.middleCols(filled, piece.signal.samples()));
        filled += piece.signal.samples();
      }
      CHECK(filled == record.signal.samples());
    }
    std::map<std::string, int> names;
    for (const Record& piece : cut.records) ++names[piece.repeat_of];
    for (const auto& [name, count] : names) CHECK(count <= (trial % 2 == 1 ? 2 : 1));
    CHECK(names.begin()->second == (trial % 2 == 1 ? 2 : 1));
  }
  CHECK(in_pieces(records_of(plant, {300}, 0, random), 0).records.size() == 1);
}

TEST_CASE("of a drive with play every held-out piece is followed, wherever in its play it begins", "[slow]") {
  Random random = numbers(6503);
  const auto solver = make_levenberg_marquardt({});
  const GapSolvers solvers{*solver, *solver, *solver};
  const CandidateList none = [](const Plant&, const Operation&) { return std::vector<EffectCandidate>{}; };
  int followed = 0;
  for (int trial = 0; trial < 12; ++trial) {
    const double gap = 0.004 * std::pow(4, random.uniform()), stiffness = 40 * std::pow(4, random.uniform());
    Plant plant = plant_from(drive_text);
    set_parameter(plant, "shaft.linear_spring.stiffness_n_per_m", stiffness);
    set_parameter(plant, "shaft.backlash.gap_m", gap);
    plant.inputs[0].interpolation = "zoh";
    RecordSet set;
    set.sampling_hz = 250;
    for (const char* role : {"estimation", "validation"}) {
      Matrix drive(1, 2 * 2500);
      double level = 0;
      for (Index k = 0; k < drive.cols(); ++k) {
        if (k % 8 == 0) level = 0.8 * level + random.normal();
        drive(k) = level;
      }
      GeneratedRecord made = generate_record(plant, drive, set.sampling_hz, {.substeps = 8});
      REQUIRE(made.status == Status::ok);
      set.records.push_back({role, role, "", 0, made.signal});
    }
    for (Index i = 0; i < 2; ++i) {
      const double noise = 0.005 * rms(set.records[0].signal.y)(i);
      set.noise_std[plant.sensors[static_cast<std::size_t>(i)].name] = noise;
      for (Record& record : set.records) record.signal.y.row(i) += noise * random.normal(1, record.signal.y.cols());
    }
    // Some motions in a play are chaotic: the plant itself, with other steps, does not follow its own records.
    const GapData whole = gap_data(plant, set, noise_floor(set), 0.5);
    Vector left;
    REQUIRE(plant_residual(plant, whole.fitted, {InitialState{}}, left));
    if (left.squaredNorm() > 1.2 * static_cast<double>(left.size())) continue;
    ++followed;
    const RecordSet cut = in_pieces(set, piece_samples(plant, set));
    REQUIRE(cut.records.size() > 8);
    const GapData data = gap_data(plant, cut, noise_floor(cut), 0.5);
    const Study study{plant, data, solvers, none, tolerance_parameters(plant)};
    const Hypothesis fitted = fit_hypothesis(study, plant, {});
    CAPTURE(gap, stiffness, fitted.fit.misfit);
    CHECK(fitted.fit.misfit < 1.2);
    CHECK(fitted.held_out.misfit < 1.2);
  }
  CHECK(followed >= 6);
}
