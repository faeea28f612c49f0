/// \file
/// A plant file as the generator of blind cases reads it: text to numbers, by a reader of its own, so that nothing of
/// the diagnosis' plant code takes part in making the truth. Knows the laws a plant is delivered with (springs and
/// viscous dampers); what is withheld is added by effects.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/base/json.hpp"
#include "core/data/signal.hpp"

namespace wheelhop::blind {

enum class Quantity { mass, stiffness, damping, shape };

/// A number of the plant file that is known within a tolerance only.
struct Parameter {
  std::string location;  ///< mass or element
  Quantity quantity = Quantity::shape;
  double value = 0;      ///< as delivered
  double tolerance = 0;  ///< relative standard deviation
};

/// A place with a displacement: a combination of masses, a displacement input, or ground (neither).
struct Node {
  std::string name;
  std::vector<std::pair<Index, double>> weights;  ///< by mass
  Index input = -1;
};

enum class LawShape { linear_spring, hardening_spring, polynomial_spring, viscous_damper };

/// `at` are positions in Plan::parameters; -1 stands for an absent optional value.
struct PlanLaw {
  LawShape shape = LawShape::linear_spring;
  std::vector<Index> at;
};

struct PlanElement {
  std::string name;
  Index from = 0, to = 0;  ///< nodes; travel = x_to - x_from
  std::vector<PlanLaw> laws;
};

struct PlanInput {
  std::string name, unit;
  bool is_force = false;
  Index from = 0, to = 0;  ///< of a force: -u on the first node, +u on the second
};

enum class Reading { displacement, velocity, acceleration };

struct PlanSensor {
  std::string name, unit;
  Reading reading = Reading::displacement;
  Index from = 0, to = 0;
};

struct Plan {
  std::string name;
  Json file;  ///< as delivered, written into every case
  std::vector<std::string> masses;
  std::vector<Node> nodes;  ///< masses first, then inputs, ground, points
  std::vector<PlanInput> inputs;
  std::vector<PlanElement> elements;
  std::vector<PlanSensor> sensors;
  std::vector<Parameter> parameters;  ///< the masses first, in their order
  double hold_hz = 0;

  Index mass_count() const { return static_cast<Index>(masses.size()); }
  Vector nominal() const;
  std::vector<Channel> input_channels() const;
  std::vector<Channel> output_channels() const;
  bool at_drive(const PlanElement& element) const;  ///< one end is moved by an input: a tyre
  bool has(const PlanElement& element, Quantity quantity) const;
};

/// UserError on what a plant file may not hold, and on the laws and paths that a delivered plant may not have here.
Plan read_plan(const JsonCursor& cursor);

/// Force with which each element carries the plant's weight at rest [N, pressing > 0]; 0 where the plant hangs on no
/// displacement input. Weight acts along the motion that lifts every driven element alike and strains nothing else.
Vector static_loads(const Plan& plan);

}  // namespace wheelhop::blind
