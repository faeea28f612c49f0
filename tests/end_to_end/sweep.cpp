// `wheelhop sweep`: rows for everything, the same whatever the jobs and restarts, mistakes before anything is computed.
#include <catch2/catch.hpp>
#include <fstream>

#include "core/base/files.hpp"
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
  base["estimation_s"] = base["validation_s"] = 10;
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
  CHECK_THAT(refused.err, Contains("sweep.json") && Contains("another") && Contains("realisations"));
  CHECK(rows_of(folder, "out") == again);
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
}
