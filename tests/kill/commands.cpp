// Every command that writes, killed at each of its calls that change files: what stands in the end is whole, and the
// same command again gives what it would have given.
#include <signal.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "tests/support/plants.hpp"
#include "tests/support/program.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
namespace fs = std::filesystem;

namespace {

/// Content of every file below a folder by its path there. Names that begin with a dot are left out or kept alone.
std::map<std::string, std::string> files_of(const fs::path& folder, bool hidden = false) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    const std::string name = fs::relative(entry.path(), folder).generic_string();
    const bool is_hidden = name.front() == '.' || name.find("/.") != std::string::npos;
    if (is_hidden == hidden) files[name] = read_file(entry.path());
  }
  return files;
}

/// Names without the numbers of processes.
std::string names_in(const std::map<std::string, std::string>& files) {
  std::string all;
  for (const auto& [name, content] : files) all += std::regex_replace(name, std::regex("[0-9]+"), "#") + "\n";
  return all;
}

struct Command {
  std::string words;  ///< as typed in the folder
  /// Files that belong together, by patterns: the first is the one by which the others are found. Where it stands, all
  /// that stand are of one run, and none that fits the last pattern is missing.
  std::vector<std::vector<std::string>> sets = {};
  std::string volatile_files = "none";  ///< pattern of files that hold times: they parse, and that is all
  std::string lines = "none";           ///< pattern of files that grow line by line
  int status = 0;
};

bool fits(const std::string& name, const std::string& pattern) { return std::regex_match(name, std::regex(pattern)); }

using Files = std::map<std::string, std::string>;

/// True if every whole line is one of a file that grows line by line.
bool holds_lines_of(const std::string& content, const Files& after, const std::string& lines) {
  std::istringstream stream(content.substr(0, content.rfind('\n') + 1));
  for (std::string line; std::getline(stream, line);)
    if (std::none_of(after.begin(), after.end(), [&](const auto& file) {
          return fits(file.first, lines) && ("\n" + file.second).find("\n" + line + "\n") != std::string::npos;
        }))
      return false;
  return true;
}

/// Every file is the one from before or the one from after, or holds some of its lines.
void check_each(const Command& command, const Files& before, const Files& now, const Files& after) {
  for (const auto& [name, content] : now) {
    CAPTURE(name);
    if (fits(name, command.volatile_files)) {
      if (name.ends_with(".json")) CHECK_NOTHROW(parse_json(content, name));
      continue;
    }
    const auto old = before.find(name), made = after.find(name);
    const bool is_old = old != before.end() && content == old->second;
    const bool is_new = made != after.end() && content == made->second;
    CHECK((is_old || is_new || (fits(name, command.lines) && holds_lines_of(content, after, command.lines))));
  }
  for (const auto& [name, content] : before)  // what the command does not touch stays
    if (const auto made = after.find(name); made != after.end() && made->second == content) CHECK(now.contains(name));
}

void check_sets(const Command& command, const Files& before, const Files& now, const Files& after) {
  for (const std::vector<std::string>& set : command.sets) {
    const auto found = std::find_if(now.begin(), now.end(), [&](const auto& file) { return fits(file.first, set[0]); });
    if (found == now.end()) continue;
    const auto is_of = [&](const Files& one) {
      return std::all_of(now.begin(), now.end(),
                         [&](const auto& file) {
                           const bool member =
                               std::any_of(set.begin(), set.end(), [&](const auto& p) { return fits(file.first, p); });
                           const auto same = one.find(file.first);
                           return !member || (same != one.end() && same->second == file.second);
                         }) &&
             std::all_of(one.begin(), one.end(),
                         [&](const auto& file) { return !fits(file.first, set.back()) || now.contains(file.first); });
    };
    CAPTURE(set[0], names_in(now));
    CHECK((is_of(before) || is_of(after)));
  }
}

/// Runs the command with a kill at its first, second, ... call that changes a file, until it ends by itself.
/// @param origin folder as it stands before the command
/// @return how many kills it took
int meets_every_kill(const fs::path& origin, const Command& command) {
  const Folder place;
  const fs::path folder = place / "here";
  const std::string there = "-C '" + folder.string() + "' PATH=/nowhere";
  const auto restore = [&] {
    fs::remove_all(folder);
    fs::copy(origin, folder, fs::copy_options::recursive);
  };
  restore();
  const Files before = files_of(folder);
  const Said whole = run_program(command.words, there);
  INFO(command.words << "\n" << whole.err);
  REQUIRE(whole.status == command.status);
  const Files after = files_of(folder);
  const std::string hidden_after = names_in(files_of(folder, true));
  CHECK(after != before);
  std::set<std::string> seen;  // states after which the command has been started again
  for (int call = 1;; ++call) {
    restore();
    const Said killed = run_program(
        command.words, there + " LD_PRELOAD='" WHEELHOP_KILL_AT "' WHEELHOP_TEST_KILL_AT=" + std::to_string(call));
    CAPTURE(call, killed.err);
    if (killed.status == command.status) {
      CHECK(names_in(files_of(folder)) == names_in(after));
      return call - 1;
    }
    REQUIRE(killed.status == 128 + SIGKILL);
    const Files now = files_of(folder);
    check_each(command, before, now, after);
    check_sets(command, before, now, after);
    std::string state = names_in(files_of(folder, true));
    for (const auto& [name, content] : now) state += name + '\0' + content + '\0';
    if (!seen.insert(state).second) continue;
    const Said again = run_program(command.words, there);
    INFO("again: " << again.err);
    CHECK(again.status == command.status);
    Files then = files_of(folder);
    for (const auto& [name, content] : then) CHECK(after.contains(name));
    CHECK(names_in(files_of(folder, true)) == hidden_after);
    for (const auto& [name, content] : after)
      if (!fits(name, command.volatile_files)) CHECK((then[name] == content));
  }
}

/// A mass on a spring, its drive held as long as a sample: the least that a command can work on.
void write_inputs(const Folder& folder) {
  Json plant = parse_json(one_mass_text, "plant");
  plant["inputs"][0]["hold_hz"] = 100;
  write_json(folder / "plant.json", plant);
  const auto data = [](int seed) {
    return Json{
        {"plant", "plant.json"},
        {"sampling_hz", 100},
        {"seed", seed},
        {"noise_snr_db", 40},
        {"records",
         {{{"role", "estimation"}, {"duration_s", 9}, {"drive", {{"name", "band_limited_noise"}, {"rms", 20}}}},
          {{"role", "validation"}, {"duration_s", 9}, {"drive", {{"name", "band_limited_noise"}, {"rms", 20}}}}}}};
  };
  write_json(folder / "data.json", data(1));
  write_json(folder / "other_data.json", data(2));
  write_json(folder / "identify.json", Json::parse(R"({"plant": "plant.json", "subspace": {"name": "pi_moesp",
    "block_rows": 8}, "pipeline": {"passes": 1, "refine_iterations": 1}})"));
}

void run_first(const Folder& folder, const std::string& words, int status = 0) {
  const Said said = run_program(words, "-C '" + folder.path().string() + "' PATH=/nowhere");
  INFO(words << "\n" << said.err);
  REQUIRE(said.status == status);
}

/// The command's files are absent first; then those of `other`, of the same names and other content, stand there.
void from_nothing_and_over(const Folder& folder, const std::string& other, const Command& command, int least) {
  const int fresh = meets_every_kill(folder.path(), command);
  CHECK(fresh >= least);
  run_first(folder, other, command.status);
  const int over = meets_every_kill(folder.path(), command);
  CHECK(over >= least);
  SUCCEED(command.words << ": " << fresh << " kills where nothing stood, " << over << " over another result");
}

}  // namespace

TEST_CASE("generate, killed anywhere, leaves one set or none") {
  const Folder folder;
  write_inputs(folder);
  from_nothing_and_over(folder, "generate other_data.json --quiet --out out",
                        {"generate data.json --quiet --out out", {{"out/records.json", "out/.*"}}}, 12);
}

TEST_CASE("identify and simulate, killed anywhere, leave one file or none") {
  const Folder folder;
  write_inputs(folder);
  run_first(folder, "generate data.json --quiet --out data");
  run_first(folder, "generate other_data.json --quiet --out other_data");
  from_nothing_and_over(folder, "identify identify.json --quiet --records other_data/records.json --out m.json",
                        {"identify identify.json --quiet --records data/records.json --out m.json"}, 3);
  for (const std::string table : {"s.csv", "s.csv.gz", "s.mat"})
    from_nothing_and_over(folder, "simulate plant.json --quiet --records other_data/records.json --out " + table,
                          {"simulate plant.json --quiet --records data/records.json --out " + table}, 3);
}

TEST_CASE("diagnose and plan, killed anywhere, leave a diagnosis with its own plant and figures, or none") {
  const Folder folder;
  write_inputs(folder);
  run_first(folder, "generate data.json --quiet --out data");
  run_first(folder, "generate other_data.json --quiet --out other_data");
  const std::string out = " --out d.json --report d.html";
  write_file(folder / "d.html", "the page of an earlier diagnosis");
  from_nothing_and_over(folder, "diagnose --quiet --plant plant.json --records other_data/records.json" + out,
                        {"diagnose --quiet --plant plant.json --records data/records.json" + out,
                         {{"d.json", "d.html", "d.figures.json", "d.plant.json"}}},
                        10);
  from_nothing_and_over(folder, "plan --quiet --plant plant.json --records other_data/records.json --out p.json",
                        {"plan --quiet --plant plant.json --records data/records.json --out p.json"}, 3);
}

TEST_CASE("reproduce, killed anywhere, leaves a table with its own figures, or none") {
  const Folder folder;
  Json config = parse_json(read_file(WHEELHOP_SOURCE "/experiments/configs/paper.json"), "paper.json");
  config["plant"] = WHEELHOP_SOURCE "/experiments/configs/paper_plant.json";
  config.update({{"estimation_s", 8}, {"validation_s", 4}, {"settle_s", 0.5}, {"realisations", 1}});
  config["subspace"] = {{"name", "pi_moesp"}, {"block_rows", 15}};
  config["pipeline"] = {{"order", 4}, {"passes", 1}, {"refine_iterations", 1}, {"refine_rounds", 1}};
  config["as_printed"]["pipeline"] = {{"order", 4}, {"direct_term", false}, {"passes", 1}};
  write_json(folder / "config.json", config);
  const std::string words = "reproduce --quiet --jobs 1 --config config.json --out out";
  const Said probe = run_program(words, "-C '" + folder.path().string() + "' PATH=/nowhere");
  fs::remove_all(folder / "out");
  from_nothing_and_over(
      folder, words + " --seed 2",
      {words, {{"out/table1.json", "out/figures/figures.json"}}, "out/timing.json", "none", probe.status}, 10);
}

TEST_CASE("sweep and compare, killed anywhere, go on to the same rows and tables") {
  const Folder folder;
  Json base = parse_json(read_file(WHEELHOP_SOURCE "/experiments/configs/paper.json"), "paper.json");
  base["plant"] = WHEELHOP_SOURCE "/experiments/configs/paper_plant.json";
  base.update({{"estimation_s", 5}, {"validation_s", 5}, {"settle_s", 0.5}});
  base["subspace"] = {{"name", "pi_moesp"}, {"block_rows", 15}};
  write_json(folder / "base.json", base);
  write_json(folder / "sweep.json", Json::parse(R"({"base": "base.json", "measure": "linear", "realisations": 2,
    "axes": [{"name": "snr_db", "values": [40, 20]}]})"));
  const std::string words = "sweep sweep.json --quiet --jobs 1 --out out";
  const std::string times = "out/timing.*", lines = "out/rows.*jsonl";
  const int fresh = meets_every_kill(folder.path(), {words, {}, times, lines});
  CHECK(fresh >= 20);
  run_first(folder, words + " --shard 1/2");
  const int last = meets_every_kill(folder.path(), {words + " --shard 2/2", {}, times, lines});
  CHECK(last >= 15);
  run_first(folder, words + " --shard 2/2");
  const int compared = meets_every_kill(folder.path(), {"compare out --over snr_db"});
  CHECK(compared >= 3);
  SUCCEED("sweep: " << fresh << " kills, its last shard: " << last << ", compare: " << compared);
}

TEST_CASE("blind make, run, score and calibrate, killed anywhere, leave whole sets and go on") {
  const Folder folder;
  const fs::path configs = WHEELHOP_SOURCE "/experiments/configs";
  Json plant = parse_json(read_file(configs / "plants/one_mass.json"), "plant");
  plant["inputs"][0]["hold_hz"] = 200;
  write_json(folder / "blind.json", {{"seed", 1},
                                     {"sets",
                                      {{{"name", "none"},
                                        {"plant", plant},
                                        {"class", "none"},
                                        {"seeds", 1},
                                        {"noise", {"white"}},
                                        {"level", 30},
                                        {"band_hz", {0.3, 8}},
                                        {"samples", 1800}}}}});
  const int made = meets_every_kill(folder.path(), {"blind make blind.json --quiet --jobs 1 --out cases --key key",
                                                    {{"cases/manifest.json", "cases/.*"}, {"key/key.json", "key/.*"}}});
  CHECK(made >= 20);
  fs::create_directory(folder / "cases");
  fs::create_directory(folder / "key");
  const int into_empty =
      meets_every_kill(folder.path(), {"blind make blind.json --quiet --jobs 1 --out cases --key key",
                                       {{"cases/manifest.json", "cases/.*"}, {"key/key.json", "key/.*"}}});
  CHECK(into_empty >= 20);
  run_first(folder, "blind make blind.json --quiet --jobs 1 --out cases --key key");
  const int answered = meets_every_kill(folder.path(), {"blind run cases --quiet --out answers",
                                                        {{"answers/case_000.json", "answers/case_000.*"}},
                                                        "answers/timing.json"});
  CHECK(answered >= 10);
  run_first(folder, "blind run cases --quiet --out answers");
  const int scored = meets_every_kill(folder.path(), {"blind score answers --quiet --key key"});
  CHECK(scored >= 3);
  const int calibrated = meets_every_kill(folder.path(), {"blind calibrate answers --key key"});
  CHECK(calibrated >= 3);
  SUCCEED("blind make: " << made << " kills, into empty folders: " << into_empty << ", run: " << answered
                         << ", score: " << scored << ", calibrate: " << calibrated);
}
