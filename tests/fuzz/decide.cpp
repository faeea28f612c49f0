#include "core/gap/verdict/decide.hpp"
#include "core/gap/verdict/thresholds.hpp"
#include "tests/fuzz/reader.hpp"

using namespace wheelhop;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::answered([&] {
    const JsonCursor file = JsonCursor::from(parse_json(fuzz::text_of(data, size), "d.json"), "d.json");
    if (!file.is_object()) return;
    const auto inside = file.find("evidence");
    const Evidence evidence = evidence_from(inside ? *inside : file);
    Thresholds thresholds;
    if (const auto list = file.find("thresholds")) thresholds = thresholds_from(*list);
    const Verdict verdict = decide(evidence, thresholds);
    fuzz::require(!verdict.row.empty() && !verdict.why.empty(),
                  "a verdict says which row of the table gave it, and why");
    const Json written = to_json(evidence);
    fuzz::require(to_json(evidence_from(JsonCursor::from(written, "written here"))) == written,
                  "what is read is written and read again");
  });
}
