#include "experiments/blind/score_print.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace wheelhop::scoring {
namespace {

std::string number(double value) { return std::isfinite(value) ? fmt::format("{:.3f}", value) : "-"; }

std::string bound(const Target& target) {
  if (target.low == target.high) return fmt::format("= {:g}", target.low);
  if (target.low <= 0) return fmt::format("<= {:g}", target.high);
  if (target.high >= 1) return fmt::format(">= {:g}", target.low);
  return fmt::format("{:g} to {:g}", target.low, target.high);
}

std::string interval(const Score& score) {
  if (!score.rate || score.n == 0) return "";
  const auto [low, high] = wilson_interval(*score.rate);
  return fmt::format("[{:.2f}, {:.2f}]", low, high);
}

void print_targets(const std::vector<Group>& groups) {
  fmt::print("  {:<52} {:<6} {:>7}  {:<13} {:>5}  {:<12}\n", "score", "cases", "value", "95 %", "n", "target");
  for (const Target& target : targets()) {
    const Group* group = find_group(groups, target.group);
    if (!group || group->score(target.score).n == 0) continue;
    const Score& score = group->score(target.score);
    fmt::print("  {:<52} {:<6} {:>7}  {:<13} {:>5}  {:<12} {}\n", score.meaning, target.group, number(score.value),
               interval(score), score.n, bound(target), is_met(target, score) ? "met" : "missed");
  }
  fmt::print("\nwithout a target, all cases\n");
  for (const Score& score : groups.front().scores) {
    const bool has_target = std::any_of(targets().begin(), targets().end(), [&](const Target& target) {
      return target.score == score.key && find_group(groups, target.group);
    });
    if (has_target || score.n == 0) continue;
    fmt::print("  {:<52} {:<6} {:>7}  {:<13} {:>5}\n", score.meaning, "all", number(score.value), interval(score),
               score.n);
  }
}

void print_groups(const std::vector<Group>& groups) {
  const std::vector<std::pair<std::string, std::string>> columns = {{"where_top1", "where"},
                                                                    {"which_top1", "which"},
                                                                    {"which_top2", "of 2"},
                                                                    {"set_contains_truth", "in set"},
                                                                    {"mean_set_size", "size"},
                                                                    {"false_alarm", "alarms"},
                                                                    {"missed_gap", "missed"},
                                                                    {"unknown_flagged", "unknown"},
                                                                    {"double_both_named", "double"},
                                                                    {"mixed_both_named", "mixed"},
                                                                    {"closure_reported", "closure"},
                                                                    {"closure_true", "true"},
                                                                    {"ece", "ECE"}};
  fmt::print("\n{:<24} {:>5}", "cases", "n");
  for (const auto& [key, title] : columns) fmt::print(" {:>7}", title);
  fmt::print("\n");
  for (const Group& group : groups) {
    fmt::print("{:<24} {:>5}", group.by == "all" ? group.name : group.by + " " + group.name, group.cases);
    for (const auto& [key, title] : columns) fmt::print(" {:>7}", number(group.score(key).value));
    fmt::print("\n");
  }
}

void print_calibration(const Calibration& calibration, long cases) {
  if (calibration.bins.empty()) return;
  long n = 0;
  for (const CalibrationBin& bin : calibration.bins) n += bin.right.n;
  fmt::print(
      "\nconfidence of the first name against how often it is right: {} of {} cases state one, {} bins of about equal "
      "mass\n  (ECE {:.3f}; a perfectly calibrated tool would show about {:.3f} on so few)\n",
      n, cases, calibration.bins.size(), calibration.ece, calibration.ece_by_chance);
  for (const CalibrationBin& bin : calibration.bins) {
    const auto [low, high] = wilson_interval(bin.right);
    fmt::print("  {:.3f} to {:.3f}   mean {:.3f}   right {:.3f} [{:.2f}, {:.2f}]   n {}\n", bin.from, bin.to,
               bin.confidence, bin.right.value(), low, high, bin.right.n);
  }
}

void print_confusions(const std::vector<Judged>& judged) {
  std::map<std::string, std::map<std::string, long>> table;
  for (const Judged& one : judged)
    for (const auto& [truth, named] : confusions(one)) ++table[truth][named];
  fmt::print("\ntrue effect: what was named\n");
  for (const auto& [truth, row] : table) {
    fmt::print("  {:<24}", truth);
    for (const auto& [named, count] : row) fmt::print("  {} {}", named, count);
    fmt::print("\n");
  }
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : " + ") + name;
  return text.empty() ? "nothing" : text;
}

void print_wrong(const std::vector<Judged>& judged) {
  const long wrong = std::count_if(judged.begin(), judged.end(), [](const Judged& one) { return !one.fault.empty(); });
  fmt::print("\nwrong: {} of {} cases{}\n", wrong, judged.size(),
             wrong > 0 ? " (truth; named, with its probability; gap over noise)" : "");
  for (const Judged& one : judged) {
    if (one.fault.empty()) continue;
    std::vector<std::string> truth;
    for (const TrueEffect& effect : one.truth.effects) truth.push_back(effect.name());
    fmt::print("  {}  {:<22}  {}; {}", one.truth.name, one.fault, joined(truth), joined(one.answer.named));
    if (one.answer.probability) fmt::print(", P {:.2f}", *one.answer.probability);
    if (one.truth.gap_sigma) fmt::print("; {:.2f}", *one.truth.gap_sigma);
    fmt::print("\n");
  }
}

}  // namespace

bool is_met(const Target& target, const Score& score) {
  return score.n > 0 && score.value >= target.low && score.value <= target.high;
}

const Group* find_group(const std::vector<Group>& groups, const std::string& name) {
  const auto found = std::find_if(groups.begin(), groups.end(), [&](const Group& group) {
    return group.name == name && (group.by == "all" || group.by == "strength");
  });
  return found == groups.end() ? nullptr : &*found;
}

void print_scores(const std::vector<Judged>& judged, const std::vector<Group>& groups) {
  const auto absent = std::count_if(judged.begin(), judged.end(), [](const Judged& one) { return one.answer.absent; });
  const auto errors =
      std::count_if(judged.begin(), judged.end(), [](const Judged& one) { return !one.answer.error.empty(); });
  fmt::print("{} cases, {} without an answer, {} answers are errors; these count as wrong\n\n", judged.size(), absent,
             errors);
  print_targets(groups);
  print_groups(groups);
  print_calibration(groups.front().calibration, std::ssize(judged));
  print_confusions(judged);
  print_wrong(judged);
}

}  // namespace wheelhop::scoring
