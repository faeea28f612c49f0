// Hypotheses whose plant follows some records and not others, or only from some time on.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "core/data/metrics.hpp"
#include "core/gap/diagnose.hpp"
#include "core/gap/which/correction.hpp"
#include "core/gap/which/extend.hpp"
#include "core/gap/which/hypothesis.hpp"
#include "core/gap/which/search.hpp"
#include "core/plant/dataset.hpp"
#include "tests/support/places.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/solver/levenberg_marquardt.hpp"
#include "variants/table.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// Records of a plant that was moving before they began, without noise, at a floor of 1 % of each channel.
/// @param validation level of the validation record over that of the estimation record
RecordSet in_motion(const Plant& plant, Index samples, double validation = 1) {
  const Index ratio = 5, lead = 4000, inputs = plant.input_count();
  Random random = numbers(631);
  RecordSet set;
  set.sampling_hz = plant.hold_hz() / static_cast<double>(ratio);
  for (const char* role : {"estimation", "validation"}) {
    Matrix drive = Matrix::Zero(inputs, (lead + samples) * ratio);
    for (Index k = ratio; k < drive.cols(); ++k)  // held over a sample of the record
      for (Index i = 0; i < inputs; ++i) {
        const double size = plant.inputs[static_cast<std::size_t>(i)].kind == InputKind::force ? 1 : 1e-3;
        drive(i, k) = k % ratio == 0 ? 0.98 * drive(i, k - 1) + size * random.normal() : drive(i, k - 1);
      }
    if (std::string(role) == "validation") drive *= validation;
    GeneratedRecord made = generate_record(plant, drive, set.sampling_hz, {.substeps = stable_substeps(plant)});
    REQUIRE(made.status == Status::ok);
    made.signal.u = made.signal.u.rightCols(samples).eval();
    made.signal.y = made.signal.y.rightCols(samples).eval();
    set.records.push_back({role, role, "", 0, made.signal});
  }
  for (Index i = 0; i < plant.sensor_count(); ++i)
    set.noise_std[plant.sensors[static_cast<std::size_t>(i)].name] = 0.01 * rms(set.records[0].signal.y)(i);
  return set;
}

}  // namespace

TEST_CASE("a plant that cannot follow the held-out drive alone has no finite chi2 and is nobody's rival") {
  const Plant plant = plant_from(quarter_car_text);
  Plant heavy = plant;  // so that a parameter is out of its tolerance, and tried
  heavy.masses[0].mass_kg *= 1.2;
  const Index ratio = 5, samples = 500;
  RecordSet set;
  set.sampling_hz = plant.hold_hz() / static_cast<double>(ratio);
  for (const auto& [role, level] : {std::pair<std::string, double>{"estimation", 0.005}, {"validation", 10.0}}) {
    Matrix drive(1, samples * ratio);
    for (Index k = 0; k < drive.cols(); ++k)
      drive(0, k) = level * std::sin(9 * static_cast<double>(k) / plant.hold_hz());
    Matrix weak = 0.005 / level * drive;
    GeneratedRecord made = generate_record(heavy, weak, set.sampling_hz);
    REQUIRE(made.status == Status::ok);
    made.signal.u *= level / 0.005;
    set.records.push_back({role, role, "", 0, made.signal});
  }
  for (const Sensor& sensor : plant.sensors) set.noise_std[sensor.name] = 1e-3;
  const auto solver = make_levenberg_marquardt({});
  const GapData data = gap_data(plant, set, noise_floor(set), 0.25);
  const GapSolvers solvers{*solver, *solver, *solver};
  const CandidateList candidates = effect_candidates;
  const Study study{plant, data, solvers, candidates, tolerance_parameters(plant)};
  const Hypothesis lost = fit_hypothesis(study, plant, study.tolerances);
  CHECK(lost.fit.error.empty());
  CHECK(std::isinf(lost.chi2));
  CHECK(std::isinf(lost.stage.misfit));

  GapData same = data;
  same.held_out = same.fitted;
  const Study followed{plant, same, solvers, candidates, tolerance_parameters(plant)};
  const Hypothesis good = fit_hypothesis(followed, plant, followed.tolerances);
  REQUIRE_FALSE(good.fit.error.empty());
  const Search search{study, {}, {}, {}, good, good, {}};
  const FreedParameters freed = free_parameters(search, {0, 1});
  REQUIRE(freed.evidence.size() == 2);
  for (const FreedEvidence& own : freed.evidence) CHECK(own.chi2 >= good.chi2);
}

TEST_CASE(
    "a held-out record that reaches further tells parameters which the fitted ones did not, and refutes nothing") {
  Plant nominal = plant_from(quarter_car_text);
  nominal.inputs[0].interpolation = "zoh";
  const std::string bend = "suspension.hardening_spring.alpha_per_m2";
  Plant truth = nominal;
  set_parameter(truth, bend, 1.3 * get_parameter(nominal, bend));
  const RecordSet set = in_motion(truth, 2000, 6);
  const auto solver = make_levenberg_marquardt({});
  const GapData data = gap_data(nominal, set, noise_floor(set), 0.5);
  const GapSolvers solvers{*solver, *solver, *solver};
  const CandidateList candidates = effect_candidates;
  const Study study{nominal, data, solvers, candidates, tolerance_parameters(nominal)};
  const Hypothesis retuned = fit_hypothesis(study, nominal, study.tolerances);
  REQUIRE_FALSE(retuned.fit.error.empty());
  CAPTURE(retuned.held_out.misfit, retuned.fit.misfit, retuned.prior_chi2, data.samples);
  REQUIRE(retuned.held_out.misfit > 1.5);    // the fitted record leaves the bend to its tolerance,
  CHECK(retuned.chi2 < 0.1 * data.samples);  // but with both records it is found, which without noise is all there is
  CHECK(retuned.prior_chi2 > 4);             // at what that costs its prior,
  CHECK(retuned.stage.misfit > 1.5);         // and the figures of the held-out record stay what was predicted
  // A mass that is wrong is refuted by every record.
  Plant heavy = nominal;
  heavy.masses[1].mass_kg *= 1.5;
  const Study wrong{heavy, data, solvers, candidates, {}};
  CHECK(fit_hypothesis(wrong, heavy, {}).chi2 > 2 * data.samples);
}

TEST_CASE(
    "the larger the residuals that a fit expects, the nearer to home its parameters stay, and the less they know") {
  Plant nominal = plant_from(quarter_car_text);
  nominal.inputs[0].interpolation = "zoh";
  Plant truth = nominal;
  truth.elements[0].laws.push_back({find_law("coulomb_friction"), {60, 0, 0.05, 0.005}});
  const RecordSet set = in_motion(truth, 2000);
  const auto solver = make_levenberg_marquardt({});
  GapData data = gap_data(nominal, set, noise_floor(set), 0.5);
  const GapSolvers solvers{*solver, *solver, *solver};
  const CandidateList candidates = effect_candidates;
  const Study study{nominal, data, solvers, candidates, tolerance_parameters(nominal)};
  double prior = std::numeric_limits<double>::infinity(), misfit = 0;
  Vector std = Vector::Zero(static_cast<Index>(study.tolerances.size()));
  for (const double dispersion : {1.0, 1e2, 1e4, 1e6, 1e10}) {
    CAPTURE(dispersion);
    disperse(data, dispersion);
    const Hypothesis fitted = fit_hypothesis(study, nominal, study.tolerances);
    REQUIRE_FALSE(fitted.fit.error.empty());
    CHECK(fitted.prior_chi2 <= prior * (1 + 1e-6));
    CHECK(fitted.fit.misfit >= misfit * (1 - 1e-3));
    const Vector now = fitted.fit.covariance.diagonal().cwiseSqrt();
    CHECK((now - std).minCoeff() > -0.05);
    CHECK(now.maxCoeff() < 1 + 1e-9);
    prior = fitted.prior_chi2;
    misfit = fitted.fit.misfit;
    std = now;
  }
  CHECK(prior < 1e-4);
  CHECK(std.minCoeff() > 0.99);
}

TEST_CASE("what a fit leaves in one band disperses more than white noise of its size, and noise alone does not") {
  Random random = numbers(632);
  for (const double size : {1.0, 3.0}) {
    GapData data;
    data.fitted.push_back({Matrix::Zero(1, 4000), Matrix::Zero(2, 4000), 1, 0, Vector::Ones(2), {}});
    data.apart = false;
    PlantFit white, slow;
    white.error.push_back(size * random.normal(2, 4000));
    Matrix wave(2, 4000);
    for (Index k = 0; k < 4000; ++k)
      wave.col(k).setConstant(size * std::sqrt(2.0) * std::sin(0.05 * static_cast<double>(k)));
    slow.error.push_back(wave);
    const double of_white = dispersion_of(data, white, {}), of_slow = dispersion_of(data, slow, {});
    CAPTURE(size, of_white, of_slow);
    CHECK(of_white < 1 + 1.5 * (size * size - 0.95));
    CHECK(of_white >= 1);
    if (size > 1) CHECK(of_slow > 8 * of_white);
  }
}

TEST_CASE("behind a plant that is bent by it the wrong sign of a drive is found, and no sign where all are right",
          "[slow]") {
  Random random = numbers(633);
  for (int draw = 0; draw < 3; ++draw) {
    Plant truth = plant_from(chain_text);
    for (PlantInput& input : truth.inputs) input.interpolation = "zoh";
    Plant nominal = truth;
    for (const FitParameter& parameter : tolerance_parameters(truth))
      set_parameter(truth, parameter.name, get_parameter(truth, parameter.name) * (1 + 0.15 * random.normal()));
    for (const double sign : {1.0, -1.0}) {
      CAPTURE(draw, sign);
      set_parameter(truth, "actuator:motor.gain", sign);
      const RecordSet set = in_motion(truth, 1500);
      const auto solver = make_levenberg_marquardt({});
      const GapData data = gap_data(nominal, set, noise_floor(set), 0.5);
      const GapSolvers solvers{*solver, *solver, *solver};
      const CandidateList candidates = effect_candidates;
      const Study study{nominal, data, solvers, candidates, tolerance_parameters(nominal)};
      const Base base{nominal, fit_hypothesis(study, nominal, {}), fit_hypothesis(study, nominal, study.tolerances)};
      const std::vector<InstrumentFault> faults = wrong_sign(study, base, 1, {});
      if (sign > 0) {
        CHECK(faults.empty());
        continue;
      }
      REQUIRE(faults.size() == 1);
      CHECK(faults[0].effect == "gain_error");
      CHECK(faults[0].location == "actuator:motor"_at);
      CHECK(faults[0].value < -0.3);
    }
  }
}

namespace {

/// Records of a quarter car in motion, and the catalogue for it.
struct Offered {
  Plant plant = plant_from(quarter_car_text);
  RecordSet set = in_motion(plant, 1000);
  GapData data = gap_data(plant, set, noise_floor(set), 0.25);
  CandidateList catalogue = effect_candidates;
  std::vector<EffectCandidate> candidates;

  Offered() {
    Operation operation;
    REQUIRE(operation_of(plant, data.fitted, {}, operation));
    candidates = catalogue(plant, operation);
  }
};

}  // namespace

TEST_CASE("a law with two labels is one form with both, and two effects at one place never have one name") {
  const Offered offered;
  const std::vector<EffectCandidate>& all = offered.candidates;
  const auto find = [&](const std::string& form) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const EffectCandidate& own) {
      return own.location == "suspension"_at && own.label().form == form;
    });
    REQUIRE(found != all.end());
    return *found;
  };
  const EffectCandidate presliding = find("presliding"), hysteresis = find("Bouc-Wen"),
                        smoothed = find("smoothed sign");
  CHECK(same_form(presliding, hysteresis));
  CHECK_FALSE(same_form(presliding, smoothed));  // dry friction with a smoothed sign is another law
  REQUIRE(presliding.labels.size() == 2);
  REQUIRE(hysteresis.labels.size() == 2);
  // Both say the same of the same sizes, in whatever order: that of friction yields soon, that of hysteresis late.
  for (const double yield : {5e-5, 2e-3}) {
    std::map<EffectId, double> one, other;
    for (const auto& [candidate, found] : {std::pair{&presliding, &one}, std::pair{&hysteresis, &other}}) {
      Plant fitted = candidate->plant;
      set_parameter(fitted, candidate->parameters[1].name, yield);
      for (const Label& label : candidate->labels) (*found)[label.effect] = log_plausibility(label, fitted);
    }
    CHECK(one == other);
    CHECK((one.at("coulomb_friction") > one.at("hysteresis")) == (yield < 1e-3));
  }
  const auto named = [](const std::vector<EffectCandidate>& effects) {
    std::set<std::vector<EffectAt>> names;
    for (const std::vector<std::size_t>& labels : labellings(effects)) {
      std::vector<EffectAt> own;
      for (std::size_t i = 0; i < labels.size(); ++i) own.push_back(name_of(effects[i], effects[i].labels[labels[i]]));
      CHECK(std::set<EffectAt>(own.begin(), own.end()).size() == own.size());
      CHECK(names.insert(own).second);
    }
    return names.size();
  };
  CHECK(named({}) == 1);
  CHECK(named({presliding}) == 2);
  CHECK(named({presliding, hysteresis}) == 2);
  CHECK(named({presliding, smoothed}) == 3);
  CHECK(named({presliding, hysteresis, presliding}) == 0);  // two labels, three effects
  EffectCandidate elsewhere = smoothed;
  elsewhere.location = "tyre"_at;
  CHECK(named({presliding, elsewhere}) == 4);
  CHECK(labellings({presliding, elsewhere}).front() == std::vector<std::size_t>{0, 0});
}

TEST_CASE("a fit is a candidate under each way to name its effects, and knows its number among the fits") {
  const Offered offered;
  const Plant& plant = offered.plant;
  const auto solver = make_levenberg_marquardt({});
  const GapSolvers solvers{*solver, *solver, *solver};
  const Study study{plant, offered.data, solvers, offered.catalogue, {}};
  const Thresholds thresholds;
  const SearchEffort effort;
  const Bootstrap bootstrap{10, 0, 1};
  const Hypothesis nothing = fit_hypothesis(study, plant, {});
  const Step step;
  const Search search{study, thresholds, effort, bootstrap, nothing, nothing, step};
  Candidates candidates;
  std::vector<EffectAt> names;
  for (const std::string form : {"presliding", "smoothed sign", "polynomial"})
    for (const EffectCandidate& own : offered.candidates) {
      if (own.location != "suspension"_at || own.label().form != form) continue;
      Hypothesis one = nothing;
      one.effects = {own};
      one.parameters = own.parameters;
      one.fit.plant = own.plant;
      one.chi2 = static_cast<double>(candidates.fits.size());
      for (const Label& label : own.labels) names.push_back(name_of(own, label));
      add_candidates(search, one, candidates);
    }
  REQUIRE(candidates.fits.size() == 3);
  REQUIRE(candidates.evidence.size() == names.size());
  REQUIRE(names.size() == 5);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const CandidateEvidence& own = candidates.evidence[i];
    const EffectCandidate& effect = candidates.fit_of(i).effects.front();
    CHECK(own.last().name() == names[i]);
    CHECK(own.chi2 == candidates.fit_of(i).chi2);
    CHECK(own.last().parameters.size() == effect.parameters.size());
    const auto label = std::find_if(effect.labels.begin(), effect.labels.end(), [&](const Label& known) {
      return known.effect == own.last().effect && known.form == own.last().form;
    });
    REQUIRE(label != effect.labels.end());
    CHECK(own.log_plausibility == log_plausibility(*label, effect.plant));
  }
  // Fitted once more, an effect keeps the labels that it has, in their order.
  Hypothesis late = candidates.fits.front();
  std::vector<Label>& labels = late.effects.front().labels;
  std::swap(labels.front(), labels.back());
  const Hypothesis again = fit_set(study, nothing, {sized_effect(late, 0)}, nothing);
  REQUIRE(again.effects.size() == 1);
  REQUIRE(again.effects.front().labels.size() == 2);
  CHECK(again.effects.front().label().effect == "hysteresis");
  labels.pop_back();
  const Hypothesis one = fit_set(study, nothing, {sized_effect(late, 0)}, nothing);
  REQUIRE(one.effects.size() == 1);
  CHECK(name_of(one.effects.front()) == "hysteresis@suspension"_effect);
  CHECK(one.effects.front().labels.size() == 1);
  // Two candidates of a tyre's polynomial differ by the order of their coefficients: sizes go where they belong.
  int orders = 0;
  for (const EffectCandidate& own : offered.candidates) {
    if (own.label().effect != "tyre_nonlinearity" || own.label().form != "polynomial") continue;
    Hypothesis bent = nothing;
    bent.effects = {own};
    bent.parameters = own.parameters;
    bent.fit.plant = own.plant;
    const Hypothesis same = fit_set(study, nothing, {sized_effect(bent, 0)}, nothing);
    REQUIRE(same.parameters.size() == own.parameters.size());
    for (std::size_t k = 0; k < own.parameters.size(); ++k) CHECK(same.parameters[k].name == own.parameters[k].name);
    ++orders;
  }
  CHECK(orders == 2);
}

TEST_CASE("at a guide where one effect stands a second may stand, at the guide of a mass that an effect brought none") {
  Plant nominal = plant_from(quarter_car_text);
  nominal.inputs[0].interpolation = "zoh";
  Plant truth = nominal;
  truth.elements.push_back(
      {guide_element("wheel"), "ground", "wheel", {{find_law("coulomb_friction"), {30, 0, 1, 0.01}}}});
  const RecordSet set = in_motion(truth, 1000);
  const auto solver = make_levenberg_marquardt({});
  const GapData data = gap_data(nominal, set, noise_floor(set), 0.25);
  const GapSolvers solvers{*solver, *solver, *solver};
  std::vector<Place> offered;
  const CandidateList guides = [&](const Plant& plant, const Operation& operation) {
    std::vector<EffectCandidate> list;
    for (EffectCandidate& candidate : effect_candidates(plant, operation))
      if (candidate.label().form == "smoothed sign" && candidate.location.kind == PlaceKind::guide) {
        offered.push_back(candidate.location);
        list.push_back(std::move(candidate));
      }
    return list;
  };
  const Study study{nominal, data, solvers, guides, {}};
  Plant damped = nominal, hung = nominal;
  damped.elements.push_back({guide_element("wheel"), "ground", "wheel", {{find_law("viscous_damper"), {20}}}});
  hung.masses.push_back({"mode_on_wheel", 2});
  hung.elements.push_back({"mode_on_wheel_mount",
                           "wheel",
                           "mode_on_wheel",
                           {{find_law("linear_spring"), {8e4}}, {find_law("viscous_damper"), {80}}}});
  for (const Plant& plant : {damped, hung}) {
    const bool guided = plant.masses.size() == nominal.masses.size();
    CAPTURE(guided);
    const Hypothesis base = fit_hypothesis(study, plant, {});
    REQUIRE_FALSE(base.fit.error.empty());
    offered.clear();
    std::vector<Place> found;
    for (const Hypothesis& one : extend(study, base, {.worth = 0})) found.push_back(one.effects.back().location);
    const auto has = [](const std::vector<Place>& list, const Place& name) {
      return std::find(list.begin(), list.end(), name) != list.end();
    };
    CHECK(has(found, "guide:wheel"_at));
    CHECK(has(offered, "guide:mode_on_wheel"_at) == !guided);
    CHECK_FALSE(has(found, "guide:mode_on_wheel"_at));
  }
}

TEST_CASE("a memory that was at work before a record began is no gap, and no short record is cut for it") {
  Plant plant = plant_from(quarter_car_text);
  plant.inputs[0].interpolation = "zoh";
  plant.elements[0].laws.push_back({find_law("maxwell_branch"), {2e4, 0.3}});
  const Index samples = 4000, block = 400;
  const RecordSet set = in_motion(plant, samples);
  const auto solver = make_levenberg_marquardt({});
  GapData data = gap_data(plant, set, noise_floor(set), static_cast<double>(block) / set.sampling_hz);
  const GapSolvers solvers{*solver, *solver, *solver};
  const CandidateList candidates = effect_candidates;
  const Study study{plant, data, solvers, candidates, {}};
  const Hypothesis truth = fit_hypothesis(study, plant, {});
  REQUIRE_FALSE(truth.fit.error.empty());
  CHECK(truth.stage.blocks.size() == samples / block - 1);
  CHECK(truth.stage.misfit < 0.1 * truth.held_out.misfit);
  FitRecord record = data.held_out.front();
  CHECK(record.skip == block / 20);
  record.skip = 7;
  CHECK(fitted_from(record, block) == 7 + block / 20);
  CHECK(judged_from(record, block) == 7 + block);
  CHECK(fitted_from(record, samples / 7) == 7);
  CHECK(judged_from(record, samples / 7) == 7);
}

TEST_CASE("a short memory that was at work before a record began bends no parameter", "[slow]") {
  for (const auto& [law, values] :
       std::vector<std::pair<std::string, std::vector<double>>>{{"cavitating_damper", {850, 3e-5, 1, 20}},
                                                                {"damper_mount", {850, 0.005}},
                                                                {"maxwell_branch", {2e5, 0.005}}}) {
    Plant plant = plant_from(quarter_car_text);
    plant.inputs[0].interpolation = "zoh";
    plant.elements[0].laws.push_back({find_law(law), values, 1e-6});
    CAPTURE(law);
    const RecordSet set = in_motion(plant, 4000);
    const auto solver = make_levenberg_marquardt({});
    const GapData data = gap_data(plant, set, noise_floor(set), 2);
    const GapSolvers solvers{*solver, *solver, *solver};
    const CandidateList candidates = effect_candidates;
    const Study study{plant, data, solvers, candidates, tolerance_parameters(plant)};
    const Hypothesis home = fit_hypothesis(study, plant, study.tolerances);
    REQUIRE_FALSE(home.fit.error.empty());
    CHECK(home.fit.theta.cwiseAbs().maxCoeff() < 0.1);
  }
}

TEST_CASE("the best pair is fitted with every near law of its instrument, not only with the one that was tried",
          "[slow]") {
  const Plant nominal = plant_from(quarter_car_text);
  const auto solver = make_levenberg_marquardt({});
  const CandidateList few = [](const Plant& plant, const Operation& operation) {
    std::vector<EffectCandidate> list = effect_candidates(plant, operation);
    std::erase_if(list, [](const EffectCandidate& own) {
      const EffectId& effect = own.label().effect;
      const bool of_sensor = own.location == "sensor:travel"_at && (effect == "sensor_lag" || effect == "time_delay");
      return !of_sensor && effect != "damper_asymmetry";
    });
    return list;
  };
  Random random = numbers(845);
  for (int draw = 0; draw < 2; ++draw) {
    Plant truth = nominal;
    truth.sensors[0].path.lag.cutoff_hz = 30 + 30 * random.uniform();
    truth.sensors[0].path.lag.damping_ratio = 0.8;
    truth.elements[0].laws.push_back({find_law("asymmetric_damper"), {850, 0.08, 0.1, 1, 1}});
    RecordSet set = in_motion(truth, 600);
    for (auto& record : set.records)
      for (Index i = 0; i < record.signal.y.rows(); ++i)
        record.signal.y.row(i) += set.noise_std.at(truth.sensors[static_cast<std::size_t>(i)].name) *
                                  random.normal(1, record.signal.y.cols());
    const auto forms = [&](std::size_t exchanged) {
      DiagnoseOptions options;
      options.effort.exchanged = exchanged;
      const Diagnosis told = diagnose(nominal, set, few, {*solver, *solver, *solver}, options, 846);
      std::set<std::string> found;
      for (const CandidateEvidence& pair : told.evidence.pairs)
        for (const EffectEvidence& effect : pair.effects)
          if (effect.location == "sensor:travel"_at) found.insert(effect.form);
      return found;
    };
    CAPTURE(truth.sensors[0].path.lag.cutoff_hz);
    CHECK(forms(0).size() < 3);  // each first effect is one form
    CHECK(forms(3) == std::set<std::string>{"late reading", "first order", "second order"});
  }
}

TEST_CASE("a second effect is not looked for again beside first ones that are as they were", "[slow]") {
  const Plant nominal = plant_from(quarter_car_text);
  const auto solver = make_levenberg_marquardt({});
  const GapSolvers solvers{*solver, *solver, *solver};
  const CandidateList few = [](const Plant& plant, const Operation& operation) {
    std::vector<EffectCandidate> list = effect_candidates(plant, operation);
    std::erase_if(list, [](const EffectCandidate& own) {
      const EffectId& effect = own.label().effect;
      return effect != "coulomb_friction" && effect != "damper_asymmetry" && effect != "tyre_damping";
    });
    return list;
  };
  Plant truth = nominal;
  truth.elements[0].laws.push_back({find_law("coulomb_friction"), {40, 40, 0.1, 0.005}});
  truth.elements[0].laws.push_back({find_law("asymmetric_damper"), {850, 0.15, 0.1, 1, 1}});
  const RecordSet set = in_motion(truth, 600);
  Evidence evidence = diagnose(nominal, set, few, solvers, {}, 851).evidence;
  evidence.pairs.clear();
  evidence.larger.clear();
  const GapData data = gap_data(nominal, set, noise_floor(set), 0.25);
  const Study study{nominal, data, solvers, few, tolerance_parameters(nominal)};
  const Hypothesis delivered = fit_hypothesis(study, nominal, {}),
                   retuned = fit_hypothesis(study, nominal, study.tolerances);
  const Thresholds thresholds;
  const SearchEffort effort;
  const Bootstrap bootstrap{10, 0, 852};
  int steps = 0;
  const Step step = [&](const std::string&) { ++steps; };
  const Search search{study, thresholds, effort, bootstrap, delivered, retuned, step};
  Changes changes;
  Candidates singles = find_singles(search, 1, changes);
  evidence.singles = singles.evidence;
  const Candidates pairs = find_pairs(search, changes, {}, evidence, singles);
  REQUIRE_FALSE(pairs.evidence.empty());
  const int searched = steps;
  CHECK(searched > 0);
  const Candidates again = find_pairs(search, changes, pairs, evidence, singles);
  CHECK(steps == searched);
  REQUIRE(again.evidence.size() == pairs.evidence.size());
  for (std::size_t i = 0; i < pairs.evidence.size(); ++i) CHECK(again.evidence[i].chi2 == pairs.evidence[i].chi2);
  for (Hypothesis& fit : singles.fits) fit.chi2 *= 1 - 1e-9;  // a better fit is another first effect
  find_pairs(search, changes, pairs, evidence, singles);
  CHECK(steps > searched);
}
