#include "core/model/model_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace wheelhop {
namespace {

constexpr const char* schema = "wheelhop.model/1";

Json numbers(const Vector& values) { return std::vector<double>(values.begin(), values.end()); }

Json extremes_json(const Extremes& e) { return {{"low", numbers(e.low)}, {"high", numbers(e.high)}}; }

Json channels_json(const std::vector<Channel>& channels, const Vector& scale, const Extremes& range) {
  Json out = Json::array();
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const auto row = static_cast<Index>(i);
    out.push_back({{"name", channels[i].name},
                   {"unit", channels[i].unit},
                   {"scale", scale(row)},
                   {"training_range", {range.low(row), range.high(row)}}});
  }
  return out;
}

Json inputs_json(const ModelFile& file) {
  Json out = channels_json(file.inputs, file.u_scale, file.envelope.u);
  for (std::size_t i = 0; i < file.inputs.size(); ++i) {
    out[i]["offset"] = file.u_offset.size() > 0 ? file.u_offset(static_cast<Index>(i)) : 0.0;
    out[i]["delay_samples"] = file.delay.empty() ? 0 : file.delay[i];
  }
  return out;
}

/// The limits of the outputs in their units, null where there is none; nothing where no output has one.
Json outputs_json(const ModelFile& file) {
  Json out = channels_json(file.outputs, file.y_scale, file.envelope.y);
  const OutputLimits& limits = file.limits;
  for (std::size_t i = 0; i < file.outputs.size() && limits.any(); ++i) {
    const auto row = static_cast<Index>(i);
    const auto value = [&](double limit) { return std::isfinite(limit) ? Json(limit) : Json(); };
    out[i]["limits"] = {value(limits.low(row)), value(limits.high(row))};
  }
  return out;
}

/// [low, high] of an output, null where there is none.
std::array<double, 2> read_limits(const JsonCursor& item) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  std::array<double, 2> limits{-infinity, infinity};
  const auto cursor = item.find("limits");
  if (!cursor) return limits;
  const std::vector<JsonCursor> ends = cursor->items();
  if (ends.size() != 2) cursor->fail("[lowest, highest], null where there is none");
  for (std::size_t i = 0; i < 2; ++i)
    if (!ends[i].raw().is_null()) limits[i] = ends[i].number();
  if (!(limits[0] < limits[1])) cursor->fail("[lowest, highest], null where there is none");
  return limits;
}

Json states_json(const StateStatistics& states) {
  if (!states.known()) return nullptr;
  return {{"mean", numbers(states.mean)},
          {"covariance", to_json(states.covariance)},
          {"residual_std", numbers(states.residual_std)}};
}

/// @param rows -1: any number
Vector read_vector(const JsonCursor& cursor, Index rows) {
  const std::vector<double> values = cursor.numbers();
  if (rows >= 0 && static_cast<Index>(values.size()) != rows) cursor.fail(fmt::format("an array of {} numbers", rows));
  return Eigen::Map<const Vector>(values.data(), static_cast<Index>(values.size()));
}

Matrix read_matrix(const JsonCursor& cursor, Index rows, Index columns) {
  Matrix M = matrix_from_json(cursor);
  if (M.rows() != rows || M.cols() != columns) cursor.fail(fmt::format("a matrix of {} x {}", rows, columns));
  return M;
}

Extremes read_extremes(const JsonCursor& cursor, Index rows) {
  Extremes e{read_vector(cursor.at("low"), rows), read_vector(cursor.at("high"), rows)};
  if ((e.high - e.low).size() > 0 && (e.high - e.low).minCoeff() < 0) cursor.fail("low <= high");
  cursor.done();
  return e;
}

/// @param rest reads what else a channel has
template <class Rest>
void read_channels(const JsonCursor& cursor, std::vector<Channel>& channels, Vector& scale, Extremes& range,
                   const Rest& rest) {
  const std::vector<JsonCursor> items = cursor.items();
  if (items.empty()) cursor.fail("at least one channel");
  const auto count = static_cast<Index>(items.size());
  scale.resize(count);
  range = {Vector(count), Vector(count)};
  for (Index i = 0; i < count; ++i) {
    const JsonCursor& item = items[static_cast<std::size_t>(i)];
    channels.push_back({item.at("name").string(), item.at("unit").string()});
    scale(i) = item.at("scale").number({.low = std::numeric_limits<double>::min()});
    const Vector ends = read_vector(item.at("training_range"), 2);
    if (ends(1) < ends(0)) item.at("training_range").fail("[lowest, highest]");
    range.low(i) = ends(0);
    range.high(i) = ends(1);
    rest(item);
    item.done();
  }
}

StateStatistics read_states(const JsonCursor& cursor, Index n, Index p) {
  StateStatistics states{read_vector(cursor.at("mean"), n), read_matrix(cursor.at("covariance"), n, n),
                         read_vector(cursor.at("residual_std"), p)};
  if (p > 0 && states.residual_std.minCoeff() < 0) cursor.at("residual_std").fail("numbers >= 0");
  cursor.done();
  return states;
}

constexpr std::array statuses = {
    Status::ok,       Status::iteration_limit, Status::rank_deficient, Status::not_stabilisable,
    Status::unstable, Status::outside_domain,  Status::not_finite,     Status::unavailable,
    Status::failed};

Status read_status(const JsonCursor& cursor) {
  std::vector<std::string> names;
  for (const Status status : statuses) names.emplace_back(to_string(status));
  const std::string name = cursor.one_of(names);
  for (const Status status : statuses)
    if (to_string(status) == name) return status;
  return Status::failed;
}

}  // namespace

Extremes extremes_of(ConstMatrixRef rows) { return {rows.rowwise().minCoeff(), rows.rowwise().maxCoeff()}; }

Json to_json(const ModelFile& file) {
  const LinearModel& linear = file.model.linear;
  return {{"schema", schema},
          {"status", std::string(to_string(file.status))},
          {"message", file.message},
          {"sampling_hz", file.sampling_hz},
          {"inputs", inputs_json(file)},
          {"outputs", outputs_json(file)},
          {"order", file.model.order()},
          {"nonlinearities", file.model.auxiliary_count()},
          {"A", to_json(linear.A)},
          {"B", to_json(linear.B)},
          {"Bt", to_json(file.model.Bt)},
          {"C", to_json(linear.C)},
          {"D", to_json(linear.D)},
          {"Dt", to_json(file.model.Dt)},
          {"y0", numbers(linear.y0)},
          {"x0", numbers(file.x0)},
          {"states", states_json(file.states)},
          {"map", file.model.map ? file.model.map->to_json() : Json(nullptr)},
          {"f_training_range", extremes_json(file.envelope.f)},
          {"uncertainty", file.uncertainty},
          {"scores", file.scores},
          {"config", file.config},
          {"provenance", file.provenance}};
}

Json without_model(const ModelFile& file) {
  return {{"schema", schema},
          {"status", std::string(to_string(file.status))},
          {"message", file.message},
          {"config", file.config},
          {"provenance", file.provenance}};
}

ModelFile parse_model(const JsonCursor& cursor, const RestoreMap& restore) {
  ModelFile file;
  cursor.at("schema").one_of({schema});
  file.status = read_status(cursor.at("status"));
  file.message = cursor.at("message").string();
  if (!cursor.has("A") && file.status != Status::ok)
    throw UserError(fmt::format("{}: expected a model, found an identification that ended without one: {}: {}",
                                cursor.where(), to_string(file.status), file.message));
  file.sampling_hz = cursor.at("sampling_hz").number({.low = std::numeric_limits<double>::min()});
  std::vector<double> offsets;
  // Files without offsets and delays have none.
  read_channels(cursor.at("inputs"), file.inputs, file.u_scale, file.envelope.u, [&](const JsonCursor& item) {
    offsets.push_back(item.number("offset", 0.0));
    file.delay.push_back(item.integer("delay_samples", 0, 0, 1000000));
  });
  file.u_offset = Eigen::Map<const Vector>(offsets.data(), static_cast<Index>(offsets.size()));
  std::vector<double> low, high;
  bool limited = false;
  read_channels(cursor.at("outputs"), file.outputs, file.y_scale, file.envelope.y, [&](const JsonCursor& item) {
    const auto [lowest, highest] = read_limits(item);
    limited = limited || std::isfinite(lowest) || std::isfinite(highest);
    low.push_back(lowest);
    high.push_back(highest);
  });
  if (limited)
    file.limits = {Eigen::Map<const Vector>(low.data(), file.y_scale.size()),
                   Eigen::Map<const Vector>(high.data(), file.y_scale.size())};
  file.model.limits = over(file.limits, file.y_scale);
  const auto m = static_cast<Index>(file.inputs.size()), p = static_cast<Index>(file.outputs.size());
  const Index n = cursor.at("order").integer(1, 1000), q = cursor.at("nonlinearities").integer(0, 1000);
  LinearModel& linear = file.model.linear;
  linear.A = read_matrix(cursor.at("A"), n, n);
  linear.B = read_matrix(cursor.at("B"), n, m);
  file.model.Bt = read_matrix(cursor.at("Bt"), n, q);
  linear.C = read_matrix(cursor.at("C"), p, n);
  linear.D = read_matrix(cursor.at("D"), p, m);
  file.model.Dt = read_matrix(cursor.at("Dt"), p, q);
  linear.y0 = read_vector(cursor.at("y0"), p);
  file.x0 = read_vector(cursor.at("x0"), n);
  if (const auto states = cursor.find("states"); states && !states->raw().is_null())
    file.states = read_states(*states, n, p);
  const JsonCursor map = cursor.at("map");
  if (map.raw().is_null() != (q == 0)) map.fail(q == 0 ? "null, as there is no nonlinearity" : "a static map");
  if (q > 0) file.model.map = restore(map, n + m, q);
  file.envelope.f = read_extremes(cursor.at("f_training_range"), q);
  if (const auto uncertainty = cursor.find("uncertainty")) file.uncertainty = uncertainty->raw();
  file.scores = cursor.at("scores").raw();
  file.config = cursor.at("config").raw();
  file.provenance = cursor.at("provenance").raw();
  cursor.done();
  return file;
}

ModelFile load_model(const std::filesystem::path& file, const RestoreMap& restore) {
  return parse_model(JsonCursor::load(file), restore);
}

Matrix acting_inputs(const ModelFile& file, ConstMatrixRef u) {
  Matrix acting = u;
  if (file.u_offset.size() > 0) acting.colwise() -= file.u_offset;
  acting = file.u_scale.cwiseInverse().asDiagonal() * acting;
  for (std::size_t i = 0; i < file.delay.size(); ++i) {
    const Index late = std::min(file.delay[i], u.cols() - 1);
    if (late <= 0) continue;
    auto row = acting.row(static_cast<Index>(i));
    const Matrix on_time = row;
    row.rightCols(u.cols() - late) = on_time.leftCols(u.cols() - late);
    row.leftCols(late).setConstant(on_time(0, 0));
  }
  return acting;
}

Index longest_delay(const ModelFile& file) {
  return file.delay.empty() ? 0 : *std::max_element(file.delay.begin(), file.delay.end());
}

FreeRun free_run(const ModelFile& file, ConstMatrixRef u, ConstVectorRef x0) {
  FreeRun run = free_run(file.model, acting_inputs(file, u), x0);
  run.y = file.y_scale.asDiagonal() * run.y;
  return run;
}

std::vector<Excess> beyond_envelope(const ModelFile& file, ConstMatrixRef u, ConstMatrixRef y, ConstMatrixRef f) {
  std::vector<Excess> result;
  const auto look = [&](ConstMatrixRef rows, const Extremes& range, const auto& channel) {
    for (Index i = 0; i < rows.rows(); ++i) {
      const double width = range.high(i) - range.low(i), margin = 1e-9 * width;
      Excess excess;
      for (Index k = 0; k < rows.cols(); ++k) {
        const double distance = std::max(range.low(i) - rows(i, k), rows(i, k) - range.high(i));
        if (!(distance > margin)) continue;
        ++excess.samples;
        excess.distance = std::max(excess.distance, distance);
      }
      if (excess.samples == 0) continue;
      const Channel named = channel(i);
      excess.channel = named.name;
      excess.unit = named.unit;
      excess.share = width > 0 ? excess.distance / width : std::numeric_limits<double>::infinity();
      result.push_back(std::move(excess));
    }
  };
  look(u, file.envelope.u, [&](Index i) { return file.inputs[static_cast<std::size_t>(i)]; });
  look(y, file.envelope.y, [&](Index i) { return file.outputs[static_cast<std::size_t>(i)]; });
  look(f, file.envelope.f, [](Index i) { return Channel{fmt::format("f_{}", i + 1), ""}; });
  return result;
}

}  // namespace wheelhop
