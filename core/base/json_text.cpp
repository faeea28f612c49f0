// Text to JSON value: a SAX handler of our own, because the library's own DOM parser lets the last of two equal keys
// win and reports an overflowing number without its place.
#include <fmt/core.h>

#include <algorithm>
#include <cstddef>
#include <iterator>

#include "core/base/json.hpp"
#include "core/base/status.hpp"

namespace wheelhop {
namespace {

constexpr std::size_t kMaximalDepth = 200;  // copying and printing a value recurse

[[noreturn]] void fail_at(const std::string& text, const std::string& source, std::size_t offset,
                          const std::string& what) {
  offset = std::min(offset, text.size());
  const std::string_view before(text.data(), offset);
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t newline = before.rfind('\n');
  const std::size_t column = newline == std::string_view::npos ? offset + 1 : offset - newline;
  throw UserError(fmt::format("{}: line {}, column {}: {}", source, line, column, what));
}

/// Reads characters and keeps the place in sight of the handler.
class Cursor {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  Cursor(const char* place, const char** shared) : place_(place), shared_(shared) {}
  reference operator*() const { return *place_; }
  Cursor& operator++() {
    *shared_ = ++place_;
    return *this;
  }
  Cursor operator++(int) {
    Cursor old = *this;
    ++*this;
    return old;
  }
  bool operator==(const Cursor& other) const { return place_ == other.place_; }
  bool operator!=(const Cursor& other) const { return place_ != other.place_; }

 private:
  const char* place_;
  const char** shared_;
};

class Builder : public nlohmann::json_sax<Json> {
 public:
  Builder(const std::string& text, const std::string& source, const char* const& place)
      : text_(text), source_(source), place_(place) {}

  Json take() { return std::move(root_); }

  bool null() override { return add(nullptr); }
  bool boolean(bool value) override { return add(value); }
  bool number_integer(number_integer_t value) override { return add(value); }
  bool number_unsigned(number_unsigned_t value) override { return add(value); }
  bool number_float(number_float_t value, const string_t&) override { return add(value); }
  bool string(string_t& value) override { return add(std::move(value)); }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(Json::object()); }
  bool start_array(std::size_t) override { return open(Json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& name) override {
    if (open_.back()->contains(name)) {
      // The place is just behind the closing quote; step back to the opening one.
      std::size_t offset = static_cast<std::size_t>(place_ - text_.data()) - 1;
      while (offset > 0 && !opens_string(--offset)) {
      }
      fail_at(text_, source_, offset, fmt::format("expected each key once in an object, found \"{}\" again", name));
    }
    key_ = name;
    return true;
  }

  bool parse_error(std::size_t position, const std::string& token, const nlohmann::detail::exception& error) override {
    std::string what = error.what();
    if (error.id == 406) {
      what = fmt::format("expected a number within the range of a double, found {}", token);
    } else {
      // Drop the library's own prefix "[json.exception...] parse error at line L, column C: ".
      const std::size_t column = what.find("column ");
      const std::size_t colon = column == std::string::npos ? column : what.find(": ", column);
      if (colon != std::string::npos) what.erase(0, colon + 2);
      what = "expected JSON, found a " + what;
    }
    fail_at(text_, source_, position > 0 ? position - 1 : 0, what);
  }

 private:
  bool opens_string(std::size_t offset) const {
    if (text_[offset] != '"') return false;
    std::size_t backslashes = 0;
    while (backslashes < offset && text_[offset - backslashes - 1] == '\\') ++backslashes;
    return backslashes % 2 == 0;
  }

  Json* place(Json&& value) {
    if (open_.empty()) {
      root_ = std::move(value);
      return &root_;
    }
    Json& parent = *open_.back();
    if (parent.is_array()) {
      parent.push_back(std::move(value));
      return &parent.back();
    }
    return &(parent[key_] = std::move(value));
  }

  template <class Value>
  bool add(Value&& value) {
    place(Json(std::forward<Value>(value)));
    return true;
  }

  // While a child is open its parent does not grow, so the pointers stay good.
  bool open(Json&& value) {
    if (open_.size() >= kMaximalDepth)
      fail_at(text_, source_, static_cast<std::size_t>(place_ - text_.data()) - 1,
              fmt::format("expected at most {} nested levels, found more", kMaximalDepth));
    open_.push_back(place(std::move(value)));
    return true;
  }

  bool close() {
    open_.pop_back();
    return true;
  }

  const std::string& text_;
  const std::string& source_;
  const char* const& place_;
  Json root_;
  std::vector<Json*> open_;
  std::string key_;
};

}  // namespace

Json parse_json(const std::string& text, const std::string& source) {
  const char* place = text.data();
  Builder builder(text, source, place);
  const Cursor begin(text.data(), &place);
  const Cursor end(text.data() + text.size(), &place);
  Json::sax_parse(begin, end, &builder);
  return builder.take();
}

}  // namespace wheelhop
