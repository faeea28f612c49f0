/// \file
/// The config of a set of blind cases, and the cases it asks for.
#pragma once

#include <memory>

#include "core/base/options.hpp"
#include "experiments/rig/drives.hpp"
#include "experiments/rig/effects.hpp"

namespace wheelhop::blind {

/// An effect that a case shall have, before its form is drawn.
struct Wanted {
  const EffectKind* kind = nullptr;
  std::string place;
};

/// One case as the config asks for it. Everything random about it follows from (seed, number).
struct CaseSpec {
  std::uint64_t seed = 1, number = 0;
  std::string set, case_class;  ///< class: single, none, parameter, unknown, double, mixed
  std::shared_ptr<const Plan> plan;
  std::vector<Wanted> effects;           ///< of class mixed: an effect of the catalogue, then a wrong parameter
  std::string strength_class;            ///< weak, medium, strong; empty for class none and where the size is given
  std::pair<double, double> size{0, 0};  ///< of an effect, drawn between; zeros where the gap sets it
  DriveShape drive;
  bool coloured = false, truth = true;
  double noise_low = 0.01, noise_high = 0.02;
  Index samples = 8000;
};

/// Members of a config of blind cases beside its sets.
struct CasesOptions {
  Index seed = 1;
  bool truth = true;
  template <class V>
  void fields(V&& visit) {
    visit("seed", seed, Range{0}, "-", "of everything random");
    visit("truth", truth, "whether the key holds the state of the rig that no sensor shows");
  }
};

/// Members of a set of blind cases beside `plant`, `effects` and `parameters`.
struct SetOptions {
  std::string name, case_class, kinds = "first";
  std::vector<std::string> strengths = {"weak", "medium", "strong"}, drives = {"multisine"}, noise = {"white"};
  Index seeds = 1, samples = 8000;
  double level = 0.008;
  std::pair<double, double> size{0, 0}, band_hz{0.3, 25}, noise_relative{0.01, 0.02};
  template <class V>
  void fields(V&& visit) {
    visit("name", name, Choices{}, "of the set");
    visit("class", case_class, Choices{{"single", "none", "parameter", "unknown", "double", "mixed"}},
          "what is withheld: one effect of the catalogue, nothing, a wrong parameter, an effect that no catalogue has, "
          "two effects, or one effect and a wrong parameter");
    visit("kinds", kinds, Choices{{"first", "added", "all"}},
          "which kinds of catalogue effects \"effects\" means: those of the first sets, those added since, or both");
    visit("strengths", strengths, Choices{{"weak", "medium", "strong"}}, "each effect in each of them");
    visit("drives", drives, Choices{drive_names()}, "taken in turn");
    visit("noise", noise, Choices{{"white", "coloured"}}, "taken in turn");
    visit("seeds", seeds, Range{1, 100000}, "-",
          "cases of each effect and strength; of the classes none, double and mixed: how many cases");
    visit("size", size, Range{0, 1e12}, "-",
          "of class single: drawn between these in the measure of the kind, in place of the strengths; 0: by the "
          "strengths");
    visit("samples", samples, Range{200, 1e7}, "-", "of each record");
    visit("level", level, Range{1e-12}, "m", "RMS of the drive");
    visit("band_hz", band_hz, Range{0.05, 90}, "Hz", "of the drive");
    visit("noise_relative", noise_relative, Range{1e-6, 1}, "-", "noise over the RMS of each sensor, drawn between");
  }
};

/// Config: {members of CasesOptions, "sets": [SET, ...]}, SET: the members of SetOptions, of which `name` and `class`
/// have no default, "plant": NAME of a file plants/NAME.json beside the config, or a plant file's object, and
/// "effects"?: "all" or a list of "ID", "ID@PLACE" or a form's text; of class mixed also "parameters"?: the same for
/// wrong parameters. An item that fits no kind of those that `kinds` names may be of the others.
/// Drives and noises take turns in drawn orders; where a place is not named it is drawn; pairs of effects stand at one
/// place and at two by turns; of class mixed every effect and every parameter has its turn. UserError on every mistake.
/// @param seed replaces that of the config where it is given
std::vector<CaseSpec> read_cases(const JsonCursor& config, std::optional<std::uint64_t> seed);

}  // namespace wheelhop::blind
