/// \file
/// Values of a sweep's rows, paired: the same realisation and the same values of all axes but the one compared.
#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "experiments/run/rows.hpp"
#include "experiments/sweep/grid.hpp"
#include "experiments/sweep/table.hpp"

namespace wheelhop {

struct CompareOptions {
  std::string over;                   ///< axis whose values are compared
  std::vector<std::string> by;        ///< axes that are looked at value by value; the remaining ones are pooled
  std::vector<std::string> metrics;   ///< columns; empty: those the sweep's measure is read by
  std::optional<double> equivalence;  ///< differences up to this are ties; none: 0.1 for a VAF in percent, 0 for others
};

/// Values of one metric at one combination of the axes looked at by value.
struct Pairing {
  std::string metric;
  Better way = Better::larger;
  Json at = Json::object();  ///< value of each axis looked at
  /// By realisation, then by the positions on the pooled axes: a value for each method; NaN where there is no such row,
  /// the worst value there is where the row has none.
  std::map<Index, std::map<std::vector<std::size_t>, std::vector<double>>> values;
};

struct Difference {
  Index realisation = 0;
  double value = 0;  ///< positive: a is better
};

/// By how much method a is better than b, one number a realisation: the median over the pooled cells that both have,
/// because the cells of one realisation share its random numbers and are no independent evidence. Two rows that have no
/// value do not differ.
std::vector<Difference> differences(const Pairing& pairing, std::size_t a, std::size_t b);

/// One row a realisation, one column a method: medians over the pooled cells in which every method has a row.
/// Realisations without such a cell are left out. Smaller is better: values of which larger is better change their
/// sign.
Matrix blocks_by_realisation(const Pairing& pairing, std::size_t methods);

/// The same with one row for every realisation and pooled cell.
Matrix blocks_by_cell(const Pairing& pairing, std::size_t methods);

/// The axis that is compared; the axes that vary together with it are neither looked at nor pooled.
struct PairedAxes {
  std::size_t over = 0;
  std::vector<std::size_t> by, pooled;
};

/// UserError for a name that no axis has, for the compared axis or one that varies with it in `by`, and for a compared
/// axis of one value.
PairedAxes paired_axes(const Grid& grid, const CompareOptions& options);

/// Columns asked for, or those that the measure is read by, of those with a better direction in any row of the first
/// `realisations`. UserError if one asked for is not among them. May be empty if none is asked for.
std::vector<std::string> metrics_of(const Grid& grid, const RowIndex& rows, const CompareOptions& options,
                                    Index realisations = std::numeric_limits<Index>::max());

/// One for each combination of the axes looked at and each metric, from the first `realisations`.
std::vector<Pairing> pair_rows(const Grid& grid, const RowIndex& rows, const PairedAxes& axes,
                               const std::vector<std::string>& metrics,
                               Index realisations = std::numeric_limits<Index>::max());

}  // namespace wheelhop
