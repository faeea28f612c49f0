#include "experiments/rigs/rigs.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <set>
#include <string>
#include <vector>

#include "core/base/files.hpp"
#include "core/base/json.hpp"
#include "core/base/status.hpp"
#include "core/gap/verdict/decide.hpp"
#include "experiments/diagnose/diagnose.hpp"
#include "experiments/identify/identify.hpp"
#include "experiments/run/file_uses.hpp"
#include "experiments/run/provenance.hpp"

namespace wheelhop {
namespace {

namespace fs = std::filesystem;

struct Rig {
  std::string name, known;
  Json known_rmse;
  bool diagnosed = false;
  fs::path first, records;  ///< plant or config, and records
};

Rig rig_from(const JsonCursor& cursor) {
  Rig rig;
  rig.name = cursor.at("name").string();
  if (rig.name.empty() || rig.name.find_first_of("/\\") != std::string::npos || rig.name.front() == '.')
    cursor.at("name").fail("a name that is a file name");
  rig.known = cursor.at("known").string();
  rig.known_rmse = Json::object();
  if (const auto known = cursor.find("known_rmse"))
    for (const auto& [channel, value] : known->raw().items())
      rig.known_rmse[channel] = known->at(channel).number({.low = 0});
  const auto diagnose = cursor.find("diagnose"), identify = cursor.find("identify");
  if (diagnose.has_value() == identify.has_value()) cursor.fail("either \"diagnose\" or \"identify\"");
  rig.diagnosed = diagnose.has_value();
  const JsonCursor& work = diagnose ? *diagnose : *identify;
  rig.first = cursor.directory() / work.at(rig.diagnosed ? "plant" : "config").string();
  rig.records = cursor.directory() / work.at("records").string();
  work.done();
  cursor.done();
  return rig;
}

/// RMSE by channel.
Json by_name(const std::vector<std::string>& names, const std::vector<double>& values) {
  Json out = Json::object();
  for (std::size_t i = 0; i < names.size(); ++i) out[names[i]] = values[i];
  return out;
}

/// What a diagnosis file says, in a row.
Json row_of_diagnosis(const fs::path& file) {
  const JsonCursor whole = JsonCursor::load(file);
  const Evidence evidence = evidence_from(whole.at("evidence"));
  const Verdict verdict = decide(evidence, thresholds_from(whole.at("thresholds")));
  std::vector<std::string> names;
  for (const JsonCursor& channel : whole.at("where").at("channels").items())
    names.push_back(channel.at("channel").string());
  Json suspects = Json::array();
  for (const EffectAt& name : verdict.named)
    for (const Suspect& suspect : verdict.suspects)
      if (suspect.name() == name) {
        suspects.push_back({{"name", name}, {"probability", suspect.probability}});
        break;
      }
  return {{"answer", whole.at("answer").string()},
          {"named", suspects},
          {"rmse",
           {{"as_delivered", by_name(names, evidence.delivered.rmse)},
            {"retuned", by_name(names, evidence.retuned.rmse)},
            {"with_answer", by_name(names, corrected_stage(evidence, verdict).rmse)}}}};
}

/// What a model file says, in a row.
Json row_of_model(const fs::path& file) {
  Json rmse = Json::array();
  const JsonCursor whole = JsonCursor::load(file);
  for (const JsonCursor& record : whole.at("scores").at("records").items()) {
    if (record.at("role").string() != "validation") continue;
    rmse.push_back(record.at("rmse").raw());
  }
  return {{"rmse", {{"validation", rmse}}}};
}

/// "y 1.2e-05, z 0.003"
std::string text_of(const Json& rmse) {
  std::string text;
  for (const auto& [channel, value] : rmse.items())
    text +=
        (text.empty() ? "" : ", ") + channel + (value.is_number() ? fmt::format(" {:.3g}", value.get<double>()) : " -");
  return text;
}

void print_row(const Json& row) {
  fmt::print("\n{} ({})\n  known        {}{}\n", row["name"].get<std::string>(), row["task"].get<std::string>(),
             row["known"].get<std::string>(), row["known_rmse"].empty() ? "" : "; RMSE " + text_of(row["known_rmse"]));
  if (row.contains("error")) {
    fmt::print("  failed       {}\n", row["error"].get<std::string>());
    return;
  }
  if (row.contains("answer")) {
    fmt::print("  found        {}\n", row["answer"].get<std::string>());
    for (const auto& [stage, rmse] : row["rmse"].items()) fmt::print("  {:<12} RMSE {}\n", stage, text_of(rmse));
    return;
  }
  for (const Json& rmse : row["rmse"]["validation"]) fmt::print("  held out     RMSE {}\n", text_of(rmse));
}

}  // namespace

int run_rigs(const RigsRequest& request) {
  std::vector<Rig> rigs;
  std::set<std::string> names;
  const JsonCursor config = JsonCursor::load(request.config);
  for (const JsonCursor& item : config.at("rigs").items()) {
    rigs.push_back(rig_from(item));
    if (!names.insert(rigs.back().name).second) item.at("name").fail("a name that no other rig has");
  }
  config.done();
  FileUses uses;
  uses.reads_named("CONFIG", request.config);
  for (const Rig& rig : rigs) uses.reads_named(rig.name, rig.first).reads_named(rig.name, rig.records);
  uses.writes_folder("--out", request.out).check();
  fs::create_directories(request.out);
  Json rows = Json::array(), timing = Json::object();
  bool failed = false;
  for (const Rig& rig : rigs) {
    if (!request.quiet) std::fprintf(stderr, "rigs: %s\n", rig.name.c_str());
    Json row = {{"name", rig.name},
                {"task", rig.diagnosed ? "diagnose" : "identify"},
                {"known", rig.known},
                {"known_rmse", rig.known_rmse}};
    const fs::path out = request.out / (rig.name + ".json");
    const auto begin = std::chrono::steady_clock::now();
    try {
      const int status = rig.diagnosed ? run_diagnose({rig.first, rig.records, out, {}, true, 0})
                                       : run_identify({rig.first, rig.records, out, true});
      if (status == 0)
        row.update(rig.diagnosed ? row_of_diagnosis(out) : row_of_model(out));
      else
        row["error"] = "no result; " + out.filename().string() + " says why";
    } catch (const UserError& error) {
      row["error"] = error.what();
    }
    timing[rig.name] = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    failed = failed || row.contains("error");
    rows.push_back(std::move(row));
  }
  write_json(request.out / "rigs.json", {{"schema", "wheelhop.rigs/1"}, {"rigs", rows}, {"provenance", provenance()}});
  write_json(request.out / "timing.json", {{"seconds", timing}});
  for (const Json& row : rows) print_row(row);
  fmt::print("\nwritten: {}\n", (request.out / "rigs.json").string());
  return failed ? 1 : 0;
}

}  // namespace wheelhop
