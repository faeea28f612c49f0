// Writes what the fuzz targets begin with, a folder a target: small files by the project's own writers and the plants
// and evidence of the tests.
#include "core/base/files.hpp"
#include "core/base/random.hpp"
#include "core/data/csv.hpp"
#include "core/data/gzip.hpp"
#include "core/data/mat.hpp"
#include "core/gap/verdict/thresholds.hpp"
#include "core/model/model_file.hpp"
#include "tests/support/evidence.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/plants.hpp"
#include "variants/table.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
namespace fs = std::filesystem;

namespace {

/// Time at 100 Hz and two channels.
Table small_table(Index samples) {
  Random random(1, Stream::road);
  Table table{{"t", "u", "y"}, random.normal(3, samples)};
  for (Index k = 0; k < samples; ++k) table.columns(0, k) = 0.01 * static_cast<double>(k);
  return table;
}

/// A linear model, or one with a map of each family.
Json model_with(const std::string& map) {
  Random random(2, Stream::parameters);
  ModelFile file;
  file.inputs = {{"u", "m"}};
  file.outputs = {{"y", "m"}};
  file.sampling_hz = 100;
  file.u_scale = file.y_scale = Vector::Ones(1);
  file.model.linear = {0.5 * Matrix::Identity(2, 2), random.normal(2, 1), random.normal(1, 2), random.normal(1, 1),
                       Vector::Zero(1)};
  const Index count = map.empty() ? 0 : 1;
  file.model.Bt = random.normal(2, count);
  file.model.Dt = random.normal(1, count);
  if (!map.empty()) {
    const Json choice = {{"name", map}};
    auto made = make_from(nonlinearity_table(), JsonCursor::from(choice, "choice")).piece(3, 1);
    made->initialise(random.normal(3, 40), random.normal(1, 40), random);
    made->W = random.normal(made->W.rows(), made->W.cols());
    made->b = Vector::Zero(1);
    made->L = Matrix::Zero(1, 3);
    file.model.map = std::move(made);
  }
  file.x0 = Vector::Zero(2);
  const Extremes one = {-Vector::Ones(1), Vector::Ones(1)};
  file.envelope = {one, one, {-Vector::Ones(count), Vector::Ones(count)}};
  return to_json(file);
}

Json diagnosis() {
  Evidence evidence = evidence_with_gap(3);
  evidence.singles = {single(evidence, "coulomb_friction", "suspension", 0.05),
                      single(evidence, "hysteresis", "suspension", 0.4)};
  evidence.pairs = {pair(evidence, "coulomb_friction", "bias", "suspension", "sensor:travel", 0.03)};
  evidence.freed = {freed(evidence, 1, 0.2)};
  return {{"evidence", to_json(evidence)}, {"thresholds", to_json(Thresholds{})}};
}

void write_all(const fs::path& root) {
  const auto put = [&](const std::string& target, const std::string& content) {
    static int number = 0;
    fs::create_directories(root / target);
    write_file(root / target / ("made_" + std::to_string(number++)), content);
  };
  const Folder folder;
  for (const Index samples : {1, 3, 40}) {
    const Table table = small_table(samples);
    write_csv(folder / "r.csv", table);
    const std::string csv = read_file(folder / "r.csv");
    put("csv", csv);
    put("gzip", pack_gzip(csv));
    put("gzip", csv);
    write_mat(folder / "r.mat", table);
    put("mat", read_file(folder / "r.mat"));
    for (const char* more : {"", R"(, "skip_initial": 1, "range": [0, 3])", R"(, "repeat_of": "a")"})
      put("records", std::string(R"({"sampling_hz": 100, "records": [{"file": "r.csv", "role": "estimation")") + more +
                         R"(}], "noise_std": {"y": 0.1}})" + '\0' + csv);
  }
  for (const std::string* text : {&quarter_car_text, &one_mass_text, &chain_text}) {
    put("json", *text);
    put("plant", *text);
    put("configs", R"(g{"plant": )" + *text + R"(, "sampling_hz": 100, "noise_snr_db": 40, "records": [
      {"role": "estimation", "duration_s": 1, "repeats": 2, "drive": {"name": "multisine", "rms": 1}},
      {"role": "validation", "duration_s": 1, "drive": {"name": "band_limited_noise", "rms": 1}}]})");
    put("configs", R"(b{"seed": 1, "sets": [{"name": "a", "plant": )" + *text +
                       R"(, "class": "none", "seeds": 2, "noise": ["white", "coloured"], "samples": 400}]})");
  }
  put("json", R"([1e-308, -0.0, 12345678901234567, "\u00e9\ud83d\ude00", true, null, {"a": {"b": []}}])");
  for (const char* map : {"", "mlp", "rbf", "polynomial", "ridge_polynomial"}) put("model", model_with(map).dump());
  put("decide", diagnosis().dump());
  put("decide", to_json(evidence_with_gap(0)).dump());
}

}  // namespace

int main(int count, char** words) {
  if (count != 2) {
    std::fputs("usage: fuzz_corpus FOLDER\n", stderr);
    return 2;
  }
  try {
    write_all(words[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fuzz_corpus: %s\n", error.what());
    return 1;
  }
  return 0;
}
