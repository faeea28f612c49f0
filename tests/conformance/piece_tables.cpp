// The tables of pieces against the files of their families, and what `list` says of them.
#include <catch2/catch.hpp>
#include <filesystem>
#include <set>

#include "core/plant/laws.hpp"
#include "experiments/list/list.hpp"
#include "variants/table.hpp"

using namespace wheelhop;

TEST_CASE("every file of a family's folder is one entry of its table, under its own name") {
  for (const Family& family : families()) {
    INFO(family.name);
    std::set<std::string> files, names;
    for (const auto& entry :
         std::filesystem::directory_iterator(std::string(WHEELHOP_SOURCE "/variants/") + family.name))
      if (entry.path().extension() == ".cpp" && entry.path().stem() != "table") files.insert(entry.path().stem());
    for (const PieceInfo& piece : family.pieces) CHECK(names.insert(piece.name).second);
    CHECK(files == names);
  }
}

TEST_CASE("every piece names its source and meaning, and every option its default, unit, range and meaning") {
  const Json list = list_pieces();
  CHECK(list.at("schema") == "wheelhop.list/1");
  std::set<std::string> families_listed;
  for (const Json& family : list.at("families")) {
    families_listed.insert(family.at("family"));
    CHECK_FALSE(family.at("pieces").empty());
    for (const Json& piece : family.at("pieces")) {
      INFO(piece.at("name"));
      CHECK_FALSE(piece.at("source").get<std::string>().empty());
      CHECK(piece.at("available").is_boolean());
      for (const Json& option : piece.at("options")) {
        INFO(option.at("name"));
        CHECK(option.contains("default"));
        CHECK_FALSE(option.at("range").get<std::string>().empty());
        CHECK_FALSE(option.at("meaning").get<std::string>().empty());
      }
    }
  }
  for (const char* name : {"subspace", "inversion", "nonlinearity", "solver", "pipeline", "law", "drive"})
    CHECK(families_listed.count(name) == 1);
}

TEST_CASE("every file of the laws is one entry of the list, with the parameters of a plant file") {
  std::set<std::string> files, names;
  for (const auto& entry : std::filesystem::directory_iterator(WHEELHOP_SOURCE "/core/plant/laws"))
    files.insert(entry.path().stem());
  const Json list = list_pieces();
  for (const Json& family : list.at("families")) {
    if (family.at("family") != "law") continue;
    for (const Json& law : family.at("pieces")) {
      INFO(law.at("name"));
      CHECK(names.insert(law.at("name")).second);
      const LawKind* kind = find_law(law.at("name").get<std::string>());
      REQUIRE(kind);
      REQUIRE(law.at("options").size() == kind->parameters.size());
      for (std::size_t k = 0; k < kind->parameters.size(); ++k) {
        CHECK(law.at("options").at(k).at("name") == kind->parameters[k].name);
        CHECK((law.at("options").at(k).at("default") == "required") == kind->parameters[k].required);
      }
    }
  }
  CHECK(files == names);
}

TEST_CASE("the effective options of a piece make the same piece again") {
  Json wanted = {{"name", "pi_moesp"}, {"block_rows", 25}};
  const auto first = make_from(subspace_table(), JsonCursor::from(wanted, "config.json"));
  CHECK(first.piece->name() == "pi_moesp");
  CHECK(first.config.at("block_rows") == 25);
  CHECK(first.config.contains("max_order"));
  const auto again = make_from(subspace_table(), JsonCursor::from(first.config, "config.json"));
  CHECK(again.config == first.config);
}

namespace {

/// Makes every piece of a table with defaults and with each kind of mistake in each option.
template <class Piece>
void check_options(const std::vector<Entry<Piece>>& table) {
  for (const Entry<Piece>& entry : table) {
    if (!entry.unavailable().empty()) continue;
    CAPTURE(entry.name);
    const auto make = [&](const Json& options) {
      Json config = {{"name", entry.name}};
      config.update(options);
      return entry.make(JsonCursor::from(config, "config.json"));
    };
    const Json defaults = make(Json::object()).config;
    CHECK(make(defaults).config == defaults);
    CHECK_THROWS_WITH(make({{"no_such_option", 1}}), Catch::Contains("no_such_option"));
    for (const OptionInfo& option : entry.options()) {
      CAPTURE(option.name);
      CHECK(defaults.at(option.name) == option.fallback);
      const std::string path = "$." + option.name;
      CHECK_THROWS_WITH(make({{option.name, Json::array()}}), Catch::Contains(path));
      if (option.fallback.is_number()) CHECK_THROWS_WITH(make({{option.name, -1e300}}), Catch::Contains(path));
      if (option.fallback.is_string())
        CHECK_THROWS_WITH(make({{option.name, "no such choice"}}), Catch::Contains(path));
    }
  }
}

}  // namespace

TEST_CASE("every piece: its defaults make it again, and each wrong option is refused with its JSON path") {
  check_options(subspace_table());
  check_options(inversion_table());
  check_options(nonlinearity_table());
  check_options(solver_table());
}

TEST_CASE("a piece whose library this build lacks is listed with the reason and refused with it") {
  const Json list = list_pieces();
  for (const Json& family : list.at("families")) {
    if (family.at("family") != "solver") continue;
    for (const Json& piece : family.at("pieces")) {
      CAPTURE(piece.at("name"));
      CHECK_FALSE(piece.at("options").empty());
      if (piece.at("available") == true) continue;
      const std::string reason = piece.at("unavailable");
      CHECK_THAT(reason, Catch::Contains("lib"));  // what to install
      const Json config = {{"name", piece.at("name")}};
      CHECK_THROWS_WITH(make_from(solver_table(), JsonCursor::from(config, "config.json")), Catch::Contains(reason));
    }
  }
}

TEST_CASE("an unknown piece, option or value is refused with file, path and the known names") {
  using Catch::Contains;
  const auto make = [](const char* text) {
    make_from(inversion_table(), JsonCursor::from(parse_json(text, "config.json"), "config.json"));
  };
  CHECK_THROWS_WITH(make(R"({"name": "sdy"})"), Contains("config.json") && Contains("$.name") && Contains("sdi"));
  CHECK_THROWS_WITH(make(R"({})"), Contains("config.json") && Contains("name"));
  CHECK_THROWS_WITH(make(R"({"name": "sdi", "leg": 4})"), Contains("leg") && Contains("lag"));
  CHECK_THROWS_WITH(make(R"({"name": "sdi", "lag": -1})"), Contains("$.lag") && Contains("-1"));
}
