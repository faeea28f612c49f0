/// \file
/// The grid of a sweep: a base experiment and axes over any of its options.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/options.hpp"
#include "experiments/experiment/config.hpp"

namespace wheelhop {

/// How far a cell is computed, and so what its rows hold. Each holds what those before it do, but for `solver`.
///   linear      step 1: VAF of the linear model, conditions, correlation of the instruments
///   inversion   steps 2 and 3: R^2 of the nonlinear part of the first pass's f
///   nonlinear   steps 4 and 5, all passes: VAF of the best
///   refined     the joint refinement
///   solver      two problems from the same start: the fit of a map and the joint refinement
enum class Measure { linear, inversion, nonlinear, refined, solver };

/// Their names, in that order.
inline const std::vector<std::string> kMeasures = {"linear", "inversion", "nonlinear", "refined", "solver"};

struct Axis {
  std::string name;
  std::vector<std::string> labels;
  std::vector<Json> values;  ///< as columns of rows hold them: number, true, false or text
  std::size_t group = 0;     ///< axes of one group, a zip, vary together
};

/// One combination of the axes' values.
struct Cell {
  std::vector<std::size_t> at;  ///< position on every axis
  std::string hash;             ///< of the effective config and of what the measure adds to it
  Json beside_base;             ///< members of the effective config that differ from the base's
};

/// Realisations that are added until every paired claim along an axis is decided.
struct Until {
  std::string over;
  Index at_most = 200, batch = 10;
  std::optional<double> equivalence;
  template <class V>
  void fields(V&& visit) {
    visit("over", over, Choices{}, "axis whose values are compared");
    visit("at_most", at_most, Range{1, 1e6}, "-", "realisations, whatever is decided");
    visit("batch", batch, Range{1, 1e6}, "-", "realisations added at once");
    visit("equivalence", equivalence, Range{0}, "-",
          "differences up to this are ties; null: 0.1 for a VAF in percent, 0 for others");
  }
};

/// Members of a sweep's config beside `base`, `axes`, `exclude` and `until`.
struct SweepOptions {
  std::string measure;
  Index realisations = 20, evaluations = 400;
  template <class V>
  void fields(V&& visit) {
    visit("measure", measure, Choices{kMeasures}, "how far a cell is computed");
    visit("realisations", realisations, Range{1, 1e6}, "-", "rows of each cell; with until: of its first batch");
    visit("evaluations", evaluations, Range{1, 1e8}, "-", "budget of each problem under the measure solver");
  }
};

struct Grid {
  Measure measure = Measure::refined;
  Index realisations = 20;  ///< of the first batch, where there is `until`
  Index evaluations = 400;  ///< budget of each problem under Measure::solver
  std::vector<Axis> axes;
  std::vector<Cell> cells;
  std::size_t excluded = 0;  ///< cells that a rule left out
  std::optional<Until> until;
  ExperimentConfig base;
  Json effective;  ///< measure, realisations, axes, effective base
  /// The same grid as a config that names no file; read_grid() of it gives the same cells.
  Json config;

  /// The experiment of a cell, read anew: a grid holds no plants.
  ExperimentConfig config_of(std::size_t cell) const;
  const std::string& label(std::size_t cell, std::size_t axis) const { return axes[axis].labels[cells[cell].at[axis]]; }
  const Json& value(std::size_t cell, std::size_t axis) const { return axes[axis].values[cells[cell].at[axis]]; }
  Index axis_called(const std::string& name) const;  ///< -1: none
  bool vary_together(std::size_t axis, std::size_t other) const { return axes[axis].group == axes[other].group; }
  Index most_realisations() const { return until ? until->at_most : realisations; }

  std::vector<std::vector<Json>> sets;  ///< for every axis and value: object of paths and what they are set to
};

/// Reads
///   {"base": "../paper.json", "measure": "linear", "realisations": 20,
///    "axes": [{"name": "snr_db", "values": [40, 30]},
///             {"name": "method", "values": [{"label": "cva", "set": {"subspace": {"name": "cva"}}}]}],
///    "exclude": [{"snr_db": 30, "method": ["cva"]}],
///    "until": {"over": "method", "at_most": 200}}
/// `base` is the config of an experiment or the file that holds one; `as_printed` in it is passed over. Files are
/// relative to the config that names them. A value of an axis is set at the path that is the axis' name
/// ("pipeline.passes", "plant_parameters.body.mass_kg"), or at every path of its "set". The first axis varies slowest.
/// In place of `values` stand `from`, `to` and `step`, or `from`, `to`, `count` and `spacing` (linear, logarithmic);
/// {"preset": "noise"} is a whole axis (see presets()); {"zip": [AXIS, AXIS]} varies axes of one length together. A
/// rule of `exclude` leaves out the cells that have one of its values on every axis it names. UserError with file and
/// JSON path for every mistake, also for a cell whose config does not fit.
Grid read_grid(const std::filesystem::path& file);
/// @param source stands for the file in messages
Grid read_grid(Json config, const std::string& source, const std::filesystem::path& directory = {});

/// Names of the axes that need no values, with what they are.
std::vector<std::pair<std::string, std::string>> presets();

/// FNV-1a, 64 bits (Fowler, Noll & Vo), as 16 hexadecimal digits.
std::string hash_of(const std::string& text);

/// The hash that stands in a row.
std::string row_hash(const Grid& grid, std::size_t cell, Index realisation);

}  // namespace wheelhop
