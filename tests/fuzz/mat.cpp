#include "core/data/mat.hpp"

#include "tests/fuzz/reader.hpp"

using namespace wheelhop;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::filesystem::path file = fuzz::put("input.mat", fuzz::text_of(data, size));
  for (const std::vector<std::string>& wanted : {std::vector<std::string>{}, std::vector<std::string>{"t", "u"}})
    fuzz::answered([&] {
      const Table table = read_mat(file, wanted);
      fuzz::require(table.columns.rows() == static_cast<Index>(table.names.size()), "a row of numbers a name");
      fuzz::require(table.columns.allFinite(), "all values are finite");
    });
  return 0;
}
