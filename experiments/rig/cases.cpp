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
  std::vector<Wanted> effects;     ///< empty place: to be drawn
  std::vector<Wanted> parameters;  ///< of class mixed, each at its place
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

using Kinds = std::vector<const EffectKind*>;

Kinds kinds_of(std::initializer_list<Family> families) {
  Kinds kinds;
  for (const Family family : families)
    for (const EffectKind& kind : effect_kinds(family)) kinds.push_back(&kind);
  return kinds;
}

/// Appends what "ID", "ID@PLACE" or a form means among the kinds. @return whether it means anything
bool add_matches(const std::string& text, const Kinds& kinds, const Plan& plan, std::vector<Wanted>& wanted) {
  const std::size_t at = text.find('@');
  const std::string name = text.substr(0, at), place = at == std::string::npos ? "" : text.substr(at + 1);
  const std::size_t before = wanted.size();
  for (const EffectKind* kind : kinds) {
    if (kind->effect != name && kind->form != name) continue;
    const std::vector<std::string> places = kind->places(plan);
    const bool stands =
        place.empty() ? !places.empty() : std::find(places.begin(), places.end(), place) != places.end();
    if (stands) wanted.push_back({kind, place});
  }
  return wanted.size() > before;
}

[[noreturn]] void fail_to_match(const JsonCursor& item, const Kinds& kinds, const Plan& plan) {
  const std::string text = item.string(), name = text.substr(0, text.find('@'));
  std::vector<std::string> known, places;
  for (const EffectKind* kind : kinds) {
    for (const std::string& word : {kind->effect, kind->form})
      if (std::find(known.begin(), known.end(), word) == known.end()) known.push_back(word);
    if (kind->effect != name && kind->form != name) continue;
    for (const std::string& place : kind->places(plan))
      if (std::find(places.begin(), places.end(), place) == places.end()) places.push_back(place);
  }
  if (std::find(known.begin(), known.end(), name) == known.end())
    item.fail("an effect (known: " + join_names(known) + ")");
  item.fail("an effect at a place of this plant (known places: " + join_names(places) + ")");
}

/// What a member of the set means, all of `kinds` where it is absent or "all". @param others kinds that an item may
/// mean if it means none of `kinds`
std::vector<Wanted> read_wanted(const JsonCursor& set, const char* member, const Plan& plan, const Kinds& kinds,
                                const Kinds& others) {
  std::vector<Wanted> wanted;
  const auto list = set.find(member);
  if (list && !list->is_string()) {
    for (const JsonCursor& item : list->items()) {
      if (add_matches(item.string(), kinds, plan, wanted) || add_matches(item.string(), others, plan, wanted)) continue;
      Kinds all = kinds;
      all.insert(all.end(), others.begin(), others.end());
      fail_to_match(item, all, plan);
    }
  } else {
    if (list) list->one_of({"all"});
    for (const EffectKind* kind : kinds)
      if (!kind->places(plan).empty()) wanted.push_back({kind, ""});
  }
  if (wanted.empty()) set.fail("a plant with a place for at least one effect");
  return wanted;
}

void read_effects(const JsonCursor& cursor, Set& set) {
  const std::string& what = set.common.case_class;
  const Plan& plan = *set.common.plan;
  if (what == "none") return;
  if (what == "unknown" || what == "parameter") {
    set.effects =
        read_wanted(cursor, "effects", plan, kinds_of({what == "unknown" ? Family::unknown : Family::parameter}), {});
    return;
  }
  const std::string& which = set.options.kinds;
  const Kinds kinds = which == "first"   ? kinds_of({Family::catalogue})
                      : which == "added" ? kinds_of({Family::added})
                                         : kinds_of({Family::catalogue, Family::added});
  set.effects = read_wanted(cursor, "effects", plan, kinds, kinds_of({Family::catalogue, Family::added}));
  if (what != "mixed") return;
  for (const Wanted& one : read_wanted(cursor, "parameters", plan, kinds_of({Family::parameter}), {}))
    for (const std::string& place : one.kind->places(plan))
      if (one.place.empty() || one.place == place) set.parameters.push_back({one.kind, place});
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
  read_effects(cursor, set);
  if (set.options.size.second > 0 && common.case_class != "single")
    cursor.at("size").fail("no size: only the class single has one");
  if (set.options.size.second > 0 && !(set.options.size.first > 0)) cursor.at("size").fail("sizes above 0");
  common.size = set.options.size;
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
template <class T>
const T& in_turn(const std::vector<T>& list, std::size_t turn, const CaseSpec& first, std::uint64_t use) {
  Random random(first.seed, Stream::parameters, first.number + turn / list.size(), use);
  std::vector<std::size_t> order(list.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t i = order.size(); i > 1; --i)
    std::swap(order[i - 1], order[static_cast<std::size_t>(random.integer(static_cast<Index>(i)))]);
  return list[order[turn % list.size()]];
}

/// Realisations of random numbers that keep the lists of a set apart. Part of the result: never renumber.
enum ListUse : std::uint64_t { of_drives = 3, of_noises = 4, of_mixed_effects = 5, of_mixed_parameters = 6 };

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
    if (spec.case_class == "mixed")
      spec.effects = {placed(in_turn(set.effects, turn, first, of_mixed_effects), *spec.plan, random),
                      in_turn(set.parameters, turn, first, of_mixed_parameters)};
    spec.strength_class = strength;
    spec.drive.name = in_turn(set.options.drives, turn, first, of_drives);
    spec.coloured = in_turn(set.options.noise, turn, first, of_noises) == "coloured";
    ++turn;
    cases.push_back(std::move(spec));
  };
  for (Index seed = 0; seed < set.options.seeds; ++seed) {
    if (set.common.case_class == "none")
      add({}, "");
    else if (set.common.case_class == "double" || set.common.case_class == "mixed")
      add({}, set.options.strengths[static_cast<std::size_t>(seed) % set.options.strengths.size()]);
    else if (set.common.size.second > 0)
      for (const Wanted& wanted : set.effects) add({wanted}, "");
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
