#include "experiments/blind/calibrate.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "core/gap/verdict/decide.hpp"
#include "experiments/blind/score_case.hpp"
#include "experiments/run/file_uses.hpp"
#include "experiments/run/provenance.hpp"

namespace wheelhop {
namespace {

/// Thresholds that follow from neither a theorem nor the literature and that evidence can tell.
constexpr std::array kLearnt = {"of_gap",     "of_gap_closed",     "of_remains",        "place_weight",
                                "held_slope", "calibration_shift", "calibration_slope", "surest"};
constexpr std::array kFactors = {0.5, 0.7, 0.85, 1.2, 1.4, 2.0};  // steps of the coordinate search
constexpr int kPasses = 3;                                        // over all coordinates
constexpr std::size_t kFolds = 5;
constexpr double kProbable = 0.999;  // no threshold that is a probability is scaled beyond it

/// A case whose truth is known.
struct Known {
  scoring::TrueCase truth;
  scoring::Answer stored;
  Evidence evidence;
};

/// What a verdict is worth on one case.
struct Worth {
  double loss = 0;
  bool right = false;
  std::vector<EffectAt> named;
};

/// As answers in files have them.
std::vector<std::string> texts_of(const std::vector<EffectAt>& names) {
  std::vector<std::string> texts;
  for (const EffectAt& name : names) texts.push_back(to_string(name));
  return texts;
}

Worth worth_of(const Known& known, const Thresholds& thresholds) {
  const Verdict verdict = decide(known.evidence, thresholds);
  scoring::Answer answer = known.stored;
  answer.outcome = outcome_of(verdict);
  answer.verdict = is<NoGap>(verdict) ? "no_gap" : is<Insufficient>(verdict) ? "insufficient" : "gap";
  answer.location = verdict.locations.empty() ? "" : to_string(verdict.locations.front().location);
  answer.same_locations = {answer.location};
  answer.named = texts_of(verdict.named);
  answer.ambiguous_with = texts_of(verdict.ambiguous_with);
  answer.ranking = answer.reported_set();
  const bool forecasts = is<Effects>(verdict) || is<Parameters>(verdict);
  const double probability = forecasts ? verdict.suspects.front().probability : 0;
  const scoring::Judged judged = scoring::judge(known.truth, answer);
  Worth worth{0, judged.fault.empty(), verdict.named};
  if (forecasts)
    worth.loss = std::pow(probability - (judged.first ? 1.0 : 0.0), 2);
  else
    worth.loss = worth.right ? 0 : 1;
  return worth;
}

std::vector<Worth> worths(const std::vector<Known>& cases, const Thresholds& thresholds) {
  std::vector<Worth> out(cases.size());
  tbb::parallel_for(std::size_t{0}, cases.size(), [&](std::size_t i) { out[i] = worth_of(cases[i], thresholds); });
  return out;
}

/// Mean loss of the cases that are, or are not, in a fold; of all for fold = kFolds.
double mean_loss(const std::vector<Worth>& all, std::size_t fold, bool inside) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (fold < kFolds && (i % kFolds == fold) != inside) continue;
    sum += all[i].loss;
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

double value_of(Thresholds thresholds, const std::string& wanted) {
  double found = 0;
  thresholds.fields([&](const char* name, double& value, const char*, const char*, Origin, const char*) {
    if (wanted == name) found = value;
  });
  return found;
}

/// A threshold at a factor of its value; probabilities and shares stay below one.
Thresholds scaled(Thresholds thresholds, const std::string& wanted, double factor) {
  thresholds.fields([&](const char* name, double& value, const char* unit, const char*, Origin, const char*) {
    if (wanted != name) return;
    const bool share = std::string(unit) == "-" && value < 1;
    value = share ? std::min(factor * value, kProbable) : factor * value;
  });
  return thresholds;
}

/// Coordinate search over factors of the learnt thresholds. @param fold left out; kFolds: none
Thresholds fitted(const std::vector<Known>& cases, std::size_t fold) {
  Thresholds best;
  double least = mean_loss(worths(cases, best), fold, false);
  for (int pass = 0; pass < kPasses; ++pass) {
    const double before = least;
    for (const char* name : kLearnt)
      for (const double factor : kFactors) {
        const Thresholds trial = scaled(best, name, factor);
        const double loss = mean_loss(worths(cases, trial), fold, false);
        if (!(loss < least)) continue;
        least = loss;
        best = trial;
      }
    if (!(least < before)) break;
  }
  return best;
}

std::vector<Known> load_cases(const BlindCalibrateRequest& request) {
  std::vector<Known> cases;
  for (const scoring::TrueCase& truth : scoring::load_key(request.key)) {
    const std::filesystem::path file = request.answers / (truth.name + ".json");
    if (!std::filesystem::exists(file)) continue;
    const JsonCursor cursor = JsonCursor::load(file);
    const auto evidence = cursor.find("evidence");
    if (!evidence) continue;  // an answer that is an error
    cases.push_back({truth, scoring::load_answer(request.answers, truth.name), evidence_from(*evidence)});
  }
  if (cases.empty())
    throw UserError(request.answers.string() + ": expected answers with evidence to the cases of the key, found none");
  return cases;
}

}  // namespace

int run_blind_calibrate(const BlindCalibrateRequest& request) {
  const std::filesystem::path out = request.out.empty() ? request.answers / "calibration.json" : request.out;
  const std::vector<Known> cases = load_cases(request);
  FileUses uses;
  uses.reads("--key", scoring::key_file(request.key)).writes("--out", out);
  for (const Known& known : cases) uses.reads("an answer in ANSWERS", request.answers / (known.truth.name + ".json"));
  uses.check();
  const Thresholds own;
  const std::vector<Worth> as_is = worths(cases, own);
  const auto right = [](const std::vector<Worth>& all) {
    return std::count_if(all.begin(), all.end(), [](const Worth& worth) { return worth.right; });
  };
  fmt::print("{} cases, {} right, mean loss {:.4f}\n\n{:<20}{:>10}{:>34}{:>34}\n", cases.size(), right(as_is),
             mean_loss(as_is, kFolds, true), "threshold", "value", "x 0.7: changed, right, loss",
             "x 1.4: changed, right, loss");
  Json sensitivity = Json::array();
  for (const Json& threshold : to_json(own)) {
    const std::string name = threshold.at("name");
    Json row = {{"name", name}, {"value", threshold.at("value")}};
    fmt::print("{:<20}{:>10.4g}", name, threshold.at("value").get<double>());
    for (const double factor : {0.7, 1.4}) {
      const std::vector<Worth> moved = worths(cases, scaled(own, name, factor));
      long changed = 0;
      for (std::size_t i = 0; i < moved.size(); ++i) changed += moved[i].named != as_is[i].named;
      const double loss = mean_loss(moved, kFolds, true);
      row[fmt::format("x{}", factor)] = {{"changed", changed}, {"right", right(moved)}, {"loss", loss}};
      fmt::print("{:>18}{:>8}{:>8.4f}", changed, right(moved), loss);
    }
    fmt::print("\n");
    sensitivity.push_back(std::move(row));
  }
  const Thresholds best = fitted(cases, kFolds);
  double held_out = 0;
  for (std::size_t fold = 0; fold < kFolds; ++fold)
    held_out += mean_loss(worths(cases, fitted(cases, fold)), fold, true) / static_cast<double>(kFolds);
  const std::vector<Worth> after = worths(cases, best);
  Json learnt = Json::object();
  fmt::print("\nlearnt\n");
  for (const char* name : kLearnt) {
    learnt[name] = {{"now", value_of(own, name)}, {"fitted", value_of(best, name)}};
    fmt::print("  {:<20}{:>10.4g} -> {:.4g}\n", name, value_of(own, name), value_of(best, name));
  }
  fmt::print("mean loss {:.4f} -> {:.4f} ({} right); by five folds, on cases not seen: {:.4f}\n",
             mean_loss(as_is, kFolds, true), mean_loss(after, kFolds, true), right(after), held_out);
  write_json(out, {{"schema", "wheelhop.calibration/1"},
                   {"cases", cases.size()},
                   {"right", right(as_is)},
                   {"sensitivity", sensitivity},
                   {"learnt", learnt},
                   {"loss",
                    {{"as_it_is", mean_loss(as_is, kFolds, true)},
                     {"fitted", mean_loss(after, kFolds, true)},
                     {"fitted_held_out", held_out}}},
                   {"provenance", provenance()}});
  fmt::print("written: {}\n", out.string());
  return 0;
}

}  // namespace wheelhop
