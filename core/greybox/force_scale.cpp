#include "core/greybox/force_scale.hpp"

#include <algorithm>
#include <cmath>

#include "core/plant/paths.hpp"

namespace wheelhop {
namespace {

/// True of a number that a factor of all forces multiplies: of a mass, inerter or inertia, of a force, torque,
/// stiffness or damping, of its slope with a schedule, and of a heat capacity, as friction heats in proportion.
bool goes_with_forces(const PlantParameter& parameter) {
  if (parameter.handle.owner != ParameterOwner::mass && parameter.handle.owner != ParameterOwner::law &&
      parameter.handle.owner != ParameterOwner::load)
    return false;
  const std::string& unit = parameter.unit;
  return unit.starts_with("N") || unit.starts_with("kg") || unit.starts_with("J");
}

/// True of a drive path that answers twice the command twofold, apart from its gain.
bool is_linear(const DrivePath& path) {
  return path.offset == 0 && !std::isfinite(path.rate_limit) && !std::isfinite(path.saturation);
}

}  // namespace

Vector with_force_scale_at_home(const Plant& plant, const Plant& start, const std::vector<FitParameter>& parameters,
                                const Vector& theta) {
  const auto told = [](const Sensor& sensor) { return sensor.kind == SensorKind::force; };
  if (theta.size() != static_cast<Index>(parameters.size()) ||
      std::any_of(plant.sensors.begin(), plant.sensors.end(), told))
    return theta;
  std::vector<Place> drives;  // of forces
  for (const PlantInput& input : plant.inputs)
    if (input.kind == InputKind::force && !input.silent) {
      if (!is_linear(input.path)) return theta;
      drives.push_back(actuator_of(plant, input));
    }
  std::vector<Index> moved;
  for (const PlantParameter& known : plant_parameters(plant)) {
    const bool gain = known.handle.owner == ParameterOwner::drive_path && known.handle.number == "gain" &&
                      std::find(drives.begin(), drives.end(), known.handle.place) != drives.end();
    if (gain) std::erase(drives, known.handle.place);
    if (known.follows || (!gain && (!goes_with_forces(known) || known.value == 0))) continue;
    const auto own = std::find_if(parameters.begin(), parameters.end(),
                                  [&](const FitParameter& parameter) { return parameter.name == known.name; });
    if (own == parameters.end()) return theta;
    moved.push_back(own - parameters.begin());
  }
  if (!drives.empty()) return theta;  // one whose gain is ideal, and thus not fitted
  // theta_i(s) = (s v_i - v0_i) / scale_i, weighed by 1 / prior_std_i.
  double cross = 0, square = 0;
  for (const Index i : moved) {
    const FitParameter& own = parameters[static_cast<std::size_t>(i)];
    if (!(own.prior_std > 0)) continue;
    const double unit = own.scale * own.prior_std, zero = get_parameter(start, own.name) / unit;
    const double value = zero + theta(i) / own.prior_std;
    cross += zero * value;
    square += value * value;
  }
  if (!(square > 0) || !(cross > 0)) return theta;
  const double s = cross / square;
  Vector home = theta;
  for (const Index i : moved) {
    const FitParameter& own = parameters[static_cast<std::size_t>(i)];
    const double zero = get_parameter(start, own.name), value = s * (zero + theta(i) * own.scale);
    home(i) = (value - zero) / own.scale;
    if (own.prior_std > 0 && !(std::abs(home(i)) <= kFarthest * own.prior_std)) return theta;
    if (value < own.least) return theta;
  }
  return home;
}

}  // namespace wheelhop
