#include "core/data/gzip.hpp"

#include "tests/fuzz/reader.hpp"

using namespace wheelhop;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::text_of(data, size);
  fuzz::require(unpack_gzip(pack_gzip(text), "packed here") == text, "what is packed unpacks to the same");
  fuzz::require(!is_intact_zlib(text) || unpack_zlib(text, 1 << 20).has_value(), "an intact stream unpacks");
  return fuzz::answered([&] { unpack_gzip(text, "input.gz"); });
}
