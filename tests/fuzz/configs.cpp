// The first byte says whose config the others are: g of `generate`, b of `blind make`.
#include "experiments/generate/config.hpp"
#include "experiments/rig/cases.hpp"
#include "tests/fuzz/reader.hpp"

using namespace wheelhop;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::text_of(data, size);
  if (text.find('/') != std::string::npos) return 0;  // files elsewhere, as devices, are none of its matter
  return fuzz::answered([&] {
    if (text.empty()) return;
    const JsonCursor config = JsonCursor::from(parse_json(text.substr(1), "config.json"), "config.json");
    if (text[0] == 'g')
      effective_config(read_generate_config(config));
    else
      fuzz::require(!blind::read_cases(config, {}).empty(), "a config of cases asks for some");
  });
}
