#include "core/model/model_file.hpp"
#include "tests/fuzz/reader.hpp"
#include "variants/table.hpp"

using namespace wheelhop;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::answered([&] {
    const Json given = parse_json(fuzz::text_of(data, size), "model.json");
    const Json written = to_json(parse_model(JsonCursor::from(given, "model.json"), restore_map));
    fuzz::require(to_json(parse_model(JsonCursor::from(written, "written here"), restore_map)) == written,
                  "what is read is written and read again");
  });
}
