// Bytes up to the first NUL are records.json, those behind it the file r.csv that it may name.
#include "core/data/records.hpp"

#include "tests/fuzz/reader.hpp"

using namespace wheelhop;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::text_of(data, size), json = text.substr(0, text.find('\0'));
  if (json.find('/') != std::string::npos) return 0;  // files elsewhere, as devices, are none of its matter
  const std::filesystem::path file = fuzz::put("records.json", json);
  fuzz::put("r.csv", json.size() < text.size() ? text.substr(json.size() + 1) : "");
  return fuzz::answered([&] {
    const RecordSet set = load_records(file, {{"u", "m"}}, {{"y", "m"}});
    fuzz::require(!set.records.empty() && set.sampling_hz > 0, "a set has records and a rate");
    for (const Record& record : set.records) {
      fuzz::require(record.signal.u.cols() == record.signal.y.cols(), "inputs and outputs have the same samples");
      fuzz::require(record.signal.skip >= 0 && record.signal.skip < record.signal.y.cols(),
                    "samples are left to score");
      fuzz::require(record.signal.u.allFinite() && record.signal.y.allFinite(), "all values are finite");
    }
  });
}
