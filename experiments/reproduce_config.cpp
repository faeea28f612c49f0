#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "core/plant/dataset.hpp"
#include "experiments/home.hpp"
#include "experiments/reproduce_study.hpp"

namespace wheelhop {
namespace {

Index mass_called(const Plant& plant, const std::string& name) {
  for (Index i = 0; i < plant.mass_count(); ++i)
    if (plant.masses[static_cast<std::size_t>(i)].name == name) return i;
  return -1;
}

QuarterCar find_quarter_car(const Plant& plant, const JsonCursor& cursor) {
  QuarterCar car;
  std::array<const Sensor*, 3> sensors{};
  std::vector<std::string> known;
  for (const Sensor& sensor : plant.sensors) known.push_back(sensor.name);
  for (std::size_t s = 0; s < 3; ++s) {
    for (std::size_t i = 0; i < plant.sensors.size(); ++i)
      if (plant.sensors[i].name == kPaperSignals[s].name) {
        car.sensors[s] = static_cast<Index>(i);
        sensors[s] = &plant.sensors[i];
      }
    if (!sensors[s])
      throw UserError(fmt::format("{}: expected a plant with the sensor \"{}\" of Table 1; its sensors: {}",
                                  cursor.where(), kPaperSignals[s].name, join_names(known)));
  }
  car.body = mass_called(plant, sensors[1]->to);
  car.wheel = mass_called(plant, sensors[2]->to);
  const bool absolute = sensors[1]->from == "ground" && sensors[2]->from == "ground" &&
                        sensors[1]->kind == SensorKind::acceleration && sensors[2]->kind == SensorKind::acceleration;
  if (car.body < 0 || car.wheel < 0 || car.body == car.wheel || !absolute)
    throw UserError(fmt::format("{}: expected chassis_acceleration and axle_acceleration of two masses of the plant",
                                cursor.where()));
  const std::string& body = sensors[1]->to;
  const std::string& wheel = sensors[2]->to;
  for (std::size_t e = 0; e < plant.elements.size(); ++e) {
    const Element& element = plant.elements[e];
    if ((element.from == wheel && element.to == body) || (element.from == body && element.to == wheel)) {
      car.suspension = static_cast<Index>(e);
      return car;
    }
  }
  throw UserError(
      fmt::format("{}: expected an element between the masses \"{}\" and \"{}\"", cursor.where(), body, wheel));
}

double duration(const JsonCursor& cursor, const char* key, double fallback, double sampling_hz) {
  const double seconds = cursor.number(key, fallback, {.low = 0, .high = 1e6});
  const double samples = seconds * sampling_hz;
  if (samples < 100 || std::abs(samples - std::round(samples)) > 1e-6) {
    const std::string expected = fmt::format("a duration of at least 100 whole samples of 1/{} s", sampling_hz);
    if (const auto member = cursor.find(key)) member->fail(expected);
    cursor.fail(expected);
  }
  return seconds;
}

Json effective(const ReproduceConfig& config) {
  Json out = {{"plant", to_json(config.plant)},
              {"drive", to_json(config.drive)},
              {"sampling_hz", config.sampling_hz},
              {"settle_s", config.settle_s},
              {"estimation_s", config.estimation_s},
              {"validation_s", config.validation_s},
              {"substeps", config.substeps},
              {"realisations", config.realisations},
              {"seed", config.seed},
              {"snr_db", config.snr_db ? Json(*config.snr_db) : Json()},
              {"initial_state_samples", config.initial_state_samples}};
  out.update(config.pieces.config());
  out["pipeline"] = write_options(config.pipeline);
  Json printed = config.printed_pieces.config();
  printed["pipeline"] = write_options(config.printed_pipeline);
  out["as_printed"] = std::move(printed);
  return out;
}

}  // namespace

ReproduceConfig parse_reproduce_config(const JsonCursor& cursor) {
  constexpr Index largest = std::numeric_limits<Index>::max();
  ReproduceConfig config;
  const JsonCursor plant = cursor.at("plant");
  config.plant = plant.is_string() ? load_plant(plant.directory() / plant.string()) : parse_plant(plant);
  config.car = find_quarter_car(config.plant, plant);
  config.drive = parse_drive(cursor.at("drive"), config.plant.hold_hz(), config.plant.inputs.front().unit);
  config.sampling_hz = cursor.number("sampling_hz", config.sampling_hz, {.low = 1e-3, .high = 1e7});
  try {
    hold_samples_per_record_sample(config.plant, config.sampling_hz);
  } catch (const UserError& error) {
    throw UserError(cursor.where() + ".sampling_hz: " + error.what());
  }
  config.settle_s = cursor.number("settle_s", config.settle_s, {.low = 0, .high = 1e5});
  config.estimation_s = duration(cursor, "estimation_s", config.estimation_s, config.sampling_hz);
  config.validation_s = duration(cursor, "validation_s", config.validation_s, config.sampling_hz);
  config.substeps = cursor.integer("substeps", config.substeps, 1, 1000);
  config.realisations = cursor.integer("realisations", config.realisations, 1, 1000000);
  config.seed = cursor.integer("seed", config.seed, 0, largest);
  if (const auto member = cursor.find("snr_db"))
    if (!member->raw().is_null()) config.snr_db = member->number({.low = -100, .high = 300});
  config.initial_state_samples = cursor.integer("initial_state_samples", config.initial_state_samples, 1, largest);
  config.pieces = read_pieces(cursor);
  config.pipeline = read_pipeline(cursor);
  config.printed_pieces = config.pieces;
  config.printed_pipeline = config.pipeline;
  if (const auto printed = cursor.find("as_printed")) {
    config.printed_pieces = read_pieces(*printed, &config.pieces);
    config.printed_pipeline = read_pipeline(*printed, config.pipeline);
    printed->done();
  }
  config.printed_pipeline.refine_iterations = 0;  // the paper has no joint refinement
  cursor.done();
  config.effective = effective(config);
  return config;
}

ReproduceConfig read_reproduce_config(const ReproduceRequest& request) {
  ReproduceConfig config = parse_reproduce_config(
      JsonCursor::load(request.config.empty() ? home() / "experiments" / "configs" / "paper.json" : request.config));
  config.preset = request.config.empty();
  if (request.realisations) config.realisations = *request.realisations;
  if (request.seed) config.seed = *request.seed;
  if (request.snr_db) config.snr_db = request.snr_db;
  config.effective = effective(config);
  return config;
}

}  // namespace wheelhop
