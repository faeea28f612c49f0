// `wheelhop sweep`: rows for everything, the same whatever the jobs and restarts, mistakes before anything is computed.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>

#include "core/base/files.hpp"
#include "core/base/random.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/program.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

/// Linear models of two short realisations by two methods at two noise levels.
Json small_sweep() {
  return Json::parse(R"({
    "base": "base.json", "measure": "linear", "realisations": 2,
    "axes": [{"name": "snr_db", "values": [40, 20]},
             {"name": "method", "values": [
               {"label": "pi", "set": {"subspace": {"name": "pi_moesp", "block_rows": 20}}},
               {"label": "cva", "set": {"subspace": {"name": "cva", "block_rows": 20}}}]}]})");
}

void prepare(const Folder& folder) {
  Json base = parse_json(read_file(WHEELHOP_SOURCE "/experiments/configs/paper.json"), "paper.json");
  base["plant"] = WHEELHOP_SOURCE "/experiments/configs/paper_plant.json";
  base["estimation_s"] = base["validation_s"] = 5;
  base["settle_s"] = 0.5;
  write_json(folder / "base.json", base);
}

Said sweep(const Folder& folder, const Json& config, const std::string& out, const std::string& more = "") {
  write_json(folder / "sweep.json", config);
  return run_program("sweep " + (folder / "sweep.json").string() + " --quiet --out " + (folder / out).string() + " " +
                     more);
}

std::string rows_of(const Folder& folder, const std::string& out) { return read_file(folder / out / "rows.jsonl"); }

}  // namespace

TEST_CASE("a sweep has a row for every cell and realisation, flat, and the same bytes with one job and two") {
  const Folder folder;
  prepare(folder);
  const Said one = sweep(folder, small_sweep(), "one", "--jobs 1");
  INFO(one.err);
  REQUIRE(one.status == 0);
  REQUIRE(sweep(folder, small_sweep(), "two", "--jobs 2").status == 0);
  CHECK(rows_of(folder, "one") == rows_of(folder, "two"));
  CHECK(read_file(folder / "one/table.json") == read_file(folder / "two/table.json"));
  std::istringstream lines(rows_of(folder, "one"));
  std::vector<Json> rows;
  for (std::string line; std::getline(lines, line);) rows.push_back(parse_json(line, "row"));
  REQUIRE(rows.size() == 8);
  for (const Json& row : rows) {
    CHECK(row.at("status") == "ok");
    for (const auto& [key, value] : row.items()) CHECK(value.is_primitive());
    CHECK(row.at("linear_vaf_axle_acceleration").get<double>() > 30);
  }
  // Methods see the same records: paired data.
  CHECK(rows[0].at("method") == "pi");
  CHECK(rows[2].at("method") == "cva");
  CHECK(rows[0].at("snr_db") == rows[2].at("snr_db"));
  CHECK(rows[0].at("realisation") == rows[2].at("realisation"));
  const Json table = parse_json(read_file(folder / "one/table.json"), "table.json");
  CHECK(table.at("cells").size() == 4);
  CHECK(table.at("cells").at(0).at("n_ok") == 2);
  CHECK(table.at("cells").at(0).at("columns").at("linear_vaf_axle_acceleration").at("n") == 2);
}

TEST_CASE("a sweep that was stopped goes on: finished rows are kept, a torn line is not, the end is the same") {
  const Folder folder;
  prepare(folder);
  REQUIRE(sweep(folder, small_sweep(), "out").status == 0);
  const std::string whole = rows_of(folder, "out"), table = read_file(folder / "out/table.json");
  const std::size_t third = whole.find('\n', whole.find('\n', whole.find('\n') + 1) + 1) + 1;
  Json marked = parse_json(whole.substr(0, whole.find('\n')), "row");
  marked["message"] = "kept";  // shows that this row is not made again
  std::ofstream(folder / "out/rows.jsonl")
      << marked.dump() << whole.substr(whole.find('\n'), third + 40 - whole.find('\n'));
  std::filesystem::remove(folder / "out/table.json");
  REQUIRE(sweep(folder, small_sweep(), "out").status == 0);
  const std::string again = rows_of(folder, "out");
  CHECK(again.substr(again.find('\n')) == whole.substr(whole.find('\n')));
  CHECK_THAT(again.substr(0, again.find('\n')), Contains("\"kept\""));
  CHECK(read_file(folder / "out/table.json").size() > 0.9 * static_cast<double>(table.size()));

  Json other = small_sweep();
  other["realisations"] = 3;
  const Said refused = sweep(folder, other, "out");
  CHECK(refused.status == 2);
  CHECK_THAT(refused.err, Contains("sweep.json") && Contains("another") && Contains("realisations: 2, now 3"));
  CHECK(rows_of(folder, "out") == again);
}

TEST_CASE("shards in any order, and ranks of an MPI job, give the bytes of one process") {
  const Folder folder;
  prepare(folder);
  REQUIRE(sweep(folder, small_sweep(), "one").status == 0);
  for (const char* shard : {"3/3", "1/3"}) {
    const Said part = sweep(folder, small_sweep(), "shards", std::string("--shard ") + shard);
    CHECK(part.status == 0);
    CHECK_THAT(part.out, Contains("of 8 rows"));
    CHECK_FALSE(std::filesystem::exists(folder / "shards/table.json"));
  }
  REQUIRE(sweep(folder, small_sweep(), "shards", "--shard 2/3").status == 0);
  for (const char* file : {"rows.jsonl", "rows.csv", "table.json"})
    CHECK(read_file(folder / "shards" / file) == read_file(folder / "one" / file));
  CHECK_FALSE(std::filesystem::exists(folder / "shards/rows.2-of-3.jsonl"));

  for (const char* wrong : {"0/3", "4/3", "2", "a/b", "1/0", "1/2/3"}) {
    const Said refused = sweep(folder, small_sweep(), "none", std::string("--shard ") + wrong);
    CHECK(refused.status == 2);
    CHECK_THAT(refused.err, Contains("--shard") && Contains(wrong));
  }

  if (std::system("mpirun --version >/dev/null 2>&1") != 0) {
    WARN("mpirun is not here: MPI is not tested");
    return;
  }
  const std::string command =
      "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 timeout 120 mpirun --oversubscribe "
      "-n 2 '" WHEELHOP_PROGRAM "' sweep " +
      (folder / "sweep.json").string() + " --quiet --out " + (folder / "ranks").string() + " >/dev/null 2>&1";
  const int state = std::system(command.c_str());
#ifdef WHEELHOP_HAS_MPI
  REQUIRE(state == 0);
  for (const char* file : {"rows.jsonl", "table.json"})
    CHECK(read_file(folder / "ranks" / file) == read_file(folder / "one" / file));
  // A rank that cannot go on, here because it does not see the config, ends the others with a message.
  const std::string broken =
      "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 timeout 60 mpirun --oversubscribe -n 1 "
      "'" WHEELHOP_PROGRAM "' sweep " +
      (folder / "sweep.json").string() + " --quiet --out " + (folder / "broken").string() +
      " : -n 1 '" WHEELHOP_PROGRAM "' sweep nowhere.json --quiet --out " + (folder / "broken").string() + " >" +
      (folder / "said").string() + " 2>&1";
  const int broken_state = std::system(broken.c_str());
  CHECK(WEXITSTATUS(broken_state) != 0);
  CHECK(WEXITSTATUS(broken_state) != 124);  // the time limit
  CHECK_THAT(read_file(folder / "said"), Contains("rank 1") && Contains("nowhere.json"));
#else
  CHECK(state != 0);  // two processes that do not know of one another must not both write
  CHECK_FALSE(std::filesystem::exists(folder / "ranks/rows.jsonl"));
#endif
}

TEST_CASE("killed at any moment a sweep goes on: no row is lost or doubled, the bytes are those of one run") {
  const Folder folder;
  prepare(folder);
  Json config = small_sweep();
  config["realisations"] = 4;
  REQUIRE(sweep(folder, config, "one").status == 0);
  Random random(77, Stream::parameters);
  int killed = 0;
  for (int i = 0; i < 6; ++i) {
    const double seconds = 0.05 + 0.25 * random.uniform();
    killed += run_program(fmt::format("sweep {} --quiet --jobs 2 --out {}", (folder / "sweep.json").string(),
                                      (folder / "out").string()),
                          "timeout -s KILL " + fmt::format("{:.3f}", seconds))
                  .status > 1;
  }
  CHECK(killed > 0);
  REQUIRE(sweep(folder, config, "out").status == 0);
  for (const char* file : {"rows.jsonl", "rows.csv", "table.json"})
    CHECK(read_file(folder / "out" / file) == read_file(folder / "one" / file));
}

TEST_CASE("SIGTERM ends a sweep within a second, between two rows, and says how to go on") {
  const Folder folder;
  prepare(folder);
  Json config = small_sweep();
  config["realisations"] = 400;
  write_json(folder / "sweep.json", config);
  // Stopped once a row is there; the shell says how many milliseconds the end took.
  const std::string rows_file = (folder / "out/rows.jsonl").string();
  const Said said =
      run_program("sweep " + (folder / "sweep.json").string() + " --quiet --jobs 2 --out " + (folder / "out").string(),
                  "sh -c '\"$@\" & p=$!; while [ ! -s " + rows_file +
                      " ]; do sleep 0.02; done; s=$(date +%s%N); kill -TERM $p; wait $p; r=$?; "
                      "echo took $(( ($(date +%s%N) - s) / 1000000 )); exit $r' sh");
  CHECK(said.status == 128 + 15);
  REQUIRE_THAT(said.out, Contains("took "));
  CHECK(std::stoi(said.out.substr(said.out.find("took ") + 5)) < 1500);  // a second, and a busy machine
  CHECK_THAT(said.err, Contains("stopped") && Contains("go on") && Contains((folder / "out").string()));
  const std::string rows = rows_of(folder, "out");
  REQUIRE_FALSE(rows.empty());
  CHECK(rows.back() == '\n');
}

TEST_CASE("a disk that takes no more stops a sweep with a message, and what stands there is kept") {
  const Folder folder;
  prepare(folder);
  Json config = small_sweep();
  config["realisations"] = 4;
  REQUIRE(sweep(folder, config, "one").status == 0);
  // A limit on the size of files answers as a full disk does: the write is refused.
  const Said said =
      run_program("sweep " + (folder / "sweep.json").string() + " --quiet --jobs 1 --out " + (folder / "out").string(),
                  R"(sh -c 'trap "" XFSZ; ulimit -f 16; exec "$@"' sh)");
  CHECK(said.status == 2);
  CHECK_THAT(said.err, Contains("rows.jsonl") && Contains("cannot be written") && Contains("go on"));
  CHECK(said.lines() == 1);
  const std::string kept = rows_of(folder, "out");
  REQUIRE_FALSE(kept.empty());
  CHECK(kept.back() == '\n');
  REQUIRE(sweep(folder, config, "out").status == 0);
  CHECK(rows_of(folder, "out") == rows_of(folder, "one"));
}

TEST_CASE("a row made again by its hash has the same bytes, and one that was changed is told") {
  const Folder folder;
  prepare(folder);
  REQUIRE(sweep(folder, small_sweep(), "out").status == 0);
  const std::string rows = rows_of(folder, "out");
  const Json row = parse_json(rows.substr(0, rows.find('\n')), "row");
  const std::string hash = row.at("config_hash").get<std::string>();
  std::filesystem::remove(folder / "base.json");  // the folder alone is enough
  const auto again = [&](const std::string& wanted) {
    return run_program("sweep --recompute " + wanted + " --out " + (folder / "out").string());
  };
  const Said same = again(hash);
  CHECK(same.status == 0);
  CHECK_THAT(same.out, Contains("the same bytes"));
  std::string changed = rows;
  changed.replace(changed.find("\"status\":\"ok\""), 13, "\"status\":\"OK\"");
  write_file(folder / "out/rows.jsonl", changed);
  const Said other = again(hash);
  CHECK(other.status == 1);
  CHECK_THAT(other.out, Contains("other bytes") && Contains("status"));
  CHECK(again("0123456789abcdef").status == 2);
}

TEST_CASE("axes: ranges, zips, presets, parameters of the plant, outputs and rules make the cells they say") {
  const Folder folder;
  prepare(folder);
  Json config = small_sweep();
  config["axes"] = Json::parse(R"([
    {"name": "snr_db", "from": 60, "to": 20, "step": -20},
    {"zip": [{"name": "plant_parameters.suspension.hardening_spring.alpha_per_m2", "values": [0, 1500]},
             {"name": "strength", "values": [{"label": "none", "set": {}}, {"label": "paper", "set": {}}]}]},
    {"name": "sensors", "values": [{"label": "all", "set": {}}, {"label": "axle", "set": {"outputs": ["axle_acceleration"]}}]}
  ])");
  config["exclude"] = Json::parse(R"([{"snr_db": [40, 20], "sensors": "axle"}])");
  config["realisations"] = 1;
  const Said said = sweep(folder, config, "out");
  INFO(said.err);
  REQUIRE(said.status == 0);
  const Json table = parse_json(read_file(folder / "out/table.json"), "table.json");
  CHECK(table.at("cells").size() == 8);
  CHECK(table.at("excluded_cells") == 4);
  std::istringstream lines(rows_of(folder, "out"));
  for (std::string line; std::getline(lines, line);) {
    const Json row = parse_json(line, "row");
    CHECK(row.at("snr_db").is_number());
    CHECK((row.at("plant_parameters.suspension.hardening_spring.alpha_per_m2") == 0) == (row.at("strength") == "none"));
    CHECK(row.contains("linear_vaf_chassis_acceleration") == (row.at("sensors") == "all"));
    CHECK(row.contains("linear_rmse_axle_acceleration"));
  }
  const Said dry = run_program("sweep " + (folder / "sweep.json").string() + " --dry-run");
  CHECK(dry.status == 0);
  CHECK_THAT(dry.out, Contains("8 cells (4 left out by rules)") && Contains("snr_db: 3 values: 60, 40, 20"));
  // The header and one line a row, as many fields everywhere.
  std::istringstream csv(read_file(folder / "out/rows.csv"));
  std::string header;
  std::getline(csv, header);
  Index count = 0;
  for (std::string line; std::getline(csv, line); ++count)
    CHECK(std::count(line.begin(), line.end(), ',') == std::count(header.begin(), header.end(), ','));
  CHECK(count == 8);
}

TEST_CASE("axes of a zip are one axis to a comparison: partners of the compared one are neither pooled nor asked for") {
  const Folder folder;
  prepare(folder);
  Json config = small_sweep();
  config["realisations"] = 6;
  config["axes"][0]["values"] = {40};
  config["axes"][1] = Json::parse(R"({"zip": [
    {"name": "subspace.name", "values": ["pi_moesp", "cva"]},
    {"name": "subspace.block_rows", "values": [20, 22]}]})");
  const Said said = sweep(folder, config, "out");
  INFO(said.err);
  REQUIRE(said.status == 0);
  const Json table = parse_json(read_file(folder / "out/table.json"), "table.json");
  CHECK(table.at("grid").at("axes").at(1).at("zip") == table.at("grid").at("axes").at(2).at("zip"));
  CHECK_FALSE(table.at("grid").at("axes").at(0).contains("zip"));
  for (const Json& one : table.at("comparison").at("comparisons")) {
    REQUIRE(one.at("pairs").size() == 1);
    CHECK(one.at("pairs").at(0).at("n") == 6);
    CHECK(one.at("blocks") == 6);
  }
  const std::string out = (folder / "out").string();
  const Said compared = run_program("compare " + out + " --over subspace.name");
  CHECK(compared.status == 0);
  CHECK_THAT(compared.out, Contains("of 6 pairs") || Contains("not told apart") || Contains("equivalent"));
  const Said refused = run_program("compare " + out + " --over subspace.name --by subspace.block_rows");
  CHECK(refused.status == 2);
  CHECK_THAT(refused.err, Contains("varies together"));
}

TEST_CASE("fewer than six realisations tell no methods apart, and pooled cells do not add to them") {
  const Folder folder;
  prepare(folder);
  Json config = small_sweep();
  config["realisations"] = 5;
  config["axes"][1]["values"].push_back(
      Json::parse(R"({"label": "again", "set": {"subspace": {"name": "pi_moesp", "block_rows": 20}}})"));
  REQUIRE(sweep(folder, config, "out").status == 0);
  for (const char* by : {"", " --by snr_db"}) {
    const Said said = run_program("compare " + (folder / "out").string() + " --over method" + by);
    REQUIRE(said.status == 0);
    CHECK_THAT(said.out, Contains("5 realisations are too few"));
    const Json compared = parse_json(read_file(folder / "out/compare.json"), "compare.json");
    for (const Json& one : compared.at("comparisons"))
      for (const Json& pair : one.at("pairs")) {
        CHECK(pair.at("verdict") == "too_few");
        CHECK(pair.at("n") == 5);
      }
  }
}

TEST_CASE("realisations are added until the claims are decided, the same way after a stop") {
  const Folder folder;
  prepare(folder);
  Json config = small_sweep();
  config["axes"][0]["values"] = {40};
  config["axes"][1]["values"][1] = Json::parse(R"({"label": "fails", "set": {"subspace.block_rows": 400}})");
  config["realisations"] = 5;
  config["until"] = {{"over", "method"}, {"at_most", 60}, {"batch", 5}};
  REQUIRE(sweep(folder, config, "one").status == 1);
  const Json table = parse_json(read_file(folder / "one/table.json"), "table.json");
  const Index used = table.at("until").at("realisations").get<Index>();
  CHECK(used >= 5);
  CHECK(used < 60);
  for (const Json& claim : table.at("until").at("claims")) {
    CHECK(claim.at("claim") == "a_better");
    CHECK(claim.at("after").get<Index>() <= used);
  }
  CHECK(table.at("cells").at(0).at("n") == used);
  run_program("sweep " + (folder / "sweep.json").string() + " --quiet --jobs 1 --out " + (folder / "two").string(),
              "timeout -s KILL 0.3");
  REQUIRE(sweep(folder, config, "two").status == 1);
  CHECK(read_file(folder / "one/table.json") == read_file(folder / "two/table.json"));
}

TEST_CASE("as long as no row has a value nothing is decided, and realisations are added up to the limit") {
  const Folder folder;
  prepare(folder);
  Json config = small_sweep();
  config["axes"][0]["values"] = {40};
  for (Json& method : config["axes"][1]["values"]) method["set"]["subspace"]["block_rows"] = 400;
  config["until"] = {{"over", "method"}, {"at_most", 7}, {"batch", 3}};
  REQUIRE(sweep(folder, config, "out").status == 1);
  const Json table = parse_json(read_file(folder / "out/table.json"), "table.json");
  CHECK(table.at("until").at("realisations") == 7);
  CHECK(table.at("until").at("claims").empty());
  CHECK(table.at("comparison").is_null());
}

TEST_CASE("a folder whose description is missing or another's is refused by name") {
  const Folder folder;
  std::filesystem::create_directory(folder / "out");
  for (const char* content : {"", "{}", "[1]", R"({"schema": "wheelhop.sweep/2"})", R"({"schema": 3, "config": {}})"}) {
    if (*content != '\0') write_file(folder / "out/sweep.json", content);
    for (const char* command : {"compare %s --over method", "sweep --recompute 0123456789abcdef --out %s"}) {
      std::string line = command;
      const Said refused = run_program(line.replace(line.find("%s"), 2, (folder / "out").string()));
      CHECK(refused.status == 2);
      CHECK_THAT(refused.err, Contains("sweep.json"));
    }
  }
}

TEST_CASE("compare says which method is better, by how much, and counts ties and failures") {
  const Folder folder;
  prepare(folder);
  Json config = small_sweep();
  config["realisations"] = 12;
  config["axes"][1]["values"] = Json::parse(R"([
    {"label": "pi", "set": {"subspace": {"name": "pi_moesp", "block_rows": 20}}},
    {"label": "fails", "set": {"subspace": {"name": "pi_moesp", "block_rows": 400}}},
    {"label": "again", "set": {"subspace": {"name": "pi_moesp", "block_rows": 20}}}])");
  CHECK(sweep(folder, config, "out").status == 1);
  const Said said = run_program("compare " + (folder / "out").string() + " --over method --by snr_db");
  INFO(said.err);
  REQUIRE(said.status == 0);
  CHECK_THAT(said.out, Contains("pi beats fails: the other one fails in most pairs on axle_acceleration at snr_db 40; "
                                "12 of 12 pairs") &&
                           Contains("pi and again are equivalent within 0.1 VAF points"));
  const Json result = parse_json(read_file(folder / "out/compare.json"), "compare.json");
  CHECK(result.at("comparisons").size() == 6);
  for (const Json& one : result.at("comparisons")) {
    CHECK(one.at("methods").at(1).at("failed") == 12);
    CHECK(one.at("blocks") == 12);
    for (const Json& pair : one.at("pairs"))
      CHECK(pair.at("wins").get<int>() + pair.at("ties").get<int>() + pair.at("losses").get<int>() == 12);
  }
  const Json table = parse_json(read_file(folder / "out/table.json"), "table.json");
  CHECK(table.at("comparison").at("comparisons") == result.at("comparisons"));
  const Said refused = run_program("compare " + (folder / "out").string() + " --over metod");
  CHECK(refused.status == 2);
  CHECK_THAT(refused.err, Contains("metod") && Contains("snr_db, method"));
}

TEST_CASE("a failed cell is a row with its reason, counted in the table, and the exit status is 1") {
  const Folder folder;
  prepare(folder);
  Json config = small_sweep();
  config["axes"][1]["values"][1]["set"]["subspace"]["block_rows"] = 400;
  const Said said = sweep(folder, config, "out");
  CHECK(said.status == 1);
  const Json table = parse_json(read_file(folder / "out/table.json"), "table.json");
  CHECK(table.at("cells").at(1).at("n_ok") == 0);
  CHECK_THAT(table.at("cells").at(1).at("failures").at(0).at("message").get<std::string>(), Contains("400 block rows"));
  CHECK(table.at("cells").at(0).at("n_ok") == 2);
}

TEST_CASE("a bad sweep is refused with file and path before anything is computed") {
  const Folder folder;
  prepare(folder);
  const auto refused = [&](const std::function<void(Json&)>& edit) {
    Json config = small_sweep();
    edit(config);
    const Said said = sweep(folder, config, "out");
    CHECK(said.status == 2);
    CHECK_FALSE(std::filesystem::exists(folder / "out/rows.jsonl"));
    return said.err;
  };
  CHECK_THAT(refused([](Json& c) { c["mesure"] = 1; }), Contains("mesure"));
  CHECK_THAT(refused([](Json& c) { c["measure"] = "speed"; }), Contains("$.measure") && Contains("refined"));
  CHECK_THAT(refused([](Json& c) { c["axes"] = Json::array(); }), Contains("$.axes"));
  CHECK_THAT(refused([](Json& c) { c["axes"][0]["values"] = Json::array(); }), Contains("$.axes[0].values"));
  CHECK_THAT(refused([](Json& c) { c["axes"][0]["name"] = "snr"; }), Contains("snr") && Contains("snr_db"));
  CHECK_THAT(refused([](Json& c) { c["axes"][0]["values"][1] = 4000; }), Contains("snr_db") && Contains("4000"));
  CHECK_THAT(refused([](Json& c) { c["axes"][1]["values"][1]["set"]["subspace"]["blok_rows"] = 3; }),
             Contains("method = cva") && Contains("block_rows"));
  CHECK_THAT(refused([](Json& c) { c["axes"][1]["values"][1]["label"] = "pi"; }), Contains("label"));
  CHECK_THAT(refused([](Json& c) { c["axes"][1]["name"] = "n_ok"; }), Contains("$.axes[1].name"));
  CHECK_THAT(refused([](Json& c) {
               c["axes"][1]["values"][1]["set"] = {{"seed.x", 1}};
             }),
             Contains("seed.x") && Contains("no object"));
  CHECK_THAT(refused([](Json& c) { c["base"] = "none.json"; }), Contains("none.json"));
  CHECK_THAT(refused([](Json& c) {
               c["axes"][0] = {{"name", "snr_db"}, {"from", 1}, {"to", 100000}, {"step", 1}};
               c["axes"][1] = {{"name", "drive.rms"}, {"from", 0.001}, {"to", 0.02}, {"count", 10000}};
             }),
             Contains("$.axes") && Contains("100000 cells"));
  CHECK_THAT(refused([](Json& c) {
               c["axes"][0] = {{"name", "snr_db"}, {"from", 40}, {"to", 20}, {"step", 5}};
             }),
             Contains("$.axes[0].step"));
  CHECK_THAT(
      refused([](Json& c) {
        c["axes"][1] = {{"zip", {{{"name", "seed"}, {"values", {1, 2}}}, {{"name", "substeps"}, {"values", {1}}}}}};
      }),
      Contains("$.axes[1].zip[1]") && Contains("2"));
  CHECK_THAT(refused([](Json& c) { c["axes"][0] = {{"preset", "noisy"}}; }), Contains("noise"));
  CHECK_THAT(refused([](Json& c) { c["exclude"] = {{{"snr_db", 41}}}; }), Contains("$.exclude[0].snr_db"));
  CHECK_THAT(refused([](Json& c) { c["exclude"] = {{{"snr", 40}}}; }), Contains("snr_db, method"));
  CHECK_THAT(refused([](Json& c) { c["exclude"] = {{{"snr_db", {40, 20}}}}; }), Contains("$.exclude"));
  CHECK_THAT(refused([](Json& c) { c["until"] = {{"over", "speed"}, {"at_most", 30}}; }), Contains("$.until.over"));
  CHECK_THAT(refused([](Json& c) {
               c["axes"][0]["values"] = {40};
               c["until"] = {{"over", "snr_db"}, {"at_most", 30}};
             }),
             Contains("$.until.over") && Contains("two values"));
  CHECK_THAT(refused([](Json& c) {
               c["axes"][0] = {{"name", "snr_db"}, {"from", 40}, {"to", 40}, {"count", 3}};
             }),
             Contains("$.axes[0].to") && Contains("stands twice"));
  CHECK_THAT(refused([](Json& c) { c["axes"][1]["name"] = "spectral_radius"; }), Contains("$.axes[1].name"));
  CHECK_THAT(refused([](Json& c) {
               c["axes"][0] = {{"name", "plant_parameters.tyre.mass_kg"}, {"values", {1}}};
             }),
             Contains("tyre.mass_kg") && Contains("known ones"));
}
