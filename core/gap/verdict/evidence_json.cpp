#include <limits>
#include <type_traits>

#include "core/gap/verdict/evidence.hpp"
#include "core/gap/verdict/thresholds.hpp"

namespace wheelhop {
namespace {

template <class T>
constexpr bool kIsList = false;
template <class T>
constexpr bool kIsList<std::vector<T>> = true;
template <class T, std::size_t n>
constexpr bool kIsList<std::array<T, n>> = true;

template <class T>
Json written(T& value);

struct Writer {
  Json out = Json::object();
  template <class T>
  void operator()(const char* name, T& value) {
    out[name] = written(value);
  }
};

template <class T>
Json written(T& value) {
  if constexpr (kIsList<T>) {
    Json list = Json::array();
    for (auto& item : value) list.push_back(written(item));
    return list;
  } else if constexpr (std::is_same_v<T, Matrix>) {
    return to_json(value);
  } else if constexpr (std::is_same_v<T, Vector>) {
    return std::vector<double>(value.begin(), value.end());
  } else if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string> || std::is_same_v<T, Place> ||
                       std::is_same_v<T, EffectId>) {
    return value;
  } else {
    Writer writer;
    value.fields(writer);
    return writer.out;
  }
}

template <class T>
void read(const JsonCursor& cursor, T& value);

struct Reader {
  const JsonCursor& cursor;
  template <class T>
  void operator()(const char* name, T& value) {
    read(cursor.at(name), value);
  }
};

template <class T>
void read(const JsonCursor& cursor, T& value) {
  if constexpr (std::is_same_v<T, bool>) {
    value = cursor.boolean();
  } else if constexpr (std::is_floating_point_v<T>) {
    value = cursor.raw().is_null() ? kUnknown : cursor.number();
  } else if constexpr (std::is_same_v<T, int>) {
    value = static_cast<int>(cursor.integer(0, 1000000));
  } else if constexpr (std::is_integral_v<T>) {
    value = static_cast<T>(cursor.integer(0));
  } else if constexpr (std::is_same_v<T, std::string>) {
    value = cursor.string();
  } else if constexpr (std::is_same_v<T, Place>) {
    value = place_from(cursor.string());
  } else if constexpr (std::is_same_v<T, EffectId>) {
    value = EffectId(cursor.string());
  } else if constexpr (std::is_same_v<T, Matrix>) {
    value = cursor.items().empty() ? Matrix() : matrix_from_json(cursor);
  } else if constexpr (std::is_same_v<T, Vector>) {
    std::vector<double> numbers;
    read(cursor, numbers);
    value = Eigen::Map<Vector>(numbers.data(), static_cast<Index>(numbers.size()));
  } else if constexpr (kIsList<T>) {
    const std::vector<JsonCursor> items = cursor.items();
    if constexpr (requires { value.resize(items.size()); })
      value.resize(items.size());
    else if (items.size() != value.size())
      cursor.fail("a list of " + std::to_string(value.size()));
    for (std::size_t i = 0; i < items.size(); ++i) read(items[i], value[i]);
  } else {
    Reader reader{cursor};
    value.fields(reader);
    cursor.done();
  }
}

const char* word(Origin origin) {
  switch (origin) {
    case Origin::derived: return "derived";
    case Origin::literature: return "literature";
    case Origin::learnt: return "learnt";
    default: return "judgement";
  }
}

/// Every index that the verdict follows, before it is followed.
void check(const JsonCursor& cursor, const Evidence& evidence) {
  const auto check_freed = [&](const std::vector<FreedEvidence>& list) {
    for (const FreedEvidence& freed : list)
      if (freed.tolerance >= evidence.tolerances.size() || freed.z.size() > evidence.tolerances.size() ||
          freed.theta.size() != evidence.tolerances.size())
        cursor.fail("freed parameters among its tolerances");
  };
  check_freed(evidence.freed);
  const auto check_sets = [&](const std::vector<CandidateEvidence>& list, std::size_t fewest, std::size_t most) {
    for (const CandidateEvidence& candidate : list) {
      check_freed(candidate.freed);
      if (candidate.effects.size() < fewest || candidate.effects.size() > most)
        cursor.fail("one effect in each of its singles, two in each of its pairs and more in its larger sets");
    }
  };
  check_sets(evidence.singles, 1, 1);
  check_sets(evidence.pairs, 2, 2);
  check_sets(evidence.larger, 3, std::numeric_limits<std::size_t>::max());
  if (evidence.places_needed == 2 && evidence.place_pairs.empty())
    cursor.fail("place_pairs where two places are needed");
  if (!(evidence.samples > 0) && evidence.cannot_follow.empty()) cursor.fail("a positive number of samples");
}

}  // namespace

Json to_json(const Evidence& evidence) {
  Evidence copy = evidence;
  return written(copy);
}

Evidence evidence_from(const JsonCursor& cursor) {
  Evidence evidence;
  read(cursor, evidence);
  check(cursor, evidence);
  return evidence;
}

Json to_json(const Thresholds& thresholds) {
  Json list = Json::array();
  Thresholds copy = thresholds;
  copy.fields(
      [&](const char* name, double& value, const char* unit, const char* meaning, Origin origin, const char* why) {
        list.push_back({{"name", name},
                        {"value", value},
                        {"unit", unit},
                        {"meaning", meaning},
                        {"origin", word(origin)},
                        {"why", why}});
      });
  return list;
}

Thresholds thresholds_from(const JsonCursor& list, Thresholds thresholds) {
  std::vector<std::string> names;
  thresholds.fields(
      [&](const char* name, double&, const char*, const char*, Origin, const char*) { names.emplace_back(name); });
  for (const JsonCursor& item : list.items()) {
    const std::string wanted = item.at("name").one_of(names);
    const double given = item.at("value").number();
    thresholds.fields([&](const char* name, double& value, const char*, const char*, Origin, const char*) {
      if (wanted == name) value = given;
    });
  }
  return thresholds;
}

}  // namespace wheelhop
