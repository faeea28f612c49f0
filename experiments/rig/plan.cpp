#include "experiments/rig/plan.hpp"

#include <algorithm>
#include <tuple>

namespace wheelhop::blind {
namespace {

constexpr double default_tolerance = 0.05;

struct Reader {
  Plan plan;

  Index node(const JsonCursor& cursor) const {
    std::vector<std::string> known;
    for (const Node& n : plan.nodes) known.push_back(n.name);
    const std::string name = cursor.one_of(known);
    for (std::size_t i = 0; i < known.size(); ++i)
      if (known[i] == name) return static_cast<Index>(i);
    return -1;
  }

  std::pair<Index, Index> ends(const JsonCursor& cursor, const char* single) const {
    if (cursor.has(single)) return {node_of_ground(), node(cursor.at(single))};
    const std::vector<JsonCursor> pair = cursor.at("between").items();
    if (pair.size() != 2) cursor.at("between").fail("two names of nodes");
    return {node(pair[0]), node(pair[1])};
  }

  Index node_of_ground() const {
    for (std::size_t i = 0; i < plan.nodes.size(); ++i)
      if (plan.nodes[i].name == "ground") return static_cast<Index>(i);
    return -1;
  }

  Index parameter(const std::string& location, Quantity quantity, double value, double tolerance) {
    plan.parameters.push_back({location, quantity, value, tolerance});
    return static_cast<Index>(plan.parameters.size()) - 1;
  }

  PlanLaw law(const JsonCursor& cursor, const std::string& element) {
    const std::string name =
        cursor.at("law").one_of({"linear_spring", "hardening_spring", "polynomial_spring", "viscous_damper"});
    const double tolerance = cursor.number("tolerance", default_tolerance, {.low = 0, .high = 1});
    const auto add = [&](const char* key, Quantity quantity) {
      return parameter(element, quantity, cursor.at(key).number(), tolerance);
    };
    const auto optional = [&](const char* key) { return cursor.has(key) ? add(key, Quantity::shape) : Index{-1}; };
    PlanLaw result;
    if (name == "linear_spring") {
      result = {LawShape::linear_spring, {add("stiffness_n_per_m", Quantity::stiffness)}};
    } else if (name == "viscous_damper") {
      result = {LawShape::viscous_damper, {add("damping_ns_per_m", Quantity::damping)}};
    } else if (name == "hardening_spring") {
      result.shape = LawShape::hardening_spring;
      result.at = {add("stiffness_n_per_m", Quantity::stiffness), optional("alpha_per_m2"), optional("beta_m"),
                   optional("travel_limit_m")};
    } else {
      result.shape = LawShape::polynomial_spring;
      for (const double c : cursor.at("coefficients").numbers())
        result.at.push_back(
            parameter(element, result.at.empty() ? Quantity::stiffness : Quantity::shape, c, tolerance));
    }
    cursor.done();
    return result;
  }

  void masses(const JsonCursor& list) {
    for (const JsonCursor& item : list.items()) {
      const std::string name = item.at("name").string();
      parameter(name, Quantity::mass, item.at("mass_kg").number({.low = 1e-12}),
                item.number("tolerance", default_tolerance, {.low = 0, .high = 1}));
      plan.nodes.push_back({name, {{plan.mass_count(), 1.0}}, -1});
      plan.masses.push_back(name);
      item.done();
    }
  }

  void points(const JsonCursor& list) {
    for (const JsonCursor& item : list.items()) {
      Node point{item.at("name").string(), {}, -1};
      const JsonCursor weights = item.at("weights");
      for (std::size_t i = 0; i < plan.masses.size(); ++i)
        if (const auto weight = weights.find(plan.masses[i]))
          point.weights.emplace_back(static_cast<Index>(i), weight->number());
      weights.done();
      plan.nodes.push_back(std::move(point));
      item.done();
    }
  }
};

}  // namespace

Plan read_plan(const JsonCursor& cursor) {
  Reader reader;
  Plan& plan = reader.plan;
  plan.name = cursor.at("name").string();
  plan.file = cursor.raw();
  reader.masses(cursor.at("masses"));
  const std::vector<JsonCursor> inputs = cursor.at("inputs").items();
  for (const JsonCursor& item : inputs) {
    const bool force = item.at("kind").one_of({"displacement", "force"}) == "force";
    plan.inputs.push_back({item.at("name").string(), item.at("unit").string(), force});
    if (!force) plan.nodes.push_back({plan.inputs.back().name, {}, static_cast<Index>(plan.inputs.size()) - 1});
    const double hold_hz = item.at("hold_hz").number({.low = 1});
    if (plan.hold_hz != 0 && plan.hold_hz != hold_hz) item.at("hold_hz").fail("one rate for all inputs");
    plan.hold_hz = hold_hz;
    if (item.string("interpolation", "band_limited") != "band_limited")
      item.at("interpolation").fail("\"band_limited\", the way the drives are made");
  }
  plan.nodes.push_back({"ground", {}, -1});
  if (const auto list = cursor.find("points")) reader.points(*list);
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    if (plan.inputs[i].is_force) std::tie(plan.inputs[i].from, plan.inputs[i].to) = reader.ends(inputs[i], "on");
    inputs[i].done();
  }
  for (const JsonCursor& item : cursor.at("elements").items()) {
    PlanElement element;
    element.name = item.at("name").string();
    std::tie(element.from, element.to) = reader.ends(item, "of");
    for (const JsonCursor& law : item.at("laws").items()) element.laws.push_back(reader.law(law, element.name));
    item.done();
    plan.elements.push_back(std::move(element));
  }
  for (const JsonCursor& item : cursor.at("sensors").items()) {
    PlanSensor sensor{item.at("name").string(), item.at("unit").string()};
    const std::string kind = item.at("kind").one_of({"displacement", "velocity", "acceleration"});
    sensor.reading = kind == "displacement" ? Reading::displacement
                     : kind == "velocity"   ? Reading::velocity
                                            : Reading::acceleration;
    std::tie(sensor.from, sensor.to) = reader.ends(item, "of");
    item.done();
    plan.sensors.push_back(std::move(sensor));
  }
  cursor.done();
  return std::move(plan);
}

Vector Plan::nominal() const {
  Vector values(static_cast<Index>(parameters.size()));
  for (Index i = 0; i < values.size(); ++i) values(i) = parameters[static_cast<std::size_t>(i)].value;
  return values;
}

std::vector<Channel> Plan::input_channels() const {
  std::vector<Channel> channels;
  for (const PlanInput& input : inputs) channels.push_back({input.name, input.unit});
  return channels;
}

std::vector<Channel> Plan::output_channels() const {
  std::vector<Channel> channels;
  for (const PlanSensor& sensor : sensors) channels.push_back({sensor.name, sensor.unit});
  return channels;
}

bool Plan::at_drive(const PlanElement& element) const {
  return nodes[static_cast<std::size_t>(element.from)].input >= 0 ||
         nodes[static_cast<std::size_t>(element.to)].input >= 0;
}

bool Plan::has(const PlanElement& element, Quantity quantity) const {
  for (const PlanLaw& law : element.laws)
    if (parameters[static_cast<std::size_t>(law.at.front())].quantity == quantity) return true;
  return false;
}

Vector static_loads(const Plan& plan) {
  const auto n = plan.mass_count(), elements = static_cast<Index>(plan.elements.size());
  Matrix strain = Matrix::Zero(elements, n);  // travel of each element by mass, inputs at rest
  Vector driven = Vector::Zero(elements), stiffness = Vector::Zero(elements);
  for (Index e = 0; e < elements; ++e) {
    const PlanElement& element = plan.elements[static_cast<std::size_t>(e)];
    for (const auto& [mass, weight] : plan.nodes[static_cast<std::size_t>(element.to)].weights)
      strain(e, mass) += weight;
    for (const auto& [mass, weight] : plan.nodes[static_cast<std::size_t>(element.from)].weights)
      strain(e, mass) -= weight;
    const bool upward = plan.nodes[static_cast<std::size_t>(element.from)].input >= 0;
    if (plan.at_drive(element)) driven(e) = upward ? 1 : -1;
    for (const PlanLaw& law : element.laws)
      if (law.shape != LawShape::viscous_damper)
        stiffness(e) += plan.parameters[static_cast<std::size_t>(law.at.front())].value;
  }
  if (driven.isZero()) return Vector::Zero(elements);
  // Padded with zeros where there are fewer elements than masses, as the solver wants.
  Matrix padded = Matrix::Zero(std::max(elements, n), n);
  padded.topRows(elements) = strain;
  Vector wanted = Vector::Zero(padded.rows());
  wanted.head(elements) = driven;
  const Vector lift = least_squares(padded, wanted).x;
  Vector weight(n);
  for (Index i = 0; i < n; ++i) weight(i) = 9.81 * plan.parameters[static_cast<std::size_t>(i)].value * lift(i);
  const Matrix K = strain.transpose() * stiffness.asDiagonal() * strain;
  return stiffness.cwiseProduct(strain * least_squares(K, weight).x).cwiseProduct(driven);
}

}  // namespace wheelhop::blind
