/// \file
/// Gzip streams in memory.
#pragma once

#include <string>

namespace wheelhop {

/// The content of a gzip stream (one member or several). UserError naming `source` if it is not gzip, damaged,
/// truncated, followed by something else, or longer than 4 GiB when unpacked.
std::string unpack_gzip(const std::string& packed, const std::string& source);

/// Gzip stream without name and time stamp: the same content gives the same bytes.
std::string pack_gzip(const std::string& content);

}  // namespace wheelhop
