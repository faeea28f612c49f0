#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/plant/dataset.hpp"
#include "experiments/experiment/config.hpp"
#include "experiments/run/input_checks.hpp"

namespace wheelhop {
namespace {

Index mass_called(const Plant& plant, const std::string& name) {
  for (Index i = 0; i < plant.mass_count(); ++i)
    if (plant.masses[static_cast<std::size_t>(i)].name == name) return i;
  return -1;
}

/// The member `key` must hold a length of at least 100 whole samples.
void require_whole_samples(const JsonCursor& cursor, const char* key, double seconds, double sampling_hz) {
  const double samples = seconds * sampling_hz;
  if (samples >= 100 && std::abs(samples - std::round(samples)) <= 1e-6) return;
  const std::string expected = fmt::format("a duration of at least 100 whole samples of 1/{} s", sampling_hz);
  if (const auto member = cursor.find(key)) member->fail(expected);
  cursor.fail(expected);
}

void set_parameters(const JsonCursor& cursor, Plant& plant) {
  if (!cursor.is_object()) cursor.fail("an object of parameters of the plant and their values");
  const std::vector<PlantParameter> known = plant_parameters(plant);
  for (const auto& [name, value] : cursor.raw().items()) {
    const JsonCursor member = cursor.at(name);
    const auto same = std::find_if(known.begin(), known.end(), [&](const auto& one) { return one.name == name; });
    if (same == known.end()) {
      std::vector<std::string> names;
      for (const PlantParameter& one : known) names.push_back(one.name);
      throw UserError(
          fmt::format("{}: unknown parameter of the plant; known ones: {}", member.where(), join_names(names)));
    }
    set_parameter(plant, name, member.number(same->range));
  }
}

std::vector<Index> read_outputs(const JsonCursor& cursor, const Plant& plant) {
  std::vector<std::string> known;
  for (const Sensor& sensor : plant.sensors) known.push_back(sensor.name);
  std::vector<Index> outputs;
  for (const JsonCursor& item : cursor.items()) {
    const std::string name = item.one_of(known);
    outputs.push_back(std::find(known.begin(), known.end(), name) - known.begin());
  }
  std::sort(outputs.begin(), outputs.end());
  if (outputs.empty() || std::adjacent_find(outputs.begin(), outputs.end()) != outputs.end())
    cursor.fail("names of sensors of the plant, at least one, each once");
  return outputs;
}

}  // namespace

QuarterCar find_quarter_car(const Plant& plant, const std::string& where) {
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
      throw UserError(fmt::format("{}: expected a plant with the sensor \"{}\" of Table 1; its sensors: {}", where,
                                  kPaperSignals[s].name, join_names(known)));
  }
  car.body = mass_called(plant, sensors[1]->to);
  car.wheel = mass_called(plant, sensors[2]->to);
  const bool absolute = sensors[1]->from == "ground" && sensors[2]->from == "ground" &&
                        sensors[1]->kind == SensorKind::acceleration && sensors[2]->kind == SensorKind::acceleration;
  if (car.body < 0 || car.wheel < 0 || car.body == car.wheel || !absolute)
    throw UserError(
        fmt::format("{}: expected chassis_acceleration and axle_acceleration of two masses of the plant", where));
  const std::string& body = sensors[1]->to;
  const std::string& wheel = sensors[2]->to;
  for (std::size_t e = 0; e < plant.elements.size(); ++e) {
    const Element& element = plant.elements[e];
    if ((element.from == wheel && element.to == body) || (element.from == body && element.to == wheel)) {
      car.suspension = static_cast<Index>(e);
      return car;
    }
  }
  throw UserError(fmt::format("{}: expected an element between the masses \"{}\" and \"{}\"", where, body, wheel));
}

Index ExperimentConfig::row_of(Index sensor) const {
  const auto at = std::find(outputs.begin(), outputs.end(), sensor);
  return at == outputs.end() ? -1 : at - outputs.begin();
}

Json effective_config(const ExperimentConfig& config) {
  Json out = {{"plant", to_json(config.plant)}, {"drive", to_json(config.drive)}};
  out.update(write_options(config.data));
  const Json usual = write_options(DepartureOptions{}), departures = write_options(config.departures);
  for (const auto& [key, value] : departures.items())
    if (value != usual[key]) out[key] = value;
  if (static_cast<Index>(config.outputs.size()) < config.plant.sensor_count())
    for (const Index sensor : config.outputs)
      out["outputs"].push_back(config.plant.sensors[static_cast<std::size_t>(sensor)].name);
  out.update(config.pieces.config());
  out["pipeline"] = write_options(config.pipeline);
  return out;
}

ExperimentConfig parse_experiment_config(const JsonCursor& cursor) {
  ExperimentConfig config;
  const JsonCursor plant = cursor.at("plant");
  config.plant = plant.is_string() ? load_acting_plant(plant.directory() / plant.string())
                                   : require_acting_inputs(parse_plant(plant), plant.where());
  if (const auto parameters = cursor.find("plant_parameters")) set_parameters(*parameters, config.plant);
  try {
    config.car = find_quarter_car(config.plant, plant.where());
  } catch (const UserError&) {  // another plant: what only the paper's has is not measured
  }
  config.drive = parse_drive(cursor.at("drive"), config.plant.hold_hz(), config.plant.inputs.front().unit);
  config.data = read_options<DataOptions>(cursor);
  try {
    hold_samples_per_record_sample(config.plant, config.data.sampling_hz);
  } catch (const UserError& error) {
    throw UserError(cursor.where() + ".sampling_hz: " + error.what());
  }
  require_whole_samples(cursor, "estimation_s", config.data.estimation_s, config.data.sampling_hz);
  require_whole_samples(cursor, "validation_s", config.data.validation_s, config.data.sampling_hz);
  config.departures = read_options<DepartureOptions>(cursor);
  if (const auto outputs = cursor.find("outputs")) {
    config.outputs = read_outputs(*outputs, config.plant);
  } else {
    for (Index i = 0; i < config.plant.sensor_count(); ++i) config.outputs.push_back(i);
  }
  config.pieces = read_pieces(cursor);
  config.pipeline = read_pipeline(cursor);
  if (config.pipeline.nonlinearities == 0)
    cursor.at("pipeline").at("nonlinearities").fail("at least 1, as linear and nonlinear models are compared here");
  config.effective = effective_config(config);
  return config;
}

}  // namespace wheelhop
