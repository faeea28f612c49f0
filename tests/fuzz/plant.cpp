#include "core/plant/plant.hpp"

#include "tests/fuzz/reader.hpp"

using namespace wheelhop;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::answered([&] {
    const Plant plant =
        parse_plant(JsonCursor::from(parse_json(fuzz::text_of(data, size), "plant.json"), "plant.json"));
    const Json written = to_json(plant);
    fuzz::require(to_json(parse_plant(JsonCursor::from(written, "written here"))) == written,
                  "what is read is written and read again");
  });
}
