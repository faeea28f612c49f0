#include "core/data/csv.hpp"

#include "tests/fuzz/reader.hpp"

using namespace wheelhop;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::answered([&] {
    const Table table = parse_csv(fuzz::text_of(data, size), "input.csv");
    fuzz::require(table.columns.rows() == static_cast<Index>(table.names.size()), "a row of numbers a name");
    fuzz::require(table.columns.allFinite(), "all values are finite");
    for (std::size_t i = 0; i < table.names.size(); ++i)
      fuzz::require(table.find(table.names[i]) == static_cast<Index>(i), "names are distinct");
  });
}
