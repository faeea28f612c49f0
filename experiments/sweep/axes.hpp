/// \file
/// Axes of a sweep as its config writes them.
#pragma once

#include <string>
#include <vector>

#include "core/base/json.hpp"

namespace wheelhop {

/// One value of an axis.
struct AxisValue {
  std::string label;
  Json column;  ///< what a row holds: number, true, false or text
  Json set;     ///< object of paths and values
};

struct AxisSpec {
  std::string name;
  std::vector<AxisValue> values;
};

/// Axes that vary together, all of one length.
using AxisGroup = std::vector<AxisSpec>;

/// Most cells a sweep may have.
inline constexpr std::size_t kMostCells = 100000;

/// The member `axes` of a sweep's config. UserError with JSON path for every mistake: no axis, no value, a name or
/// label twice, a name that is a column of the results, axes of a zip of different lengths, too many cells.
std::vector<AxisGroup> read_axes(const JsonCursor& list);

/// The same axes as JSON that names no file and no preset.
Json write_axes(const std::vector<AxisGroup>& groups);

/// Sets config[a][b] for the path "a.b"; what follows "plant_parameters." is one key. Objects are made where they are
/// missing. UserError that begins with `where` if the path leads through something else.
void set_path(Json& config, const std::string& path, const Json& value, const std::string& where);

}  // namespace wheelhop
