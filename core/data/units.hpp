/// \file
/// Units as they are written in the heads of files, and the numbers between them.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace wheelhop {

/// A unit of measurement: `factor` times a product of powers of m, kg, s, A and rad.
struct Unit {
  double factor = 1;
  std::array<int, 5> powers = {};  ///< of m, kg, s, A, rad
};

/// Reads a unit: a symbol of the table with an SI prefix where that is usual, or products, quotients and powers of
/// them: "mm", "m/s^2", "m/s²", "m/s2", "m s^-2", "m/s/s", "g" (of gravity: 9.80665 m/s^2), "in", "inch", "deg", "°",
/// "N", "kN", "lbf", "mV", "rad/s", "km/h". "-", "1" and "%" are numbers. Superscripts, the degree sign and the micro
/// sign are known in UTF-8 and in Latin-1. Brackets around the whole do not matter. None if it is no unit that is
/// known.
std::optional<Unit> find_unit(std::string_view text);

/// What unit conversion does to a number: value = factor * number.
/// @return factor from one to the other; none if the dimensions differ
std::optional<double> conversion_factor(const Unit& from, const Unit& to);

/// Quotient of two units, for sensitivities ("mV/g").
Unit operator/(const Unit& a, const Unit& b);

/// A sensitivity as data sheets give it, "100 mV/g": what one unit of the quantity reads. None if it is not a number >
/// 0 and a known unit.
std::optional<Unit> find_sensitivity(std::string_view text);

/// "m, mm, um, ..., rad, deg": spellings for messages.
std::string known_units();

}  // namespace wheelhop
