/// \file
/// The plant: a graph of lumped elements (masses, displacement and force inputs, laws between nodes, constant loads,
/// sensors), as read from a plant file. Nodes are the masses, the displacement inputs, `ground`, and rigid points,
/// numbered in this order.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/json.hpp"
#include "core/base/place.hpp"
#include "core/data/signal.hpp"
#include "core/plant/laws.hpp"
#include "core/plant/paths.hpp"

namespace wheelhop {

struct Mass {
  std::string name;
  double mass_kg = 0;
  double tolerance = default_tolerance;
  bool rotary = false;  ///< it turns, and the number is a moment of inertia [kg m^2], see rotary.hpp
};

/// A massless point that masses carry rigidly: its displacement is a fixed combination of theirs, sum of weight x_mass,
/// and a force on it acts on each of them times its weight (principle of virtual work). With it a rigid body is a set
/// of masses: a car body in heave, pitch and roll is three, its corners are points. Optional in a plant file:
/// `"points": [{"name": "corner", "weights": {"front": 0.5, "rear": 0.5}}]`.
struct Point {
  std::string name;
  std::vector<std::pair<std::string, double>> weights;  ///< by mass
  bool rotary = false;                                  ///< it turns
};

/// What a drive does: moves a node, pushes masses, accelerates the ground, as a shaking table does, or sets numbers of
/// laws and moves nothing itself, as the voltage of an adjustable damper (`Schedule`). All
/// displacements and velocities are relative to the ground; where it accelerates, each mass feels -m u, as in an
/// earthquake: M a + D v + K q = -M r u, r = 1, and 0 of a mass that `turns`. A. K. Chopra, Dynamics of Structures,
/// 4th ed., section 1.7.
enum class InputKind { displacement, force, acceleration, schedule };

struct PlantInput {
  std::string name;
  InputKind kind = InputKind::displacement;
  std::string unit;  ///< "m", "N" or "m/s^2"; "rad" or "N m" of what turns; any of a schedule
  /// Samples of the drive a second, between which it is held (ZOH). Of a drive that is not held this is the rate of the
  /// samples that it runs through smoothly; a plant file does not give it, `with_drive_rate` finds it for records.
  double hold_hz = 0;
  /// Between the samples of a slower record: band_limited, zoh, linear. Of a schedule a plant file need not say it
  /// where it is zoh (held), or linear.
  std::string interpolation = "band_limited";
  /// A force acts as -u on the first and +u on the second node; ("ground", mass) for a force `on` a mass.
  std::string from, to;
  DrivePath path = {};  ///< from the command to what the plant feels
  bool held = true;     ///< false of a measured drive, which was never held
  /// Element in which a force acts, as a law of it would: its force sensors read -u beside its laws. Empty: beside the
  /// elements. Not in plant files; for a force that stands for an unknown law.
  std::string inside = {};
  /// Of a plant without drives, as in a free decay: a force that is always zero, of which there are no readings. Not in
  /// plant files.
  bool silent = false;
  Range range = {};  ///< of a schedule: the values that it may take, between which all laws are inside their own ranges

  bool moves() const { return kind != InputKind::schedule; }  ///< the plant; a schedule moves nothing itself
};

struct Element {
  std::string name;
  std::string from, to;   ///< `between [from, to]`: travel = x_to - x_from, a positive force pulls `to` toward `from`
  std::vector<Law> laws;  ///< in parallel, at least one
};

/// A constant force on a mass or point, as weight or a preload. Positive pushes it toward larger displacements.
/// Optional in a plant file: `"loads": [{"name": "gravity", "on": "body", "force_n": -2450, "tolerance": 0.01}]`.
struct Load {
  std::string name;
  std::string on;
  double force_n = 0;
  double tolerance = default_tolerance;  ///< relative standard deviation of the force
};

enum class SensorKind { displacement, velocity, acceleration, force };

/// A force sensor, `{"name": "cell", "kind": "force", "element": "damper", "unit": "N"}`, reads the force of an
/// element: the sum of all its laws, inerters, clearance and contact included. It is positive where the element pulls
/// the second node of its `between` toward the first, as a stretched spring does: k travel + d rate.
struct Sensor {
  std::string name;
  SensorKind kind = SensorKind::displacement;
  /// Reads x_to - x_from; from = "ground" for a sensor `of` a mass. Empty for a force. An accelerometer reads absolute
  /// accelerations, also where the ground accelerates.
  std::string from, to;
  std::string unit;          ///< "m", "m/s", "m/s^2" or "N"; "rad", "rad/s", "rad/s^2" or "N m" of what turns
  SensorPath path = {};      ///< from the ideal reading to the record
  std::string element = {};  ///< of a force sensor
};

struct Plant {
  std::string name;
  std::vector<Mass> masses;
  std::vector<Point> points;
  std::vector<PlantInput> inputs;
  std::vector<Element> elements;
  std::vector<Load> loads;
  std::vector<Sensor> sensors;
  double clock_skew = 0;  ///< the drive's clock runs 1 + skew times as fast as that of the records

  Index mass_count() const { return static_cast<Index>(masses.size()); }
  Index input_count() const { return static_cast<Index>(inputs.size()); }
  Index sensor_count() const { return static_cast<Index>(sensors.size()); }
  std::vector<std::string> node_names() const;   ///< masses, displacement inputs, "ground", points
  Index node(std::string_view node_name) const;  ///< index into node_names(); UserError if unknown
  Index element(std::string_view name) const;    ///< index; UserError if unknown
  double hold_hz() const;                        ///< common rate of all drives; UserError where it is not known yet
  bool held() const;                             ///< false if the drives are continuous between their samples
  std::vector<Channel> input_channels() const;
  std::vector<Channel> output_channels() const;
};

/// Reads and checks a plant file. UserError with file, JSON path, what was expected and found, and the known names:
/// unknown node, law or key; element with one node only, or without a mass at either end unless a force sensor reads it
/// (a damper on a dynamometer); mass that is not positive or that nothing touches; repeated name; wrong unit; tolerance
/// outside (0, 1]; inputs of different hold rates, or held ones beside others; two accelerations of the ground; a law
/// that follows no input of kind "schedule", or leaves its numbers' ranges within that of the input; no
/// input or sensor; no mass unless there is a force sensor; something that turns joined to something that slides.
Plant load_plant(const std::filesystem::path& file);
Plant parse_plant(const JsonCursor& cursor);
/// `parse_plant(to_json(plant))` gives the same plant.
Json to_json(const Plant& plant);

/// True of a mass that rigid points carry with a negative weight, as they do a pitch or roll.
bool turns(const Plant& plant, const std::string& mass);

/// The stiffness [N/m] of a linear or hardening spring; nullptr of another law.
const double* spring_stiffness(const Law& law);

/// "suspension.viscous_damper", or "suspension.viscous_damper[2]" of a second law of one kind: what the names of a
/// law's parameters begin with. @param law its number in the element
std::string law_name(const Element& element, std::size_t law);

/// Name of the element between the ground and a mass that holds the laws of its guide where a plant file has no other
/// element there: what an effect puts at `guide:MASS`. (Names in a plant file hold no colon.)
std::string guide_element(const std::string& mass);
/// Location of an element: its name, or `guide:MASS` of that one.
Place location_of(const Element& element);
/// Location of a load: `guide:MASS`, as of any force between the ground and a mass, or the name of its point.
Place location_of(const Plant& plant, const Load& load);
/// Location of an input's drive path: `actuator`, or `actuator:NAME` where there are several inputs.
Place actuator_of(const Plant& plant, const PlantInput& input);

/// What a number of the plant belongs to.
enum class ParameterOwner { mass, law, load, drive_path, sensor_path, crosstalk, clock };

/// What a parameter is. It is not its identity, which is its name: two laws of one kind in an element have numbers of
/// one handle.
struct ParameterHandle {
  ParameterOwner owner = ParameterOwner::mass;
  Place place;                   ///< of the mass or the path, `location_of` the element or load, or the clock
  const LawKind* law = nullptr;  ///< null unless a law owns it
  std::string number;            ///< "mass_kg", "damping_ns_per_m", "lag.cutoff_hz"; of a crosstalk the other channel
};

/// A scalar of the plant that a fit may move.
struct PlantParameter {
  std::string name;  ///< "body.mass_kg", "suspension.viscous_damper.damping_ns_per_m", its slope with a schedule
                     ///< "suspension.viscous_damper.scheduled.damping_ns_per_m"; a second law of the same kind in
                     ///< one element is "suspension.linear_spring[2].stiffness_n_per_m"; loads are
                     ///< "load:gravity.force_n"; paths are "actuator:road.delay_s",
                     ///< "sensor:travel.lag.time_constant_s", "timebase.clock_skew"
  ParameterHandle handle;
  std::string unit;
  double value = 0;
  double tolerance = default_tolerance;  ///< relative standard deviation of the value
  Range range = {};                      ///< admissible in a file
  /// True of the damping of a law that corrects the viscous damper beside it, and of the stiffness of one that corrects
  /// a spring, where both are the same: it moves with that damper or spring.
  bool follows = false;
};

/// Names of the internal states of all laws, in the order in which simulations keep them: "suspension.bouc_wen.z_1".
std::vector<std::string> memory_names(const Plant& plant);

/// All masses, then all finite law parameters in the order of the file, then the loads, then what the paths hold beside
/// the ideal.
std::vector<PlantParameter> plant_parameters(const Plant& plant);
/// These know the ideal parameters of the paths too. UserError naming the known ones if there is no such name. The
/// range is the caller's business: fits may probe. What follows a parameter is set with it.
double get_parameter(const Plant& plant, std::string_view name);
void set_parameter(Plant& plant, std::string_view name, double value);

}  // namespace wheelhop
