#include "experiments/run/input_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <system_error>

#include "core/plant/dataset.hpp"

namespace wheelhop {
namespace {

namespace fs = std::filesystem;

constexpr double kLeastSquare = std::numeric_limits<double>::min();

std::string place_of_record(const RecordSet& set, std::size_t index, const fs::path& file) {
  return fmt::format("{}: $.records[{}] ({})", file.string(), index, set.records[index].file);
}

void require_squares(ConstMatrixRef rows, const std::vector<Channel>& channels, const Record& record,
                     const std::string& where) {
  for (Index i = 0; i < rows.rows(); ++i) {
    Index largest = 0;
    const double peak = rows.row(i).cwiseAbs().maxCoeff(&largest), power = rows.row(i).squaredNorm();
    if (peak == 0 || (power >= kLeastSquare && std::isfinite(power))) continue;
    throw UserError(
        fmt::format("{}: expected values whose squares are numbers, found {:g} in \"{}\" ({}); is its unit what it "
                    "should be?",
                    where, rows(i, largest), channels[static_cast<std::size_t>(i)].name, record.place(largest)));
  }
}

/// Largest RMS of a channel over the records, 0 if none holds it.
double level_of(const RecordSet& set, const std::string& channel) {
  double level = 0;
  const auto add = [&](ConstMatrixRef rows, const std::vector<Channel>& channels) {
    for (std::size_t i = 0; i < channels.size(); ++i)
      if (channels[i].name == channel)
        level = std::max(level, rows.row(static_cast<Index>(i)).norm() / std::sqrt(static_cast<double>(rows.cols())));
  };
  for (const Record& record : set.records) {
    add(record.signal.u, record.signal.inputs);
    add(record.signal.y, record.signal.outputs);
  }
  return level;
}

void require_noise(const RecordSet& set, const fs::path& file) {
  for (const auto& [channel, std] : set.noise_std) {
    const double level = level_of(set, channel), least = std::numeric_limits<double>::epsilon() * level;
    if (std * std >= kLeastSquare && std::isfinite(std * std) && std >= least) continue;
    throw UserError(fmt::format(
        "{}: $.noise_std.{}: expected the standard deviation of a measurement{}, found {:g}", file.string(), channel,
        level > 0 ? fmt::format(", {:.2g} or more where the channel has {:g} (RMS)", least, level) : "", std));
  }
}

/// Whether two records share samples: of one file, or number by number.
bool share_samples(const Record& a, const Record& b, const fs::path& folder) {
  std::error_code error;
  if (fs::equivalent(folder / a.file, folder / b.file, error) && !error && a.first < b.file_end() &&
      b.first < a.file_end())
    return true;
  return a.signal.y.rows() > 0 && a.signal.u.cols() == b.signal.u.cols() && a.signal.u == b.signal.u &&
         a.signal.y == b.signal.y;
}

}  // namespace

Plant require_acting_inputs(Plant plant, const std::string& where) {
  if (plant.inputs.empty())
    throw UserError(fmt::format("{}.inputs: expected at least one input, found an array of 0", where));
  for (std::size_t i = 0; i < plant.inputs.size(); ++i) {
    const PlantInput& input = plant.inputs[i];
    const bool touched = std::any_of(plant.elements.begin(), plant.elements.end(), [&](const Element& element) {
      return element.from == input.name || element.to == input.name;
    });
    const bool followed = std::any_of(plant.elements.begin(), plant.elements.end(), [&](const Element& element) {
      return std::any_of(element.laws.begin(), element.laws.end(),
                         [&](const Law& law) { return law.schedule.by == input.name; });
    });
    if (input.kind == InputKind::schedule && !followed)
      throw UserError(
          fmt::format("{}.inputs[{}]: expected a law that follows \"{}\" (\"scheduled\": {{\"by\": \"{}\", \"slopes\": "
                      "...}}), found "
                      "none: this drive would change nothing",
                      where, i, input.name, input.name));
    if (input.kind == InputKind::displacement && !touched)
      throw UserError(fmt::format(
          "{}.inputs[{}]: expected an element between \"{}\" and the plant, found none: this drive would move nothing",
          where, i, input.name));
  }
  return plant;
}

Plant load_plant_of_records(const fs::path& file) {
  Plant plant = load_plant(file);
  return plant.inputs.empty() ? plant : require_acting_inputs(std::move(plant), file.string() + ": $");
}

Plant load_acting_plant(const fs::path& file) { return require_acting_inputs(load_plant(file), file.string() + ": $"); }

void require_sound_records(const RecordSet& set, const fs::path& file) {
  for (std::size_t i = 0; i < set.records.size(); ++i) {
    const Record& record = set.records[i];
    const std::string where = place_of_record(set, i, file);
    require_squares(record.signal.u, record.signal.inputs, record, where);
    require_squares(record.signal.y, record.signal.outputs, record, where);
  }
  require_noise(set, file);
}

void require_hold_rate(const Plant& plant, const RecordSet& set, const fs::path& file) {
  try {
    hold_samples_per_record_sample(plant, set.sampling_hz);
  } catch (const UserError& error) {
    throw UserError(fmt::format("{}: $.sampling_hz: {}", file.string(), error.what()));
  }
}

UserError placed_in_records(const UserError& error, const RecordSet& set, const fs::path& file) {
  const std::string_view what = error.what();
  // A message begins with the name of its record, if it is about one; a longer name may begin with a shorter one.
  std::size_t best = set.records.size();
  for (std::size_t i = 0; i < set.records.size(); ++i)
    if (what.starts_with(set.records[i].file) &&
        (best == set.records.size() || set.records[i].file.size() > set.records[best].file.size()))
      best = i;
  if (best < set.records.size()) return UserError(fmt::format("{}: $.records[{}]: {}", file.string(), best, what));
  constexpr std::string_view noise = "noise_std: ";
  if (what.starts_with(noise))
    return UserError(fmt::format("{}: $.noise_std: {}", file.string(), what.substr(noise.size())));
  return UserError(fmt::format("{}: $.records: {}", file.string(), what));
}

void require_held_out(const RecordSet& set, const fs::path& file) {
  const fs::path folder = file.parent_path();
  for (std::size_t i = 0; i < set.records.size(); ++i) {
    const Record& record = set.records[i];
    if (record.role != "validation") continue;
    for (std::size_t j = 0; j < set.records.size(); ++j)
      if (set.records[j].role == "estimation" && share_samples(record, set.records[j], folder))
        throw UserError(
            fmt::format("{}: expected a record for validation that is not fitted, found samples of $.records[{}] ({}), "
                        "which is for "
                        "estimation; take another one, or another range",
                        place_of_record(set, i, file), j, set.records[j].file));
  }
}

}  // namespace wheelhop
