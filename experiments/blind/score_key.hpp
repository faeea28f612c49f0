/// \file
/// The key of a blind test: what each case truly holds.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace wheelhop::scoring {

/// What a case asks of the answer. `mixed` is an effect and a wrong parameter; `left_out` a single effect whose
/// family was taken out of the catalogue.
enum class CaseKind { none, single, parameter, unknown, twofold, mixed, left_out };
std::string to_string(CaseKind kind);

struct TrueEffect {
  std::string effect, location;
  std::string form;                    ///< what the generator calls it; empty where the key does not say
  std::optional<bool> catalogue_form;  ///< the formula is one that the catalogue fits
  bool in_catalogue = true;

  std::string name() const { return effect + "@" + location; }
};

struct TrueCase {
  std::string name;
  CaseKind kind = CaseKind::none;
  std::string set, drive, plant;    ///< empty where the key does not say
  std::string strength;             ///< weak, medium or strong; empty where neither class nor gap is given
  std::optional<double> gap_sigma;  ///< gap after re-tuning over the noise
  std::vector<TrueEffect> effects;
};

/// Reads `key.json`, or the one in a folder: an array of `{"case", "class", "effects": [{"effect", "location"}]}`. The
/// class is `none`, `single`, `parameter`, `unknown` (or `open`), `double` or `mixed` (one of its two effects is a
/// parameter); without it, and for `single`, the effects tell: a `mass_error`, `stiffness_error` or `damping_error` is
/// a parameter, `"in_catalogue": false` an unknown. Optional: `set`, `strength_class` (else by `gap_sigma`), `drive`,
/// `plant`, and of an effect `form` and `catalogue_form` (else: whether the form is called "catalogue"); other keys are
/// the generator's own. Entries whose case is null were not made and are left out. UserError for a mistake in any of
/// them, a case twice, a class that its effects belie.
std::vector<TrueCase> load_key(const std::filesystem::path& key);

/// mass_error, stiffness_error or damping_error.
bool is_wrong_parameter(const TrueEffect& effect);

/// The file that load_key reads.
std::filesystem::path key_file(const std::filesystem::path& key);

/// The same place: equal names, or `actuator` and the `actuator:INPUT` of a plant with several inputs.
bool same_location(const std::string& a, const std::string& b);

}  // namespace wheelhop::scoring
