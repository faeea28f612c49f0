#include "experiments/compare/pairing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/status.hpp"
#include "experiments/compare/statistics.hpp"

namespace wheelhop {
namespace {

bool holds(const std::vector<std::size_t>& list, std::size_t one) {
  return std::find(list.begin(), list.end(), one) != list.end();
}

bool is_complete(const std::vector<double>& row) {
  return std::none_of(row.begin(), row.end(), [](double v) { return std::isnan(v); });
}

Matrix rows_to_matrix(const std::vector<std::vector<double>>& rows, std::size_t methods, Better way) {
  Matrix values(static_cast<Index>(rows.size()), static_cast<Index>(methods));
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (std::size_t j = 0; j < methods; ++j)
      values(static_cast<Index>(i), static_cast<Index>(j)) = way == Better::larger ? -rows[i][j] : rows[i][j];
  return values;
}

}  // namespace

std::vector<Difference> differences(const Pairing& pairing, std::size_t a, std::size_t b) {
  std::vector<Difference> all;
  for (const auto& [realisation, cells] : pairing.values) {
    std::vector<double> own;
    for (const auto& [cell, row] : cells) {
      if (std::isnan(row[a]) || std::isnan(row[b])) continue;
      const double difference = row[a] == row[b] ? 0 : row[a] - row[b];  // both may be infinite
      own.push_back(pairing.way == Better::larger ? difference : -difference);
    }
    if (!own.empty()) all.push_back({realisation, median(std::move(own))});
  }
  return all;
}

Matrix blocks_by_realisation(const Pairing& pairing, std::size_t methods) {
  std::vector<std::vector<double>> rows;
  for (const auto& [realisation, cells] : pairing.values) {
    std::vector<std::vector<double>> own(methods);
    for (const auto& [cell, row] : cells)
      if (is_complete(row))
        for (std::size_t j = 0; j < methods; ++j) own[j].push_back(row[j]);
    if (own.front().empty()) continue;
    rows.emplace_back();
    for (std::vector<double>& values : own) rows.back().push_back(median(std::move(values)));
  }
  return rows_to_matrix(rows, methods, pairing.way);
}

Matrix blocks_by_cell(const Pairing& pairing, std::size_t methods) {
  std::vector<std::vector<double>> rows;
  for (const auto& [realisation, cells] : pairing.values)
    for (const auto& [cell, row] : cells)
      if (is_complete(row)) rows.push_back(row);
  return rows_to_matrix(rows, methods, pairing.way);
}

PairedAxes paired_axes(const Grid& grid, const CompareOptions& options) {
  std::vector<std::string> names;
  for (const Axis& axis : grid.axes) names.push_back(axis.name);
  const auto find = [&](const std::string& name, const char* option) {
    const Index at = grid.axis_called(name);
    if (at < 0) throw UserError(fmt::format("{}: no axis is called \"{}\"; axes: {}", option, name, join_names(names)));
    return static_cast<std::size_t>(at);
  };
  PairedAxes axes{find(options.over, "--over"), {}, {}};
  if (grid.axes[axes.over].labels.size() < 2)
    throw UserError(fmt::format("--over: the axis \"{}\" has one value, nothing is to compare", options.over));
  for (const std::string& name : options.by) {
    axes.by.push_back(find(name, "--by"));
    if (axes.by.back() == axes.over) throw UserError("--by: \"" + name + "\" is the axis that is compared");
    if (grid.vary_together(axes.by.back(), axes.over))
      throw UserError(fmt::format("--by: \"{}\" varies together with \"{}\", which is compared", name, options.over));
  }
  for (std::size_t i = 0; i < grid.axes.size(); ++i)
    if (!grid.vary_together(i, axes.over) && !holds(axes.by, i)) axes.pooled.push_back(i);
  return axes;
}

std::vector<std::string> metrics_of(const Grid& grid, const RowIndex& rows, const CompareOptions& options,
                                    Index realisations) {
  std::vector<std::string> known;
  rows.for_each([&](const RowKey& key, const std::string& line) {
    if (key.realisation >= realisations) return;
    const Json row = parse_json(line, "row");
    for (const auto& [column, value] : row.items())
      if (better(column) != Better::neither && grid.axis_called(column) < 0 &&
          std::find(known.begin(), known.end(), column) == known.end())
        known.push_back(column);
  });
  std::vector<std::string> metrics;
  for (const std::string& wanted : options.metrics) {
    if (std::find(known.begin(), known.end(), wanted) == known.end())
      throw UserError(
          fmt::format("--metric: \"{}\" is no column with a better direction; those: {}", wanted, join_names(known)));
    metrics.push_back(wanted);
  }
  if (metrics.empty())
    std::copy_if(known.begin(), known.end(), std::back_inserter(metrics),
                 [&](const std::string& column) { return is_headline(grid.measure, column); });
  return metrics;
}

std::vector<Pairing> pair_rows(const Grid& grid, const RowIndex& rows, const PairedAxes& axes,
                               const std::vector<std::string>& metrics, Index realisations) {
  const std::size_t methods = grid.axes[axes.over].labels.size();
  std::map<std::vector<std::size_t>, std::vector<Pairing>> by_context;
  rows.for_each([&](const RowKey& key, const std::string& line) {
    if (key.realisation >= realisations) return;
    const Cell& cell = grid.cells[key.cell];
    std::vector<std::size_t> context, pooled;
    for (const std::size_t axis : axes.by) context.push_back(cell.at[axis]);
    for (const std::size_t axis : axes.pooled) pooled.push_back(cell.at[axis]);
    std::vector<Pairing>& own = by_context[context];
    if (own.empty())
      for (const std::string& metric : metrics) {
        own.push_back({metric, better(metric), Json::object(), {}});
        for (const std::size_t axis : axes.by) own.back().at[grid.axes[axis].name] = grid.value(key.cell, axis);
      }
    const Json row = parse_json(line, "row");
    for (Pairing& one : own) {
      std::vector<double>& values = one.values[key.realisation][pooled];
      values.resize(methods, std::numeric_limits<double>::quiet_NaN());
      const bool has = row.contains(one.metric) && row[one.metric].is_number();
      values[cell.at[axes.over]] = has ? row[one.metric].get<double>() : worst(one.way);
    }
  });
  std::vector<Pairing> all;
  for (auto& [context, own] : by_context) std::move(own.begin(), own.end(), std::back_inserter(all));
  return all;
}

}  // namespace wheelhop
