#include <algorithm>
#include <iterator>
#include <set>
#include <string>

#include "core/plant/rotary.hpp"
#include "core/plant/schedule.hpp"

namespace wheelhop {
namespace {

const std::string ground = "ground";

/// A name becomes a CSV column, a part of a location (`sensor:NAME`, `EFFECT@NAME`) or of a parameter name (`NAME.x`).
std::string read_name(const JsonCursor& cursor) {
  const std::string name = cursor.string();
  const bool bad = name.empty() || name.front() == ' ' || name.back() == ' ' ||
                   std::any_of(name.begin(), name.end(), [](unsigned char c) {
                     return c < 32 || c == ',' || c == '"' || c == ':' || c == '@' || c == '.' || c == ';';
                   });
  if (bad) cursor.fail("a name without , ; : . @ or quotes");
  return name;
}

/// Refuses a name for the second time, and names that mean something else already.
class Names {
 public:
  Names(std::string what, std::set<std::string> taken) : what_(std::move(what)), taken_(std::move(taken)) {}
  std::string read(const JsonCursor& cursor) {
    const std::string name = read_name(cursor);
    if (!taken_.insert(name).second) cursor.fail("a " + what_ + " name that is not taken (taken: " + listed() + ")");
    return name;
  }

 private:
  std::string listed() const {
    std::string text;
    for (const std::string& name : taken_) text += (text.empty() ? "" : ", ") + name;
    return text;
  }
  std::string what_;
  std::set<std::string> taken_;
};

std::vector<JsonCursor> read_list(const JsonCursor& plant, const char* key, const char* what) {
  const JsonCursor list = plant.at(key);
  std::vector<JsonCursor> items = list.items();
  if (items.empty()) list.fail(std::string("at least one ") + what);
  return items;
}

void read_pair(const JsonCursor& cursor, const std::vector<std::string>& nodes, std::string& from, std::string& to) {
  const std::vector<JsonCursor> pair = cursor.items();
  if (pair.size() != 2) cursor.fail("two node names [a, b]");
  from = pair[0].one_of(nodes);
  to = pair[1].one_of(nodes);
  if (from == to) cursor.fail("two different nodes");
}

/// `of` (or `on`) one mass, or `between` two nodes.
void read_place(const JsonCursor& cursor, const char* single, const std::vector<std::string>& masses,
                const std::vector<std::string>& nodes, std::string& from, std::string& to) {
  const auto one = cursor.find(single);
  const auto two = cursor.find("between");
  if (one.has_value() == two.has_value())
    cursor.fail(std::string("either \"") + single + "\" (one mass) or \"between\" (two nodes)");
  if (one) {
    from = ground;
    to = one->one_of(masses);
  } else {
    read_pair(*two, nodes, from, to);
  }
}

void read_unit(const JsonCursor& cursor, const std::string& expected, const std::string& of) {
  const JsonCursor unit = cursor.at("unit");
  if (unit.string() != expected) unit.fail("\"" + expected + "\" (the unit of " + of + ")");
}

std::vector<std::string> mass_names(const Plant& plant) {
  std::vector<std::string> names;
  for (const Mass& mass : plant.masses) names.push_back(mass.name);
  return names;
}

/// What a force moves and an accelerometer may stand on: masses and the points they carry.
std::vector<std::string> movable_names(const Plant& plant) {
  std::vector<std::string> names = mass_names(plant);
  for (const Point& point : plant.points) names.push_back(point.name);
  return names;
}

Mass read_mass(const JsonCursor& cursor, Names& places) {
  Mass mass;
  mass.name = places.read(cursor.at("name"));
  mass.rotary = cursor.find("inertia_kg_m2").has_value();
  if (mass.rotary && cursor.find("mass_kg")) cursor.at("mass_kg").fail("no mass beside \"inertia_kg_m2\"");
  const JsonCursor value = cursor.at(mass.rotary ? "inertia_kg_m2" : "mass_kg");
  mass.mass_kg = value.number();
  if (!(mass.mass_kg > 0))
    value.fail(mass.rotary ? "a moment of inertia above 0 kg m^2"
                           : "a mass above 0 kg (a massless node has no equation of motion)");
  mass.tolerance = parse_tolerance(cursor);
  cursor.done();
  return mass;
}

Point read_point(const JsonCursor& cursor, const Plant& plant, Names& places) {
  Point point;
  point.name = places.read(cursor.at("name"));
  const JsonCursor weights = cursor.at("weights");
  for (const Mass& mass : plant.masses)
    if (auto weight = weights.find(mass.name)) point.weights.emplace_back(mass.name, weight->number());
  weights.done();
  if (point.weights.empty()) weights.fail("the weight of one mass at least");
  point.rotary = std::all_of(point.weights.begin(), point.weights.end(),
                             [&](const auto& weight) { return is_rotary(plant, weight.first); });
  if (const auto unit = cursor.find("unit")) point.rotary = unit->one_of({"m", "rad"}) == "rad";
  cursor.done();
  return point;
}

/// What a kind of input or sensor is called in a file, and its unit; none: any.
template <class Kind>
struct KindName {
  Kind kind;
  const char *name, *unit;
  bool rotary;
};
constexpr KindName<InputKind> kInputKinds[] = {{InputKind::displacement, "displacement", "m", false},
                                               {InputKind::force, "force", "N", false},
                                               {InputKind::acceleration, "acceleration", "m/s^2", false},
                                               {InputKind::displacement, "angle", "rad", true},
                                               {InputKind::force, "torque", "N m", true},
                                               {InputKind::schedule, "schedule", nullptr, false}};
constexpr KindName<SensorKind> kSensorKinds[] = {{SensorKind::displacement, "displacement", "m", false},
                                                 {SensorKind::velocity, "velocity", "m/s", false},
                                                 {SensorKind::acceleration, "acceleration", "m/s^2", false},
                                                 {SensorKind::force, "force", "N", false},
                                                 {SensorKind::displacement, "angle", "rad", true},
                                                 {SensorKind::velocity, "angular_velocity", "rad/s", true},
                                                 {SensorKind::acceleration, "angular_acceleration", "rad/s^2", true},
                                                 {SensorKind::force, "torque", "N m", true}};

/// The member `kind`.
template <class Kind, std::size_t count>
const KindName<Kind>& read_kind(const JsonCursor& cursor, const KindName<Kind> (&kinds)[count]) {
  std::vector<std::string> names;
  for (const KindName<Kind>& own : kinds) names.push_back(own.name);
  const std::string name = cursor.at("kind").one_of(names);
  return *std::find_if(std::begin(kinds), std::end(kinds), [&](const auto& k) { return name == k.name; });
}

template <class Kind, std::size_t count>
const char* kind_name(Kind kind, const std::string& unit, const KindName<Kind> (&kinds)[count]) {
  const auto named = [&](const KindName<Kind>& own) { return own.kind == kind && (!own.unit || own.unit == unit); };
  const auto* own = std::find_if(std::begin(kinds), std::end(kinds), named);
  if (own == std::end(kinds))  // a plant that was put together without units
    own = std::find_if(std::begin(kinds), std::end(kinds), [&](const auto& any) { return any.kind == kind; });
  return own->name;
}

/// Refuses a node that slides where something turns, or the other way round. The ground goes with either.
void require_rotary(const JsonCursor& cursor, const Plant& plant, const std::string& node, bool rotary) {
  if (node != ground && is_rotary(plant, node) != rotary)
    cursor.fail(rotary ? "something that turns (a mass with \"inertia_kg_m2\", an input of kind \"angle\")"
                       : "something that slides; a point with \"unit\": \"m\" and weights in m/rad slides with what "
                         "turns");
}

[[noreturn]] void fail_hold(const JsonCursor& input, const std::string& expected) {
  if (auto member = input.find("hold_hz")) member->fail(expected);
  input.fail("\"hold_hz\": " + expected);
}

/// The range of a schedule.
Range read_range(const JsonCursor& cursor) {
  const std::vector<double> ends = cursor.numbers();
  if (ends.size() != 2 || !(ends[0] < ends[1])) cursor.fail("two numbers [low, high], between which the drive stays");
  return {ends[0], ends[1]};
}

PlantInput read_input(const JsonCursor& cursor, const Plant& plant, Names& places, Names& channels) {
  PlantInput input;
  const KindName<InputKind>& kind = read_kind(cursor, kInputKinds);
  input.kind = kind.kind;
  input.name = channels.read(cursor.at("name"));
  if (input.kind == InputKind::displacement) places.read(cursor.at("name"));
  if (input.kind == InputKind::schedule) {
    input.unit = cursor.at("unit").string();
    input.range = read_range(cursor.at("range"));
    // It often moves in steps, beside which a smoother curve would ring.
    input.interpolation = cursor.find("hold_hz") ? "zoh" : "linear";
  } else {
    input.unit = kind.unit;
    read_unit(cursor, input.unit, std::string("an input of kind ") + kind.name);
  }
  const auto accelerates = [](const PlantInput& other) { return other.kind == InputKind::acceleration; };
  if (accelerates(input) && std::any_of(plant.inputs.begin(), plant.inputs.end(), accelerates))
    cursor.at("kind").fail("one acceleration at most: it is that of the ground");
  if (auto member = cursor.find("hold_hz")) input.hold_hz = member->number({.low = 1e-3, .high = 1e7});
  input.held = input.hold_hz > 0;
  if (auto member = cursor.find("interpolation"))
    input.interpolation = member->one_of({"band_limited", "zoh", "linear"});
  if (input.kind == InputKind::force) {
    const std::vector<std::string> movable = movable_names(plant);
    read_place(cursor, "on", movable, movable, input.from, input.to);
    for (const std::string& node : {input.from, input.to}) require_rotary(cursor, plant, node, kind.rotary);
  }
  input.path = parse_drive_path(cursor);
  cursor.done();
  if (!plant.inputs.empty() && input.hold_hz != plant.inputs.front().hold_hz)
    fail_hold(cursor, "the hold rate of the other inputs, or none as they have (all are held at the same instants)");
  if (!input.held && input.interpolation == "zoh")
    fail_hold(cursor, "a hold rate, since \"interpolation\": \"zoh\" says that the drive is held");
  if (!input.held && input.path.sampling_phase != 0)
    fail_hold(cursor, "a hold rate beside \"sampling_phase\", which is a share of the hold interval");
  return input;
}

std::vector<std::string> schedule_names(const Plant& plant) {
  std::vector<std::string> names;
  for (const PlantInput& input : plant.inputs)
    if (input.kind == InputKind::schedule) names.push_back(input.name);
  return names;
}

Element read_element(const JsonCursor& cursor, const Plant& plant, Names& places) {
  Element element;
  element.name = places.read(cursor.at("name"));
  read_pair(cursor.at("between"), plant.node_names(), element.from, element.to);
  const bool rotary = is_rotary(plant, element);
  for (const std::string& node : {element.from, element.to}) require_rotary(cursor.at("between"), plant, node, rotary);
  for (const JsonCursor& law : read_list(cursor, "laws", "law")) element.laws.push_back(parse_law(law, rotary));
  const std::vector<JsonCursor> laws = cursor.at("laws").items();
  for (std::size_t i = 0; i < laws.size(); ++i)
    if (element.laws[i].scheduled()) laws[i].at("scheduled").at("by").one_of(schedule_names(plant));
  const auto any = [&](LawRole role) {
    return std::any_of(element.laws.begin(), element.laws.end(),
                       [&](const Law& law) { return law.kind->role == role; });
  };
  if (!any(LawRole::force) && !any(LawRole::inertance))
    cursor.at("laws").fail("a law that gives a force beside those that limit it");
  const std::vector<std::string> movable = movable_names(plant);
  const auto stands = [&](const std::string& name) {
    return name == ground || std::find(movable.begin(), movable.end(), name) != movable.end();
  };
  if (any(LawRole::inertance) && !(stands(element.from) && stands(element.to)))
    cursor.at("laws").fail("no inerter at a displacement input: a held drive moves in steps and has no acceleration");
  cursor.done();
  return element;
}

Load read_load(const JsonCursor& cursor, const Plant& plant, Names& loads) {
  Load load;
  load.name = loads.read(cursor.at("name"));
  load.on = cursor.at("on").one_of(movable_names(plant));
  load.force_n = cursor.at(is_rotary(plant, load.on) ? "torque_nm" : "force_n").number();
  load.tolerance = parse_tolerance(cursor);
  cursor.done();
  return load;
}

Sensor read_sensor(const JsonCursor& cursor, const Plant& plant, Names& channels) {
  Sensor sensor;
  sensor.name = channels.read(cursor.at("name"));
  const KindName<SensorKind>& kind = read_kind(cursor, kSensorKinds);
  sensor.kind = kind.kind;
  sensor.unit = kind.unit;
  read_unit(cursor, sensor.unit, std::string("a sensor of ") + kind.name);
  if (sensor.kind == SensorKind::force) {
    std::vector<std::string> elements;
    for (const Element& element : plant.elements) elements.push_back(element.name);
    sensor.element = cursor.at("element").one_of(elements);
    const Element& read = plant.elements[static_cast<std::size_t>(plant.element(sensor.element))];
    if (is_rotary(plant, read) != kind.rotary)
      cursor.at("element").fail(kind.rotary ? "an element that turns" : "an element that slides");
    sensor.path = parse_sensor_path(cursor);
    cursor.done();
    return sensor;
  }
  const std::vector<std::string> movable = movable_names(plant);
  std::vector<std::string> nodes = plant.node_names();
  if (sensor.kind == SensorKind::acceleration) {
    // A held drive has no acceleration: it moves in steps.
    nodes = movable;
    nodes.push_back(ground);
  }
  read_place(cursor, "of", movable, nodes, sensor.from, sensor.to);
  for (const std::string& node : {sensor.from, sensor.to}) require_rotary(cursor, plant, node, kind.rotary);
  sensor.path = parse_sensor_path(cursor);
  cursor.done();
  return sensor;
}

void require_every_mass_connected(const JsonCursor& cursor, const Plant& plant) {
  std::set<std::string> touched;
  for (const Element& element : plant.elements) touched.insert({element.from, element.to});
  for (const PlantInput& input : plant.inputs) touched.insert({input.from, input.to});
  for (const Point& point : plant.points)
    if (touched.contains(point.name))
      for (const auto& [mass, weight] : point.weights) touched.insert(mass);
  if (plant.masses.empty()) return;
  const std::vector<JsonCursor> items = cursor.at("masses").items();
  for (std::size_t i = 0; i < plant.masses.size(); ++i)
    if (!touched.contains(plant.masses[i].name))
      items[i].at("name").fail("a mass that an element or an input touches (nothing is attached to this one)");
}

/// An element whose two ends are held moves nothing; on a dynamometer its force is what is measured.
void require_every_element_felt(const JsonCursor& cursor, const Plant& plant) {
  const std::vector<std::string> movable = movable_names(plant);
  const auto moves = [&](const std::string& name) {
    return std::find(movable.begin(), movable.end(), name) != movable.end();
  };
  for (std::size_t e = 0; e < plant.elements.size(); ++e) {
    const Element& element = plant.elements[e];
    const bool read = std::any_of(plant.sensors.begin(), plant.sensors.end(),
                                  [&](const Sensor& sensor) { return sensor.element == element.name; });
    if (!read && !moves(element.from) && !moves(element.to))
      cursor.at("elements")
          .items()[e]
          .at("between")
          .fail("a mass at one end at least, or a sensor of kind \"force\" that reads this element: it moves nothing");
  }
}

/// Read beside the cursor, which would take the key for one that the sensor knows.
bool has_force_sensor(const Json& plant) {
  if (!plant.is_object() || !plant.contains("sensors") || !plant["sensors"].is_array()) return false;
  return std::any_of(plant["sensors"].begin(), plant["sensors"].end(), [](const Json& sensor) {
    return sensor.is_object() && sensor.contains("kind") && (sensor["kind"] == "force" || sensor["kind"] == "torque");
  });
}

}  // namespace

Plant parse_plant(const JsonCursor& cursor) {
  Plant plant;
  plant.name = cursor.at("name").string();
  // Masses, points, displacement inputs and elements share their names: each is a node or a location of a diagnosis.
  Names places("mass, point, input or element", {ground, "timebase", "actuator"});
  Names channels("channel", {"t"});
  if (!has_force_sensor(cursor.raw())) read_list(cursor, "masses", "mass (or a sensor of the force in an element)");
  if (auto list = cursor.find("masses"))
    for (const JsonCursor& item : list->items()) plant.masses.push_back(read_mass(item, places));
  if (auto list = cursor.find("points"))
    for (const JsonCursor& item : list->items()) plant.points.push_back(read_point(item, plant, places));
  for (const JsonCursor& item : cursor.at("inputs").items())
    plant.inputs.push_back(read_input(item, plant, places, channels));
  if (auto list = cursor.find("elements"))
    for (const JsonCursor& item : list->items()) plant.elements.push_back(read_element(item, plant, places));
  Names loads("load", {});
  if (auto list = cursor.find("loads"))
    for (const JsonCursor& item : list->items()) plant.loads.push_back(read_load(item, plant, loads));
  for (const JsonCursor& item : read_list(cursor, "sensors", "sensor"))
    plant.sensors.push_back(read_sensor(item, plant, channels));
  check_crosstalk(cursor.at("sensors"), plant);
  plant.clock_skew = cursor.number("clock_skew", 0, {.low = -0.01, .high = 0.01});
  cursor.done();
  require_every_mass_connected(cursor, plant);
  require_every_element_felt(cursor, plant);
  if (const std::string beyond = schedule_fault(plant); !beyond.empty())
    cursor.at("elements")
        .fail("numbers that stay in their ranges wherever the drive stays in its own (" + beyond + ")");
  return plant;
}

Plant load_plant(const std::filesystem::path& file) { return parse_plant(JsonCursor::load(file)); }

namespace {

Json pair_json(const std::string& from, const std::string& to) { return Json::array({from, to}); }

void write_place(Json& out, const char* single, const Plant& plant, const std::string& from, const std::string& to) {
  const std::vector<std::string> movable = movable_names(plant);
  if (from == ground && std::find(movable.begin(), movable.end(), to) != movable.end())
    out[single] = to;
  else
    out["between"] = pair_json(from, to);
}

}  // namespace

Json to_json(const Plant& plant) {
  Json out = Json::object();
  out["name"] = plant.name;
  out["masses"] = Json::array();
  for (const Mass& mass : plant.masses)
    out["masses"].push_back({{"name", mass.name},
                             {mass.rotary ? "inertia_kg_m2" : "mass_kg", mass.mass_kg},
                             {"tolerance", mass.tolerance}});
  if (!plant.points.empty()) out["points"] = Json::array();
  for (const Point& point : plant.points) {
    Json weights = Json::object();
    for (const auto& [mass, weight] : point.weights) weights[mass] = weight;
    out["points"].push_back({{"name", point.name}, {"weights", std::move(weights)}});
    const bool carried = std::all_of(point.weights.begin(), point.weights.end(),
                                     [&](const auto& weight) { return is_rotary(plant, weight.first); });
    if (carried != point.rotary) out["points"].back()["unit"] = point.rotary ? "rad" : "m";
  }
  out["inputs"] = Json::array();
  for (const PlantInput& input : plant.inputs) {
    if (input.silent) continue;
    Json item = {{"name", input.name}, {"kind", kind_name(input.kind, input.unit, kInputKinds)}, {"unit", input.unit}};
    if (input.kind == InputKind::force) write_place(item, "on", plant, input.from, input.to);
    if (input.kind == InputKind::schedule) item["range"] = {input.range.low, input.range.high};
    if (input.held) item["hold_hz"] = input.hold_hz;
    item["interpolation"] = input.interpolation;
    write_path(item, input.path);
    out["inputs"].push_back(std::move(item));
  }
  out["elements"] = Json::array();
  for (const Element& element : plant.elements) {
    Json item = {{"name", element.name}, {"between", pair_json(element.from, element.to)}, {"laws", Json::array()}};
    for (const Law& law : element.laws) item["laws"].push_back(to_json(law, is_rotary(plant, element)));
    out["elements"].push_back(std::move(item));
  }
  if (!plant.loads.empty()) out["loads"] = Json::array();
  for (const Load& load : plant.loads)
    out["loads"].push_back({{"name", load.name},
                            {"on", load.on},
                            {is_rotary(plant, load.on) ? "torque_nm" : "force_n", load.force_n},
                            {"tolerance", load.tolerance}});
  out["sensors"] = Json::array();
  for (const Sensor& sensor : plant.sensors) {
    Json item = {{"name", sensor.name}, {"kind", kind_name(sensor.kind, sensor.unit, kSensorKinds)}};
    if (sensor.kind == SensorKind::force)
      item["element"] = sensor.element;
    else
      write_place(item, "of", plant, sensor.from, sensor.to);
    item["unit"] = sensor.unit;
    write_path(item, sensor.path);
    out["sensors"].push_back(std::move(item));
  }
  if (plant.clock_skew != 0) out["clock_skew"] = plant.clock_skew;
  return out;
}

}  // namespace wheelhop
