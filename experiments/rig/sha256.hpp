/// \file
/// SHA-256 (FIPS 180-4), for the seal of a key: whoever holds the sum can tell later that the key was not changed.
#pragma once

#include <string>
#include <string_view>

namespace wheelhop::blind {

/// 64 hexadecimal digits.
std::string sha256(std::string_view bytes);

}  // namespace wheelhop::blind
