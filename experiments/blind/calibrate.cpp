#include "experiments/blind/calibrate.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "core/gap/verdict/decide.hpp"
#include "experiments/blind/score_case.hpp"
#include "experiments/run/file_uses.hpp"
#include "experiments/run/provenance.hpp"

namespace wheelhop {
namespace {

constexpr std::array kFactors = {0.5, 0.7, 0.85, 1.2, 1.4, 2.0};  // steps of the coordinate search
constexpr int kPasses = 3;                                        // over all coordinates
constexpr std::size_t kFolds = 5;
constexpr double kErrors = 2;        // standard errors of a fall that counts
constexpr double kProbable = 0.999;  // no threshold that is a probability is scaled beyond it

/// A case whose truth is known.
struct Known {
  scoring::TrueCase truth;
  scoring::Answer stored;
  Evidence evidence;
};

/// The thresholds that follow from neither a theorem nor the literature: those that evidence may teach.
std::vector<std::string> open_thresholds() {
  std::vector<std::string> names;
  Thresholds().fields([&](const char* name, double&, const char*, const char*, Origin origin, const char*) {
    if (origin == Origin::learnt || origin == Origin::judgement) names.emplace_back(name);
  });
  return names;
}

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

/// Brier's score (1950, Monthly Weather Review 78) of every name that is true or given: the sum of (p - 1)^2 over the
/// true effects and of p^2 over the others that are named. p is 0 of a name that no suspect has.
double brier(const Verdict& verdict, const scoring::TrueCase& truth) {
  const auto probability = [&](const auto& is_meant) {
    for (const Suspect& suspect : verdict.suspects)
      if (is_meant(to_string(suspect.name()))) return suspect.probability;
    return 0.0;
  };
  double sum = 0;
  for (const scoring::TrueEffect& effect : truth.effects) {
    const double p = probability([&](const std::string& name) { return scoring::is_named(effect, truth.kind, name); });
    sum += (1 - p) * (1 - p);
  }
  for (const std::string& given : texts_of(verdict.named)) {
    const bool right = std::any_of(truth.effects.begin(), truth.effects.end(), [&](const scoring::TrueEffect& effect) {
      return scoring::is_named(effect, truth.kind, given);
    });
    const double p = probability([&](const std::string& name) { return name == given; });
    if (!right) sum += p * p;
  }
  return sum;
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
  const scoring::Judged judged = scoring::judge(known.truth, answer);
  const bool forecasts = is<Effects>(verdict) || is<Parameters>(verdict);
  const double loss = forecasts ? brier(verdict, known.truth) : judged.fault.empty() ? 0 : 1;
  return {loss, judged.fault.empty(), verdict.named};
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

/// What the verdicts under some thresholds are worth, each computed once.
class Ledger {
 public:
  explicit Ledger(const std::vector<Known>& cases) : cases_(cases) {}
  const std::vector<Worth>& under(Thresholds thresholds) {
    std::vector<double> values;
    thresholds.fields(
        [&](const char*, double& value, const char*, const char*, Origin, const char*) { values.push_back(value); });
    const auto [known, added] = known_.try_emplace(std::move(values));
    if (added) known->second = worths(cases_, thresholds);
    return known->second;
  }

 private:
  const std::vector<Known>& cases_;
  std::map<std::vector<double>, std::vector<Worth>> known_;
};

/// True if the mean loss falls by more than two standard errors of that fall over the cases outside of a fold, so that
/// a threshold stays where the cases do not tell it. One standard error (Breiman et al. 1984, Classification and
/// Regression Trees) was seen to make held-out cases worse, with so many thresholds asked.
bool tells(const std::vector<Worth>& before, const std::vector<Worth>& after, std::size_t fold) {
  double count = 0, sum = 0, squares = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (i % kFolds == fold) continue;
    const double fall = before[i].loss - after[i].loss;
    ++count;
    sum += fall;
    squares += fall * fall;
  }
  const double variance = squares - sum * sum / std::max(count, 1.0);  // of the sum
  return sum > 0 && sum * sum > kErrors * kErrors * variance;
}

/// Coordinate search over factors of the open thresholds. @param fold left out; kFolds: none
Thresholds fitted(Ledger& ledger, std::size_t fold) {
  Thresholds best;
  for (int pass = 0; pass < kPasses; ++pass) {
    bool moved = false;
    for (const std::string& name : open_thresholds()) {
      const Thresholds from = best;
      for (const double factor : kFactors) {
        const Thresholds trial = scaled(from, name, factor);
        if (!tells(ledger.under(from), ledger.under(trial), fold)) continue;
        if (!(mean_loss(ledger.under(trial), fold, false) < mean_loss(ledger.under(best), fold, false))) continue;
        best = trial;
        moved = true;
      }
    }
    if (!moved) break;
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
  Ledger ledger(cases);
  const Thresholds best = fitted(ledger, kFolds);
  double held_out = 0;
  for (std::size_t fold = 0; fold < kFolds; ++fold)
    held_out += mean_loss(ledger.under(fitted(ledger, fold)), fold, true) / static_cast<double>(kFolds);
  const std::vector<Worth>& after = ledger.under(best);
  Json learnt = Json::object();
  fmt::print("\nlearnt; the cases do not tell the others by two standard errors\n");
  for (const std::string& name : open_thresholds()) {
    if (value_of(own, name) == value_of(best, name)) continue;
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
