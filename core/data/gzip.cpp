#include "core/data/gzip.hpp"

#include <fmt/core.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <new>

#include "core/base/files.hpp"
#include "core/base/status.hpp"

namespace wheelhop {
namespace {

constexpr int kGzipWindow = 15 + 16;  // largest window; 16 asks zlib for the gzip wrapper

/// zlib counts in 32 bits; longer buffers go through in pieces.
uInt piece(std::size_t size) { return static_cast<uInt>(std::min<std::size_t>(size, 1u << 30)); }

Bytef* bytes(const char* text) { return reinterpret_cast<Bytef*>(const_cast<char*>(text)); }

struct Inflater {
  z_stream stream{};
  explicit Inflater(int window) {
    if (inflateInit2(&stream, window) != Z_OK) throw std::bad_alloc();
  }
  ~Inflater() { inflateEnd(&stream); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;
};

}  // namespace

std::string unpack_gzip(const std::string& packed, const std::string& source) {
  if (packed.size() < 2 || packed[0] != '\x1f' || packed[1] != '\x8b')
    throw UserError(fmt::format("{}: expected a gzip stream, found {}", source,
                                packed.empty() ? "an empty file" : "other content"));
  Inflater inflater(kGzipWindow);
  z_stream& stream = inflater.stream;
  std::string content;
  std::size_t read = 0, written = 0;
  const double most = read_limits().unpacked_from(packed.size());
  for (;;) {
    if (written == content.size()) {
      const double wanted = static_cast<double>(std::max(2 * content.size(), 4 * packed.size() + 4096));
      content.resize(static_cast<std::size_t>(std::min(wanted, most + 1)));
    }
    stream.next_in = bytes(packed.data() + read);
    stream.avail_in = piece(packed.size() - read);
    stream.next_out = bytes(content.data() + written);
    stream.avail_out = piece(content.size() - written);
    const uInt in = stream.avail_in, out = stream.avail_out;
    const int outcome = inflate(&stream, Z_NO_FLUSH);
    read += in - stream.avail_in;
    written += out - stream.avail_out;
    if (static_cast<double>(written) > most)
      throw UserError(fmt::format("{}: expected at most {:.0f} bytes in a gzip stream of {}, found more; {}", source,
                                  most, packed.size(), how_to_lift));
    if (outcome == Z_STREAM_END) {
      while (read < packed.size() && packed[read] == '\0') ++read;  // padding that tapes and some writers leave
      if (read == packed.size()) break;
      if (packed[read] != '\x1f') throw UserError(fmt::format("{}: damaged: content after the gzip stream", source));
      inflateReset(&stream);
    } else if (read == packed.size() && stream.avail_out > 0) {
      throw UserError(fmt::format("{}: truncated: the gzip stream ends after {} unpacked bytes", source, written));
    } else if (outcome != Z_OK && outcome != Z_BUF_ERROR) {
      throw UserError(fmt::format("{}: damaged gzip stream after {} unpacked bytes: {}", source, written,
                                  stream.msg ? stream.msg : "bad data"));
    }
  }
  content.resize(written);
  return content;
}

std::optional<std::string> unpack_zlib(std::string_view packed, std::size_t most) {
  Inflater inflater(15);
  z_stream& stream = inflater.stream;
  std::string content(std::min<std::size_t>(most, 4096), '\0');
  std::size_t read = 0, written = 0;
  for (;;) {
    stream.next_in = bytes(packed.data() + read);
    stream.avail_in = piece(packed.size() - read);
    stream.next_out = bytes(content.data() + written);
    stream.avail_out = piece(content.size() - written);
    const uInt in = stream.avail_in, out = stream.avail_out;
    const int outcome = inflate(&stream, Z_NO_FLUSH);
    read += in - stream.avail_in;
    written += out - stream.avail_out;
    if (outcome == Z_STREAM_END || written == most) break;
    // Without progress in either direction zlib answers Z_BUF_ERROR, so this loop ends.
    if (outcome != Z_OK) return std::nullopt;
    if (written == content.size()) content.resize(std::min(most, 2 * content.size()));
  }
  content.resize(written);
  return content;
}

bool is_intact_zlib(std::string_view packed) {
  Inflater inflater(15);
  std::string scrap(1 << 16, '\0');
  std::size_t read = 0;
  for (;;) {
    z_stream& stream = inflater.stream;
    stream.next_in = bytes(packed.data() + read);
    stream.avail_in = piece(packed.size() - read);
    stream.next_out = bytes(scrap.data());
    stream.avail_out = piece(scrap.size());
    const uInt in = stream.avail_in;
    const int outcome = inflate(&stream, Z_NO_FLUSH);
    read += in - stream.avail_in;
    if (outcome == Z_STREAM_END) return true;
    // Without progress in either direction zlib answers Z_BUF_ERROR, so this loop ends.
    if (outcome != Z_OK) return false;
  }
}

std::string pack_gzip(const std::string& content) {
  z_stream stream{};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzipWindow, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
  std::string packed(1 << 16, '\0');
  std::size_t read = 0, written = 0;
  int outcome = Z_OK;
  while (outcome != Z_STREAM_END) {
    if (written == packed.size()) packed.resize(2 * packed.size());
    stream.next_in = bytes(content.data() + read);
    stream.avail_in = piece(content.size() - read);
    stream.next_out = bytes(packed.data() + written);
    stream.avail_out = piece(packed.size() - written);
    const uInt in = stream.avail_in, out = stream.avail_out;
    const bool last = read + in == content.size();
    outcome = deflate(&stream, last ? Z_FINISH : Z_NO_FLUSH);
    read += in - stream.avail_in;
    written += out - stream.avail_out;
  }
  deflateEnd(&stream);
  packed.resize(written);
  return packed;
}

}  // namespace wheelhop
