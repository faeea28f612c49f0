#include "experiments/blind/score.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "experiments/blind/run.hpp"
#include "experiments/blind/score_closure.hpp"
#include "experiments/blind/score_print.hpp"
#include "experiments/rig/sha256.hpp"
#include "experiments/run/file_uses.hpp"
#include "experiments/run/progress.hpp"

namespace wheelhop {
namespace {

namespace fs = std::filesystem;
using namespace scoring;

/// The cases of the key that are asked about.
std::vector<TrueCase> chosen_truth(const BlindScoreRequest& request, const std::vector<TrueCase>& key) {
  std::vector<std::string> names;
  for (const TrueCase& truth : key) names.push_back(truth.name);
  const std::vector<std::string> chosen = chosen_cases(names, request.cases, key_file(request.key).string());
  std::vector<TrueCase> out;
  for (const TrueCase& truth : key)
    if (std::find(chosen.begin(), chosen.end(), truth.name) != chosen.end()) out.push_back(truth);
  return out;
}

/// The answers were made of the cases that this key is for, and the key is the one whose check sum was published.
void check_manifest(const fs::path& manifest, const fs::path& key, std::size_t cases) {
  if (!fs::exists(manifest)) return;
  const JsonCursor cursor = JsonCursor::load(manifest);
  if (const auto made = cursor.find("cases"); made && made->integer() != static_cast<Index>(cases))
    made->fail(fmt::format("{}, the number of cases in the key", cases));
  const auto published = cursor.find("key_sha256");
  if (!published) return;
  if (const std::string sum = blind::sha256(read_file(key)); published->string() != sum)
    published->fail(fmt::format("the SHA-256 of {}, {}", key.string(), sum));
}

std::vector<Judged> judge_all(const BlindScoreRequest& request, const std::vector<TrueCase>& truths) {
  std::vector<Judged> judged;
  bool answered = false;
  for (const TrueCase& truth : truths) {
    judged.push_back(judge(truth, load_answer(request.answers, truth.name)));
    answered = answered || !judged.back().answer.absent;
  }
  if (!answered)
    throw UserError(fmt::format("{}: expected answers to cases of {}, such as {}.json, found none",
                                request.answers.string(), key_file(request.key).string(), truths.front().name));
  const fs::path truth = key_file(request.key).parent_path() / "truth";
  if (request.names_only || !fs::is_directory(truth)) return judged;
  Progress progress("blind score", std::ssize(judged), request.quiet);
  tbb::parallel_for(std::size_t{0}, judged.size(), [&](std::size_t i) {
    measure_closure(judged[i], request.answers, truth / judged[i].truth.name);
    progress.advance();
  });
  return judged;
}

Json score_json(const Score& score) {
  Json out = {{"value", score.value}};
  if (score.rate) out["hits"] = score.rate->hits;
  out["n"] = score.n;
  if (score.rate) {
    const auto [low, high] = wilson_interval(*score.rate);
    out["wilson95"] = {low, high};
  }
  return out;
}

Json calibration_json(const Calibration& calibration) {
  Json bins = Json::array();
  for (const CalibrationBin& bin : calibration.bins) {
    const auto [low, high] = wilson_interval(bin.right);
    bins.push_back({{"from", bin.from},
                    {"to", bin.to},
                    {"confidence", bin.confidence},
                    {"right", bin.right.value()},
                    {"hits", bin.right.hits},
                    {"n", bin.right.n},
                    {"wilson95", {low, high}}});
  }
  return {{"ece", calibration.ece},
          {"ece_by_chance", calibration.ece_by_chance},
          {"brier", calibration.brier},
          {"brier_skill", calibration.brier_skill},
          {"bins", bins}};
}

template <class Value>
Json optional_json(const std::optional<Value>& value) {
  return value ? Json(*value) : Json();
}

Json case_json(const Judged& judged) {
  Json truth = Json::array();
  for (const TrueEffect& effect : judged.truth.effects) truth.push_back(effect.name());
  return {{"case", judged.truth.name},
          {"kind", to_string(judged.truth.kind)},
          {"set", judged.truth.set},
          {"strength_class", judged.truth.strength},
          {"gap_sigma", optional_json(judged.truth.gap_sigma)},
          {"truth", truth},
          {"named", judged.answer.named},
          {"ambiguous_with", judged.answer.ambiguous_with},
          {"location", judged.answer.location},
          {"probability", optional_json(judged.answer.probability)},
          {"closure", optional_json(judged.answer.closure)},
          {"closure_true", optional_json(judged.true_closure)},
          {"closure_beyond", optional_json(judged.beyond_closure)},
          {"fault", judged.fault.empty() ? Json() : Json(judged.fault)}};
}

Json targets_json(const std::vector<Group>& groups) {
  Json out = Json::array();
  for (const Target& target : targets()) {
    const Group* group = find_group(groups, target.group);
    if (!group) continue;
    const Score& score = group->score(target.score);
    Json row = {{"score", target.score}, {"group", target.group}, {"low", target.low}, {"high", target.high}};
    row.update(score_json(score));
    row["met"] = score.n > 0 ? Json(is_met(target, score)) : Json();
    out.push_back(row);
  }
  return out;
}

Json scores_json(const std::vector<Judged>& judged, const std::vector<Group>& groups) {
  std::map<std::string, long> commits;
  std::map<std::string, std::map<std::string, long>> confusion;
  Json cases = Json::array();
  long absent = 0, errors = 0;
  for (const Judged& one : judged) {
    absent += one.answer.absent;
    errors += !one.answer.error.empty();
    if (!one.answer.commit.empty()) ++commits[one.answer.commit];
    for (const auto& [truth, named] : confusions(one)) ++confusion[truth][named];
    cases.push_back(case_json(one));
  }
  Json rows = Json::array();
  for (const Group& group : groups) {
    Json scores = Json::object();
    for (const Score& score : group.scores) scores[score.key] = score_json(score);
    rows.push_back({{"by", group.by},
                    {"name", group.name},
                    {"cases", group.cases},
                    {"scores", scores},
                    {"calibration", calibration_json(group.calibration)}});
  }
  return {{"schema", "wheelhop.blind_scores/1"},
          {"cases_in_all", judged.size()},
          {"errors", errors},
          {"absent", absent},
          {"commits_of_answers", commits},
          {"targets", targets_json(groups)},
          {"groups", rows},
          {"confusion", confusion},
          {"cases", cases}};
}

}  // namespace

int run_blind_score(const BlindScoreRequest& request) {
  const std::vector<TrueCase> key = load_key(request.key);
  const fs::path out = request.out.empty() ? request.answers / "scores.json" : request.out;
  FileUses uses;
  uses.reads("--key", key_file(request.key)).reads("the manifest in ANSWERS", request.answers / "manifest.json");
  for (const TrueCase& truth : key) {
    uses.reads("an answer in ANSWERS", request.answers / (truth.name + ".json"));
    for (const char* ending : {".plant.json", ".retuned.json"})
      uses.reads("a plant in ANSWERS", request.answers / (truth.name + ending));
  }
  uses.writes("--out", out).check();
  check_manifest(request.answers / "manifest.json", key_file(request.key), key.size());
  const std::vector<Judged> judged = judge_all(request, chosen_truth(request, key));
  const std::vector<Group> groups = score_groups(judged);
  const Json scores = scores_json(judged, groups);
  write_json(out, scores);
  print_scores(judged, groups);
  fmt::print("\nwritten: {}\n", out.string());
  return scores.at("errors") == 0 && scores.at("absent") == 0 ? 0 : 1;
}

}  // namespace wheelhop
