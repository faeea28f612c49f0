/// \file
/// Constitutive laws: the force of one element as a function of its relative travel x, its rate v and, for a law with
/// memory, of internal states z with z' = g(x, v, z).
/// A law is plain data (a kind and its parameter values), so that plants copy cheaply and a fit can move any parameter
/// by name. Adding one is one file in core/plant/laws and its name in the list of laws.cpp.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/json.hpp"
#include "core/plant/lanes.hpp"

namespace wheelhop {

/// Tolerance (relative standard deviation) of a value for which the plant file gives none.
inline constexpr double default_tolerance = 0.05;

/// One parameter of a law as it stands in the plant file.
struct LawParameter {
  std::string name;  ///< key in the plant file, unit included
  std::string unit;
  std::string meaning;
  Range range = {};      ///< admissible in a file, and in a fit
  bool required = true;  ///< otherwise `fallback` where the key is absent
  double fallback = 0;   ///< infinity stands for "none" and is not written to files
  bool is_list = false;  ///< an array of numbers; only as the single parameter of a law
  double typical = 0;    ///< usual size in a passenger car's corner, where a fit may start; 0 where none is given
};

inline constexpr int max_law_states = 2;

/// Derivatives of force and state rates of a law with memory; entry (i, j) of dz_dz at max_law_states * i + j.
struct MemorySlopes {
  double df_dx = 0, df_dv = 0;
  std::array<double, max_law_states> df_dz = {}, dz_dx = {}, dz_dv = {};
  std::array<double, max_law_states* max_law_states> dz_dz = {};
};

/// The functions of a law with internal states z. Convention: at z = 0 the memory is at rest at every constant travel,
/// it then stays at 0, and the law gives no force unless the element moves. So the static equilibrium of a plant is
/// that of its laws without memory.
struct LawMemory {
  int states = 0;  ///< how many, at most `max_law_states`; 0 for a law without memory
  /// Force f [N] and rates z' [1/s times the state]; false outside the domain.
  bool (*force)(std::span<const double> p, double x, double v, const double* z, double& f, double* z_rate) = nullptr;
  bool (*slopes)(std::span<const double> p, double x, double v, const double* z, MemorySlopes& slopes) = nullptr;
  /// What a step dx of the travel does to the states, where it is known in closed form: a held drive moves in steps.
  /// Without it the step counts as the velocity of the interval that follows.
  void (*jump)(std::span<const double> p, double dx, double* z) = nullptr;
  /// Stored energy [J] of the states alone, nullptr if they store none, and the power turned into heat [W]:
  /// force * v = energy' + dissipation.
  double (*energy)(std::span<const double> p, const double* z) = nullptr;
  double (*dissipation)(std::span<const double> p, double x, double v, const double* z) = nullptr;
};

/// What a law does in its element; but for the first two, to the other laws there instead of adding a force.
enum class LawRole {
  force,      ///< adds its force to that of the others
  inertance,  ///< value 0 goes with the masses: beside the others it resists the acceleration of the element's travel
  play,       ///< value 0 is a gap: the others read the travel that is left beyond it on either side
  contact,    ///< value 0 is a preload: the sum of the others pulls with that force at most
  offset      ///< value 0 is a shift: the others read the travel beyond it and count their force from there
};

/// What is common to all laws of one name. `p` holds the values in the order of `parameters`.
struct LawKind {
  /// Of a law that acts through its role or its memory alone.
  static bool no_force(std::span<const double>, double, double, double& f) {
    f = 0;
    return true;
  }
  static bool no_slopes(std::span<const double>, double, double, double& df_dx, double& df_dv) {
    df_dx = df_dv = 0;
    return true;
  }

  std::string name;
  std::string equation;
  std::string source;
  std::vector<LawParameter> parameters;
  /// Force f [N] at travel x [m] and rate v [m/s]; false outside the domain of the law, f is then undefined.
  bool (*force)(std::span<const double> p, double x, double v, double& f) = no_force;
  /// The same for four simulations at once, `p` with a value of each; nullptr: one after the other.
  LaneMask (*force_of_lanes)(const Lanes* p, Lanes x, Lanes v, Lanes& f) = nullptr;
  /// Slopes dF/dx [N/m] and dF/dv [Ns/m]; false outside the domain.
  bool (*slopes)(std::span<const double> p, double x, double v, double& df_dx, double& df_dv) = no_slopes;
  /// dF/dp, one number a value; false outside the domain. nullptr: nobody asks so often that it pays.
  bool (*gradient)(std::span<const double> p, double x, double v, double* df_dp) = nullptr;
  /// Stored energy [J], zero at x = 0; nullptr for a law that stores none.
  double (*energy)(std::span<const double> p, double x) = nullptr;
  /// Power turned into heat [W]; nullptr for a law that turns none.
  double (*dissipation)(std::span<const double> p, double x, double v) = nullptr;
  /// True if F = k x + d v with constant slopes everywhere: such laws of one element are summed before a simulation.
  bool is_linear = false;
  /// Relations between parameters: empty, or what was expected; nullptr where there are none.
  std::string (*check)(std::span<const double> p) = nullptr;
  /// True if the law is the difference between a damper and the viscous one of the same damping: alone it may deliver
  /// energy (`dissipation` is signed), together they do not. Its damping follows that of the damper (set_parameter).
  bool is_correction = false;
  /// True if it is the difference from a spring, likewise: its stiffness follows that of the spring.
  bool corrects_spring = false;
  LawRole role = LawRole::force;
  LawMemory memory = {};  ///< with states, this alone gives the law's force, slopes, energy and dissipation

  /// The parameter that number k of a law's values belongs to: all entries of a list belong to one.
  const LawParameter& parameter_of(std::size_t k) const { return parameters[parameters.front().is_list ? 0 : k]; }
  /// True of a force of the travel alone, which turns nothing into heat.
  bool is_elastic() const {
    return role == LawRole::force && memory.states == 0 && energy != nullptr && dissipation == nullptr;
  }
  /// True of a force that stores nothing: it vanishes at rest, and is one of a damper or corrects one.
  bool is_dissipative() const {
    if (role != LawRole::force) return false;
    return memory.states == 0 ? energy == nullptr && dissipation != nullptr : memory.energy == nullptr;
  }
};

/// How numbers of a law follow a drive of kind "schedule", u: number i is values[i] + slope_i u, as that of a damper
/// whose valve or magnetic field is set from outside.
struct Schedule {
  std::string by;                                      ///< name of the drive; empty: none
  std::vector<std::pair<std::size_t, double>> slopes;  ///< by number of the value, in its unit per unit of the drive
  double tolerance = default_tolerance;                ///< relative standard deviation of the slopes
};

/// One law of an element: its kind and the values of its parameters.
struct Law {
  const LawKind* kind = nullptr;
  std::vector<double> values;
  double tolerance = default_tolerance;  ///< relative standard deviation within which the values are known
  Schedule schedule = {};                ///< with one, `values` are those where the drive is 0

  bool scheduled() const { return !schedule.by.empty(); }
  /// Of a law without memory.
  bool force(double x, double v, double& f) const { return kind->force(values, x, v, f); }
  bool slopes(double x, double v, double& df_dx, double& df_dv) const {
    return kind->slopes(values, x, v, df_dx, df_dv);
  }
  int states() const { return kind->memory.states; }
  double energy(double x) const { return kind->energy ? kind->energy(values, x) : 0; }
  double dissipation(double x, double v) const { return kind->dissipation ? kind->dissipation(values, x, v) : 0; }

  /// Names of the values, in their order; the entries of a list are `NAME_1`, `NAME_2`, ...
  std::vector<std::string> parameter_names() const;
};

/// Fastest decay [1/s] of the internal states of a law that has yielded at rate v [m/s]; 0 for a law without memory.
double decay(const Law& law, double v);

/// All laws, in the order in which they are listed to users.
const std::vector<LawKind>& law_table();
std::vector<std::string> law_names();
/// The law of that name, nullptr if there is none.
const LawKind* find_law(std::string_view name);

/// The optional member `tolerance` of a mass or law, in (0, 1].
double parse_tolerance(const JsonCursor& cursor);
/// Reads `{"law": NAME, PARAMETER: value, ..., "tolerance"?: value, "scheduled"?: {"by": DRIVE, "slopes": {PARAMETER:
/// value, ...}, "tolerance"?: value}}`. UserError on anything else, but any name of a drive.
/// @param rotary the keys are those of what turns, see rotary.hpp
Law parse_law(const JsonCursor& cursor, bool rotary = false);
Json to_json(const Law& law, bool rotary = false);

}  // namespace wheelhop
