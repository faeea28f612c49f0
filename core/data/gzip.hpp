/// \file
/// Gzip streams in memory.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace wheelhop {

/// The content of a gzip stream (one member or several). UserError naming `source` if it is not gzip, damaged,
/// truncated, followed by something else, or longer than ReadLimits allows when unpacked.
std::string unpack_gzip(const std::string& packed, const std::string& source);

/// The first `most` bytes of what a zlib stream holds, all where it holds fewer. Nothing if it is damaged before that.
std::optional<std::string> unpack_zlib(std::string_view packed, std::size_t most);

/// True if the bytes are one whole zlib stream whose check sum is right.
bool is_intact_zlib(std::string_view packed);

/// Gzip stream without name and time stamp: the same content gives the same bytes.
std::string pack_gzip(const std::string& content);

}  // namespace wheelhop
