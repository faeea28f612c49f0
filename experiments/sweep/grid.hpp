/// \file
/// The grid of a sweep: a base experiment and axes over any of its options.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "experiments/reproduce_study.hpp"

namespace wheelhop {

/// How far a cell is computed, and so what its rows hold. Each holds what those before it do, but for `solver`.
///   linear      step 1: VAF of the linear model, conditions, correlation of the instruments
///   inversion   steps 2 and 3: R^2 of the nonlinear part of the first pass's f
///   nonlinear   steps 4 and 5, all passes: VAF of the best
///   refined     the joint refinement
///   solver      two problems from the same start: the fit of a map and the joint refinement
enum class Measure { linear, inversion, nonlinear, refined, solver };

struct Axis {
  std::string name;
  std::vector<std::string> labels;
};

/// One combination of the axes' values.
struct Cell {
  std::vector<std::string> labels;  ///< one an axis
  ReproduceConfig config;
  std::string hash;  ///< of the cell's effective config and of the grid it stands in
};

struct Grid {
  Measure measure = Measure::refined;
  Index realisations = 20;
  Index evaluations = 400;  ///< budget of each problem under Measure::solver
  std::vector<Axis> axes;
  std::vector<Cell> cells;
  ReproduceConfig base;  ///< whose pieces prepare the starts under Measure::solver
  Json effective;        ///< measure, realisations, axes, effective base
};

/// Reads
///   {"base": "../paper.json", "measure": "linear", "realisations": 20,
///    "axes": [{"name": "snr_db", "values": [40, 30]},
///             {"name": "method", "values": [{"label": "cva", "set": {"subspace": {"name": "cva"}}}]}]}
/// `base` is a config of `wheelhop reproduce`; files it or an axis names are relative to it. A value of an axis is set
/// at the path that is the axis' name ("pipeline.passes"), or at every path of its "set". The first axis varies
/// slowest. UserError with file and JSON path for every mistake, also for a cell whose config does not fit.
Grid read_grid(const std::filesystem::path& file);

}  // namespace wheelhop
