/// \file
/// Constitutive laws: the force of one element as a function of its relative travel x and its rate v.
/// A law is plain data (a kind and its parameter values), so that plants copy cheaply and a fit can move any parameter
/// by name. Adding one is one file in core/plant/laws and its name in the list of laws.cpp.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/json.hpp"

namespace wheelhop {

/// Tolerance (relative standard deviation) of a value for which the plant file gives none.
inline constexpr double default_tolerance = 0.05;

/// One parameter of a law as it stands in the plant file.
struct LawParameter {
  std::string name;  ///< key in the plant file, unit included
  std::string unit;
  std::string meaning;
  Range range = {};      ///< admissible in a file; a fit may move beyond
  bool required = true;  ///< otherwise `fallback` where the key is absent
  double fallback = 0;   ///< infinity stands for "none" and is not written to files
  bool is_list = false;  ///< an array of numbers; only as the single parameter of a law
};

/// What is common to all laws of one name. `p` holds the values in the order of `parameters`.
struct LawKind {
  std::string name;
  std::string equation;
  std::string source;
  std::vector<LawParameter> parameters;
  /// Force f [N] at travel x [m] and rate v [m/s]; false outside the domain of the law, f is then undefined.
  bool (*force)(std::span<const double> p, double x, double v, double& f);
  /// Slopes dF/dx [N/m] and dF/dv [Ns/m]; false outside the domain.
  bool (*slopes)(std::span<const double> p, double x, double v, double& df_dx, double& df_dv);
  /// Stored energy [J], zero at x = 0; nullptr for a law that stores none.
  double (*energy)(std::span<const double> p, double x);
  /// Power turned into heat [W]; nullptr for a law that turns none.
  double (*dissipation)(std::span<const double> p, double x, double v);
  /// True if F = k x + d v with constant slopes everywhere: such laws of one element are summed before a simulation.
  bool is_linear = false;
  /// Relations between parameters: empty, or what was expected; nullptr where there are none.
  std::string (*check)(std::span<const double> p);
};

/// One law of an element: its kind and the values of its parameters.
struct Law {
  const LawKind* kind = nullptr;
  std::vector<double> values;
  double tolerance = default_tolerance;  ///< relative standard deviation within which the values are known

  bool force(double x, double v, double& f) const { return kind->force(values, x, v, f); }
  bool slopes(double x, double v, double& df_dx, double& df_dv) const {
    return kind->slopes(values, x, v, df_dx, df_dv);
  }
  double energy(double x) const { return kind->energy ? kind->energy(values, x) : 0; }
  double dissipation(double x, double v) const { return kind->dissipation ? kind->dissipation(values, x, v) : 0; }

  /// Names of the values, in their order; the entries of a list are `NAME_1`, `NAME_2`, ...
  std::vector<std::string> parameter_names() const;
};

/// All laws, in the order in which they are listed to users.
const std::vector<LawKind>& law_table();
std::vector<std::string> law_names();
/// The law of that name, nullptr if there is none.
const LawKind* find_law(std::string_view name);

/// The optional member `tolerance` of a mass or law, in (0, 1].
double parse_tolerance(const JsonCursor& cursor);
/// Reads `{"law": NAME, PARAMETER: value, ..., "tolerance"?: value}`. UserError on anything else.
Law parse_law(const JsonCursor& cursor);
Json to_json(const Law& law);

}  // namespace wheelhop
