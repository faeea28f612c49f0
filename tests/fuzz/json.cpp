#include "core/base/json.hpp"

#include "tests/fuzz/reader.hpp"

using namespace wheelhop;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::answered([&] {
    const Json value = parse_json(fuzz::text_of(data, size), "input.json");
    fuzz::require(parse_json(value.dump(), "written here") == value, "what is read is written and read again");
  });
}
