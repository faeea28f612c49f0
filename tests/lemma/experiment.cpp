// An experiment's config and its records: the effective config is the experiment, drawn plants keep their tolerances.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/files.hpp"
#include "experiments/experiment/records.hpp"
#include "experiments/sweep/cell.hpp"
#include "experiments/sweep/folder.hpp"

using namespace wheelhop;

namespace {

ExperimentConfig parse(Json config) {
  return parse_experiment_config(
      JsonCursor::from(std::move(config), "test.json", WHEELHOP_SOURCE "/experiments/configs"));
}

Json short_config() {
  Json config = parse_json(read_file(WHEELHOP_SOURCE "/experiments/configs/paper.json"), "paper.json");
  config.erase("as_printed");
  config["estimation_s"] = config["validation_s"] = 1;
  config["settle_s"] = 0.1;
  return config;
}

}  // namespace

TEST_CASE("the effective config of an experiment, read as a config, is the same experiment") {
  Json config = short_config();
  const Json usual = parse(config).effective;
  CHECK(parse(usual).effective == usual);
  CHECK_FALSE(usual.contains("noise_corner_hz"));
  config["snr_db"] = 30;
  config["noise_corner_hz"] = 5;
  config["draw_parameters"] = true;
  config["outputs"] = {"axle_acceleration"};
  config["plant_parameters"] = {{"suspension.viscous_damper.damping_ns_per_m", 900}};
  const Json changed = parse(config).effective;
  CHECK(changed["noise_corner_hz"] == 5);
  CHECK(changed["plant"].dump().find("900") != std::string::npos);
  CHECK(parse(changed).effective == changed);
}

TEST_CASE("records: outputs that are not measured go, those that are keep their numbers, noise and all") {
  Json config = short_config();
  config["snr_db"] = 30;
  const SimulatedRecords all = simulate_records(parse(config), 3);
  config["outputs"] = {"axle_acceleration", "suspension_displacement"};
  const ExperimentConfig part_config = parse(config);
  const SimulatedRecords part = simulate_records(part_config, 3);
  REQUIRE(all.status == Status::ok);
  REQUIRE(part.training.output_count() == 2);
  for (Index i = 0; i < 2; ++i) {
    const Index sensor = part_config.outputs[static_cast<std::size_t>(i)];
    CHECK(part_config.row_of(sensor) == i);
    CHECK(part.training.y.row(i) == all.training.y.row(sensor));
    CHECK(part.clean.row(i) == all.clean.row(sensor));
    CHECK(part.noise_std(i) == all.noise_std(sensor));
    CHECK(part.training.outputs[static_cast<std::size_t>(i)].name ==
          all.training.outputs[static_cast<std::size_t>(sensor)].name);
  }
}

TEST_CASE("drawn plants differ from one realisation to the next, by their tolerances, and are drawn again the same") {
  Json config = short_config();
  config["draw_parameters"] = true;
  config["drive"]["rms"] = 0.004;
  const ExperimentConfig experiment = parse(config);
  const std::vector<PlantParameter> nominal = plant_parameters(experiment.plant);
  double squares = 0;
  Index count = 0;
  for (Index r = 0; r < 60; ++r) {
    const Plant plant = simulate_records(experiment, r).plant;
    CHECK(to_json(plant) == to_json(simulate_records(experiment, r).plant));
    for (const PlantParameter& parameter : nominal) {
      if (parameter.value == 0) continue;
      const double relative = (get_parameter(plant, parameter.name) / parameter.value - 1) / parameter.tolerance;
      squares += relative * relative;
      ++count;
    }
  }
  const double variance = squares / static_cast<double>(count);
  CHECK(std::abs(variance - 1) < 4 * std::sqrt(2 / static_cast<double>(count)));
}

TEST_CASE("under every measure a row holds its axes and columns that no axis may be called") {
  for (const char* measure : {"linear", "inversion", "nonlinear", "refined", "solver"}) {
    Json config = {{"base", short_config()}, {"measure", measure}, {"realisations", 1}, {"evaluations", 5}};
    config["base"]["plant"] = WHEELHOP_SOURCE "/experiments/configs/paper_plant.json";
    config["base"]["estimation_s"] = 5;
    config["base"]["pipeline"]["passes"] = 1;
    config["base"]["pipeline"]["refine_iterations"] = 2;
    config["axes"] = Json::parse(R"([{"name": "snr_db", "values": [40]}])");
    const Grid grid = read_grid(config, "test.json");
    const Json row = compute_row(grid, 0, 0);
    INFO(row.dump());
    CHECK(row["status"] == "ok");
    CHECK(row.size() > 15);
    for (const auto& [name, value] : row.items()) CHECK((is_row_column(name) || grid.axis_called(name) >= 0));
    CHECK(is_row_of(grid, row));
    for (const char* spoilt : {"config_hash", "status", "message"})
      for (const Json& value : {Json(), Json(1), Json(Json::object())}) {
        Json other = row;
        other[spoilt] = value;
        CHECK_FALSE(is_row_of(grid, other));
      }
    Json other = row;
    other["cell"] = 1;
    CHECK_FALSE(is_row_of(grid, other));
    other = row;
    other["realisation"] = 1;
    CHECK_FALSE(is_row_of(grid, other));
  }
}
