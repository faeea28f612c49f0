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

/// Re-tuning has left a gap as large as the noise, and friction in the suspension closes it.
Evidence friction() {
  Evidence evidence = evidence_with_gap(1);
  evidence.singles = {single(evidence, "coulomb_friction", "suspension", 0.01),
                      single(evidence, "hysteresis", "tyre", 0.6)};
  return evidence;
}

/// Friction explains three quarters; with a tyre's damping all is explained.
Evidence two_effects() {
  Evidence evidence = evidence_with_gap(4);
  evidence.singles = {single(evidence, "coulomb_friction", "suspension", 1),
                      single(evidence, "tyre_damping", "tyre", 3)};
  evidence.pairs = {pair(evidence, "coulomb_friction", "tyre_damping", "suspension", "tyre", 0.01),
                    pair(evidence, "coulomb_friction", "time_delay", "suspension", "actuator", 0.9)};
  return evidence;
}

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

TEST_CASE("a second effect is named where the pair is needed and either alone is not enough") {
  Evidence evidence = two_effects();
  Verdict verdict = decide(evidence);
  CHECK(verdict.named == Names{"coulomb_friction@suspension"_effect, "tyre_damping@tyre"_effect});
  CHECK(std::get<Effects>(verdict.answer).count == 2);
  CHECK(verdict.suspects[1].misfit == evidence.pairs[0].stage.misfit);
  // One effect alone, fitted anew, is as good.
  evidence.pairs[0].alone_chi2 = {evidence.samples * 1.011, evidence.samples * 4};
  CHECK(decide(evidence).named.size() == 1);
  // What remains of the first is as much as chance leaves.
  evidence = two_effects();
  evidence.singles[0] = single(evidence, "coulomb_friction", "suspension", 0.003);
  evidence.pairs[0] = pair(evidence, "coulomb_friction", "tyre_damping", "suspension", "tyre", 0);
  CHECK(decide(evidence).named == Names{"coulomb_friction@suspension"_effect});
  // At one place a second effect has to remove more.
  evidence = two_effects();
  evidence.pairs = {pair(evidence, "coulomb_friction", "bump_stop", "suspension", "suspension", 0.4)};
  CHECK(decide(evidence).named.size() == 1);
  evidence.pairs = {pair(evidence, "coulomb_friction", "tyre_damping", "suspension", "tyre", 0.4)};
  CHECK(decide(evidence).named.size() == 2);
  // Neither is named by a size that is another effect's.
  for (std::size_t odd = 0; odd < 2; ++odd) {
    evidence = two_effects();
    evidence.pairs.resize(1);
    evidence.pairs[0].effects[odd].defining = {{"gain", 170, 0.7, 1.3, 6}};
    CHECK(decide(evidence).named.size() == 1);
    evidence.pairs[0].effects[odd].defining = {{"gain", 1.2, 0.7, 1.3, 1}};
    CHECK(decide(evidence).named.size() == 2);
  }
}

TEST_CASE("pairs that differ in one effect share its probability, and one pair in either order counts once") {
  const auto told = [](bool rival_first, double rival_leaves) {
    Evidence evidence = two_effects();
    evidence.singles.push_back(single(evidence, "hysteresis", "suspension", 1.5));
    const CandidateEvidence rival = pair(evidence, "hysteresis", "tyre_damping", "suspension", "tyre", rival_leaves);
    const CandidateEvidence swapped = pair(evidence, "tyre_damping", "coulomb_friction", "tyre", "suspension", 0.011);
    evidence.pairs.insert(rival_first ? evidence.pairs.begin() : evidence.pairs.end(), rival);
    evidence.pairs.push_back(swapped);
    return decide(evidence);
  };
  for (const bool rival_first : {false, true}) {
    const Verdict tie = told(rival_first, 0.0101);
    REQUIRE(tie.named.size() == 2);
    CHECK(tie.suspects[0].name() == "coulomb_friction@suspension"_effect);
    CHECK(tie.suspects[0].probability < 0.7);
    CHECK(tie.suspects[1].probability > 0.9);
    CHECK(tie.ambiguous_with == Names{"hysteresis@suspension"_effect});
    std::map<EffectAt, double> probabilities;
    for (const Suspect& suspect : tie.suspects)
      CHECK(probabilities.emplace(suspect.name(), suspect.probability).second);
    CHECK(probabilities["hysteresis@suspension"_effect] > 0.2);
    const Verdict clear = told(rival_first, 0.9);
    CHECK(clear.suspects[0].probability > 0.9);
    CHECK(clear.ambiguous_with.empty());
  }
}

TEST_CASE("a third effect is named where what two leave needs it, and none of the three can be spared") {
  const auto three = [](double two_leave, double three_leave) {
    Evidence evidence = two_effects();
    evidence.pairs[0] = pair(evidence, "coulomb_friction", "tyre_damping", "suspension", "tyre", two_leave);
    CandidateEvidence set = pair(evidence, "coulomb_friction", "tyre_damping", "suspension", "tyre", three_leave);
    CandidateEvidence other = set;
    set.effects.push_back({"time_delay", "sensor:travel"_at, "form", {{"size", 1, 0}}, {}});
    set.without_chi2 = {evidence.samples * 4, evidence.samples * 2, evidence.pairs[0].chi2};
    other.effects.push_back({"drift", "sensor:body_acc"_at, "form", {{"size", 1, 0}}, {}});
    other.chi2 = evidence.samples * (1 + 0.9 * two_leave);
    evidence.larger = {set, other};
    return evidence;
  };
  Evidence evidence = three(0.4, 0.01);
  Verdict verdict = decide(evidence);
  CHECK(verdict.row == "3e");
  CHECK(verdict.named ==
        Names{"coulomb_friction@suspension"_effect, "tyre_damping@tyre"_effect, "time_delay@sensor:travel"_effect});
  REQUIRE(std::get<Effects>(verdict.answer).count == 3);
  CHECK(&candidate_of(evidence, std::get<Effects>(verdict.answer)) == &evidence.larger[0]);
  REQUIRE(verdict.suspects.size() >= 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(verdict.suspects[i].name() == verdict.named[i]);
    CHECK(verdict.suspects[i].probability > 0.8);
  }
  CHECK(verdict.ambiguous_with.empty());
  // The file tells the same.
  const Evidence read = evidence_from(JsonCursor::from(Json::parse(to_json(evidence).dump()), "evidence"));
  CHECK(decide(read).named == verdict.named);
  // It removes too little, or one of the three can be spared.
  CHECK(decide(three(0.4, 0.3)).named.size() == 2);
  evidence.larger[0].without_chi2[1] = evidence.larger[0].chi2 * 1.001;
  CHECK(decide(evidence).named.size() == 2);
  // What was found beside another pair counts as well, and a pair that is not enough to be named.
  evidence = three(0.4, 0.01);
  evidence.larger[0].effects[1].location = "actuator"_at;
  CHECK(decide(evidence).named ==
        Names{"coulomb_friction@suspension"_effect, "tyre_damping@actuator"_effect, "time_delay@sensor:travel"_effect});
  evidence = three(0.6, 0.01);
  CHECK(decide(evidence).named.size() == 3);
  evidence.larger.clear();
  CHECK(decide(evidence).named.size() == 1);
  CHECK(decide(evidence).largest.count == 2);
}

TEST_CASE("what may be the error of a form is explained by further effects nearly whole, or not at all") {
  // Friction leaves 5 % of the gap, five times the noise.
  const auto told = [](double two_leave, double three_leave, const std::string& second_at = "tyre") {
    Evidence evidence = evidence_with_gap(100);
    evidence.singles = {single(evidence, "coulomb_friction", "suspension", 5)};
    evidence.pairs = {pair(evidence, "coulomb_friction", "tyre_damping", "suspension", second_at, two_leave)};
    CandidateEvidence set = evidence.pairs[0];
    set.effects.push_back({"time_delay", "sensor:travel"_at, "form", {{"size", 1, 0}}, {}});
    set.chi2 = evidence.samples * (1 + three_leave);
    evidence.larger = {set};
    return decide(evidence);
  };
  CHECK(told(0.01, 0.005).named.size() == 2);
  CHECK(told(2, 0.01).named.size() == 3);
  CHECK(told(0.01, 0.005, "suspension").named.size() == 1);  // at its own place it is the form's error all the more
  CHECK(told(2, 0.8).named.size() == 1);
  CHECK(told(2, 0.8).largest.count == 3);
  CHECK(told(2, 1.5).named.size() == 1);
  CHECK(told(2, 1.8).largest.count == 2);
}

TEST_CASE("beside an effect that stores nothing its element's damping bends, and beside an elastic one the stiffness") {
  const auto named = [](std::size_t wrong, std::size_t bent, bool elastic, bool dissipative) {
    Evidence evidence = friction();
    evidence.tolerances[2].location = "suspension"_at;
    evidence.singles[0].effects[0].elastic = elastic;
    evidence.singles[0].effects[0].dissipative = dissipative;
    evidence.singles[0].freed = {freed(evidence, wrong, 0.002)};
    evidence.singles[0].freed[0].z[bent] = 5;
    return decide(evidence).named.size();
  };
  const std::size_t body = 0, damping = 1, stiffness = 2;
  CHECK(named(stiffness, damping, false, true) == 2);
  CHECK(named(damping, stiffness, true, false) == 2);
  CHECK(named(stiffness, damping, true, false) == 1);
  CHECK(named(damping, stiffness, false, true) == 1);
  CHECK(named(damping, stiffness, false, false) == 1);
  CHECK(named(stiffness, body, false, true) == 1);
  // A parameter of another element where an effect acts says nothing of this one's damper.
  for (const bool out : {false, true}) {
    Evidence evidence = two_effects();
    evidence.pairs[0].effects[0].dissipative = evidence.pairs[0].effects[1].elastic = true;
    evidence.pairs[0].freed = {freed(evidence, stiffness, -0.002)};
    if (out) evidence.pairs[0].freed[0].z[damping] = 5;
    CHECK(decide(evidence).named.size() == (out ? 2 : 3));
  }
}

TEST_CASE("at one place an elastic and a dissipative effect are two, and two of one kind are one form's error") {
  const auto told = [](double left, const char* kinds) {
    Evidence evidence = evidence_with_gap(100);
    evidence.singles = {single(evidence, "bump_stop", "suspension", 5)};
    evidence.pairs = {pair(evidence, "bump_stop", "damper_nonlinearity", "suspension", "suspension", left)};
    for (std::size_t i = 0; i < 2; ++i) {
      evidence.pairs[0].effects[i].elastic = kinds[i] == 'e';
      evidence.pairs[0].effects[i].dissipative = kinds[i] == 'd';
    }
    return decide(evidence).named.size();
  };
  for (const double left : {0.01, 0.3}) {
    CAPTURE(left);
    CHECK(told(left, "ed") == 2);
    CHECK(told(left, "de") == 2);
    for (const char* kinds : {"ee", "dd", "e-", "-d", "--"}) CHECK(told(left, kinds) == 1);
  }
  CHECK(told(0.8, "ed") == 1);  // not nearly whole
}

TEST_CASE(
    "a parameter beside an effect is named where it alone takes off enough, never where a wrong form bends others") {
  Evidence evidence = friction();
  evidence.singles[0].freed = {freed(evidence, 1, 0.002)};
  FreedEvidence& damping = evidence.singles[0].freed[0];
  CHECK(decide(evidence).named == Names{"coulomb_friction@suspension"_effect, "damping_error@suspension"_effect});
  const Verdict beside_body = [&] {
    Evidence other = evidence;
    other.singles[0].freed = {freed(evidence, 0, 0.002)};
    return decide(other);
  }();
  REQUIRE(beside_body.locations.size() >= 2);
  CHECK(beside_body.locations[1].location == "body"_at);  // its place is told with it, as sure as it is
  CHECK(beside_body.locations[1].probability == beside_body.suspects[1].probability);
  damping.chi2 = evidence.singles[0].chi2 - 1;  // it has moved far along what the records do not tell
  CHECK(decide(evidence).named.size() == 1);
  damping.chi2 = evidence.samples * 1.002;
  damping.theta[1] = 2;  // nothing is wrong with it
  CHECK(decide(evidence).named.size() == 1);
  damping.theta[1] = 6.5;
  damping.std = 3;  // the data hardly tell it
  CHECK(decide(evidence).named.size() == 1);
  damping.std = 1;
  evidence.noise.colour = 30;  // or less surely than white noise would let them
  CHECK(decide(evidence).named.size() == 1);
  damping.std_of_tolerances = 1;  // unless it is the other tolerances that leave it open
  CHECK(decide(evidence).named.size() == 2);
  damping.std_of_tolerances = 0;
  evidence.noise.colour = 1;
  CHECK(decide(evidence).named.size() == 2);
  evidence.singles[0].freed[0].z[0] = 5;  // another one is out as well
  CHECK(decide(evidence).named.size() == 1);
  evidence.singles[0].freed[0].z[0] = 0.1;
  // What belongs to the element of the effect bends with its form, beside a parameter of another part.
  const std::vector<FreedEvidence> of_damping = evidence.singles[0].freed;
  evidence.singles[0].freed = {freed(evidence, 0, 0.002)};
  for (std::size_t i : {1, 2}) {
    evidence.singles[0].freed[0].z[i] = 5;
    CHECK(decide(evidence).named.size() == (evidence.tolerances[i].location == "suspension"_at ? 2 : 1));
    evidence.singles[0].freed[0].z[i] = 0.1;
  }
  evidence.singles[0].freed = of_damping;
  evidence.singles[0].freed.push_back(evidence.singles[0].freed[0]);  // or another one explains as much
  evidence.singles[0].freed[1].tolerance = 0;
  std::swap(evidence.singles[0].freed[1].theta[0], evidence.singles[0].freed[1].theta[1]);
  CHECK(decide(evidence).named.size() == 1);
  evidence.singles[0].freed.pop_back();
  CHECK(decide(evidence).named.size() == 2);
  // Where the effect leaves much, its form is not the rig's, and a parameter may bend around that: one that the records
  // hardly tell does, one that they tell sharply does not.
  for (CandidateEvidence& candidate : evidence.singles) candidate.chi2 += 0.2 * evidence.samples;
  evidence.singles[0].freed[0].chi2 += 0.2 * evidence.samples;
  evidence.retuned_chi2 += evidence.samples;
  CHECK(decide(evidence).named.size() == 1);
  evidence.singles[0].freed[0].std = 0.05;
  CHECK(decide(evidence).named.size() == 2);
}

TEST_CASE("of parameters beside an effect the one that explains most is named, and of equals the nearer one") {
  const auto named = [](double left_0, double size_0, double left_1, double size_1) {
    Evidence evidence = friction();
    std::vector<FreedEvidence>& list = evidence.singles[0].freed;
    list = {freed(evidence, 0, left_0), freed(evidence, 1, left_1)};
    list[0].theta[0] = size_0;
    list[1].theta[1] = size_1;
    // In whichever order the search tells them.
    const std::vector<EffectAt> one = decide(evidence).named;
    std::swap(list[0], list[1]);
    CHECK(decide(evidence).named == one);
    return one.size() < 2 ? "none" : to_string(one[1]);
  };
  CHECK(named(0.002, 6.5, 0.004, 6.5) == "mass_error@body");
  CHECK(named(0.004, 6.5, 0.002, 6.5) == "damping_error@suspension");
  CHECK(named(0.002, 8, 0.002, 80) == "mass_error@body");
  CHECK(named(0.002, -80, 0.002, -8) == "damping_error@suspension");
  CHECK(named(0.002, 8, 0.002, -8) == "none");
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
