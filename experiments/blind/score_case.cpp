#include "experiments/blind/score_case.hpp"

#include <algorithm>

#include "core/base/status.hpp"

namespace wheelhop::scoring {
namespace {

using Names = std::vector<std::string>;

bool holds(const Names& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

void add_once(Names& names, const std::string& name) {
  if (!holds(names, name)) names.push_back(name);
}

Names strings(const JsonCursor& cursor) {
  Names out;
  for (const JsonCursor& item : cursor.items()) out.push_back(item.string());
  return out;
}

/// A number, or nothing where the file has null (a closure of no gap).
std::optional<double> number_of(const JsonCursor& cursor) {
  if (cursor.raw().is_null()) return std::nullopt;
  return cursor.number();
}

void read_which(const JsonCursor& which, Answer& answer) {
  answer.outcome = which.at("outcome").string();
  answer.named = strings(which.at("named"));
  if (const auto others = which.find("ambiguous_with")) answer.ambiguous_with = strings(*others);
  answer.ranking = answer.reported_set();
  for (const JsonCursor& effect : which.at("effects").items()) {
    const std::string name = effect.at("effect").string() + "@" + effect.at("location").string();
    add_once(answer.ranking, name);
    if (!answer.named.empty() && name == answer.named.front() && !answer.probability)
      answer.probability = number_of(effect.at("probability"));
  }
}

void read_where(const JsonCursor& where, Answer& answer) {
  if (const auto location = where.find("location"); location && location->is_string())
    answer.location = location->string();
  answer.same_locations = {answer.location};
  const auto places = where.find("without_catalogue");
  if (!places) return;
  for (const JsonCursor& place : places->items()) {
    Names same = {place.at("location").string()};
    if (const auto others = place.find("same_entry"))
      for (const std::string& other : strings(*others)) same.push_back(other);
    const bool own =
        std::any_of(same.begin(), same.end(), [&](const auto& name) { return same_location(name, answer.location); });
    if (own)
      for (const std::string& name : same) add_once(answer.same_locations, name);
  }
}

void read_how_far(const JsonCursor& how_far, Answer& answer) {
  if (const auto closure = how_far.find("closure")) answer.closure = number_of(*closure);
  if (const auto interval = how_far.find("closure_ci90")) {
    const std::vector<JsonCursor> ends = interval->items();
    if (ends.size() != 2) interval->fail("two numbers");
    answer.closure_low = number_of(ends[0]);
    answer.closure_high = number_of(ends[1]);
  }
  if (const auto beyond = how_far.find("beyond_envelope"); beyond && !beyond->raw().is_null())  // null: not known
    answer.beyond_flagged = beyond->boolean("flagged", false);
  if (const auto floor = how_far.find("floor"))
    if (const auto std = floor->find("std"))
      for (const auto& [channel, value] : std->raw().items())
        answer.floor.emplace_back(channel, std->at(channel).number({.low = 0}));
}

Answer read_answer(const JsonCursor& cursor) {
  Answer answer;
  if (const auto left_out = cursor.find("left_out")) answer.left_out = strings(*left_out);
  if (const auto error = cursor.find("error")) {
    answer.error = error->string();
    return answer;
  }
  answer.verdict = cursor.at("verdict").string();
  read_which(cursor.at("which"), answer);
  read_where(cursor.at("where"), answer);
  if (const auto how_far = cursor.find("how_far")) read_how_far(*how_far, answer);
  answer.plant = cursor.string("corrected_plant", "");
  answer.retuned = cursor.string("retuned_plant", "");
  if (const auto made = cursor.find("provenance"); made && made->is_object())
    answer.commit = made->string("commit", "");
  return answer;
}

bool is_unknown(const std::string& name) { return name.starts_with("unknown@"); }

/// No family of the catalogue is the right answer.
bool asks_for_unknown(CaseKind kind) { return kind == CaseKind::unknown || kind == CaseKind::left_out; }

std::string fault_of(const Judged& judged) {
  if (judged.answer.absent) return "no answer";
  if (!judged.answer.error.empty()) return "error: " + judged.answer.error;
  const bool none = judged.truth.kind == CaseKind::none;
  if (none) return judged.alarm ? "false alarm" : "";
  if (!judged.alarm) return "missed";
  switch (judged.truth.kind) {
    case CaseKind::unknown:
    case CaseKind::left_out:
      if (!judged.flagged) return "not flagged as unknown";
      return judged.where_in_set ? "" : "wrong place";
    case CaseKind::twofold:
      if (!judged.all_named) return judged.first ? "one of two" : "misnamed";
      break;
    case CaseKind::mixed:
      if (judged.all_named) break;
      return judged.effect_named ? "only the effect" : judged.parameter_named ? "only the parameter" : "misnamed";
    default:
      if (!judged.first) return judged.flagged ? "flagged as unknown" : "misnamed";
  }
  return judged.extras > 0 ? "named beside the truth" : "";
}

}  // namespace

bool is_named(const TrueEffect& effect, CaseKind kind, const std::string& name) {
  const std::size_t at = name.find('@');
  if (at == std::string::npos || !same_location(name.substr(at + 1), effect.location)) return false;
  return name.substr(0, at) == effect.effect || (asks_for_unknown(kind) && is_unknown(name));
}

std::vector<std::string> Answer::reported_set() const {
  Names names;
  for (const std::string& name : named) add_once(names, name);
  for (const std::string& name : ambiguous_with) add_once(names, name);
  return names;
}

Answer load_answer(const std::filesystem::path& folder, const std::string& name) {
  const std::filesystem::path file = folder / (name + ".json");
  Answer answer;
  if (!std::filesystem::exists(file)) {
    answer.absent = true;
    return answer;
  }
  try {
    return read_answer(JsonCursor::load(file));
  } catch (const MachineError&) {
    throw;
  } catch (const UserError& error) {
    answer.error = error.what();
    return answer;
  }
}

Judged judge(const TrueCase& truth, Answer given) {
  Judged judged;
  judged.truth = truth;
  judged.answer = std::move(given);
  const Answer& answer = judged.answer;
  if (!answer.left_out.empty()) judged.truth.kind = CaseKind::left_out;
  const bool answered = !answer.absent && answer.error.empty();
  const Names reported = answer.reported_set();
  std::size_t named = 0, in_set = 0;
  for (const TrueEffect& effect : truth.effects) {
    const auto is = [&](const std::string& name) { return is_named(effect, judged.truth.kind, name); };
    const auto at = [&](const std::string& place) { return same_location(place, effect.location); };
    judged.where = judged.where || at(answer.location);
    judged.where_in_set =
        judged.where_in_set || std::any_of(answer.same_locations.begin(), answer.same_locations.end(), at);
    judged.first = judged.first || (!answer.named.empty() && is(answer.named.front()));
    const auto two = answer.ranking.begin() + std::min<std::ptrdiff_t>(2, std::ssize(answer.ranking));
    judged.in_first_two = judged.in_first_two || std::any_of(answer.ranking.begin(), two, is);
    const bool is_among_named = std::any_of(answer.named.begin(), answer.named.end(), is);
    named += is_among_named;
    if (judged.truth.kind == CaseKind::mixed)
      (is_wrong_parameter(effect) ? judged.parameter_named : judged.effect_named) = is_among_named;
    in_set += std::any_of(reported.begin(), reported.end(), is);
  }
  judged.all_named = answered && named == truth.effects.size();
  judged.in_set = answered && in_set == truth.effects.size();
  judged.flagged = std::any_of(answer.named.begin(), answer.named.end(), is_unknown);
  judged.alarm = answered && (answer.verdict == "gap" || !answer.named.empty());
  for (const std::string& name : answer.named) {
    const bool is_true = std::any_of(truth.effects.begin(), truth.effects.end(), [&](const TrueEffect& effect) {
      return is_named(effect, judged.truth.kind, name);
    });
    judged.extras += !is_true && !(asks_for_unknown(judged.truth.kind) && is_unknown(name));
  }
  judged.fault = fault_of(judged);
  return judged;
}

std::vector<std::pair<std::string, std::string>> confusions(const Judged& judged) {
  const auto id = [](const std::string& name) { return name.substr(0, name.find('@')); };
  Names left;
  for (const std::string& name : judged.answer.named) left.push_back(id(name));
  const std::string nothing = judged.answer.absent || !judged.answer.error.empty() ? "error" : "none";
  std::vector<std::pair<std::string, std::string>> pairs;
  Names open;
  for (const TrueEffect& effect : judged.truth.effects) {
    const auto hit = std::find(left.begin(), left.end(), effect.effect);
    if (hit == left.end()) {
      open.push_back(effect.effect);
    } else {
      pairs.emplace_back(effect.effect, effect.effect);
      left.erase(hit);
    }
  }
  if (judged.truth.effects.empty()) open.push_back("none");
  for (const std::string& effect : open) {
    pairs.emplace_back(effect, left.empty() ? nothing : left.front());
    if (!left.empty()) left.erase(left.begin());
  }
  return pairs;
}

}  // namespace wheelhop::scoring
