#include <Eigen/LU>
#include <algorithm>

#include "core/gap/where/probe.hpp"
#include "variants/effect/effects.hpp"

namespace wheelhop {
namespace {

constexpr double kOfForcesThere = 0.1;  // of the forces that move a mass, where a fit starts: a judgement
constexpr double kNoReading = 1e-9;     // of the terms of a reading, below which their sum is round-off

/// Readings that a constant force on a mass shifts in the linear plant, as a bias would. Where it has no equilibrium
/// the force moves it for good, which no bias does: more than one.
Index shifted_readings(const Plant& plant, const std::string& mass) {
  const LinearPlant linear = linearise(plant_with_force(plant, {"ground", mass}));
  if (linear.A.size() == 0) return plant.sensor_count();
  const Vector b = linear.B.rightCols(1), x = -linear.A.partialPivLu().solve(b);
  if (!x.allFinite() || !(linear.A * x + b).isZero(kNoReading * b.cwiseAbs().maxCoeff()))
    return std::max<Index>(plant.sensor_count(), 2);
  const Vector direct = linear.D.rightCols(1), terms = linear.C.cwiseAbs() * x.cwiseAbs() + direct.cwiseAbs();
  return ((linear.C * x + direct).cwiseAbs().array() > kNoReading * terms.array()).count();
}

bool has_linear_laws(const Plant& plant) {
  const auto linear = [](const Law& law) { return law.kind->is_linear || law.kind->role == LawRole::inertance; };
  return std::all_of(plant.elements.begin(), plant.elements.end(), [&](const Element& element) {
    return std::all_of(element.laws.begin(), element.laws.end(), linear);
  });
}

}  // namespace

// Weight, payload or preload that the plant file does not know. A known load of a mass has a tolerance of its own, and
// what shifts a single reading of a linear plant by a constant is that sensor's bias.
std::shared_ptr<const Effect> make_load(const EffectOptions&) {
  return effect_family("load", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
    for (std::size_t i = 0; i < plant.masses.size(); ++i) {
      const std::string& mass = plant.masses[i].name;
      const double size = kOfForcesThere * operation.guides[i].force_rms_n;
      const auto known = [&](const Load& load) { return load.on == mass; };
      if (!(size > 0) || turns(plant, mass) || std::any_of(plant.loads.begin(), plant.loads.end(), known) ||
          (has_linear_laws(plant) && shifted_readings(plant, mass) < 2))
        continue;
      const Load load{"load_on_" + mass, mass, 0};
      const auto put_on = [load](Plant& other) {
        const auto same = [&](const Load& own) { return own.on == load.on; };
        const auto there = [&](const Mass& own) { return own.name == load.on; };
        if (std::none_of(other.masses.begin(), other.masses.end(), there) ||
            std::any_of(other.loads.begin(), other.loads.end(), same))
          return false;
        other.loads.push_back(load);
        return true;
      };
      list.push_back(with_path(plant, "load", location_of(plant, load), "constant",
                               {{"load:" + load.name + ".force_n", size, size}}, put_on));
      list.back().either_sign = true;
    }
  });
}

}  // namespace wheelhop
