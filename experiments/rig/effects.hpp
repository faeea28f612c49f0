/// \file
/// The true effects. A kind of effect knows where it may stand; for one place in one rig it draws its form (shape
/// parameters, side, sign) and can then be made at any size. Forms are meant to differ from the laws that a diagnosis
/// may hold in its catalogue: a name has to be told by its physics, not by one formula.
#pragma once

#include <optional>

#include "experiments/rig/drives.hpp"
#include "experiments/rig/rig.hpp"

namespace wheelhop::blind {

/// What the rig without the effect does under the drive of the case: effects scale their shapes by it.
struct Surroundings {
  const Plan* plan = nullptr;
  Vector theta = {};  ///< true parameters
  std::vector<Extent> elements = {}, masses = {};
  Vector sensor_rms = {}, sensor_std = {};       ///< p; the second about the mean
  Vector input_peak = {}, input_speed_rms = {};  ///< m, over the record
  Vector static_load_n = {};                     ///< by element
  double band_hz = 25;                           ///< highest frequency of the drive
  double duration_s = 40;
  Vector sensor_rate_rms = {};  ///< p, of the change of a reading in a second
};

/// Between command and plant: the command is read at t * rate - delay, then `change` works on its samples.
struct DriveStep {
  Index input = 0;
  double rate = 1, delay_s = 0;
  std::function<void(Vector& u, double rate_hz)> change;  ///< empty: none
};

/// Works on all channels at the hold rate; `lead` samples come before t = 0.
using SensorStep = std::function<void(Matrix& y, Index lead, double rate_hz)>;

/// Column at a position between samples, by the cubic through the four samples about it (Lagrange). At 25 Hz and a hold
/// rate of 1 kHz its error is 2e-5 of the amplitude.
Vector read_at(const Matrix& samples, double position);

/// One effect at one place, of one size.
struct TrueEffect {
  double strength = 0;
  std::string unit = {};  ///< of the strength
  std::vector<Mount> mounts = {};
  std::vector<DriveStep> drive = {};
  std::vector<SensorStep> sensors = {};
  std::vector<std::pair<Index, double>> quanta = {};   ///< converter steps by sensor, applied after the noise
  std::vector<std::pair<Index, double>> factors = {};  ///< of true parameters
  double recorder_rate = 1;  ///< true seconds between two samples of the recorder, over its nominal interval
};

/// An effect whose form is drawn. The effect grows with `size`, from `smallest` to the largest that is physical.
struct Formed {
  double smallest = 0, largest = 0;
  std::function<TrueEffect(double size)> at_size;
};

struct EffectKind {
  std::string effect;  ///< id of a diagnosis, or "unknown"
  std::string form;    ///< unique among the kinds
  std::vector<std::string> (*places)(const Plan& plan);
  /// Empty where the rig offers nothing to work on (a stop where nothing moves, an offset of a linear spring).
  std::optional<Formed> (*form_at)(const Surroundings& rig, const std::string& place, Random& random);
  bool catalogue_form = false;  ///< the formula is one that a diagnosis may well hold
};

/// `added` are kinds of catalogue effects that came after the first sets of cases had been sealed. They stand apart
/// because the number of a case, and with it all that is random in it, counts the kinds before it.
enum class Family { catalogue, unknown, parameter, added };

/// The kinds of a family, in a fixed order.
const std::vector<EffectKind>& effect_kinds(Family family);

// One list a file.
std::vector<EffectKind> strut_kinds();
std::vector<EffectKind> damper_kinds();
std::vector<EffectKind> tyre_kinds();
std::vector<EffectKind> mass_kinds();
std::vector<EffectKind> drive_kinds();
std::vector<EffectKind> sensor_kinds();
std::vector<EffectKind> textbook_kinds();
std::vector<EffectKind> textbook_path_kinds();
std::vector<EffectKind> unknown_strut_kinds();
std::vector<EffectKind> unknown_mass_kinds();
std::vector<EffectKind> unknown_ground_kinds();
std::vector<EffectKind> parameter_kinds();
std::vector<EffectKind> added_plant_kinds();
std::vector<EffectKind> added_path_kinds();
std::vector<EffectKind> added_ground_kinds();

std::vector<std::string> struts(const Plan& plan);          ///< elements with spring and damper away from the drive
std::vector<std::string> driven_springs(const Plan& plan);  ///< elements at a displacement input: tyres
std::vector<std::string> all_masses(const Plan& plan);      ///< that are nodes of an element (no coordinates of points)
std::vector<std::string> guides(const Plan& plan);          ///< `guide:MASS` where no element joins mass and ground
std::vector<std::string> actuators(const Plan& plan);       ///< `actuator`, or `actuator:INPUT` where there are several
std::vector<std::string> sensor_places(const Plan& plan);
std::vector<std::string> timebase(const Plan& plan);
Index element_at(const Plan& plan, const std::string& place);
Index mass_at(const Plan& plan, const std::string& place);  ///< of `MASS` or `guide:MASS`
Index input_at(const Plan& plan, const std::string& place);
Index sensor_at(const Plan& plan, const std::string& place);

const Extent& motion_of(const Surroundings& rig, Index element);
/// Force of spring and damper of an element at its usual motion [N]: the scale of what is added.
double usual_force(const Surroundings& rig, Index element);

double between(Random& random, double low, double high);      ///< uniform
double log_between(Random& random, double low, double high);  ///< log-uniform
double either_sign(Random& random);

/// An effect mounted on an element or a mass: every run gets a copy of `prototype`.
template <class T>
TrueEffect mounted(bool on_mass, Index at, const T& prototype, double strength, std::string unit) {
  return {.strength = strength,
          .unit = std::move(unit),
          .mounts = {{on_mass, at, [prototype] { return std::make_unique<T>(prototype); }}}};
}
template <class T>
TrueEffect on_element(Index element, const T& prototype, double strength, std::string unit) {
  return mounted(false, element, prototype, strength, std::move(unit));
}
template <class T>
TrueEffect on_mass(Index mass, const T& prototype, double strength, std::string unit) {
  return mounted(true, mass, prototype, strength, std::move(unit));
}

}  // namespace wheelhop::blind
