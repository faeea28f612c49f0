#include "experiments/sweep/folder.hpp"

#include <fmt/format.h>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "experiments/run/provenance.hpp"

namespace wheelhop {
namespace {

constexpr const char* kSchema = "wheelhop.sweep/2";

std::filesystem::path file_of(const std::filesystem::path& folder) { return folder / "sweep.json"; }

Json read_description(const std::filesystem::path& file) {
  const Json description = parse_json(read_file(file), file.string());
  if (!description.is_object() || description.value("schema", Json()) != kSchema || !description.contains("config") ||
      !description.contains("provenance"))
    throw UserError(
        fmt::format("{}: expected what this build's `wheelhop sweep` writes, schema \"{}\"", file.string(), kSchema));
  return description;
}

void add_differences(const Json& before, const Json& now, const std::string& path, std::vector<std::string>& found) {
  if (found.size() >= 3 || before == now) return;
  if (before.is_object() && now.is_object()) {
    for (const auto& [key, value] : before.items())
      add_differences(value, now.value(key, Json()), path + "." + key, found);
    for (const auto& [key, value] : now.items())
      if (!before.contains(key)) add_differences(Json(), value, path + "." + key, found);
  } else if (before.is_array() && now.is_array() && before.size() == now.size()) {
    for (std::size_t i = 0; i < now.size(); ++i)
      add_differences(before[i], now[i], fmt::format("{}[{}]", path, i), found);
  } else {
    found.push_back(fmt::format("{}: {}, now {}", path, before.dump().substr(0, 80), now.dump().substr(0, 80)));
  }
}

}  // namespace

SweepFolder read_folder(const std::filesystem::path& folder) {
  const std::filesystem::path file = file_of(folder);
  Json description = read_description(file);
  return {read_grid(std::move(description["config"]), file.string()), std::move(description["provenance"])};
}

void claim_folder(const std::filesystem::path& folder, const Grid& grid) {
  require_writable_folder(folder);
  const std::filesystem::path file = file_of(folder);
  const Json own = {{"schema", kSchema}, {"config", grid.config}, {"provenance", provenance()}};
  if (!std::filesystem::exists(file)) {
    write_json(file, own);
    return;
  }
  const std::vector<std::string> differences = list_differences(read_description(file), own, "$");
  if (!differences.empty())
    throw UserError(
        fmt::format("{}: the folder holds rows of another config or build\n  {}\ntake another folder, or remove "
                    "this one to start anew",
                    file.string(), fmt::join(differences, "\n  ")));
}

bool is_row_of(const Grid& grid, const Json& row) {
  const auto text_at = [&](const char* key) { return row.contains(key) && row[key].is_string(); };
  const auto cell = row["cell"].get<std::size_t>();
  const auto realisation = row["realisation"].get<Index>();
  return cell < grid.cells.size() && realisation >= 0 && realisation < grid.most_realisations() && text_at("status") &&
         text_at("message") && text_at("config_hash") && row["config_hash"] == row_hash(grid, cell, realisation);
}

std::vector<std::string> list_differences(const Json& before, const Json& now, const std::string& path) {
  std::vector<std::string> found;
  add_differences(before, now, path, found);
  return found;
}

}  // namespace wheelhop
