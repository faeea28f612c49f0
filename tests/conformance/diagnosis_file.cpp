// The diagnosis file and the data of its page hold what the contract names, for a gap whose truth is known.
#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "core/plant/dataset.hpp"
#include "experiments/diagnose/answer.hpp"
#include "experiments/diagnose/json.hpp"
#include "experiments/diagnose/report.hpp"
#include "experiments/diagnose/view.hpp"
#include "tests/support/places.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/nonlinearity/mlp.hpp"
#include "variants/solver/levenberg_marquardt.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// Two repeats, and a validation record half as strong again.
RecordSet measured(const Plant& truth) {
  RecordSet set;
  set.sampling_hz = 200;
  const Index ratio = 5, samples = 4000;
  Random random = numbers(841);
  Matrix drive;
  for (int which = 0; which < 3; ++which) {
    if (which != 1) {
      drive.resize(1, samples * ratio);
      Vector poles = Vector::Zero(4);
      for (Index k = 0; k < drive.cols(); ++k) {
        double value = random.normal();
        for (double& pole : poles) value = pole += 0.06 * (value - pole);
        drive(0, k) = (which == 2 ? 0.006 : 0.004) * value;
      }
    }
    Record record{"r" + std::to_string(which) + ".csv", which < 2 ? "estimation" : "validation",
                  which < 2 ? "drive" : "", 0, generate_record(truth, drive, 200).signal};
    const Vector noise = (Vector(3) << 4e-5, 0.01, 0.06).finished();
    record.signal.y += noise.asDiagonal() * random.normal(3, samples);
    set.records.push_back(std::move(record));
  }
  return set;
}

const ViewTable* table_of(const View& view, const std::string& id) {
  const auto own = std::find_if(view.tables.begin(), view.tables.end(), [&](const auto& one) { return one.id == id; });
  return own == view.tables.end() ? nullptr : &*own;
}

/// Every table has rows, each with a cell a column, and its own id; nothing is a number that is none.
void check_tables(const View& view) {
  std::set<std::string> ids;
  for (const ViewTable& table : view.tables) {
    CAPTURE(table.id);
    CHECK(ids.insert(table.id).second);
    CHECK_FALSE(table.rows.empty());
    for (const auto& row : table.rows) {
      CHECK(row.size() == table.columns.size());
      for (const std::string& cell : row) CHECK_THAT(cell, !Catch::Contains("nan") && !Catch::Contains("inf"));
    }
  }
}

double sum_of(const Json& parts, const char* key) {
  double sum = 0;
  for (const Json& part : parts) sum += part.at(key).get<double>();
  return sum;
}

}  // namespace

TEST_CASE("beyond what training has seen a parameter that is the answer is held against the plant as delivered") {
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  set_parameter(truth, "tyre.linear_spring.stiffness_n_per_m", 1.1 * 196000);
  const RecordSet set = measured(truth);
  const auto solver = make_levenberg_marquardt({});
  Random random = numbers(843);
  const Examination agrees = examine({truth, truth, truth}, set, noise_floor(set), truth, {}, *solver, {}, random);
  CHECK_FALSE(agrees.beyond_known);  // there is no gap
  const Examination retuned = examine({nominal, truth, truth}, set, noise_floor(set), nominal, {}, *solver, {}, random);
  REQUIRE(retuned.beyond_known);
  CHECK(retuned.beyond.outside.value > 0.9);
  CHECK(retuned.beyond.inside.value > 0.9);
}

TEST_CASE("a diagnosis file tells where, how far and beyond what, its figures hold every series at one length") {
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  truth.elements[0].laws.push_back({find_law("asymmetric_damper"), {850, 0.3, 0.1, 1, 1}});
  const RecordSet set = measured(truth);
  Diagnosis diagnosis;
  diagnosis.floor = noise_floor(set);
  diagnosis.plant = truth;
  diagnosis.evidence.places = {{"suspension"_at, {}, 1.1}, {"tyre"_at, {"actuator"_at}, 20}};
  diagnosis.evidence.singles.emplace_back();
  diagnosis.verdict.locations = {{"actuator"_at, 0.9}};
  CHECK(place_of_note(diagnosis).empty());  // no gap
  diagnosis.verdict.answer = Effects{};
  CHECK(place_of_note(diagnosis) == "tyre"_at);
  diagnosis.verdict.locations = {{"suspension"_at, 0.9}};
  CHECK(place_of_note(diagnosis) == "suspension"_at);
  Random random = numbers(842);
  const auto solver = make_levenberg_marquardt({});
  const auto map = make_mlp(2, 1, {});
  const Examination examination =
      examine({nominal, nominal, truth}, set, diagnosis.floor, nominal, "suspension"_at, *solver,
              {.draws = 50, .ceiling = "suspension"_at, .map = map.get(), .map_solver = solver.get()}, random);
  for (const auto& [effect, location] : {std::pair{"damper_asymmetry", "suspension"},
                                         {"tyre_damping", "tyre"},
                                         {"hysteresis", "suspension"},
                                         {"tyre_damping", "tyre"}}) {
    diagnosis.verdict.suspects.emplace_back();
    diagnosis.verdict.suspects.back().effect = effect;
    diagnosis.verdict.suspects.back().location = part_place(location);
  }
  diagnosis.verdict.named = {"tyre_damping@tyre"_effect, "damper_asymmetry@suspension"_effect};
  diagnosis.follow_up.shares = (Vector(2) << 0.1, 0.85).finished();
  CHECK(telling_stage(examination) == 1);
  const View view = view_of(nominal, diagnosis, &examination, nullptr);
  const Json file = diagnosis_json(nominal, diagnosis, &examination, view, "d.plant.json");
  CHECK(file.at("answer") == view.answer);
  CHECK(file.at("view").at("tables").size() == view.tables.size());
  check_tables(view);
  // What was computed is shown, and a number as the file has it.
  for (const char* id : {"how_far", "ceiling", "effects", "places", "bands", "kind"}) REQUIRE(table_of(view, id));
  CHECK(table_of(view, "two_places") == nullptr);
  CHECK(table_of(view, "bridged") == nullptr);
  CHECK(table_of(view, "how_far")->rows.size() == 1 + nominal.sensors.size());
  const ViewTable& suspects = *table_of(view, "effects");
  CHECK(suspects.rows[0][0] == "damper asymmetry at suspension");
  CHECK(suspects.rows[0][4] == "85 %");
  CHECK(suspects.rows[3][4] == "-");
  CHECK(table_of(view, "places")->rows[1] == std::vector<std::string>{"tyre", "20", "actuator"});
  CHECK(view.heading == "Why simulation and rig disagree: tyre damping at tyre and damper asymmetry at suspension");
  Placebo again{"", 20, 17, 3, {{"tyre_damping@tyre"_effect, 17}}};
  CHECK_THAT(view_of(nominal, diagnosis, nullptr, &again).notes.back(),
             Catch::Contains("17 of 20") && Catch::Contains("tyre damping at tyre 17, none 3"));
  diagnosis.spikes.assign(7, {"r1.csv", "travel", 1.25, 0.5, 0.01});
  CHECK(table_of(view_of(nominal, diagnosis, nullptr, nullptr), "bridged")->rows.size() == 5);

  const Json& where = file.at("where");
  for (const Json* stage : {&where, &where.at("after_retuning"), &where.at("after_effect")}) {
    for (const char* parts : {"bands", "time"}) {
      const double sum = sum_of(stage->at(parts), "share");
      CHECK((sum == Approx(1) || (stage == &where.at("after_effect") && sum == 0)));  // nothing above the floor
    }
    CHECK(stage->at("kind").at("repeatable").at("share").get<double>() <= 1);
    CHECK(stage->at("kind").at("lines").contains("absent"));
  }
  CHECK(where.at("unknown_signal").at("rms").get<double>() >
        5 * where.at("unknown_signal").at("noise_rms").get<double>());
  CHECK(where.at("kind").at("repeatable").at("share").get<double>() > 0.8);
  for (const Json& band : file.at("how_far").at("per_band"))
    CHECK(band.at("excess").at("with_effect").get<double>() < 0.1);
  for (const Json& channel : file.at("how_far").at("per_channel")) {
    CHECK(channel.at("misfit").at("as_delivered").get<double>() > 2);
    CHECK(channel.at("misfit").at("with_effect").get<double>() == Approx(1).epsilon(0.1));
  }
  const Json& beyond = file.at("how_far").at("beyond_envelope");
  CHECK(beyond.at("time_share").get<double>() > 0.02);
  CHECK(beyond.at("closure").get<double>() > 0.95);
  CHECK_FALSE(beyond.at("flagged").get<bool>());
  const Json& ceiling = file.at("how_far").at("ceiling");
  CHECK(ceiling.at("location") == "suspension");
  CHECK(ceiling.at("signal").get<double>() == Approx(1).epsilon(0.05));
  CHECK(ceiling.at("static_map").get<double>() == Approx(1).epsilon(0.05));
  const Json& effects = file.at("which").at("effects");
  CHECK(effects[0].at("share") == 0.85);
  CHECK(effects[1].at("share") == 0.1);
  CHECK(effects[2].at("share").is_null());
  CHECK(effects[3].at("share").is_null());  // the same effect, fitted alone

  const Json figures = diagnosis_figures_json(nominal, examination);
  const Json& segment = figures.at("segment");
  REQUIRE(segment.at("time_s").size() == 200);
  for (const Json& channel : segment.at("channels"))
    for (const char* line : {"measured", "as_delivered", "retuned", "with_effect"})
      CHECK(channel.at(line).size() == 200);
  const Json& signal = figures.at("unknown_signal");
  REQUIRE(signal.at("axes").size() == 2);
  CHECK(signal.at("axes")[1].at("name") == "suspension velocity");
  for (const Json& axis : signal.at("axes")) CHECK(axis.at("values").size() == signal.at("value").size());
  // An asymmetric damper pulls harder one way than the other: its even part is c a |v|, positive on both sides.
  const Json& medians = signal.at("axes")[1].at("medians");
  CHECK(medians.front()[1].get<double>() > 10);
  CHECK(medians.back()[1].get<double>() > 10);
  CHECK(figures.dump() == diagnosis_figures_json(nominal, examination).dump());
  // A diagnosis that failed has a file, without what could not be seen.
  CHECK(diagnosis_json(nominal, diagnosis, nullptr, {}, "d.plant.json").at("where").at("bands").empty());
}

TEST_CASE("an answer speaks of a share that goes only where the validation records have a gap") {
  using Catch::Contains;
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  Evidence evidence;
  evidence.delivered.misfit = 0.98;
  evidence.singles.emplace_back();
  evidence.singles[0].closure = {nan, nan, nan};
  evidence.freed.emplace_back();
  evidence.freed[0].closure_of_delivered = {nan, nan, nan};
  Verdict verdict;
  verdict.locations = {{"suspension"_at, 0.9}};
  verdict.suspects.emplace_back();
  verdict.suspects[0].effect = "bump_stop";
  verdict.suspects[0].location = "suspension"_at;
  verdict.suspects[0].closure = {nan, nan, nan};
  verdict.named = {"bump_stop@suspension"_effect};
  for (const Answer& kind : std::vector<Answer>{Effects{}, Parameters{}, AtPlace{}, Exogenous{}}) {
    CAPTURE(kind.index());
    verdict.answer = kind;
    CHECK_THAT(answer(evidence, verdict, {}), !Contains("nan") && !Contains("no model of the plant"));
  }
  verdict.answer = Effects{};
  CHECK_THAT(answer(evidence, verdict, {}), Contains("validation records hardly do"));
  verdict.answer = Rounding{};
  verdict.named = {"quantisation@sensor:travel"_effect};
  CHECK_THAT(answer(evidence, verdict, {}), Contains("no model of the plant removes it"));
}

TEST_CASE("a file without an examination holds the same keys") {
  const Json file = diagnosis_json(plant_from(quarter_car_text), {}, nullptr, {}, "");
  for (const char* key : {"channels", "bands", "regions", "time"}) CHECK(file.at("where").at(key).is_array());
  for (const char* key : {"per_channel", "per_band"}) CHECK(file.at("how_far").at(key).is_array());
  CHECK(file.at("how_far").at("beyond_envelope").is_null());
}
