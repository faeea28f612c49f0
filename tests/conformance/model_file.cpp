// The model file: what was written simulates the same bytes, and a damaged file is refused by name and place.
#include "core/model/model_file.hpp"

#include <catch2/catch.hpp>
#include <functional>
#include <limits>

#include "core/base/files.hpp"
#include "core/base/random.hpp"
#include "tests/support/folder.hpp"
#include "variants/table.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

constexpr Index kOrder = 3, kInputs = 2, kOutputs = 3, kMaps = 1, kRecorded = 400;

/// A stable model with a map of random weights; nothing in it is round.
ModelFile sample_model(bool with_map = true) {
  Random random(17, Stream::parameters);
  ModelFile file;
  file.inputs = {{"road", "m"}, {"push", "N"}};
  file.outputs = {{"travel", "m"}, {"body_acc", "m/s^2"}, {"wheel_acc", "m/s^2"}};
  file.sampling_hz = 200;
  file.u_scale = Vector::Constant(kInputs, 1.0 / 3);
  file.y_scale = random.normal(kOutputs, 1).cwiseAbs();
  const Matrix A = random.normal(kOrder, kOrder);
  file.model.linear = {0.8 / spectral_radius(A) * A, random.normal(kOrder, kInputs), random.normal(kOutputs, kOrder),
                       random.normal(kOutputs, kInputs), random.normal(kOutputs, 1)};
  constexpr double infinity = std::numeric_limits<double>::infinity();
  file.limits = {Vector::Constant(kOutputs, -infinity), Vector::Constant(kOutputs, infinity)};
  file.limits.high(0) = 0.1 * file.y_scale(0);  // the drive takes it beyond
  file.limits.low(1) = -1.0 / 3;
  file.model.limits = over(file.limits, file.y_scale);
  const Index count = with_map ? kMaps : 0;
  file.model.Bt = 0.1 * random.normal(kOrder, count);
  file.model.Dt = random.normal(kOutputs, count);
  if (with_map) {
    Json choice = {{"name", "mlp"}, {"hidden_units", 4}};
    auto map = make_from(nonlinearity_table(), JsonCursor::from(choice, "choice")).piece(kOrder + kInputs, kMaps);
    map->initialise(random.normal(kOrder + kInputs, 50), random.normal(kMaps, 50), random);
    map->W = random.normal(map->W.rows(), map->W.cols());
    map->b = random.normal(kMaps, 1);
    map->L = 0.1 * random.normal(kMaps, kOrder + kInputs);
    file.model.map = std::move(map);
  }
  file.x0 = random.normal(kOrder, 1);
  file.states = {random.normal(kOrder, 1), Matrix::Identity(kOrder, kOrder), random.normal(kOutputs, 1).cwiseAbs()};
  file.envelope = {{-Vector::Ones(kInputs), Vector::Ones(kInputs)},
                   {-2 * Vector::Ones(kOutputs), 3 * Vector::Ones(kOutputs)},
                   {-Vector::Ones(count), Vector::Ones(count)}};
  file.uncertainty = {{"interval", 0.9}, {"poles_at_rest", Json::array()}};
  file.config = {{"seed", 1}};
  file.scores = {{"order", kOrder}};
  file.provenance = {{"program", "wheelhop"}};
  return file;
}

Matrix drive() {
  Random random(18, Stream::road);
  return 0.3 * random.normal(kInputs, kRecorded);
}

}  // namespace

TEST_CASE("a model that went through its file simulates the same bytes, with and without a map") {
  for (const bool with_map : {true, false}) {
    const Folder folder;
    const ModelFile before = sample_model(with_map);
    write_json(folder / "model.json", to_json(before));
    const ModelFile after = load_model(folder / "model.json", restore_map);
    const FreeRun a = free_run(before, drive(), before.x0), b = free_run(after, drive(), after.x0);
    REQUIRE(a.status == Status::ok);
    CHECK(a.y == b.y);
    CHECK(a.f == b.f);
    CHECK(to_json(after) == to_json(before));
    CHECK(after.outputs[1].unit == "m/s^2");
  }
}

TEST_CASE("the outputs of a model file are in physical units: twice the scale, twice the output") {
  ModelFile file = sample_model();
  const Matrix once = free_run(file, drive(), file.x0).y;
  file.y_scale *= 2;
  CHECK(free_run(file, drive(), file.x0).y == 2 * once);
  const Matrix doubled = 2 * drive();
  file.u_scale *= 2;
  CHECK(free_run(file, doubled, file.x0).y == 2 * once);
}

TEST_CASE("offsets and delays of the inputs go through the file and act before the model") {
  for (const std::uint64_t draw : {1, 2, 3}) {
    const Folder folder;
    Random random(19, Stream::parameters, draw);
    ModelFile plain = sample_model();
    ModelFile file = plain;
    file.u_offset = 10 * random.normal(kInputs, 1);
    file.delay = {random.integer(6), 1 + random.integer(6)};
    write_json(folder / "model.json", to_json(file));
    const ModelFile after = load_model(folder / "model.json", restore_map);
    CHECK(to_json(after) == to_json(file));
    const Matrix u = drive();
    Matrix late = u.colwise() - file.u_offset;
    for (Index i = 0; i < kInputs; ++i)
      for (Index k = u.cols() - 1; k >= 0; --k)
        late(i, k) = late(i, std::max<Index>(0, k - file.delay[static_cast<std::size_t>(i)]));
    CHECK((free_run(after, u, file.x0).y - free_run(plain, late, file.x0).y).norm() < 1e-9);
    CHECK(longest_delay(after) == std::max(file.delay[0], file.delay[1]));
    // A file from before there were any.
    Json old = to_json(plain);
    for (Json& input : old["inputs"]) {
      input.erase("offset");
      input.erase("delay_samples");
    }
    write_json(folder / "old.json", old);
    CHECK(free_run(load_model(folder / "old.json", restore_map), u, plain.x0).y == free_run(plain, u, plain.x0).y);
  }
}

TEST_CASE("samples outside the training range are counted by channel, with their distance") {
  const ModelFile file = sample_model();
  Matrix u = Matrix::Zero(kInputs, 5), y = Matrix::Zero(kOutputs, 5);
  const Matrix f = Matrix::Zero(kMaps, 5);
  CHECK(beyond_envelope(file, u, y, f).empty());
  u(1, 2) = -1.5;
  y(2, 0) = 4;
  y(2, 4) = 3.25;
  const std::vector<Excess> found = beyond_envelope(file, u, y, f);
  REQUIRE(found.size() == 2);
  CHECK(found[0].channel == "push");
  CHECK(found[0].distance == Approx(0.5));
  CHECK(found[0].share == Approx(0.25));
  CHECK(found[1].channel == "wheel_acc");
  CHECK(found[1].samples == 2);
  CHECK(found[1].distance == Approx(1));
}

TEST_CASE("a broken model file is refused with file, path and what was expected") {
  const Json whole = to_json(sample_model());
  const auto refused = [&](const std::function<void(Json&)>& edit) {
    const Folder folder;
    Json broken = whole;
    edit(broken);
    write_json(folder / "model.json", broken);
    try {
      load_model(folder / "model.json", restore_map);
    } catch (const UserError& error) {
      CHECK_THAT(error.what(), Contains("model.json"));
      return std::string(error.what());
    }
    FAIL("the file was accepted");
    return std::string();
  };
  CHECK_THAT(refused([](Json& j) { j["schema"] = "wheelhop.model/2"; }), Contains("$.schema"));
  CHECK_THAT(refused([](Json& j) { j.erase("Bt"); }), Contains("Bt"));
  CHECK_THAT(refused([](Json& j) { j["A"].erase(0); }), Contains("$.A") && Contains("3 x 3"));
  CHECK_THAT(refused([](Json& j) { j["A"][0][0] = nullptr; }), Contains("$.A[0]"));
  CHECK_THAT(refused([](Json& j) { j["y0"].push_back(1.0); }), Contains("$.y0") && Contains("3 numbers"));
  CHECK_THAT(refused([](Json& j) { j["outputs"][0]["scale"] = 0; }), Contains("$.outputs[0].scale"));
  CHECK_THAT(refused([](Json& j) { j["outputs"][0]["training_range"] = {2, 1}; }), Contains("training_range"));
  CHECK_THAT(refused([](Json& j) { j["map"]["name"] = "mpl"; }), Contains("$.map.name") && Contains("mlp"));
  CHECK_THAT(refused([](Json& j) { j["map"]["alpha"].erase(0); }), Contains("$.map.alpha"));
  CHECK_THAT(refused([](Json& j) { j["map"]["options"]["hidden_units"] = 5; }), Contains("$.map"));
  CHECK_THAT(refused([](Json& j) { j["map"] = nullptr; }), Contains("$.map"));
  CHECK_THAT(refused([](Json& j) { j["order"] = 4; }), Contains("$.A"));
  CHECK_THAT(refused([](Json& j) { j["extra"] = 1; }), Contains("extra"));
  CHECK_THAT(refused([](Json& j) {
               ModelFile failed;
               failed.status = Status::rank_deficient;
               failed.message = "too little to go by";
               j = without_model(failed);
             }),
             Contains("rank_deficient") && Contains("too little to go by"));
}
