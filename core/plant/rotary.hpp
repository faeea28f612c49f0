/// \file
/// Parts of a plant that turn. The equations are those of what slides, with an angle [rad] for a displacement, a moment
/// of inertia [kg m^2] for a mass and a torque [N m] for a force; only names and units differ. The program counts in
/// the names of what slides, and plant files and results of what turns are written in their own: `inertia_kg_m2`,
/// `stiffness_nm_per_rad`, `torque`.
///
/// A mass turns where its file gives `inertia_kg_m2` in place of `mass_kg`, an input where its kind is `angle` or
/// `torque`, a sensor by its kind `angle`, `angular_velocity`, `angular_acceleration` or `torque`. A point turns where
/// all masses that carry it do, unless it says `"unit": "m"`: then its weights are in m/rad, as of a rack on a pinion.
#pragma once

#include <string>
#include <string_view>

#include "core/base/place.hpp"
#include "core/plant/plant.hpp"

namespace wheelhop {

/// The key of a law, mass or load as it is of what turns: "stiffness_n_per_m" is "stiffness_nm_per_rad", "mass_kg"
/// "inertia_kg_m2", "force_n" "torque_nm". Keys without length, force or mass stay as they are.
std::string rotary_name(std::string_view name);

/// True of a mass, point or displacement input that turns; false of the ground.
bool is_rotary(const Plant& plant, const std::string& node);
/// True of an element one of whose ends turns; both do, or the other is the ground.
bool is_rotary(const Plant& plant, const Element& element);
/// Unit of a force at a place that elements, guides and masses have: "N", or "N m".
std::string force_unit(const Plant& plant, const Place& location);

/// Unit of "ELEMENT.travel" or "ELEMENT.velocity": m or m/s, rad or rad/s.
std::string motion_unit(const Plant& plant, const std::string& variable);

/// A parameter's name as users read it: "motor.mass_kg" of a rotary mass is "motor.inertia_kg_m2".
/// @param parameter of plant_parameters(); any other text comes back as it is
std::string shown_name(const Plant& plant, const std::string& parameter);

}  // namespace wheelhop
