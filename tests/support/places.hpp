/// \file
/// Places and effects at places, written in tests as their texts.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

#include "core/base/place.hpp"

namespace wheelhop::test {

/// "sensor:travel"_at
inline Place operator""_at(const char* text, std::size_t length) { return place_from({text, length}); }

/// "coulomb_friction@suspension"_effect
inline EffectAt operator""_effect(const char* text, std::size_t length) {
  const std::string whole(text, length);
  const std::size_t at = whole.find('@');
  if (at == std::string::npos) throw std::invalid_argument(whole + ": expected EFFECT@PLACE");
  return {EffectId(whole.substr(0, at)), place_from(whole.substr(at + 1))};
}

}  // namespace wheelhop::test
