#include "variants/table.hpp"
#include "variants/effect/effects.hpp"
#include "variants/extra.hpp"

namespace wheelhop {

const std::vector<Entry<EffectPiece>>& effect_table() {
  static const std::vector<Entry<EffectPiece>> table = with_extra(
      {table_entry<EffectPiece, EffectOptions, make_coulomb_friction>(
           "coulomb_friction", "Coulomb; smoothed after Threlfall 1978", "sliding friction of an element"),
       table_entry<EffectPiece, EffectOptions, make_hysteresis>("hysteresis", "Bouc 1967; Wen 1976",
                                                                "rate-independent hysteresis of bushings and strut"),
       table_entry<EffectPiece, EffectOptions, make_series_compliance>(
           "series_compliance", "Maxwell 1867", "a spring in series with a damper: top mount, oil and gas"),
       table_entry<EffectPiece, EffectOptions, make_damper_asymmetry>(
           "damper_asymmetry", "rebound and jounce valves of a shock absorber",
           "damping that differs between growing and shrinking travel"),
       table_entry<EffectPiece, EffectOptions, make_damper_nonlinearity>(
           "damper_nonlinearity", "valve characteristics; motion ratio", "damping that depends on speed or position"),
       table_entry<EffectPiece, EffectOptions, make_damper_fade>("damper_fade", "viscosity over temperature",
                                                                 "damping that is lost as the damper warms"),
       table_entry<EffectPiece, EffectOptions, make_cavitation>("cavitation", "aeration of a damper",
                                                                "dead travel after a reversal, on one side"),
       table_entry<EffectPiece, EffectOptions, make_bump_stop>("bump_stop", "foam stops, exponents 2 to 3.5",
                                                               "an end stop on either side"),
       table_entry<EffectPiece, EffectOptions, make_backlash>("backlash", "clearance of a joint",
                                                              "play in a joint of the element"),
       table_entry<EffectPiece, EffectOptions, make_spring_nonlinearity>(
           "spring_nonlinearity", "progressive springs, ride height", "a spring that is not as delivered"),
       table_entry<EffectPiece, EffectOptions, make_tyre_nonlinearity>(
           "tyre_nonlinearity", "tyre force over deflection to the power 1.1 to 1.3",
           "a tyre whose stiffness changes with deflection"),
       table_entry<EffectPiece, EffectOptions, make_tyre_damping>("tyre_damping", "rolling tyres: 50 to 500 Ns/m",
                                                                  "damping of a tyre that was delivered without"),
       table_entry<EffectPiece, EffectOptions, make_tyre_liftoff>("tyre_liftoff", "unilateral contact",
                                                                  "a tyre that leaves the road"),
       table_entry<EffectPiece, EffectOptions, make_time_delay>("time_delay", "converters and networks: 0.1 to 10 ms",
                                                                "a delay between command and plant, or of a sensor"),
       table_entry<EffectPiece, EffectOptions, make_actuator_lag>("actuator_lag", "servo hydraulics: 20 to 60 Hz",
                                                                  "an actuator of finite bandwidth"),
       table_entry<EffectPiece, EffectOptions, make_rate_limit>("rate_limit", "servo valves; slew rate of amplifiers",
                                                                "an actuator or amplifier of limited speed"),
       table_entry<EffectPiece, EffectOptions, make_saturation>("saturation", "end of stroke; full scale of sensors",
                                                                "an actuator or sensor of limited range"),
       table_entry<EffectPiece, EffectOptions, make_gain_error>("gain_error", "calibration: 1 to 3 %",
                                                                "a wrong gain of a sensor or a drive"),
       table_entry<EffectPiece, EffectOptions, make_sensor_lag>("sensor_lag", "anti-alias filters: 2 to 8 ms",
                                                                "the phase of a sensor or its filter"),
       table_entry<EffectPiece, EffectOptions, make_high_pass>("high_pass", "AC coupling: 0.01 to 5 Hz",
                                                               "a sensor that loses what is slow or constant"),
       table_entry<EffectPiece, EffectOptions, make_bias>("bias", "0.05 to 0.5 m/s^2, millimetres",
                                                          "an offset of a sensor"),
       table_entry<EffectPiece, EffectOptions, make_drift>("drift", "warming electronics", "a sensor that drifts"),
       table_entry<EffectPiece, EffectOptions, make_clock_skew>("clock_skew", "quartz clocks: 10 to 100 ppm",
                                                                "clocks of drive and record that run apart"),
       table_entry<EffectPiece, EffectOptions, make_crosstalk>("crosstalk", "tilted mounts: 0.5 to 3 %",
                                                               "a channel that sees a share of another"),
       table_entry<EffectPiece, EffectOptions, make_quantisation>("quantisation", "converters of 8 to 12 bits",
                                                                  "readings rounded to steps that matter"),
       table_entry<EffectPiece, EffectOptions, make_added_damping>("added_damping", "guides, hoses, open dampers",
                                                                   "a damper that the plant does not know"),
       table_entry<EffectPiece, EffectOptions, make_added_stiffness>(
           "added_stiffness", "gas of a damper, bellows, hoses", "a spring that the plant does not know"),
       table_entry<EffectPiece, EffectOptions, make_added_mode>("added_mode", "seats, engines, top mounts: 4 to 60 Hz",
                                                                "a mass on a spring that the plant does not know"),
       table_entry<EffectPiece, EffectOptions, make_inertance>("inertance", "M. C. Smith 2002; hydraulic mounts",
                                                               "a mass that only relative motion accelerates"),
       table_entry<EffectPiece, EffectOptions, make_static_offset>("static_offset", "ride height: 5 to 20 mm",
                                                                   "a spring that works about another point"),
       table_entry<EffectPiece, EffectOptions, make_load>("load", "weight, payload, preload",
                                                          "a constant force on a mass that the plant does not know")},
      extra_pieces().effect);
  return table;
}

std::vector<EffectCandidate> effect_candidates(const Plant& plant, const Operation& operation) {
  std::vector<EffectCandidate> all;
  for (const Entry<EffectPiece>& entry : effect_table()) {
    const Json config = {{"name", entry.name}};
    const EffectPiece family = entry.make(JsonCursor::from(config, "effect")).piece;
    for (EffectCandidate& candidate : family->candidates(plant, operation)) all.push_back(std::move(candidate));
  }
  return all;
}

}  // namespace wheelhop
