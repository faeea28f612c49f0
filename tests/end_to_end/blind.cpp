// `blind run`: every case gets an answer, a run that was stopped goes on, and families leave the catalogue.
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>

#include "core/base/files.hpp"
#include "core/base/random.hpp"
#include "core/base/status.hpp"
#include "core/data/records.hpp"
#include "core/plant/dataset.hpp"
#include "experiments/blind/run.hpp"
#include "experiments/diagnose/diagnose.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/plants.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

/// A rig that is its plant, pushed by noise and measured with noise for so many seconds.
void make_case(const std::filesystem::path& folder, double seconds) {
  const Plant plant = plant_from(one_mass_text);
  RecordSet set;
  set.sampling_hz = 100;
  Random random(630, Stream::road);
  const Index samples = static_cast<Index>(seconds * set.sampling_hz), ratio = 5;
  for (const char* role : {"estimation", "validation"}) {
    Matrix drive(1, samples * ratio);
    for (Index k = 0; k < samples; ++k) drive.middleCols(k * ratio, ratio).setConstant(random.normal());
    GeneratedRecord made = generate_record(plant, drive, set.sampling_hz);
    REQUIRE(made.status == Status::ok);
    for (Index i = 0; i < made.signal.y.rows(); ++i) {
      const double level = made.signal.y.row(i).norm() / std::sqrt(static_cast<double>(samples));
      const auto std = set.noise_std.emplace(plant.sensors[static_cast<std::size_t>(i)].name, 0.02 * level).first;
      made.signal.y.row(i) += std->second * random.normal(1, samples);
    }
    set.records.push_back({role + std::string(".csv"), role, "", 0, made.signal});
  }
  Json file = to_json(plant);
  file["inputs"][0]["interpolation"] = "zoh";
  write_records(folder, set);
  write_json(folder / "plant.json", file);
}

Json read(const std::filesystem::path& file) { return parse_json(read_file(file), file.string()); }

}  // namespace

TEST_CASE("a case that cannot be diagnosed is an answer with its reason, and a second run does only what is missing") {
  const Folder cases, answers;
  make_case(cases / "case_000", 9);
  make_case(cases / "case_001", 0.02);
  write_json(cases / "manifest.json", {{"cases", 2}});
  BlindRunRequest request{cases.path(), answers.path()};
  request.quiet = true;
  CHECK(run_blind_run(request) == 1);
  const std::string first = read_file(answers / "case_000.json");
  CHECK(read(answers / "case_000.json").at("verdict") == "no_gap");
  CHECK_THAT(read(answers / "case_001.json").at("error").get<std::string>(),
             Contains("expected at least") && Contains("readings"));
  CHECK(read(answers / "manifest.json").at("cases") == 2);
  CHECK(read(answers / "timing.json").at("case_s").size() == 2);
  // Without an effect the plant with the answer is the re-tuned one.
  const Plant corrected = load_plant(answers / "case_000.plant.json");
  const Plant retuned = load_plant(answers / "case_000.retuned.json");
  for (const PlantParameter& parameter : plant_parameters(corrected))
    CHECK(get_parameter(retuned, parameter.name) == Approx(parameter.value).epsilon(1e-12));

  const Json kept = {{"left_out", Json::array()}, {"kept", true}};
  write_json(answers / "case_001.json", kept);
  write_file(answers / "case_000.json", "{\"schema\": ");  // half a file is none
  CHECK(run_blind_run(request) == 0);
  CHECK(read_file(answers / "case_000.json") == first);
  CHECK(read(answers / "case_001.json") == kept);

  request.cases = "case_00[0],case_2*";
  CHECK_THROWS_WITH(run_blind_run(request), Contains("case_2*"));
  request.cases = "";
  write_json(answers / "key.json",
             {{{"case", "case_000"}, {"effects", {{{"effect", "bias"}, {"location", "sensor:x"}}}}},
              {{"case", "case_001"}, {"effects", Json::array()}}});
  request.leave_out = answers / "key.json";
  CHECK_THROWS_WITH(run_blind_run(request), Contains("case_000.json") && Contains("bias"));
}

TEST_CASE("a full disk is no answer: the run stops, says how to go on, and the case is done again") {
  const Folder cases, answers;
  make_case(cases / "case_000", 9);
  make_case(cases / "case_001", 0.02);
  BlindRunRequest request{cases.path(), answers.path()};
  request.quiet = true;
  // A limit on the size of files answers as a full disk does. A plant is longer than this, and a short answer is not.
  struct rlimit before {};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = signal(SIGXFSZ, SIG_IGN);
  const struct rlimit small = {600, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  std::string message;
  try {
    run_blind_run(request);
  } catch (const MachineError& error) {
    message = error.what();
  }
  setrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, handler);
  CHECK_THAT(message, Contains("case_000") && Contains("cannot write") && Contains("start the same command again"));
  for (const std::string& name : answers.names()) CHECK((name.find("case_") == std::string::npos && name[0] != '.'));

  if (const pid_t child = ::fork(); child == 0) {
    write_file(temporary_beside(answers / "case_000.json"), "half");
    ::_exit(0);
  } else {
    ::waitpid(child, nullptr, 0);
  }
  CHECK(run_blind_run(request) == 1);  // one case is too short, which is a fault of its own
  CHECK(read(answers / "case_000.json").at("verdict") == "no_gap");
  CHECK(read(answers / "case_001.json").contains("error"));
  for (const std::string& name : answers.names()) CHECK(name[0] != '.');
}

TEST_CASE("a family that is left out has no candidate, and the others keep theirs") {
  const Plant plant = plant_from(quarter_car_text);
  Operation operation;
  FitRecord record{Matrix::Random(1, 2000) * 0.003, Matrix::Zero(3, 400), 5, 0, Vector::Ones(3), {}};
  REQUIRE(operation_of(plant, {record}, {}, operation));
  const auto all = catalogue_without({})(plant, operation);
  const auto fewer = catalogue_without({"coulomb_friction"})(plant, operation);
  const auto count = [](const std::vector<EffectCandidate>& list, const EffectId& effect) {
    return std::count_if(list.begin(), list.end(), [&](const auto& one) { return one.label().effect == effect; });
  };
  CHECK(count(all, "coulomb_friction") > 0);
  CHECK(count(fewer, "coulomb_friction") == 0);
  CHECK(std::ssize(fewer) == std::ssize(all) - count(all, "coulomb_friction"));
  for (const EffectCandidate& candidate : fewer)
    for (const Label& label : candidate.labels) CHECK(label.effect != "coulomb_friction");
}
