#include "experiments/blind/run.hpp"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <sstream>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "core/data/slow_channels.hpp"
#include "core/data/spikes.hpp"
#include "core/greybox/plant_fit.hpp"
#include "experiments/blind/score_calibration.hpp"
#include "experiments/blind/score_key.hpp"
#include "experiments/diagnose/diagnose.hpp"
#include "experiments/run/file_uses.hpp"
#include "experiments/run/input_checks.hpp"
#include "experiments/run/jobs.hpp"
#include "variants/table.hpp"

namespace wheelhop {
namespace {

namespace fs = std::filesystem;
using LeftOut = std::map<std::string, std::vector<std::string>>;  // by case

std::vector<std::string> find_cases(const fs::path& folder) {
  if (!fs::is_directory(folder)) throw UserError(folder.string() + ": expected a folder of cases, found none");
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    if (fs::exists(entry.path() / "plant.json") && fs::exists(entry.path() / "records.json"))
      names.push_back(entry.path().filename().string());
  if (names.empty())
    throw UserError(folder.string() + ": expected cases (folders with plant.json and records.json), found none");
  std::sort(names.begin(), names.end());
  return names;
}

/// What leaves the catalogue in each case; nothing where the key names no effect of the catalogue.
LeftOut left_out_by(const fs::path& key, const std::vector<std::string>& cases) {
  LeftOut left_out;
  for (const std::string& name : cases) left_out[name];
  if (key.empty()) return left_out;
  std::map<std::string, scoring::TrueCase> truth;
  for (scoring::TrueCase& item : scoring::load_key(key)) truth[item.name] = std::move(item);
  for (const std::string& name : cases) {
    if (!truth.contains(name))
      throw UserError(scoring::key_file(key).string() + ": expected the case " + name + ", found none");
    for (const Entry<EffectPiece>& entry : effect_table())
      for (const scoring::TrueEffect& effect : truth[name].effects)
        if (effect.effect == entry.name && effect.in_catalogue) left_out[name].push_back(entry.name);
  }
  return left_out;
}

struct Found {
  bool answered = false, error = false;
};

/// An answer of an earlier run; one that does not parse counts as none.
Found find_answer(const fs::path& file, const std::vector<std::string>& left_out) {
  if (!fs::exists(file)) return {};
  Json answer;
  try {
    answer = parse_json(read_file(file), file.string());
  } catch (const MachineError&) {
    throw;
  } catch (const UserError&) {
    return {};
  }
  if (!answer.is_object()) return {};
  if (answer.value("left_out", Json::array()) != Json(left_out))
    throw UserError(
        fmt::format("{}: expected an answer with these effects left out: {}, found {}; answers of one kind "
                    "only in one folder",
                    file.string(), Json(left_out).dump(), answer.value("left_out", Json::array()).dump()));
  return {true, answer.contains("error")};
}

/// What a fault of the case ends in is its answer; a fault of the machine is thrown, and leaves none.
/// @return false where the answer is an error
bool answer_case(const fs::path& folder, const fs::path& out, const std::vector<std::string>& left_out) {
  try {
    Plant plant = load_acting_plant(folder / "plant.json");
    RecordSet set = load_records(folder / "records.json", plant.input_channels(), plant.output_channels());
    require_sound_records(set, folder / "records.json");
    bridge_spikes(set);
    find_slow_channels(set);
    require_held_out(set, folder / "records.json");
    plant = with_drive_rate(std::move(plant), set);
    require_hold_rate(plant, set, folder / "records.json");
    const Diagnosis diagnosis = at_records(set, folder / "records.json",
                                           [&] { return diagnose_records(plant, set, catalogue_without(left_out)); });
    fs::path retuned = out;
    write_json(retuned.replace_extension(".retuned.json"), to_json(diagnosis.retuned_plant));
    // The answer last: where it stands, everything does.
    write_diagnosis(plant, diagnosis, nullptr, view_of(plant, diagnosis, nullptr, nullptr), out,
                    {{"left_out", left_out}, {"retuned_plant", retuned.filename().string()}});
    return true;
  } catch (const MachineError&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw MachineError(folder.string() + ": not enough memory to diagnose it");
  } catch (const std::system_error&) {
    throw;
  } catch (const std::exception& error) {
    write_json(out, {{"schema", "wheelhop.diagnosis/1"}, {"error", error.what()}, {"left_out", left_out}});
    return false;
  }
}

}  // namespace

std::vector<std::string> chosen_cases(const std::vector<std::string>& all, const std::string& list,
                                      const std::string& source) {
  if (list.empty()) return all;
  std::vector<std::string> chosen;
  std::vector<bool> wanted(all.size(), false);
  std::istringstream entries(list);
  for (std::string entry; std::getline(entries, entry, ',');) {
    bool fits = false;
    for (std::size_t i = 0; i < all.size(); ++i)
      if (::fnmatch(entry.c_str(), all[i].c_str(), 0) == 0) fits = wanted[i] = true;
    if (!fits)
      throw UserError(fmt::format("--cases: expected names or patterns of cases in {} ({} to {}), found \"{}\"", source,
                                  all.front(), all.back(), entry));
  }
  for (std::size_t i = 0; i < all.size(); ++i)
    if (wanted[i]) chosen.push_back(all[i]);
  return chosen;
}

int run_blind_run(const BlindRunRequest& request) {
  FileUses uses;
  uses.reads("DIR", request.folder).writes_folder("--out", request.out, {"manifest.json", "timing.json"});
  uses.reads("the manifest in DIR", request.folder / "manifest.json");
  if (!request.leave_out.empty()) uses.reads("--leave-out", scoring::key_file(request.leave_out));
  uses.check();
  const std::vector<std::string> cases =
      chosen_cases(find_cases(request.folder), request.cases, request.folder.string());
  const LeftOut left_out = left_out_by(request.leave_out, cases);
  require_writable_folder(request.out);
  std::vector<std::string> open;
  long errors = 0;
  for (const std::string& name : cases) {
    const Found found = find_answer(request.out / (name + ".json"), left_out.at(name));
    if (!found.answered) open.push_back(name);
    errors += found.error;
  }
  if (const fs::path manifest = request.folder / "manifest.json"; fs::exists(manifest))
    write_file(request.out / "manifest.json", read_file(manifest));

  const fs::path timing_file = request.out / "timing.json";
  Json timing = {{"schema", "wheelhop.timing/1"}, {"case_s", Json::object()}};
  if (fs::exists(timing_file)) timing = parse_json(read_file(timing_file), timing_file.string());
  const JobOptions options{request.jobs, "blind run",
                           "answers are kept in " + request.out.string() + "; start the same command again to go on",
                           request.quiet};
  const Job answer_one = [&](std::size_t i) -> std::function<void()> {
    const std::string& name = open[i];
    const auto start = std::chrono::steady_clock::now();
    const bool answered = answer_case(request.folder / name, request.out / (name + ".json"), left_out.at(name));
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return [&, answered, seconds] {
      errors += !answered;
      timing["case_s"][name] = seconds;
      write_json(timing_file, timing);
    };
  };
  try {
    run_jobs(open.size(), options, answer_one);
  } catch (const MachineError& error) {
    throw MachineError(fmt::format("{}; {}", error.what(), options.go_on));
  }
  std::vector<double> seconds;
  for (const std::string& name : cases)
    if (timing["case_s"].contains(name)) seconds.push_back(timing["case_s"][name].get<double>());
  fmt::print("{} cases: {} answered now, {} before, {} of all are errors; {:.1f} s a case (median)\nwritten: {}\n",
             cases.size(), open.size(), cases.size() - open.size(), errors, scoring::median(seconds),
             request.out.string());
  return errors > 0 ? 1 : 0;
}

}  // namespace wheelhop
