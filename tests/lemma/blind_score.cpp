// The scores of a blind test, on keys and answers small enough to count by hand.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "core/data/records.hpp"
#include "core/plant/dataset.hpp"
#include "experiments/blind/score.hpp"
#include "experiments/blind/score_closure.hpp"
#include "experiments/blind/score_table.hpp"
#include "experiments/rig/sha256.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::scoring;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

Json effect(const std::string& name) {
  const std::size_t at = name.find('@');
  return {{"effect", name.substr(0, at)}, {"location", name.substr(at + 1)}};
}

Json truth(const std::string& name, const std::vector<std::string>& effects, const std::string& strength = "medium") {
  Json list = Json::array();
  for (const std::string& one : effects) list.push_back(effect(one));
  return {{"case", name}, {"set", effects.size() > 1 ? "E" : "A"}, {"strength_class", strength}, {"effects", list}};
}

struct Said {
  std::vector<std::string> named, ambiguous_with = {}, suspects = {};
  double probability = 0.9, closure = 0.98;
  std::string location = {};  // empty: of the first name
};

void say(const Folder& folder, const std::string& name, const Said& said) {
  Json effects = Json::array();
  for (const std::string& one : said.named)
    if (!one.starts_with("unknown@")) effects.push_back(effect(one));
  for (const std::string& one : said.suspects) effects.push_back(effect(one));
  for (Json& one : effects) one["probability"] = said.probability;
  const std::string place = !said.location.empty() ? said.location
                            : said.named.empty()   ? ""
                                                   : effect(said.named[0]).at("location").get<std::string>();
  write_json(folder / (name + ".json"),
             {{"schema", "wheelhop.diagnosis/1"},
              {"verdict", said.named.empty() ? "no_gap" : "gap"},
              {"where",
               {{"location", place.empty() ? Json() : Json(place)},
                {"without_catalogue", {{{"location", "tyre"}, {"same_entry", {"actuator"}}, {"leftover_chi2", 1.0}}}}}},
              {"which",
               {{"effects", effects},
                {"named", said.named},
                {"outcome", said.named.empty() ? "none" : "effect"},
                {"ambiguous_with", said.ambiguous_with}}},
              {"how_far",
               {{"closure", said.closure},
                {"closure_ci90", {0.9, 1.0}},
                {"beyond_envelope", nullptr},
                {"floor", {{"std", {{"x", 1e-5}}}}}}}});
}

std::vector<Judged> judge_folder(const Folder& folder, const Json& key) {
  write_json(folder / "key.json", key);
  std::vector<Judged> judged;
  for (const TrueCase& one : load_key(folder.path()))
    judged.push_back(judge(one, load_answer(folder.path(), one.name)));
  return judged;
}

void check(const Group& group, const std::string& key, long hits, long n) {
  CAPTURE(group.name, key);
  const Score& score = group.score(key);
  REQUIRE(score.rate);
  CHECK(score.rate->hits == hits);
  CHECK(score.n == n);
}

std::string refusal(const Folder& folder, const std::string& key) {
  write_file(folder / "bad.json", key);
  try {
    load_key(folder / "bad.json");
  } catch (const UserError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace

TEST_CASE("every case counts, and each score counts the cases it is about") {
  const Folder folder;
  say(folder, "quiet", {{}});
  say(folder, "alarm", {{"backlash@suspension"}, {}, {}, 0.6});
  say(folder, "right", {{"coulomb_friction@suspension"}});
  say(folder, "second",
      {{"coulomb_friction@suspension"}, {"hysteresis@suspension"}, {"hysteresis@suspension"}, 0.5, 0.7});
  write_json(folder / "broken.json", {{"schema", "wheelhop.diagnosis/1"}, {"error", "no such channel"}});
  say(folder, "reversed", {{"actuator_lag@actuator", "hysteresis@suspension"}});
  say(folder, "half", {{"hysteresis@suspension", "bias@sensor:travel"}});
  say(folder, "strange", {{"unknown@tyre"}, {}, {"hysteresis@suspension"}});
  say(folder, "heavy", {{"mass_error@body"}});
  Json strange = truth("strange", {"stick@actuator"});
  strange["effects"][0]["in_catalogue"] = false;
  const std::vector<Judged> judged =
      judge_folder(folder, {truth("quiet", {}), truth("alarm", {}), truth("right", {"coulomb_friction@suspension"}),
                            truth("second", {"hysteresis@suspension"}, "weak"),
                            truth("broken", {"time_delay@actuator"}), truth("absent", {"bias@sensor:travel"}),
                            truth("reversed", {"hysteresis@suspension", "actuator_lag@actuator:road"}),
                            truth("half", {"hysteresis@suspension", "clock_skew@timebase"}), strange,
                            truth("heavy", {"mass_error@body"})});
  const std::vector<Group> groups = score_groups(judged);
  const Group &all = groups[0], &clear = groups[1];
  REQUIRE(all.name == "all");
  REQUIRE(clear.name == "clear");
  CHECK(all.cases == 10);
  CHECK(clear.cases == 9);
  check(all, "where_top1", 3, 6);    // right, second, heavy; not broken, absent, strange
  check(all, "where_in_set", 4, 6);  // strange: the tyre enters as the actuator does
  check(clear, "where_top1", 2, 5);
  check(all, "which_top1", 1, 4);
  check(all, "which_top2", 2, 4);
  check(clear, "which_top1", 1, 3);
  check(all, "set_contains_truth", 2, 4);
  check(all, "set_of_two_contains_truth", 2, 4);
  check(all, "known_accepted", 2, 4);
  CHECK(all.score("mean_set_size").value == 1.5);
  CHECK(all.score("mean_set_size").n == 2);
  check(all, "false_alarm", 1, 2);
  check(all, "missed_gap", 2, 7);  // an error and an absent answer see nothing
  check(all, "parameter_named", 1, 1);
  check(all, "unknown_flagged", 1, 1);
  check(all, "unknown_located", 0, 1);
  check(all, "double_both_named", 1, 2);
  check(all, "double_first_right", 2, 2);
  CHECK(all.score("double_extras").value == 0.5);
  CHECK(all.score("closure_reported").value == Approx(0.35));  // of 0, 0, 0.7, 0.98
  CHECK(all.score("closure_reported").n == 4);
  CHECK(all.score("ece").n == 6);
  for (const Judged& one : judged) {
    const std::string& name = one.truth.name;
    CAPTURE(name, one.fault);
    CHECK(one.fault.empty() ==
          (name == "quiet" || name == "right" || name == "reversed" || name == "strange" || name == "heavy"));
  }
  CHECK(confusions(judged[6]) == std::vector<std::pair<std::string, std::string>>{{"hysteresis", "hysteresis"},
                                                                                  {"actuator_lag", "actuator_lag"}});
  CHECK(confusions(judged[7]) ==
        std::vector<std::pair<std::string, std::string>>{{"hysteresis", "hysteresis"}, {"clock_skew", "bias"}});
}

TEST_CASE("of an effect and a wrong parameter each counts by itself, and both together") {
  const Folder folder;
  say(folder, "both", {{"stiffness_error@tyre", "hysteresis@suspension"}});
  say(folder, "effect", {{"hysteresis@suspension", "bias@sensor:travel"}});
  say(folder, "parameter", {{"mass_error@body"}});
  say(folder, "neither", {{"mass_error@wheel", "hysteresis@tyre"}});
  Json key = {truth("both", {"hysteresis@suspension", "stiffness_error@tyre"}),
              truth("effect", {"hysteresis@suspension", "stiffness_error@tyre"}),
              truth("parameter", {"bias@sensor:travel", "mass_error@body"}),
              truth("neither", {"hysteresis@suspension", "mass_error@body"}),
              truth("absent", {"hysteresis@suspension", "mass_error@body"})};
  for (Json& one : key) one["class"] = "mixed";
  const std::vector<Judged> judged = judge_folder(folder, key);
  const Group all = score_groups(judged).front();
  check(all, "mixed_both_named", 1, 5);
  check(all, "mixed_effect_named", 2, 5);
  check(all, "mixed_parameter_named", 2, 5);
  CHECK(all.score("mixed_extras").value == Approx(3.0 / 5));  // a bias, and two of the case without a right name
  CHECK(all.score("mixed_extras").n == 5);
  check(all, "missed_gap", 1, 5);
  for (const char* other : {"double_both_named", "parameter_named", "which_top1", "where_top1"})
    check(all, other, 0, 0);
  CHECK(judged[0].fault.empty());
  CHECK(judged[1].fault == "only the effect");
  CHECK(judged[2].fault == "only the parameter");
  CHECK(judged[3].fault == "misnamed");
  CHECK(judged[4].fault == "no answer");
}

TEST_CASE("two effects without a class are a double, and a mixed case has one parameter among two effects") {
  const Folder folder;
  const auto kind = [&](const std::vector<std::string>& effects, const Json& change) {
    Json one = truth("a", effects);
    one.update(change);
    write_json(folder / "key.json", Json::array({one}));
    return load_key(folder.path()).front().kind;
  };
  const Json mixed = {{"class", "mixed"}};
  CHECK(kind({"bias@sensor:travel", "mass_error@body"}, Json::object()) == CaseKind::twofold);
  CHECK(kind({"bias@sensor:travel", "mass_error@body"}, mixed) == CaseKind::mixed);
  for (const std::vector<std::string>& effects : {std::vector<std::string>{"bias@sensor:travel", "drift@sensor:travel"},
                                                  {"mass_error@wheel", "mass_error@body"},
                                                  {"mass_error@body"}}) {
    Json one = truth("a", effects);
    one.update(mixed);
    CHECK_THAT(refusal(folder, Json::array({one}).dump()), Contains("$[0].class"));
  }
}

TEST_CASE(
    "an answer made without the family of the truth is right where it says unknown, and not where it names a rival") {
  const Folder folder;
  for (const char* name : {"flagged", "misled"}) {
    const std::string what = name == std::string("flagged") ? "unknown" : "hysteresis";
    say(folder, name, {{what + "@suspension"}});
    Json answer = parse_json(read_file(folder / (name + std::string(".json"))), name);
    answer["left_out"] = {"coulomb_friction"};
    write_json(folder / (name + std::string(".json")), answer);
  }
  std::vector<Judged> judged = judge_folder(
      folder, {truth("flagged", {"coulomb_friction@suspension"}), truth("misled", {"coulomb_friction@suspension"})});
  judged[1].true_closure = 0.5;
  const Group all = score_groups(judged).front();
  check(all, "left_out_flagged", 1, 2);
  check(all, "left_out_twin", 0, 2);
  check(all, "left_out_located", 2, 2);
  check(all, "which_top1", 0, 0);
  CHECK(judged[0].fault.empty());
  CHECK_THAT(judged[1].fault, Contains("not flagged"));
  // What closes the true gap is a twin: nothing in the records speaks against it.
  judged[1].true_closure = 0.95;
  const Group twins = score_groups(judged).front();
  check(twins, "left_out_flagged", 1, 1);
  check(twins, "left_out_twin", 1, 2);
}

TEST_CASE("Wilson's interval has the published ends") {  // Newcombe 1998, Statist. Med. 17, table I, method 3
  const std::vector<std::array<double, 4>> published = {
      {81, 263, 0.2553, 0.3662}, {15, 148, 0.0624, 0.1605}, {0, 20, 0, 0.1611}, {1, 29, 0.0061, 0.1718}};
  for (const auto& [hits, n, low, high] : published) {
    const auto ends = wilson_interval({static_cast<long>(hits), static_cast<long>(n)});
    CHECK(ends.first == Approx(low).margin(5e-5));
    CHECK(ends.second == Approx(high).margin(5e-5));
  }
  CHECK(wilson_interval({0, 0}) == std::pair{0.0, 1.0});
}

TEST_CASE("probabilities that come true have no calibration error, too high ones as much as they are too high") {
  std::vector<Forecast> perfect;
  for (int tenth = 1; tenth <= 9; ++tenth)
    for (int i = 0; i < 10; ++i) perfect.push_back({tenth / 10.0, i < tenth});
  const Calibration good = calibrate(perfect);
  CHECK(good.bins.size() == 9);
  CHECK(good.ece == Approx(0).margin(1e-12));
  CHECK(good.ece_by_chance > 0.05);
  CHECK(good.brier_skill == Approx(1 - (165.0 / 900) / 0.25));  // mean p (1 - p) = 0.165 * 10 / 9

  std::vector<Forecast> boastful;
  for (int i = 0; i < 20; ++i) boastful.push_back({0.9, i % 2 == 0});
  const Calibration bad = calibrate(boastful);
  REQUIRE(bad.bins.size() == 1);  // equal probabilities are not torn apart
  CHECK(bad.ece == Approx(0.4));
  CHECK(bad.brier == Approx(0.41));
  CHECK(bad.brier_skill == Approx(-0.64));
  CHECK(std::isnan(calibrate({}).ece));
  CHECK(median({3, -INFINITY, 1, 2}) == 1.5);
}

TEST_CASE("the true closure is 1 for the truth, 0 for the re-tuned plant, and is that of the squared error between") {
  const Folder folder;
  Plant before = plant_from(one_mass_text);
  before.sensors.resize(1);
  const std::string damping = "spring.viscous_damper.damping_ns_per_m";
  Plant right = before, half = before;
  set_parameter(right, damping, 4.4);
  set_parameter(half, damping, 4.2);
  RecordSet set;
  set.sampling_hz = 500;
  Random random = numbers(620);
  for (const char* file : {"val_long.csv", "beyond.csv"}) {
    const double level = file == std::string("beyond.csv") ? 3 : 1;
    const GeneratedRecord made = generate_record(right, level * random.normal(1, 3000), 500);
    REQUIRE(made.status == Status::ok);
    set.records.push_back({file, "validation", "", 0, made.signal});
  }
  write_records(folder.path() / "truth", set);
  write_json(folder / "c.retuned.json", to_json(before));
  write_json(folder / "c.plant.json", to_json(half));
  Judged judged;
  judged.answer.floor = {{"x", 1e-5}};
  judged.answer.retuned = "c.retuned.json";
  judged.answer.plant = "c.plant.json";
  measure_closure(judged, folder.path(), folder / "truth");
  CHECK(judged.true_closure.value() == Approx(0.75).margin(0.05));
  CHECK(judged.beyond_closure.value() == Approx(0.75).margin(0.05));
  write_json(folder / "c.plant.json", to_json(right));
  measure_closure(judged, folder.path(), folder / "truth");
  CHECK(judged.true_closure.value() == Approx(1).margin(1e-3));
  judged.answer.plant = "c.retuned.json";
  measure_closure(judged, folder.path(), folder / "truth");
  CHECK(judged.true_closure.value() == Approx(0).margin(1e-6));
}

TEST_CASE("the truth leaves nothing of itself, however its record began, also where a law jumps") {
  Plant plant = plant_from(one_mass_text);
  plant.sensors.resize(1);
  plant.elements[0].laws.push_back({.kind = find_law("cavitating_damper"), .values = {3.5, 2e-4, 1, 30}});
  Random random = numbers(621);
  GeneratedRecord made = generate_record(plant, 3 * random.normal(1, 9000), 500);
  REQUIRE(made.status == Status::ok);
  Record record{"val_long.csv", "validation", "", 0, made.signal};
  record.signal.u = made.signal.u.rightCols(8000).eval();  // in the middle of its motion
  record.signal.y = made.signal.y.rightCols(8000).eval();
  const Vector floor = Vector::Constant(1, 0.01 * std::sqrt(record.signal.y.squaredNorm() / 8000));
  Plant without = plant;
  without.elements[0].laws.pop_back();
  CHECK(noise_free_misfit(plant, {&record}, floor) < 0.01 * noise_free_misfit(without, {&record}, floor));
  record.signal.y.leftCols(500).array() += 100 * floor(0);  // a start that no initial state explains
  CHECK(noise_free_misfit(plant, {&record}, floor) < 1);
}

TEST_CASE("the score file is the same for the same answers, and wrong keys are refused at their place") {
  const Folder folder, answers;
  say(answers, "a", {{"coulomb_friction@suspension"}});
  write_json(folder / "key.json", {truth("a", {"coulomb_friction@suspension"}),
                                   truth("b", {}),
                                   {{"case", nullptr}, {"effects", Json::array()}, {"why", "cannot reach its gap"}}});
  BlindScoreRequest request{answers.path(), folder.path(), folder / "one.json"};
  request.quiet = true;
  CHECK(run_blind_score(request) == 1);  // b has no answer
  request.out = folder / "two.json";
  CHECK(run_blind_score(request) == 1);
  CHECK(read_file(folder / "one.json") == read_file(folder / "two.json"));
  const Json scores = parse_json(read_file(folder / "one.json"), "one.json");
  CHECK(scores.at("schema") == "wheelhop.blind_scores/1");
  CHECK(scores.at("absent") == 1);
  CHECK(scores.at("cases")[1].at("fault") == "no answer");
  CHECK(scores.at("groups")[0].at("scores").at("which_top1").at("n") == 1);

  // With the truth an absent answer closes nothing; names alone leave that open.
  std::filesystem::create_directories(folder / "truth" / "b");
  write_file(folder / "truth" / "b" / "records.json", "{}");
  const auto closure_of_b = [&] {
    CHECK(run_blind_score(request) == 1);
    return parse_json(read_file(folder / "two.json"), "two.json").at("cases")[1].at("closure_true");
  };
  CHECK(closure_of_b() == 0);
  request.names_only = true;
  CHECK(closure_of_b().is_null());

  request.cases = "a";
  CHECK(run_blind_score(request) == 0);
  request.cases = "c*";
  CHECK_THROWS_WITH(run_blind_score(request), Contains("\"c*\""));
  request.cases = "";
  write_json(answers / "manifest.json", {{"cases", 3}});
  CHECK_THROWS_WITH(run_blind_score(request), Contains("manifest.json") && Contains("$.cases"));
  write_json(answers / "manifest.json", {{"cases", 2}, {"key_sha256", std::string(64, '0')}});
  CHECK_THROWS_WITH(run_blind_score(request), Contains("$.key_sha256"));
  write_json(answers / "manifest.json", {{"cases", 2}, {"key_sha256", blind::sha256(read_file(folder / "key.json"))}});
  CHECK(run_blind_score(request) == 1);

  CHECK_THAT(refusal(folder, R"([{"case": "a", "effects": [], "class": "single"}])"), Contains("$[0].class"));
  CHECK_THAT(refusal(folder, R"([{"case": "a", "effects": []}, {"case": "a", "effects": []}])"), Contains("$[1].case"));
  CHECK_THAT(refusal(folder, R"([{"case": "a", "effects": [{"effect": "bias"}]}])"), Contains("location"));
  CHECK_THAT(refusal(folder, "[]"), Contains("at least one case"));
}
