#include "experiments/blind/score_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace wheelhop::scoring {
namespace {

using Cases = std::vector<const Judged*>;
using Value = std::optional<double>;

struct RateRule {
  const char *key, *meaning;
  bool (*counts)(const Judged&);
  bool (*hits)(const Judged&);
};

struct ValueRule {
  const char *key, *meaning;
  bool median;                    // else the mean
  Value (*value)(const Judged&);  // of a case that counts
};

bool is(const Judged& judged, CaseKind kind) { return judged.truth.kind == kind; }
bool is_none(const Judged& judged) { return is(judged, CaseKind::none); }
bool is_single(const Judged& judged) { return is(judged, CaseKind::single); }
bool is_parameter(const Judged& judged) { return is(judged, CaseKind::parameter); }
bool is_unknown(const Judged& judged) { return is(judged, CaseKind::unknown); }
bool is_left_out(const Judged& judged) { return is(judged, CaseKind::left_out); }
bool is_double(const Judged& judged) { return is(judged, CaseKind::twofold); }
bool is_mixed(const Judged& judged) { return is(judged, CaseKind::mixed); }
bool has_one_place(const Judged& judged) { return !is_none(judged) && !is_double(judged) && !is_mixed(judged); }
/// Not of a parameter: a small one goes in the tolerances, and no gap is the right answer.
bool must_be_seen(const Judged& judged) { return !is_none(judged) && !is_parameter(judged); }

constexpr double kTwin = 0.9;
/// With the true family out of the catalogue another one closes the true gap: no record of this drive tells them apart.
bool twin_named(const Judged& judged) {
  return is_left_out(judged) && !judged.flagged && judged.true_closure.value_or(0) >= kTwin;
}

/// The answer adds something to the re-tuned plant.
bool claims_effect(const Answer& answer) { return !answer.named.empty() && answer.outcome != "parameter"; }

Value reported_closure(const Judged& judged) {
  if (!is_single(judged)) return std::nullopt;
  return claims_effect(judged.answer) ? judged.answer.closure.value_or(0) : 0;
}
bool catalogue_form(const Judged& judged) { return judged.truth.effects.front().catalogue_form == true; }
bool other_form(const Judged& judged) { return judged.truth.effects.front().catalogue_form == false; }
Value when(bool counts, Value value) { return counts ? value : std::nullopt; }

const std::vector<RateRule>& rate_rules() {
  using J = const Judged&;
  static const std::vector<RateRule> rules = {
      {"where_top1", "where: the place named is right", has_one_place, [](J j) { return j.where; }},
      {"where_in_set", "where: right, or not to be told from it", has_one_place, [](J j) { return j.where_in_set; }},
      {"which_top1", "which: the first name is right", is_single, [](J j) { return j.first; }},
      {"which_top2", "which: right among the first two", is_single, [](J j) { return j.in_first_two; }},
      {"set_contains_truth", "which: the reported set holds the truth", is_single, [](J j) { return j.in_set; }},
      {"set_of_two_contains_truth", "which: it does, and is of two at most", is_single,
       [](J j) { return j.in_set && j.answer.reported_set().size() <= 2; }},
      {"known_accepted", "which: an effect of the catalogue is named", is_single,
       [](J j) { return claims_effect(j.answer) && !j.flagged; }},
      {"false_alarm", "no gap: a gap is claimed all the same", is_none, [](J j) { return !j.fault.empty(); }},
      {"missed_gap", "a gap is missed", must_be_seen, [](J j) { return !j.alarm; }},
      {"parameter_named", "wrong parameter: named", is_parameter, [](J j) { return j.first; }},
      {"parameter_in_set", "wrong parameter: in the reported set", is_parameter, [](J j) { return j.in_set; }},
      {"unknown_flagged", "off the catalogue: flagged as unknown", is_unknown, [](J j) { return j.flagged; }},
      {"unknown_located", "off the catalogue: the place is right", is_unknown, [](J j) { return j.where; }},
      {"left_out_flagged", "family left out, no twin closes the gap: flagged as unknown",
       [](J j) { return is_left_out(j) && !twin_named(j); }, [](J j) { return j.flagged; }},
      {"left_out_twin", "family left out: another one truly closes the gap", is_left_out, twin_named},
      {"left_out_located", "family left out: the place is right", is_left_out, [](J j) { return j.where; }},
      {"double_both_named", "two effects: both named", is_double, [](J j) { return j.all_named; }},
      {"double_first_right", "two effects: the first name is right", is_double, [](J j) { return j.first; }},
      {"mixed_both_named", "mixed: both named", is_mixed, [](J j) { return j.all_named; }},
      {"mixed_effect_named", "mixed: the effect named", is_mixed, [](J j) { return j.effect_named; }},
      {"mixed_parameter_named", "mixed: the parameter named", is_mixed, [](J j) { return j.parameter_named; }},
      {"closure_ci90_covers", "closure: true value in the 90 % interval",
       [](J j) {
         return must_be_seen(j) && claims_effect(j.answer) && j.true_closure && j.answer.closure_low &&
                j.answer.closure_high;
       },
       [](J j) { return *j.answer.closure_low <= *j.true_closure && *j.true_closure <= *j.answer.closure_high; }},
      {"beyond_worse_unflagged", "closure beyond the envelope: below 0, unflagged",
       [](J j) { return must_be_seen(j) && j.beyond_closure.has_value(); },
       [](J j) { return *j.beyond_closure < 0 && !j.answer.beyond_flagged; }}};
  return rules;
}

const std::vector<ValueRule>& value_rules() {
  using J = const Judged&;
  static const std::vector<ValueRule> rules = {
      {"mean_set_size", "which: mean size of a reported set", false,
       [](J j) {
         const double size = static_cast<double>(j.answer.reported_set().size());
         return when(is_single(j) && size > 0, size);
       }},
      {"single_extras", "one effect: false names beside it, mean", false,
       [](J j) { return when(is_single(j), j.answer.named.empty() || j.first ? j.extras : j.extras - 1); }},
      {"double_extras", "two effects: false names, mean", false, [](J j) { return when(is_double(j), j.extras); }},
      {"mixed_extras", "mixed: false names, mean", false, [](J j) { return when(is_mixed(j), j.extras); }},
      {"closure_reported", "closure: reported, median", true, reported_closure},
      {"closure_reported_catalogue_form", "closure: reported, catalogue form", true,
       [](J j) { return when(is_single(j) && catalogue_form(j), reported_closure(j)); }},
      {"closure_reported_other_form", "closure: reported, other form", true,
       [](J j) { return when(is_single(j) && other_form(j), reported_closure(j)); }},
      {"closure_true", "closure: true, median", true, [](J j) { return when(is_single(j), j.true_closure); }},
      {"closure_true_catalogue_form", "closure: true, catalogue form", true,
       [](J j) { return when(is_single(j) && catalogue_form(j), j.true_closure); }},
      {"closure_true_other_form", "closure: true, other form", true,
       [](J j) { return when(is_single(j) && other_form(j), j.true_closure); }},
      {"closure_true_double", "closure: true, two effects", true,
       [](J j) { return when(is_double(j), j.true_closure); }},
      {"closure_true_mixed", "closure: true, mixed", true, [](J j) { return when(is_mixed(j), j.true_closure); }},
      {"closure_beyond", "closure: true beyond the envelope", true,
       [](J j) { return when(is_single(j), j.beyond_closure); }}};
  return rules;
}

Score apply(const RateRule& rule, const Cases& cases) {
  Rate rate;
  for (const Judged* judged : cases) {
    if (!rule.counts(*judged)) continue;
    ++rate.n;
    rate.hits += rule.hits(*judged);
  }
  return {rule.key, rule.meaning, rate.value(), rate.n, rate};
}

Score apply(const ValueRule& rule, const Cases& cases) {
  std::vector<double> values;
  for (const Judged* judged : cases)
    if (const Value value = rule.value(*judged)) values.push_back(*value);
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  const double mean = sum / static_cast<double>(values.size());
  return {rule.key, rule.meaning, rule.median ? median(values) : mean, std::ssize(values), std::nullopt};
}

Group make_group(const std::string& by, const std::string& name, const Cases& cases) {
  Group group{by, name, std::ssize(cases), {}, {}};
  std::vector<Forecast> forecasts;
  for (const Judged* judged : cases)
    if (judged->answer.probability) forecasts.push_back({*judged->answer.probability, judged->first});
  group.calibration = calibrate(forecasts);
  for (const RateRule& rule : rate_rules()) group.scores.push_back(apply(rule, cases));
  for (const ValueRule& rule : value_rules()) group.scores.push_back(apply(rule, cases));
  const long n = std::ssize(forecasts);
  group.scores.push_back({"ece", "confidence: expected calibration error", group.calibration.ece, n, {}});
  group.scores.push_back({"brier_skill", "confidence: Brier skill", group.calibration.brier_skill, n, {}});
  return group;
}

}  // namespace

const Score& Group::score(const std::string& key) const {
  const auto found = std::find_if(scores.begin(), scores.end(), [&](const Score& s) { return s.key == key; });
  if (found == scores.end()) throw std::invalid_argument("no score is called " + key);
  return *found;
}

std::vector<Group> score_groups(const std::vector<Judged>& judged) {
  Cases all, clear;
  for (const Judged& one : judged) {
    all.push_back(&one);
    if (one.truth.strength != "weak") clear.push_back(&one);
  }
  std::vector<Group> groups = {make_group("all", "all", all), make_group("all", "clear", clear)};
  using Property = std::string (*)(const Judged&);
  const std::vector<std::pair<std::string, Property>> properties = {
      {"strength", [](const Judged& one) { return one.truth.strength; }},
      {"kind", [](const Judged& one) { return to_string(one.truth.kind); }},
      {"set", [](const Judged& one) { return one.truth.set; }},
      {"effect", [](const Judged& one) { return is_single(one) ? one.truth.effects.front().effect : ""; }},
      {"drive", [](const Judged& one) { return one.truth.drive; }},
      {"plant", [](const Judged& one) { return one.truth.plant; }}};
  for (const auto& [by, property] : properties) {
    std::vector<std::string> names;
    if (by == "strength") names = {"weak", "medium", "strong"};
    for (const Judged* one : all)
      if (std::find(names.begin(), names.end(), property(*one)) == names.end()) names.push_back(property(*one));
    if (by != "strength") std::sort(names.begin(), names.end());
    for (const std::string& name : names) {
      Cases own;
      std::copy_if(all.begin(), all.end(), std::back_inserter(own),
                   [&, &property = property](const Judged* one) { return property(*one) == name; });
      if (!name.empty() && !own.empty()) groups.push_back(make_group(by, name, own));
    }
  }
  return groups;
}

const std::vector<Target>& targets() {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  static const std::vector<Target> list = {{"clear", "where_top1", 0.97, 1},
                                           {"weak", "where_top1", 0.75, 1},
                                           {"clear", "which_top1", 0.95, 1},
                                           {"clear", "which_top2", 0.99, 1},
                                           {"weak", "which_top1", 0.70, 1},
                                           {"weak", "which_top2", 0.85, 1},
                                           {"all", "set_contains_truth", 0.98, 1},
                                           {"all", "mean_set_size", 0, 1.6},
                                           {"all", "false_alarm", 0, 0.02},
                                           {"clear", "missed_gap", 0, 0.01},
                                           {"all", "parameter_named", 0.95, 1},
                                           {"all", "left_out_flagged", 0.95, 1},
                                           {"all", "known_accepted", 0.95, 1},
                                           {"all", "unknown_flagged", 0.90, 1},
                                           {"all", "unknown_located", 0.90, 1},
                                           {"all", "double_both_named", 0.80, 1},
                                           {"all", "double_first_right", 0.98, 1},
                                           {"all", "double_extras", 0, 0.1},
                                           {"all", "closure_reported_catalogue_form", 0.98, infinity},
                                           {"all", "closure_reported_other_form", 0.90, infinity},
                                           {"all", "closure_true_catalogue_form", 0.98, infinity},
                                           {"all", "closure_true_other_form", 0.90, infinity},
                                           {"all", "closure_ci90_covers", 0.85, 0.95},
                                           {"all", "beyond_worse_unflagged", 0, 0},
                                           {"all", "ece", 0, 0.05},
                                           {"all", "brier_skill", 0.7, 1}};
  return list;
}

}  // namespace wheelhop::scoring
