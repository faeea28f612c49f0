/// \file
/// The evidence of a diagnosis: everything that fits and simulations have told, as plain numbers and names. `decide`
/// reads nothing else, so that a verdict can be read, stored and made again without a simulation.
#pragma once

#include <array>
#include <limits>
#include <string>
#include <vector>

#include "core/base/json.hpp"
#include "core/base/place.hpp"

namespace wheelhop {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// The plant at a stage on the held-out records: as delivered, re-tuned, with the answer.
struct GapStage {
  double misfit = 0;              ///< reduced chi-square, 1 at the floor; NaN where the plant does not follow the drive
  std::vector<double> nrmse;      ///< p, RMS of the error over RMS of the record
  Vector blocks;                  ///< reduced chi-square of each block of time; empty where a simulation failed
  std::vector<double> rmse = {};  ///< p, RMS of the error, in the unit of the channel
  template <class V>
  void fields(V&& visit) {
    visit("misfit", misfit);
    visit("rmse", rmse);
    visit("nrmse", nrmse);
    visit("blocks", blocks);
  }
};

/// Share of a gap that goes.
struct Closure {
  double value = 0;          ///< 1 - (J_after - 1) / (J_before - 1), J the reduced chi-square
  double low = 0, high = 0;  ///< 90 % interval
  template <class V>
  void fields(V&& visit) {
    visit("value", value);
    visit("low", low);
    visit("high", high);
  }
};

/// Closure of an answer that changes nothing: 0, and no interval.
inline constexpr Closure kNothingAdded{0, kUnknown, kUnknown};

/// A gross fault of an instrument, as the plant without it tells.
struct InstrumentFault {
  EffectId effect;   ///< gain_error, bias or clock_skew
  Place location;    ///< of a channel, a drive or the clock
  double value = 0;  ///< of a gain: y ~ value * y_plant by least squares; of a bias in the unit of the channel
  template <class V>
  void fields(V&& visit) {
    visit("effect", effect);
    visit("location", location);
    visit("value", value);
  }
};

/// A place at which something unknown may act on the plant or on a record.
struct PlaceLeftover {
  Place location;           ///< an element, a guide or a sensor
  std::vector<Place> same;  ///< further locations that enter the same way: no record can tell them apart
  double leftover = 0;      ///< what an unknown signal there leaves, over the noise: 1 where it explains all
  template <class V>
  void fields(V&& visit) {
    visit("location", location);
    visit("same", same);
    visit("leftover", leftover);
  }
};
/// All places at which a signal enters as it does at this one.
inline std::vector<Place> entries_of(const PlaceLeftover& place) {
  std::vector<Place> entries = place.same;
  entries.insert(entries.begin(), place.location);
  return entries;
}

/// Two places, at each of which an unknown signal of its own may enter.
struct PairLeftover {
  std::array<Place, 2> locations;
  double leftover = 0;  ///< as a single place's
  template <class V>
  void fields(V&& visit) {
    visit("locations", locations);
    visit("leftover", leftover);
  }
};

/// The noise floor, as chi2 is measured with it.
struct NoiseEvidence {
  std::vector<double> std;  ///< p, of one record, in the units of the outputs
  std::string source;       ///< repeats, noise_std or estimated, in words
  double power_error = 0;   ///< relative standard error of the noise power
  double colour = 1;        ///< largest density of the noise over its mean density
  template <class V>
  void fields(V&& visit) {
    visit("std", std);
    visit("source", source);
    visit("power_error", power_error);
    visit("colour", colour);
  }
};

/// True of effects that are a wrong value of the plant file: mass_error, stiffness_error, damping_error.
bool is_parameter_error(const EffectId& effect);

/// A parameter of the plant file after re-tuning inside the tolerances.
struct ToleranceEvidence {
  std::string parameter;  ///< full name in the plant
  EffectId effect;        ///< what an error of it is called
  Place location;
  double theta = 0, std = 0;  ///< deviation from the plant file and its posterior standard deviation, in tolerances
  double z = 0;               ///< leave-prior-out z: deviation the data alone see, over its standard deviation
  double influence = 0;       ///< RMS change of the residuals that its deviation makes, in units of the noise
  EffectAt name() const { return {effect, location}; }
  template <class V>
  void fields(V&& visit) {
    visit("parameter", parameter);
    visit("effect", effect);
    visit("location", location);
    visit("theta", theta);
    visit("std", std);
    visit("z", z);
    visit("influence", influence);
  }
};

struct FittedParameter {
  std::string name;
  double value = 0, std = 0;  ///< std 0: not known
  template <class V>
  void fields(V&& visit) {
    visit("name", name);
    visit("value", value);
    visit("std", std);
  }
};

/// A size that makes an effect what its name says.
struct DefiningSize {
  std::string parameter;
  double value = 0, low = 0, high = 0;  ///< nine of ten lie between low and high
  double z = 0;                         ///< standard deviations of its logarithm above the middle
  template <class V>
  void fields(V&& visit) {
    visit("parameter", parameter);
    visit("value", value);
    visit("low", low);
    visit("high", high);
    visit("z", z);
  }
};

struct EffectEvidence {
  EffectId effect;
  Place location;
  std::string form;
  std::vector<FittedParameter> parameters;
  std::vector<DefiningSize> defining;
  bool elastic = false;      ///< it is a law whose force is one of the travel alone (LawKind::is_elastic)
  bool dissipative = false;  ///< it is a law whose force stores nothing (LawKind::is_dissipative)
  EffectAt name() const { return {effect, location}; }
  template <class V>
  void fields(V&& visit) {
    visit("effect", effect);
    visit("location", location);
    visit("form", form);
    visit("parameters", parameters);
    visit("defining", defining);
    visit("elastic", elastic);
    visit("dissipative", dissipative);
  }
};

/// A parameter set free of its tolerance in the fit of a candidate.
struct FreedEvidence {
  std::size_t tolerance = 0;  ///< index into Evidence::tolerances
  double chi2 = 0;            ///< of the fit with it free
  double prior_chi2 = 0;      ///< of that, the priors of the other parameters
  GapStage stage;
  Closure closure_of_delivered, closure_of_retuned;
  FittedParameter fitted;
  double std = 0;  ///< posterior standard deviation of its deviation, without a prior of its own, in tolerances
  /// The part of std that comes from the priors of the other tolerances, in tolerances. The rest,
  /// sqrt(std^2 - std_of_tolerances^2), comes from noise.
  double std_of_tolerances = 0;
  std::vector<double> theta;  ///< of all tolerances, in tolerances; its own among them
  /// Tolerances that would have to move with it for the outputs to stay as they are, where the records do not tell it
  /// from them: only ratios of masses, stiffnesses and damping show where no force is measured. Empty where they do.
  std::vector<std::size_t> not_told_from;
  std::vector<double> z;  ///< leave-prior-out, of all tolerances; empty where the fit was not linearised
  template <class V>
  void fields(V&& visit) {
    visit("tolerance", tolerance);
    visit("chi2", chi2);
    visit("prior_chi2", prior_chi2);
    visit("stage", stage);
    visit("closure_of_delivered", closure_of_delivered);
    visit("closure_of_retuned", closure_of_retuned);
    visit("fitted", fitted);
    visit("std", std);
    visit("std_of_tolerances", std_of_tolerances);
    visit("theta", theta);
    visit("not_told_from", not_told_from);
    visit("z", z);
  }
};

/// Effects added to the plant, fitted together with the parameters inside their tolerances. A model form that may go by
/// several labels is fitted once, and is one candidate by each.
struct CandidateEvidence {
  std::vector<EffectEvidence> effects;
  /// Index of the fit among those of its list. Candidates that share it differ by their labels and the plausibility
  /// under them. What is asked of a leading candidate alone (left_at_place, alone_chi2, without_chi2, freed, standard
  /// deviations) is known for that one only.
  std::size_t fit = 0;
  double chi2 = 0;              ///< residuals of fitted and held-out records and priors
  double prior_chi2 = 0;        ///< of that, the priors of the parameters
  double log_plausibility = 0;  ///< log density of the sizes of its effects
  std::size_t parameters = 0;   ///< that the fit moved, tolerances included
  double misfit = 0;            ///< reduced chi-square of the fitted records
  GapStage stage;               ///< on the held-out records
  Closure closure;              ///< of what re-tuning leaves
  std::vector<double> theta;    ///< of all tolerances; with z empty where the fit was not linearised
  std::vector<double> z;
  double left_at_place = kUnknown;  ///< what an unknown signal at its place leaves with the effect, over the best
                                    ///< place; of several effects, at that of their places where this is least
  std::array<double, 2> alone_chi2{kUnknown, kUnknown};  ///< of a pair: chi2 of either effect alone, fitted anew
  std::vector<double> without_chi2;  ///< of more than two effects: chi2 of all but one, fitted anew; the last one apart
  std::vector<FreedEvidence> freed;  ///< parameters set free beside the effects, each alone
  const EffectEvidence& last() const { return effects.back(); }
  template <class V>
  void fields(V&& visit) {
    visit("effects", effects);
    visit("fit", fit);
    visit("chi2", chi2);
    visit("prior_chi2", prior_chi2);
    visit("log_plausibility", log_plausibility);
    visit("parameters", parameters);
    visit("misfit", misfit);
    visit("stage", stage);
    visit("closure", closure);
    visit("theta", theta);
    visit("z", z);
    visit("left_at_place", left_at_place);
    visit("alone_chi2", alone_chi2);
    visit("without_chi2", without_chi2);
    visit("freed", freed);
  }
};

/// Faults of instruments that were put into the plant before anything else was asked: all other evidence is that of the
/// plant with them, their sizes inside a tolerance of their own.
struct CorrectionEvidence {
  std::vector<EffectEvidence> faults;  ///< none: the plant is as delivered
  GapStage retuned_without;            ///< re-tuned inside the tolerances without them
  double chi2_without = 0;             ///< of that plant
  Closure closure;                     ///< of what that plant leaves, by the faults alone
  Closure closure_with_answer;         ///< likewise, by the faults and the answer beside them
  double interpolation = 0;            ///< reduced chi2 that putting readings of a wrong clock onto its grid makes
  template <class V>
  void fields(V&& visit) {
    visit("faults", faults);
    visit("retuned_without", retuned_without);
    visit("chi2_without", chi2_without);
    visit("closure", closure);
    visit("closure_with_answer", closure_with_answer);
    visit("interpolation", interpolation);
  }
};

/// Readings of a channel that lie on a lattice, as a converter makes them.
struct LatticeEvidence {
  std::string channel;
  double step = 0;         ///< in the unit of the channel
  double noise_share = 0;  ///< power of the rounding over that of the noise floor
  template <class V>
  void fields(V&& visit) {
    visit("channel", channel);
    visit("step", step);
    visit("noise_share", noise_share);
  }
};

/// How much of the unknown signal at a place is a function of what moves at an entry.
struct MotionShare {
  Place at;               ///< place whose unknown signal is asked about
  Place entry;            ///< whose motion it is compared with; empty: all that moves
  bool attached = false;  ///< the entry is an element that hangs on the guided mass `at`
  double share = 0;       ///< 0 ... 1; NaN where the signal cannot be reconstructed
  template <class V>
  void fields(V&& visit) {
    visit("at", at);
    visit("entry", entry);
    visit("attached", attached);
    visit("share", share);
  }
};

struct Evidence {
  NoiseEvidence noise;
  std::string cannot_follow;  ///< why the plant cannot be compared at all; empty otherwise
  bool held_out = true;       ///< false: there is no validation record, and every figure is of the records fitted
  double judged_from_s = 0;   ///< start of the records that no figure counts
  double samples = 0;         ///< values behind chi2: chi2 of a plant at the floor
  double dispersion = 1;      ///< variance of residuals that the fits expect, in units of the noise's
  std::size_t channels = 0;
  std::vector<std::string> elements;  ///< of the plant
  GapStage delivered;                 ///< of the plant as it came, without any correction
  GapStage retuned;
  double delivered_chi2 = 0, retuned_chi2 = 0, retuned_prior_chi2 = 0;
  double retuned_misfit = 0;     ///< reduced chi-square of the fitted records
  bool retuned_stopped = false;  ///< a parameter went as far as re-tuning may move it
  std::vector<ToleranceEvidence> tolerances;
  Matrix tolerance_covariance;                ///< of their deviations, in tolerances squared
  std::vector<InstrumentFault> gross_faults;  ///< seen at the plant as delivered, and not corrected
  CorrectionEvidence correction;
  std::vector<PlaceLeftover> places;  ///< ascending by leftover
  std::vector<PairLeftover> place_pairs;
  int places_needed = 0;             ///< places that explain what re-tuning leaves: 1, 2, or 0 for neither or not known
  std::vector<FreedEvidence> freed;  ///< parameters set free in the plant without effects
  std::vector<CandidateEvidence> singles;  ///< ascending by chi2
  std::vector<CandidateEvidence> pairs;    ///< of the last search for a second effect, ascending by chi2
  std::vector<CandidateEvidence> larger;   ///< sets of three effects and more
  std::vector<LatticeEvidence> lattices;
  std::vector<MotionShare> motion;
  template <class V>
  void fields(V&& visit) {
    visit("noise", noise);
    visit("cannot_follow", cannot_follow);
    visit("held_out", held_out);
    visit("judged_from_s", judged_from_s);
    visit("samples", samples);
    visit("dispersion", dispersion);
    visit("channels", channels);
    visit("elements", elements);
    visit("delivered", delivered);
    visit("retuned", retuned);
    visit("delivered_chi2", delivered_chi2);
    visit("retuned_chi2", retuned_chi2);
    visit("retuned_prior_chi2", retuned_prior_chi2);
    visit("retuned_misfit", retuned_misfit);
    visit("retuned_stopped", retuned_stopped);
    visit("tolerances", tolerances);
    visit("tolerance_covariance", tolerance_covariance);
    visit("gross_faults", gross_faults);
    visit("correction", correction);
    visit("places", places);
    visit("place_pairs", place_pairs);
    visit("places_needed", places_needed);
    visit("freed", freed);
    visit("singles", singles);
    visit("pairs", pairs);
    visit("larger", larger);
    visit("lattices", lattices);
    visit("motion", motion);
  }
};

/// The evidence as JSON, member by member; numbers that are not finite become null.
Json to_json(const Evidence& evidence);
/// Reads it back, to the last bit. UserError with file and path where a member is missing or of the wrong type.
Evidence evidence_from(const JsonCursor& cursor);

}  // namespace wheelhop
