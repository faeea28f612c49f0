// The verdict from synthetic evidence: a test for each row of the decision table, and what must hold for all of them.
#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "core/base/status.hpp"
#include "core/gap/verdict/decide.hpp"
#include "core/gap/verdict/faults.hpp"
#include "core/gap/verdict/posterior.hpp"
#include "tests/support/evidence.hpp"
#include "tests/support/places.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Names = std::vector<EffectAt>;

namespace {

/// Every evidence of this file, one for each row.
std::vector<std::pair<std::string, Evidence>> rows() {
  std::vector<std::pair<std::string, Evidence>> all;
  Evidence evidence = evidence_with_gap(1);
  evidence.cannot_follow = "the plant cannot follow";
  all.emplace_back("0", evidence);
  evidence = evidence_with_gap(0.02);
  evidence.delivered_chi2 = 3 * evidence.samples;
  evidence.tolerances[0].theta = 2;
  evidence.freed = {freed(evidence, 0, 0.02)};
  evidence.freed[0].prior_chi2 = 0;
  all.emplace_back("1a", evidence);
  evidence = evidence_with_gap(0.02);
  evidence.lattices = {{"travel", 1e-4, 0.8}};
  all.emplace_back("1b", evidence);
  all.emplace_back("1c", evidence_with_gap(0.02));
  evidence = evidence_with_gap(1);
  all.emplace_back("1d, 4d", evidence);
  evidence = evidence_with_gap(0.05);
  evidence.retuned_prior_chi2 = 100;
  evidence.freed = {freed(evidence, 0, 0.01)};
  all.emplace_back("2a", evidence);
  evidence.freed[0].z[1] = 9;
  all.emplace_back("2b, 4d", evidence);
  evidence = friction();
  evidence.singles[0].effects[0].defining = {{"relaxation_s", 0.2, 0.001, 0.02, 4}};
  all.emplace_back("3a", evidence);
  evidence = evidence_with_gap(1);
  evidence.singles = {single(evidence, "quantisation", "sensor:travel", 0.6)};
  evidence.lattices = {{"travel", 1e-4, 0.8}};
  all.emplace_back("3c", evidence);
  evidence.lattices.clear();
  all.emplace_back("3d, 4d", evidence);
  evidence = evidence_with_gap(0.05);
  evidence.singles = {single(evidence, "coulomb_friction", "suspension", 0.04)};
  all.emplace_back("3b", evidence);
  all.emplace_back("3e", friction());
  evidence = friction();
  evidence.singles[0].freed = {freed(evidence, 0, 0)};
  all.emplace_back("3f", evidence);
  evidence = evidence_with_gap(1);
  evidence.places.clear();
  evidence.places_needed = 0;
  all.emplace_back("1d, 4a", evidence);
  evidence = evidence_with_gap(1);
  evidence.places_needed = 2;
  evidence.place_pairs = {{{"sensor:travel"_at, "suspension"_at}, 1}, {{"tyre"_at, "suspension"_at}, 5}};
  all.emplace_back("1d, 4b", evidence);
  evidence = evidence_with_gap(1);
  std::swap(evidence.places[0].location, evidence.places[1].location);
  evidence.motion = {{"guide:body"_at, {}, false, 0}};
  all.emplace_back("1d, 4c", evidence);
  return all;
}

Verdict verdict_of(const std::string& row) {
  for (const auto& [name, evidence] : rows())
    if (name == row) return decide(evidence);
  FAIL("no evidence for row " << row);
  return {};
}

}  // namespace

TEST_CASE("a gap within two standard errors of the floor's power is none, and a larger one is") {
  for (const double gap : {0.05, 0.15, 0.3}) {
    Evidence evidence = evidence_with_gap(gap);
    for (const double error : {0.0, 0.02, 0.1, 0.2}) {
      CAPTURE(gap, error);
      evidence.noise.power_error = error;
      CHECK(is<NoGap>(decide(evidence)) == (gap <= std::max(0.1, 2 * error)));
    }
  }
}

TEST_CASE("each row of the decision table is reached by the evidence that it describes") {
  for (const auto& [row, evidence] : rows()) {
    CAPTURE(row);
    const Verdict verdict = decide(evidence);
    CHECK(verdict.row == row);
    CHECK_FALSE(verdict.why.empty());
  }
}

TEST_CASE("where the most probable parameter needs another one, the next that needs none is named") {
  Evidence evidence = evidence_with_gap(0.05);
  evidence.retuned_prior_chi2 = 100;
  evidence.freed = {freed(evidence, 0, 0.01), freed(evidence, 2, 0.0101)};
  evidence.freed[0].z[2] = 9;
  Verdict verdict = decide(evidence);
  CHECK(verdict.row == "2a");
  CHECK(verdict.named == Names{"stiffness_error@tyre"_effect});
  evidence.freed[1].z[1] = -9;  // neither is alone
  verdict = decide(evidence);
  CHECK_THAT(verdict.row, Catch::StartsWith("2b"));
}

TEST_CASE("what each row names, and what kind of answer it is") {
  CHECK(is<Insufficient>(verdict_of("0")));
  CHECK(verdict_of("1a").named == Names{"mass_error@body"_effect});
  CHECK(is<Parameters>(verdict_of("1a")));
  CHECK(verdict_of("1b").named == Names{"quantisation@sensor:travel"_effect});
  CHECK(is<NoGap>(verdict_of("1c")));
  CHECK(verdict_of("1d, 4d").named == Names{"unknown@suspension"_effect});
  CHECK(verdict_of("2a").named == Names{"mass_error@body"_effect});
  CHECK(outcome_of(verdict_of("2a")) == "parameter");
  CHECK_THAT(verdict_of("2b, 4d").message, Catch::Contains("would need suspension.viscous_damper"));
  CHECK(verdict_of("3a").named == Names{"unknown@suspension"_effect});
  CHECK_THAT(verdict_of("3a").message, Catch::Contains("relaxation_s 0.2, usually 0.001 to 0.02"));
  CHECK(is<NoGap>(verdict_of("3b")));
  CHECK(verdict_of("3b").named.empty());
  CHECK(is<Rounding>(verdict_of("3c")));
  CHECK(is_place(verdict_of("3d, 4d")));
  CHECK(verdict_of("3e").named == Names{"coulomb_friction@suspension"_effect});
  CHECK(verdict_of("3f").named == Names{"coulomb_friction@suspension"_effect, "mass_error@body"_effect});
  CHECK(outcome_of(verdict_of("3f")) == "several");
  CHECK(is<Insufficient>(verdict_of("1d, 4a")));
  CHECK(is<AtTwoPlaces>(verdict_of("1d, 4b")));
  CHECK(verdict_of("1d, 4b").named == Names{"unknown@sensor:travel"_effect, "unknown@suspension"_effect});
  CHECK(is<Exogenous>(verdict_of("1d, 4c")));
  CHECK(verdict_of("1d, 4c").named == Names{"exogenous_force@body"_effect});
}

TEST_CASE("probabilities lie below one, suspects lead with what is named, and locations are sorted") {
  for (const auto& [row, evidence] : rows()) {
    CAPTURE(row);
    const Verdict verdict = decide(evidence);
    for (const Suspect& suspect : verdict.suspects) {
      CHECK(suspect.probability >= 0);
      CHECK(suspect.probability < 1);
    }
    if (is<Effects>(verdict) || is<Parameters>(verdict) || is<Rounding>(verdict))
      for (std::size_t i = 0; i < verdict.named.size(); ++i) CHECK(verdict.suspects[i].name() == verdict.named[i]);
    for (std::size_t i = 1; !is<AtTwoPlaces>(verdict) && i < verdict.locations.size(); ++i)
      CHECK(verdict.locations[i - 1].probability >= verdict.locations[i].probability);
    for (const EffectAt& other : verdict.ambiguous_with)
      CHECK(std::find(verdict.named.begin(), verdict.named.end(), other) == verdict.named.end());
  }
}

TEST_CASE("evidence and thresholds come back from their files to the last bit, and with them the verdict") {
  for (const auto& [row, evidence] : rows()) {
    CAPTURE(row);
    const std::string text = to_json(evidence).dump();
    const Evidence again = evidence_from(JsonCursor::from(parse_json(text, "e"), "e"));
    CHECK(to_json(again).dump() == text);
    const Thresholds thresholds = thresholds_from(JsonCursor::from(to_json(Thresholds{}), "t"));
    const Verdict first = decide(evidence), second = decide(again, thresholds);
    CHECK(first.row == second.row);
    CHECK(first.named == second.named);
    REQUIRE(first.suspects.size() == second.suspects.size());
    for (std::size_t i = 0; i < first.suspects.size(); ++i)
      CHECK(first.suspects[i].probability == second.suspects[i].probability);
  }
}

TEST_CASE("evidence that does not hold together is refused with its path") {
  const auto refused = [](const std::function<void(Json&)>& spoil) {
    Json file = to_json(two_effects());
    spoil(file);
    CHECK_THROWS_AS(evidence_from(JsonCursor::from(file, "e")), UserError);
  };
  refused([](Json& file) { file.erase("singles"); });
  refused([](Json& file) { file["singles"][0]["chi2"] = "much"; });
  refused([](Json& file) { file["singles"][0]["effects"] = Json::array(); });
  refused([](Json& file) { file["places_needed"] = 2; });
  refused([](Json& file) { file["more"] = 1; });
  refused([](Json& file) {
    file["freed"] = Json::array({to_json(rows()[1].second).at("freed")[0]});
    file["freed"][0]["tolerance"] = 7;
  });
  CHECK_THROWS_AS(thresholds_from(JsonCursor::from(Json::parse(R"([{"name": "notise", "value": 1}])"), "t")),
                  UserError);
}

TEST_CASE("the motion of an element on a mass places a force there only if it explains much, or the leftovers agree") {
  const auto place = [](double share, double leftover) {
    Evidence evidence = evidence_with_gap(3);
    evidence.places = {{"guide:body"_at, {}, 1}, {"suspension"_at, {}, leftover}, {"tyre"_at, {}, 20}};
    evidence.motion = {{"guide:body"_at, {}, false, 0.9},
                       {"guide:body"_at, "guide:body"_at, false, 0.2},
                       {"guide:body"_at, "suspension"_at, true, share}};
    return to_string(decide(evidence).named.front());
  };
  CHECK(place(0.27, 8) == "unknown@body");
  CHECK(place(0.27, 1.2) == "unknown@suspension");
  CHECK(place(0.8, 8) == "unknown@suspension");  // a force that is passed on to one end only
  CHECK(place(0.1, 1.2) == "unknown@body");
}

TEST_CASE("what the travel of a tyre hardly explains is its law only where the wheel's motion explains clearly less") {
  const auto place = [](double tyre, double wheel) {
    Evidence evidence = evidence_with_gap(3);
    evidence.places = {{"tyre"_at, {"actuator"_at, "guide:wheel"_at}, 1}, {"suspension"_at, {}, 9}};
    evidence.motion = {{"tyre"_at, {}, false, std::max(tyre, wheel)},
                       {"tyre"_at, "tyre"_at, false, tyre},
                       {"tyre"_at, "guide:wheel"_at, false, wheel}};
    return to_string(decide(evidence).named.front());
  };
  CHECK(place(0.8, 0.6) == "unknown@tyre");
  CHECK(place(0.27, 0.09) == "unknown@tyre");
  CHECK(place(0.27, 0.25) == "unknown@wheel");
  CHECK(place(0.1, 0.8) == "unknown@wheel");
}

TEST_CASE("an answer from a place that another signal explains better loses its name") {
  Evidence evidence = friction();
  evidence.singles[0] = single(evidence, "crosstalk", "sensor:travel", 0.15);
  evidence.places.push_back({"sensor:travel"_at, {}, 8});
  const Verdict verdict = decide(evidence);
  CHECK(is_place(verdict));
  CHECK(verdict.suspects.front().probability < 0.1);
}

TEST_CASE("channels in another unit are told wherever nothing is named") {
  Evidence evidence = evidence_with_gap(1);
  evidence.gross_faults = {{"gain_error", "sensor:travel"_at, 1000}};
  CHECK_THAT(decide(evidence).message, Catch::Contains("travel reads 1e+03 times"));
  evidence.singles = friction().singles;
  CHECK(decide(evidence).message.empty());
}

TEST_CASE("every threshold has a unit, a meaning, an origin and a reason, and a name of its own") {
  std::vector<std::string> names;
  for (const Json& own : to_json(Thresholds{})) {
    CAPTURE(own.dump());
    names.push_back(own.at("name"));
    for (const char* key : {"unit", "meaning", "origin", "why"}) CHECK_FALSE(own.at(key).get<std::string>().empty());
  }
  std::sort(names.begin(), names.end());
  CHECK(std::adjacent_find(names.begin(), names.end()) == names.end());
}

TEST_CASE("an effect is not lost to a parameter of its name that explains the gap with others out of tolerance alone") {
  Evidence evidence = friction();
  evidence.retuned_stopped = true;
  evidence.singles = {single(evidence, "spring_nonlinearity", "suspension", 0.001),
                      single(evidence, "bump_stop", "suspension", 0.05)};
  evidence.tolerances.push_back({"suspension.hardening_spring.alpha_per_m2", "spring_nonlinearity", "suspension"_at});
  evidence.freed = {freed(evidence, 0, 0.001)};
  evidence.freed[0].tolerance = 3;
  evidence.freed[0].theta = {0.1, 0.1, 9, 300};
  evidence.freed[0].z = {0.1, 0.1, 9, 300};
  for (CandidateEvidence& own : evidence.singles) own.log_plausibility = -1;  // the parameter is the most probable
  CHECK(decide(evidence).named.front() == "spring_nonlinearity@suspension"_effect);
  CHECK(is<Effects>(decide(evidence)));
}

TEST_CASE("gross faults that were corrected are named before the answer, and are the answer where it has no name") {
  const auto corrected = [](Evidence evidence) {
    evidence.correction.faults = {
        {"gain_error", "sensor:travel"_at, "gain", {{"sensor:travel.gain", 0.001, 1e-6}}, {}}};
    evidence.correction.retuned_without = stage_at(1000);
    evidence.correction.closure = {0.9, 0.89, 0.91};
    evidence.correction.closure_with_answer = {0.99, 0.98, 1};
    return evidence;
  };
  const EffectAt fault = "gain_error@sensor:travel"_effect;
  for (const auto& [row, evidence] : rows()) {
    CAPTURE(row);
    if (row == "0") continue;
    const Verdict alone = decide(evidence), both = decide(corrected(evidence));
    REQUIRE_FALSE(both.named.empty());
    CHECK(both.named.front() == fault);
    CHECK(both.locations.front().location == "sensor:travel"_at);
    CHECK(both.suspects.front().name() == fault);
    CHECK_THAT(both.row, Catch::StartsWith("5, "));
    if (is<Instruments>(both)) {
      CHECK(both.named.size() == 1);
      CHECK(closure_of(corrected(evidence), both).value == 0.9);
      CHECK(outcome_of(both) == "effect");
    } else {
      CHECK(both.named.size() == alone.named.size() + 1);
      CHECK(outcome_of(both) == "several");
    }
  }
  CHECK(closure_of(corrected(friction()), decide(corrected(friction()))).value == 0.99);
  CHECK(closure_of_retuning(corrected(friction())) < 0);  // of the plant without the correction
}

TEST_CASE("what interpolation onto another clock makes of a gap has no name beside that clock") {
  Evidence evidence = friction();
  evidence.correction.faults = {{"clock_skew", clock_place(), "linear", {{"timebase.clock_skew", 0.005, 1e-6}}, {}}};
  evidence.correction.retuned_without = stage_at(1000);
  const double gap = evidence.retuned_chi2 / evidence.samples - 1;
  evidence.correction.interpolation = 0.9 * gap;
  CHECK(decide(evidence).named == Names{"clock_skew@timebase"_effect, "coulomb_friction@suspension"_effect});
  evidence.correction.interpolation = 1.1 * gap;
  CHECK(decide(evidence).named == Names{"clock_skew@timebase"_effect});
  CHECK(is<Instruments>(decide(evidence)));
}

TEST_CASE("faults go into the plant only where they explain what re-tuning does not") {
  const Thresholds thresholds;
  CHECK(faults_explain(50000, 12000, 10000, 1, false, thresholds));
  CHECK_FALSE(faults_explain(50000, 35000, 10000, 1, false, thresholds));
  CHECK(faults_explain(50000, 35000, 10000, 1, true, thresholds));  // a wrong sign bends the plant
  CHECK_FALSE(faults_explain(50000, 40000, 10000, 1, true, thresholds));
  CHECK_FALSE(faults_explain(10060, 10030, 10000, 1, false, thresholds));
  CHECK_FALSE(faults_explain(10060, 10010, 10000, 4, false, thresholds));
}

TEST_CASE("a parameter that the records tell only against one other component may be right, and that one off instead") {
  Evidence evidence = evidence_with_gap(0.05);
  evidence.retuned_prior_chi2 = 100;
  evidence.freed = {freed(evidence, 0, 0.01)};
  evidence.tolerances.push_back({"suspension.linear_spring.stiffness_n_per_m", "stiffness_error", "suspension"_at});
  evidence.freed[0].not_told_from = {1, 3};
  const Verdict verdict = decide(evidence);
  CHECK(outcome_of(verdict) == "ambiguous");
  CHECK(verdict.named == Names{"mass_error@body"_effect});
  CHECK(verdict.ambiguous_with == Names{"damping_error@suspension"_effect, "stiffness_error@suspension"_effect});
  CHECK(verdict.suspects.front().probability <= 0.5);
  CHECK(verdict.suspects.front().parameters.front().std == 0);
  CHECK_THAT(verdict.message, Catch::Contains("only against"));
  evidence.freed[0].not_told_from = {1, 2};  // of two components: one that is wrong is more probable than two
  CHECK(outcome_of(decide(evidence)) == "parameter");
}
