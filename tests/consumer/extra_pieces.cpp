// A piece that lives in a folder of its own stands in every place where our own stand. The conformance tests of all
// pieces are part of this program as well.
#include <catch2/catch.hpp>

#include "experiments/experiment/study.hpp"
#include "experiments/list/list.hpp"
#include "tests/support/systems.hpp"
#include "variants/extra.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// Before any table is asked for, as the program's main function does it.
const bool kAdded = (add_extra_pieces(), true);

}  // namespace

TEST_CASE("a piece from outside the tree is listed with its options") {
  REQUIRE(kAdded);
  const Json list = list_pieces();
  Index found = 0;
  for (const Json& family : list.at("families"))
    for (const Json& piece : family.at("pieces")) {
      if (piece.at("name") != "static_gain") continue;
      ++found;
      CHECK(family.at("family") == "inversion");
      CHECK(piece.at("available") == true);
      CHECK(piece.at("options").at(0).at("name") == "gain");
    }
  CHECK(found == 1);
}

TEST_CASE("a piece from outside the tree is chosen by a config, with strict options, and used") {
  const auto read = [](const char* text) {
    return read_pieces(JsonCursor::from(parse_json(text, "config.json"), "config.json"));
  };
  const PieceSet pieces = read(R"({"inversion": {"name": "static_gain", "gain": 2}})");
  CHECK(pieces.inversion.config == Json({{"name", "static_gain"}, {"gain", 2.0}}));
  Random random = numbers(201);
  const LinearModel system = random_linear(3, 1, 2, 0.5, random);
  const Matrix z = random.normal(2, 40);
  const PipelineOptions options;
  const Reconstruction found =
      pieces.borrowed(options).inversion.reconstruct(system.A, system.C, system.B, system.D, z, Vector::Ones(2));
  REQUIRE(found.status == Status::ok);
  CHECK(relative_error(found.f, 2 * least_squares(system.D, z).x) < 1e-12);
  CHECK_THROWS_WITH(read(R"({"inversion": {"name": "static_gain", "gian": 2}})"),
                    Catch::Contains("$.inversion") && Catch::Contains("gain"));
  CHECK_THROWS_WITH(read(R"({"inversion": {"name": "static_gian"}})"), Catch::Contains("static_gain"));
}

TEST_CASE("a piece from outside that takes a name of ours is refused") {
  const std::vector<Entry<InversionPiece>> own = {inversion_table().front()};
  CHECK_THROWS_WITH(with_extra(own, own), Catch::Contains("sdi"));
}
