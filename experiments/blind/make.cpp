#include "experiments/blind/make.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <numeric>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "experiments/rig/records.hpp"
#include "experiments/rig/sha256.hpp"
#include "experiments/run/file_uses.hpp"
#include "experiments/run/jobs.hpp"

namespace wheelhop {
namespace fs = std::filesystem;
namespace {

using blind::CaseSpec;
using blind::Prepared;

Json effects_json(const Prepared& prepared) {
  Json list = Json::array();
  for (std::size_t i = 0; i < prepared.spec.effects.size(); ++i) {
    const blind::Wanted& wanted = prepared.spec.effects[i];
    Json item = {{"effect", wanted.kind->effect},
                 {"location", wanted.place},
                 {"in_catalogue", wanted.kind->effect != "unknown"},
                 {"form", wanted.kind->form},
                 {"catalogue_form", wanted.kind->catalogue_form}};
    if (i < prepared.system.effects.size()) {
      item["strength"] = prepared.system.effects[i].strength;
      item["unit"] = prepared.system.effects[i].unit;
    }
    list.push_back(std::move(item));
  }
  return list;
}

Json entry(const Prepared& prepared, Json name) {
  const CaseSpec& spec = prepared.spec;
  const bool reachable = prepared.unreachable.empty();
  Json out = {{"case", std::move(name)},
              {"set", spec.set},
              {"class", spec.case_class},
              {"plant", spec.plan->name},
              {"drive", spec.drive.name},
              {"coloured", spec.coloured},
              {"noise", prepared.noise_relative},
              {"strength_class", !reachable                    ? "unreachable"
                                 : spec.strength_class.empty() ? "none"
                                                               : spec.strength_class}};
  if (reachable) {
    out["gap_sigma"] = prepared.gap_sigma;
    out["gap_delivered_sigma"] = prepared.delivered_sigma;
    if (spec.case_class == "mixed") out["gap_parameter_sigma"] = prepared.parameter_sigma;
  } else {
    out["why"] = prepared.unreachable;
  }
  out["effects"] = effects_json(prepared);
  return out;
}

/// Absolute, without dots, links or a slash at the end.
fs::path plain(const fs::path& path) {
  const fs::path result = fs::weakly_canonical(fs::absolute(path));
  return result.has_filename() ? result : result.parent_path();
}

bool lies_inside(const fs::path& inner, const fs::path& outer) {
  const fs::path a = plain(inner), b = plain(outer);
  return std::mismatch(a.begin(), a.end(), b.begin(), b.end()).second == b.end();
}

bool is_empty_or_absent(const fs::path& folder) {
  std::error_code error;
  return !fs::exists(folder, error) || fs::is_empty(folder, error);
}

[[noreturn]] void refuse_key(const fs::path& folder, const std::string& found) {
  throw UserError(fmt::format("{}: expected a folder without a key, found {}; choose another folder for this key",
                              folder.string(), found));
}

/// Names of the sets of all cases, in order; none where the file is no key.
std::vector<std::string> sets_of_key(const fs::path& file) {
  std::vector<std::string> sets;
  for (const Json& one : Json::parse(read_file(file), nullptr, false))
    if (one.is_object()) sets.push_back(one.value("set", ""));
  std::sort(sets.begin(), sets.end());
  return sets;
}

/// Cases and keys are made once: a key that is lost opens no cases any more. A key whose cases are not there may be
/// that of a call that was stopped between the two, if it is of these cases.
void require_new(const BlindMakeRequest& request, const std::vector<CaseSpec>& specs) {
  if (lies_inside(request.key, request.out))
    throw UserError(request.key.string() + ": expected a folder for the key outside " + request.out.string() +
                    ", which is handed out");
  FileUses()
      .reads_named("CONFIG", request.config)
      .writes_folder("--out", request.out, {"manifest.json"})
      .writes_folder("--key", request.key, {"key.json"})
      .check();
  if (!is_empty_or_absent(request.out))
    throw UserError(request.out.string() + ": expected a new or empty folder for the cases");
  const bool has_key = fs::exists(request.key / "key.json");
  if (!has_key && fs::exists(request.key / "truth")) refuse_key(request.key, "truth");
  std::vector<std::string> sets;
  for (const CaseSpec& spec : specs) sets.push_back(spec.set);
  std::sort(sets.begin(), sets.end());
  if (has_key && sets_of_key(request.key / "key.json") != sets) refuse_key(request.key, "key.json");
}

/// Positions of the cases that exist, in an order that tells nothing of their kind.
std::vector<std::size_t> shuffled(const std::vector<Prepared>& prepared, std::uint64_t seed) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < prepared.size(); ++i)
    if (prepared[i].unreachable.empty()) order.push_back(i);
  Random random(seed, Stream::parameters, prepared.size(), 2);
  for (std::size_t i = order.size(); i > 1; --i)
    std::swap(order[i - 1], order[static_cast<std::size_t>(random.integer(static_cast<Index>(i)))]);
  return order;
}

void for_all(std::size_t count, const BlindMakeRequest& request, const char* what,
             const std::function<void(std::size_t)>& work) {
  const JobOptions options{request.jobs, what, "nothing was written; start the same command again", request.quiet};
  run_jobs(count, options, [&](std::size_t i) -> std::function<void()> {
    work(i);
    return {};
  });
}

}  // namespace

int run_blind_make(const BlindMakeRequest& request) {
  const std::vector<CaseSpec> specs = blind::read_cases(JsonCursor::load(request.config), request.seed);
  require_new(request, specs);
  std::vector<Prepared> prepared(specs.size());
  for_all(specs.size(), request, "strengths of blind cases",
          [&](std::size_t i) { prepared[i] = blind::prepare(specs[i]); });

  const std::vector<std::size_t> order = shuffled(prepared, specs.front().seed);
  const int digits = std::max(3, static_cast<int>(fmt::format("{}", order.size()).size()));
  const auto name_of = [&](std::size_t k) { return fmt::format("case_{:0{}}", k, digits); };
  Json key = Json::array();
  for (std::size_t k = 0; k < order.size(); ++k) key.push_back(entry(prepared[order[k]], name_of(k)));
  for (const Prepared& one : prepared)
    if (!one.unreachable.empty()) {
      key.push_back(entry(one, nullptr));
      std::fprintf(stderr, "left out of set \"%s\" (%s): %s\n", one.spec.set.c_str(), one.spec.strength_class.c_str(),
                   one.unreachable.c_str());
    }
  StagedSet key_set(request.key, "key.json"), case_set(request.out, "manifest.json");
  write_json(key_set.path() / "key.json", key);
  // Of a call that was stopped when its key was in place and its cases were not.
  const bool has_key = fs::exists(request.key / "key.json");
  if (has_key && read_file(request.key / "key.json") != read_file(key_set.path() / "key.json"))
    refuse_key(request.key, "key.json of other cases");
  for_all(order.size(), request, "records of blind cases", [&](std::size_t k) {
    const Prepared& one = prepared[order[k]];
    const fs::path folder = case_set.path() / name_of(k);
    write_records(folder, blind::measured_records(one));
    write_json(folder / "plant.json", one.spec.plan->file);
    if (one.spec.truth && !has_key) write_records(key_set.path() / "truth" / name_of(k), blind::truth_records(one));
  });
  write_json(case_set.path() / "manifest.json",
             {{"schema", "wheelhop.blind/1"},
              {"cases", order.size()},
              {"key_sha256", blind::sha256(read_file(key_set.path() / "key.json"))}});
  if (!has_key) key_set.publish();  // first: cases without a key would be lost
  case_set.publish();
  return 0;
}

}  // namespace wheelhop
