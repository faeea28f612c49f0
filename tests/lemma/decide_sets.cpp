// The verdict on sets of effects and on parameters beside them, from synthetic evidence.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/gap/verdict/decide.hpp"
#include "core/gap/verdict/posterior.hpp"
#include "tests/support/evidence.hpp"
#include "tests/support/places.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Names = std::vector<EffectAt>;

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
  CHECK(told(0.3, 0.3, "suspension").named.size() == 1);    // at its own place it is the form's error all the more,
  CHECK(told(0.03, 0.03, "suspension").named.size() == 2);  // unless next to nothing is left
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
  for (const double left : {0.01, 0.1, 0.3}) {
    CAPTURE(left);
    CHECK(told(left, "ed") == 2);
    CHECK(told(left, "de") == 2);
    // Where next to nothing is left of what the first one's form left, the second is no accident.
    for (const char* kinds : {"ee", "dd", "e-", "-d", "--"}) CHECK(told(left, kinds) == (left < 0.05 ? 2 : 1));
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

TEST_CASE("the more of a gap the form of a name leaves, the less probable it is, and further names all the more") {
  const Thresholds thresholds;
  double before = 1, second_before = 1;
  for (const double left : {0.01, 1.0, 5.0, 50.0, 200.0}) {  // times the noise, of a gap of 5,000
    CAPTURE(left);
    Evidence evidence = evidence_with_gap(5000);
    evidence.singles = {single(evidence, "coulomb_friction", "suspension", left)};
    const Verdict one = decide(evidence);
    REQUIRE(one.named == Names{"coulomb_friction@suspension"_effect});
    const double p = one.suspects.front().probability;
    CHECK(p <= before);
    CHECK(p >= thresholds.held_far * thresholds.surest - 0.02);
    before = p;
    evidence.singles[0].chi2 = (1 + 1500) * evidence.samples;
    evidence.pairs = {pair(evidence, "coulomb_friction", "tyre_damping", "suspension", "tyre", left)};
    const Verdict two = decide(evidence);
    REQUIRE(two.named.size() == 2);
    CHECK(two.suspects[1].probability <= second_before);
    CHECK(two.suspects[1].probability <= two.suspects[0].probability);
    second_before = two.suspects[1].probability;
    if (left <= thresholds.much_left) CHECK(p > 0.97);
  }
  CHECK(before < 0.85);
  CHECK(second_before < 0.7);
  // What removes all but a ten-thousandth of a gap is not in doubt for being far from the noise.
  Evidence evidence = evidence_with_gap(1e6);
  evidence.singles = {single(evidence, "coulomb_friction", "suspension", 100)};
  CHECK(decide(evidence).suspects.front().probability > 0.97);
}

TEST_CASE(
    "a factor of an instrument beside its law in time is another kind, and two laws in time are one form's error") {
  const auto told = [](const char* one, const char* other, double left) {
    Evidence evidence = evidence_with_gap(100);
    evidence.places[0].location = "sensor:travel"_at;
    evidence.singles = {single(evidence, one, "sensor:travel", 5)};
    evidence.pairs = {pair(evidence, one, other, "sensor:travel", "sensor:travel", left)};
    return decide(evidence).named.size();
  };
  CHECK(told("sensor_lag", "gain_error", 0.1) == 2);
  CHECK(told("gain_error", "high_pass", 0.1) == 2);
  CHECK(told("sensor_lag", "time_delay", 0.1) == 1);
  CHECK(told("sensor_lag", "gain_error", 0.8) == 1);  // not nearly whole
}

TEST_CASE("a second effect that brings home what the first bends elsewhere is named for what the tolerances tell") {
  // The first leaves 2 % of the noise and a bent body beyond that, of which the second takes the bend alone.
  const auto told = [](double bent, double home, const char* second_at) {
    Evidence evidence = evidence_with_gap(100);
    evidence.singles = {single(evidence, "bump_stop", "suspension", 0.06)};
    evidence.singles[0].theta = {bent, 0, 0};
    evidence.singles[0].prior_chi2 = bent * bent;
    evidence.pairs = {pair(evidence, "bump_stop", "gain_error", "suspension", second_at, 0.03)};
    evidence.pairs[0].theta = {home, 0, 0};
    evidence.pairs[0].prior_chi2 = home * home;
    evidence.pairs[0].alone_chi2 = {evidence.singles[0].chi2, evidence.retuned_chi2};
    return decide(evidence).named.size();
  };
  CHECK(told(18, 0.5, "actuator") == 2);
  CHECK(told(18, 16, "actuator") == 1);    // it stays away
  CHECK(told(0.5, 0.5, "actuator") == 1);  // nothing is bent, and half of what a form leaves says little
}
