/// \file
/// Synthetic evidence for tests of the verdict: a car of three sensors, 10,000 values, and a gap of a given size.
#pragma once

#include "core/gap/verdict/evidence.hpp"
#include "tests/support/places.hpp"

namespace wheelhop::test {

/// A stage whose blocks all have one reduced chi-square.
inline GapStage stage_at(double misfit) { return {misfit, {0.1, 0.1, 0.1}, Vector::Constant(14, misfit)}; }

/// Re-tuning leaves `left` times the noise power, at three places that differ by a factor of three.
inline Evidence evidence_with_gap(double left) {
  Evidence evidence;
  evidence.noise = {{1e-5, 0.01, 0.06}, "repeats of one drive", 0.01, 1};
  evidence.samples = 10000;
  evidence.channels = 3;
  evidence.elements = {"suspension", "tyre"};
  evidence.delivered = stage_at(1 + 3 * left);
  evidence.retuned = stage_at(1 + left);
  evidence.delivered_chi2 = evidence.samples * (1 + 3 * left);
  evidence.retuned_chi2 = evidence.samples * (1 + left);
  evidence.retuned_misfit = 1 + left;
  const char* const names[] = {"body.mass_kg", "suspension.viscous_damper.damping_ns_per_m",
                               "tyre.linear_spring.stiffness_n_per_m"};
  const char* const effects[] = {"mass_error", "damping_error", "stiffness_error"};
  const char* const places[] = {"body", "suspension", "tyre"};
  for (int i = 0; i < 3; ++i)
    evidence.tolerances.push_back({names[i], effects[i], part_place(places[i]), 0.1, 0.1, 0.1, 0.1});
  evidence.tolerance_covariance = 0.01 * Matrix::Identity(3, 3);
  evidence.places = {{"suspension"_at, {}, 1}, {"guide:body"_at, {}, 3}, {"tyre"_at, {"actuator"_at}, 9}};
  evidence.places_needed = 1;
  return evidence;
}

/// An effect that leaves `left` times the noise power.
inline CandidateEvidence single(const Evidence& evidence, const EffectId& effect, const std::string& location,
                                double left) {
  CandidateEvidence candidate;
  candidate.effects = {{effect, place_from(location), "form", {{"size", 1, 0}}, {}}};
  candidate.chi2 = evidence.samples * (1 + left);
  candidate.parameters = 4;
  candidate.misfit = 1 + left;
  candidate.stage = stage_at(1 + left);
  const double value = 1 - left / std::max(evidence.retuned.misfit - 1, 1e-9);
  candidate.closure = {value, value - 0.02, value + 0.01};
  return candidate;
}

inline CandidateEvidence pair(const Evidence& evidence, const EffectId& first, const EffectId& second,
                              const std::string& first_at, const std::string& second_at, double left) {
  CandidateEvidence both = single(evidence, first, first_at, left);
  both.effects.push_back({second, place_from(second_at), "form", {{"size", 1, 0}}, {}});
  both.parameters = 5;
  return both;
}

/// A parameter set free of its tolerance. @param left of the noise power
inline FreedEvidence freed(const Evidence& evidence, std::size_t tolerance, double left) {
  FreedEvidence out;
  out.tolerance = tolerance;
  out.chi2 = evidence.samples * (1 + left);
  out.stage = stage_at(1 + left);
  out.closure_of_delivered = out.closure_of_retuned = {0.99, 0.98, 1};
  out.fitted = {evidence.tolerances[tolerance].parameter, 2, 0.1};
  out.theta = {0.1, 0.1, 0.1};
  out.theta[tolerance] = 6.5;
  out.std = 0.1;
  out.z = {0.1, 0.1, 0.1};
  return out;
}

/// Re-tuning has left a gap as large as the noise, and friction in the suspension closes it.
inline Evidence friction() {
  Evidence evidence = evidence_with_gap(1);
  evidence.singles = {single(evidence, "coulomb_friction", "suspension", 0.01),
                      single(evidence, "hysteresis", "tyre", 0.6)};
  return evidence;
}

/// Friction explains three quarters; with a tyre's damping all is explained.
inline Evidence two_effects() {
  Evidence evidence = evidence_with_gap(4);
  evidence.singles = {single(evidence, "coulomb_friction", "suspension", 1),
                      single(evidence, "tyre_damping", "tyre", 3)};
  evidence.pairs = {pair(evidence, "coulomb_friction", "tyre_damping", "suspension", "tyre", 0.01),
                    pair(evidence, "coulomb_friction", "time_delay", "suspension", "actuator", 0.9)};
  return evidence;
}

}  // namespace wheelhop::test
