#include <algorithm>
#include <numbers>
#include "variants/effect/effects.hpp"

namespace wheelhop {

// A seat, an engine on its mounts, a top mount: a mass on a spring that the plant file does not know.
std::shared_ptr<const Effect> make_added_mode(const EffectOptions&) {
  return effect_family("added_mode", [](const Plant& plant, const Operation&, std::vector<EffectCandidate>& list) {
    constexpr double damping_ratio = 0.1;  // so that neighbours, half an octave apart, overlap
    for (const Mass& host : plant.masses) {
      const std::string mode = "mode_on_" + host.name;
      const auto taken = [&](const Mass& mass) { return mass.name == mode || host.name.starts_with("mode_on_"); };
      if (std::any_of(plant.masses.begin(), plant.masses.end(), taken)) continue;
      const double mass_kg = 0.05 * host.mass_kg;
      for (const double mode_hz : {4.0, 5.7, 8.0, 11.3, 16.0, 22.6, 32.0}) {
        const double omega = 2 * std::numbers::pi * mode_hz;
        const double stiffness = mass_kg * omega * omega, damping = 2 * damping_ratio * mass_kg * omega;
        Element spring{mode + "_mount", host.name, mode, {}};
        for (const auto& [law, value] : {std::pair{"linear_spring", stiffness}, std::pair{"viscous_damper", damping}}) {
          Law added;
          added.kind = find_law(law);
          added.values = {value};
          spring.laws.push_back(added);
        }
        const Mass sprung{mode, mass_kg, default_tolerance, host.rotary};
        const auto mount = [sprung, spring](Plant& other) {
          const auto has = [&](const std::string& name) {
            return std::any_of(other.masses.begin(), other.masses.end(),
                               [&](const Mass& mass) { return mass.name == name; });
          };
          if (!has(spring.from) || has(sprung.name)) return false;
          other.masses.push_back(sprung);
          other.elements.push_back(spring);
          return true;
        };
        list.push_back(with_path(plant, "added_mode", part_place(host.name), "mass on a spring",
                                 {{mode + ".mass_kg", mass_kg, third(mass_kg)},
                                  {spring.name + ".linear_spring.stiffness_n_per_m", stiffness, third(stiffness)},
                                  {spring.name + ".viscous_damper.damping_ns_per_m", damping, third(damping)}},
                                 mount));
        list.back().proportional = false;
        // What swings freely is a mode; what is damped to a crawl only mimics other effects.
        plausibly(list.back(), "mass_kg", 0.2 * mass_kg, 4 * mass_kg);
        plausibly(list.back(), "stiffness_n_per_m", 0.1 * stiffness, 10 * stiffness);
        plausibly(list.back(), "damping_ns_per_m", 0.1 * damping, 10 * damping);
      }
    }
  });
}

}  // namespace wheelhop
