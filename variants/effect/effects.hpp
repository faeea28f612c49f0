/// \file
/// The effect families, one file each. A new one is a file, a line here and a line in table.cpp.
#pragma once

#include "variants/effect_build.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_coulomb_friction(const EffectOptions&);
std::shared_ptr<const Effect> make_hysteresis(const EffectOptions&);
std::shared_ptr<const Effect> make_series_compliance(const EffectOptions&);
std::shared_ptr<const Effect> make_damper_asymmetry(const EffectOptions&);
std::shared_ptr<const Effect> make_damper_nonlinearity(const EffectOptions&);
std::shared_ptr<const Effect> make_damper_fade(const EffectOptions&);
std::shared_ptr<const Effect> make_cavitation(const EffectOptions&);
std::shared_ptr<const Effect> make_bump_stop(const EffectOptions&);
std::shared_ptr<const Effect> make_backlash(const EffectOptions&);
std::shared_ptr<const Effect> make_spring_nonlinearity(const EffectOptions&);
std::shared_ptr<const Effect> make_tyre_nonlinearity(const EffectOptions&);
std::shared_ptr<const Effect> make_tyre_damping(const EffectOptions&);
std::shared_ptr<const Effect> make_tyre_liftoff(const EffectOptions&);
std::shared_ptr<const Effect> make_time_delay(const EffectOptions&);
std::shared_ptr<const Effect> make_actuator_lag(const EffectOptions&);
std::shared_ptr<const Effect> make_rate_limit(const EffectOptions&);
std::shared_ptr<const Effect> make_saturation(const EffectOptions&);
std::shared_ptr<const Effect> make_gain_error(const EffectOptions&);
std::shared_ptr<const Effect> make_sensor_lag(const EffectOptions&);
std::shared_ptr<const Effect> make_high_pass(const EffectOptions&);
std::shared_ptr<const Effect> make_bias(const EffectOptions&);
std::shared_ptr<const Effect> make_drift(const EffectOptions&);
std::shared_ptr<const Effect> make_clock_skew(const EffectOptions&);
std::shared_ptr<const Effect> make_crosstalk(const EffectOptions&);
std::shared_ptr<const Effect> make_quantisation(const EffectOptions&);
std::shared_ptr<const Effect> make_added_damping(const EffectOptions&);
std::shared_ptr<const Effect> make_added_stiffness(const EffectOptions&);
std::shared_ptr<const Effect> make_added_mode(const EffectOptions&);
std::shared_ptr<const Effect> make_inertance(const EffectOptions&);
std::shared_ptr<const Effect> make_static_offset(const EffectOptions&);
std::shared_ptr<const Effect> make_load(const EffectOptions&);

}  // namespace wheelhop
