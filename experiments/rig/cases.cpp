#include "experiments/rig/cases.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/status.hpp"
#include "experiments/rig/system.hpp"

namespace wheelhop::blind {
namespace {

struct Set {
  CaseSpec common;
  std::vector<Wanted> effects;  ///< empty place: to be drawn
  SetOptions options;
};

std::shared_ptr<const Plan> read_plant(const JsonCursor& cursor) {
  const auto plan = std::make_shared<const Plan>(
      cursor.is_string() ? read_plan(JsonCursor::load(cursor.directory() / "plants" / (cursor.string() + ".json")))
                         : read_plan(cursor));
  const double ratio = plan->hold_hz / record_hz;
  if (ratio < 1 || ratio != std::round(ratio)) cursor.fail("a plant whose hold rate is a multiple of 200 Hz");
  return plan;
}

/// "ID", "ID@PLACE" or a form, all kinds that match.
void add_wanted(const JsonCursor& item, const std::vector<EffectKind>& kinds, const Plan& plan,
                std::vector<Wanted>& wanted) {
  const std::string text = item.string();
  const std::size_t at = text.find('@');
  const std::string name = text.substr(0, at), place = at == std::string::npos ? "" : text.substr(at + 1);
  std::vector<std::string> known, places;
  bool found = false;
  for (const EffectKind& kind : kinds) {
    for (const std::string& word : {kind.effect, kind.form})
      if (std::find(known.begin(), known.end(), word) == known.end()) known.push_back(word);
    if (kind.effect != name && kind.form != name) continue;
    for (const std::string& other : kind.places(plan)) {
      places.push_back(other);
      if (place == other) wanted.push_back({&kind, place}), found = true;
    }
    if (place.empty() && !kind.places(plan).empty()) wanted.push_back({&kind, ""}), found = true;
  }
  if (std::find(known.begin(), known.end(), name) == known.end())
    item.fail("an effect (known: " + join_names(known) + ")");
  if (!found) item.fail("an effect at a place of this plant (known places: " + join_names(places) + ")");
}

std::vector<Wanted> read_effects(const JsonCursor& set, const CaseSpec& common) {
  std::vector<Wanted> wanted;
  if (common.case_class == "none") return wanted;
  const std::vector<EffectKind>& kinds = effect_kinds(common.case_class == "unknown"     ? Family::unknown
                                                      : common.case_class == "parameter" ? Family::parameter
                                                                                         : Family::catalogue);
  const auto list = set.find("effects");
  if (list && !list->is_string()) {
    for (const JsonCursor& item : list->items()) add_wanted(item, kinds, *common.plan, wanted);
  } else {
    if (list) list->one_of({"all"});
    for (const EffectKind& kind : kinds)
      if (!kind.places(*common.plan).empty()) wanted.push_back({&kind, ""});
  }
  if (wanted.empty()) set.fail("a plant with a place for at least one effect");
  return wanted;
}

Set read_set(const JsonCursor& cursor, bool truth) {
  for (const char* required : {"name", "class"}) cursor.at(required);
  Set set;
  set.options = read_options<SetOptions>(cursor);
  CaseSpec& common = set.common;
  common.truth = truth;
  common.set = set.options.name;
  common.case_class = set.options.case_class;
  common.plan = read_plant(cursor.at("plant"));
  set.effects = read_effects(cursor, common);
  common.drive.rms = set.options.level;
  std::tie(common.drive.from_hz, common.drive.to_hz) = set.options.band_hz;
  std::tie(common.noise_low, common.noise_high) = set.options.noise_relative;
  common.samples = set.options.samples;
  cursor.done();
  return set;
}

Wanted placed(Wanted wanted, const Plan& plan, Random& random) {
  const std::vector<std::string> places = wanted.kind->places(plan);
  if (wanted.place.empty())
    wanted.place = places[static_cast<std::size_t>(random.integer(static_cast<Index>(places.size())))];
  return wanted;
}

/// Two different effects, at one place or at two.
std::vector<Wanted> pair_of(const Set& set, bool same_place, Random& random) {
  const auto draw = [&] {
    const auto count = static_cast<Index>(set.effects.size());
    return placed(set.effects[static_cast<std::size_t>(random.integer(count))], *set.common.plan, random);
  };
  for (int attempt = 0; attempt < 1000; ++attempt) {
    const Wanted first = draw(), second = draw();
    if (first.kind->effect != second.kind->effect && (first.place == second.place) == same_place)
      return {first, second};
  }
  throw UserError("set \"" + set.common.set + "\": expected effects of which two can stand together");
}

/// The entry whose turn it is: all of them once in each round, every round in an order of its own, so that no drive or
/// noise always meets the same strength. @param use keeps lists apart
const std::string& in_turn(const std::vector<std::string>& list, std::size_t turn, const CaseSpec& first,
                           std::uint64_t use) {
  Random random(first.seed, Stream::parameters, first.number + turn / list.size(), use);
  std::vector<std::size_t> order(list.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t i = order.size(); i > 1; --i)
    std::swap(order[i - 1], order[static_cast<std::size_t>(random.integer(static_cast<Index>(i)))]);
  return list[order[turn % list.size()]];
}

void expand(const Set& set, std::vector<CaseSpec>& cases) {
  std::size_t turn = 0;
  CaseSpec first = set.common;
  first.number = cases.size();
  const auto add = [&](const std::vector<Wanted>& wanted, const std::string& strength) {
    CaseSpec spec = set.common;
    spec.number = cases.size();
    Random random(spec.seed, Stream::parameters, spec.number, 0);
    for (const Wanted& one : wanted) spec.effects.push_back(placed(one, *spec.plan, random));
    if (spec.case_class == "double") spec.effects = pair_of(set, turn / set.options.strengths.size() % 2 == 0, random);
    spec.strength_class = strength;
    spec.drive.name = in_turn(set.options.drives, turn, first, 3);
    spec.coloured = in_turn(set.options.noise, turn, first, 4) == "coloured";
    ++turn;
    cases.push_back(std::move(spec));
  };
  for (Index seed = 0; seed < set.options.seeds; ++seed) {
    if (set.common.case_class == "none")
      add({}, "");
    else if (set.common.case_class == "double")
      add({}, set.options.strengths[static_cast<std::size_t>(seed) % set.options.strengths.size()]);
    else
      for (const Wanted& wanted : set.effects)
        for (const std::string& strength : set.options.strengths) add({wanted}, strength);
  }
}

}  // namespace

std::vector<CaseSpec> read_cases(const JsonCursor& config, std::optional<std::uint64_t> seed) {
  const auto options = read_options<CasesOptions>(config);
  std::vector<CaseSpec> cases;
  for (const JsonCursor& item : config.at("sets").items()) {
    Set set = read_set(item, options.truth);
    set.common.seed = seed.value_or(static_cast<std::uint64_t>(options.seed));
    expand(set, cases);
  }
  if (cases.empty()) config.at("sets").fail("at least one set");
  config.done();
  return cases;
}

}  // namespace wheelhop::blind
