#include "core/data/units.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/data/text.hpp"

namespace wheelhop {
namespace {

struct Symbol {
  std::string_view name;
  Unit unit;
  bool prefixed;  ///< takes SI prefixes
};

// Powers of m, kg, s, A, rad. Exact by definition: inch, pound, standard gravity (CGPM 1901), hour, degree.
constexpr double kGravity = 9.80665, kInch = 0.0254, kPound = 0.45359237;
constexpr std::array<int, 5> kNone = {}, kLength = {1, 0, 0, 0, 0}, kMass = {0, 1, 0, 0, 0}, kTime = {0, 0, 1, 0, 0},
                             kCurrent = {0, 0, 0, 1, 0}, kAngle = {0, 0, 0, 0, 1}, kSpeed = {1, 0, -1, 0, 0},
                             kAcceleration = {1, 0, -2, 0, 0}, kForce = {1, 1, -2, 0, 0}, kRate = {0, 0, -1, 0, 0},
                             kTurning = {0, 0, -1, 0, 1}, kPressure = {-1, 1, -2, 0, 0}, kEnergy = {2, 1, -2, 0, 0},
                             kPower = {2, 1, -3, 0, 0}, kImpulse = {1, 1, -1, 0, 0}, kVoltage = {2, 1, -3, -1, 0},
                             kCharge = {0, 0, 1, 1, 0};

constexpr Symbol kSymbols[] = {{"-", {1, kNone}, false},
                               {"1", {1, kNone}, false},
                               {"%", {0.01, kNone}, false},
                               {"m", {1, kLength}, true},
                               {"in", {kInch, kLength}, false},
                               {"inch", {kInch, kLength}, false},
                               {"inches", {kInch, kLength}, false},
                               {"ft", {12 * kInch, kLength}, false},
                               {"kg", {1, kMass}, false},
                               {"lb", {kPound, kMass}, false},
                               {"s", {1, kTime}, true},
                               {"sec", {1, kTime}, true},
                               {"seconds", {1, kTime}, false},
                               {"min", {60, kTime}, false},
                               {"h", {3600, kTime}, false},
                               {"d", {86400, kTime}, false},
                               {"A", {1, kCurrent}, true},
                               {"rad", {1, kAngle}, true},
                               {"deg", {std::numbers::pi / 180, kAngle}, false},
                               {"degree", {std::numbers::pi / 180, kAngle}, false},
                               {"degrees", {std::numbers::pi / 180, kAngle}, false},
                               {"mph", {1609.344 / 3600, kSpeed}, false},
                               {"kph", {1 / 3.6, kSpeed}, false},
                               {"g", {kGravity, kAcceleration}, false},
                               {"mg", {1e-3 * kGravity, kAcceleration}, false},
                               {"G", {kGravity, kAcceleration}, false},
                               {"g0", {kGravity, kAcceleration}, false},
                               {"gn", {kGravity, kAcceleration}, false},
                               {"g_n", {kGravity, kAcceleration}, false},
                               {"Hz", {1, kRate}, true},
                               {"rpm", {std::numbers::pi / 30, kTurning}, false},
                               {"N", {1, kForce}, true},
                               {"lbf", {kPound * kGravity, kForce}, false},
                               {"kgf", {kGravity, kForce}, false},
                               {"kip", {1000 * kPound * kGravity, kForce}, false},
                               {"Pa", {1, kPressure}, true},
                               {"bar", {1e5, kPressure}, true},
                               {"psi", {kPound * kGravity / (kInch * kInch), kPressure}, false},
                               {"J", {1, kEnergy}, true},
                               {"Nm", {1, kEnergy}, true},
                               {"Ns", {1, kImpulse}, true},
                               {"W", {1, kPower}, true},
                               {"V", {1, kVoltage}, true},
                               {"volt", {1, kVoltage}, false},
                               {"C", {1, kCharge}, true}};

constexpr std::pair<char, double> kPrefixes[] = {{'p', 1e-12}, {'n', 1e-9}, {'u', 1e-6}, {'m', 1e-3},
                                                 {'c', 1e-2},  {'d', 1e-1}, {'k', 1e3},  {'M', 1e6}};

const Symbol* find_symbol(std::string_view name) {
  const auto* const place =
      std::find_if(std::begin(kSymbols), std::end(kSymbols), [&](const Symbol& symbol) { return symbol.name == name; });
  return place == std::end(kSymbols) ? nullptr : place;
}

std::optional<Unit> find_prefixed(std::string_view name) {
  if (const Symbol* symbol = find_symbol(name)) return symbol->unit;
  if (name.size() < 2) return {};
  for (const auto& [prefix, factor] : kPrefixes)
    if (name.front() == prefix)
      if (const Symbol* symbol = find_symbol(name.substr(1)); symbol && symbol->prefixed)
        return Unit{factor * symbol->unit.factor, symbol->unit.powers};
  return {};
}

/// Signs beyond ASCII in plain letters: superscripts as powers, micro as u, degree as deg, a dot as a product.
std::string in_ascii(std::string_view text) {
  struct Sign {
    std::string_view bytes, plain;
  };
  // UTF-8 first, so that its first byte is not taken for a letter of Latin-1.
  static constexpr Sign signs[] = {{"\xc2\xb2", "^2"},
                                   {"\xc2\xb3", "^3"},
                                   {"\xc2\xb9", "^1"},
                                   {"\xc2\xb5", "u"},
                                   {"\xc2\xb0", "deg"},
                                   {"\xc2\xb7", "*"},
                                   {"\xce\xbc", "u"},
                                   {"\xe2\x8b\x85", "*"},
                                   {"\xe2\x81\xbb\xc2\xb9", "^-1"},
                                   {"\xe2\x81\xbb\xc2\xb2", "^-2"},
                                   {"\xe2\x81\xb4", "^4"},
                                   {"\xb2", "^2"},
                                   {"\xb3", "^3"},
                                   {"\xb9", "^1"},
                                   {"\xb5", "u"},
                                   {"\xb0", "deg"},
                                   {"\xb7", "*"},
                                   {"**", "^"}};
  std::string result;
  while (!text.empty()) {
    const auto* const sign = std::find_if(std::begin(signs), std::end(signs),
                                          [&](const Sign& known) { return text.starts_with(known.bytes); });
    result += sign == std::end(signs) ? text.substr(0, 1) : sign->plain;
    text.remove_prefix(sign == std::end(signs) ? 1 : sign->bytes.size());
  }
  return result;
}

/// One factor of a product, "s^2" or "s2" or "mm": a symbol and its power.
std::optional<Unit> find_power(std::string_view text) {
  if (const auto unit = find_prefixed(text)) return unit;  // "g0", "1"
  std::size_t end = text.size();
  while (end > 0 && text[end - 1] >= '0' && text[end - 1] <= '9') --end;
  const std::size_t digits = end;
  if (end > 0 && text[end - 1] == '-') --end;
  int power = 1;
  if (digits == text.size() || std::from_chars(text.data() + end, text.data() + text.size(), power).ec != std::errc() ||
      std::abs(power) > 9)
    return {};
  if (end > 0 && text[end - 1] == '^') --end;
  const auto base = find_prefixed(text.substr(0, end));
  if (!base) return {};
  Unit unit{std::pow(base->factor, power), base->powers};
  for (int& own : unit.powers) own *= power;
  return unit;
}

Unit product(const Unit& a, const Unit& b, int sign) {
  Unit unit{sign > 0 ? a.factor * b.factor : a.factor / b.factor, a.powers};
  for (std::size_t i = 0; i < unit.powers.size(); ++i) unit.powers[i] += sign * b.powers[i];
  return unit;
}

/// product = factor {("*" | "." | " " | "/") factor},  factor = "(" product ")" | symbol with power. A "/" divides by
/// the one factor behind it: m/s/s is m/s^2.
class UnitParser {
 public:
  explicit UnitParser(std::string_view text) : rest_(text) {}

  std::optional<Unit> whole() {
    const auto unit = sequence();
    return rest_.empty() ? unit : std::nullopt;
  }

 private:
  std::optional<Unit> factor() {
    rest_ = trim(rest_);
    if (rest_.starts_with('(')) {
      rest_.remove_prefix(1);
      const auto inner = sequence();
      if (!inner || !rest_.starts_with(')')) return {};
      rest_.remove_prefix(1);
      return inner;
    }
    const std::size_t end = std::min(rest_.find_first_of("/*. ()"), rest_.size());
    const auto unit = find_power(rest_.substr(0, end));
    rest_.remove_prefix(end);
    return unit;
  }

  std::optional<Unit> sequence() {
    auto result = factor();
    while (result) {
      rest_ = trim(rest_);
      if (rest_.empty() || rest_.front() == ')') return result;
      const int sign = rest_.front() == '/' ? -1 : 1;
      if (rest_.front() == '/' || rest_.front() == '*' || rest_.front() == '.') rest_.remove_prefix(1);
      const auto next = factor();
      if (!next) return {};
      result = product(*result, *next, sign);
    }
    return {};
  }

  std::string_view rest_;
};

std::string_view without_brackets(std::string_view text) {
  text = trim(text);
  if (text.size() >= 2 && text.front() == '[' && text.back() == ']') text = trim(text.substr(1, text.size() - 2));
  return text;
}

}  // namespace

std::optional<Unit> find_unit(std::string_view text) { return UnitParser(in_ascii(without_brackets(text))).whole(); }

std::optional<double> conversion_factor(const Unit& from, const Unit& to) {
  if (from.powers != to.powers) return {};
  return from.factor == to.factor ? 1 : from.factor / to.factor;
}

Unit operator/(const Unit& a, const Unit& b) { return product(a, b, -1); }

std::optional<Unit> find_sensitivity(std::string_view text) {
  text = trim(text);
  const std::size_t end = std::min(text.find_first_not_of("+-.0123456789eE"), text.size());
  double number = 0;
  if (!parse_number(trim(text.substr(0, end)), number) || !(number > 0 && std::isfinite(number))) return {};
  const auto unit = find_unit(text.substr(end));
  if (!unit) return {};
  return Unit{number * unit->factor, unit->powers};
}

std::string known_units() {
  return "m, mm, um, in, ft, m/s, km/h, m/s^2, g, N, kN, lbf, rad, deg, rad/s, Pa, bar, V, mV, A, s, ms, kg, -, %";
}

}  // namespace wheelhop
