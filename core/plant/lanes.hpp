/// \file
/// Four doubles that are computed with at once, one vector register of AVX2: a simulation a lane. Code written for a
/// type V runs with V = double for one simulation and with V = Lanes for four, operation by operation the same.
#pragma once

#include <cmath>
#include <cstdint>
#include <type_traits>

namespace wheelhop {

/// One truth value a lane: all bits set, or none.
struct LaneMask {
  typedef std::int64_t Vector __attribute__((vector_size(32)));
  Vector bits;
  bool operator[](int lane) const { return bits[lane] != 0; }
};

struct Lanes {
  static constexpr int count = 4;
  typedef double Vector __attribute__((vector_size(32)));
  Vector values;

  Lanes() = default;
  Lanes(double same) : values{same, same, same, same} {}
  explicit Lanes(Vector v) : values(v) {}
  double operator[](int lane) const { return values[lane]; }
  void set(int lane, double value) { values[lane] = value; }

  friend Lanes operator+(Lanes a, Lanes b) { return Lanes(a.values + b.values); }
  friend Lanes operator-(Lanes a, Lanes b) { return Lanes(a.values - b.values); }
  friend Lanes operator*(Lanes a, Lanes b) { return Lanes(a.values * b.values); }
  friend Lanes operator/(Lanes a, Lanes b) { return Lanes(a.values / b.values); }
  friend Lanes operator-(Lanes a) { return Lanes(-a.values); }
  friend LaneMask operator<(Lanes a, Lanes b) { return {a.values < b.values}; }
  friend LaneMask operator>(Lanes a, Lanes b) { return {a.values > b.values}; }
  friend LaneMask operator==(Lanes a, Lanes b) { return {a.values == b.values}; }
  Lanes& operator+=(Lanes b) { return *this = *this + b; }
  Lanes& operator-=(Lanes b) { return *this = *this - b; }
};

inline LaneMask operator&(LaneMask a, LaneMask b) { return {a.bits & b.bits}; }

/// The truth values that belong to V.
template <class V>
struct TruthOf {
  using Type = bool;
};
template <>
struct TruthOf<Lanes> {
  using Type = LaneMask;
};
template <class V>
using Truth = typename TruthOf<V>::Type;

inline bool both(bool a, bool b) { return a && b; }
inline LaneMask both(LaneMask a, LaneMask b) { return a & b; }
inline bool all(bool a) { return a; }
inline bool all(LaneMask a) {
#ifdef __AVX__
  return __builtin_ia32_movmskpd256(reinterpret_cast<Lanes::Vector>(a.bits)) == 15;
#else
  return a[0] && a[1] && a[2] && a[3];
#endif
}
/// What `number` gives for each lane.
template <class V, class Function>
V each_lane(Function&& number) {
  if constexpr (std::is_same_v<V, double>)
    return number(0);
  else
    return V(Lanes::Vector{number(0), number(1), number(2), number(3)});
}
/// a where the condition holds, else b.
inline double choose(bool where, double a, double b) { return where ? a : b; }
inline Lanes choose(LaneMask where, Lanes a, Lanes b) { return Lanes(where.bits ? a.values : b.values); }
inline double absolute(double a) { return std::abs(a); }
inline Lanes absolute(Lanes a) {
  const LaneMask::Vector all_but_sign = {INT64_MAX, INT64_MAX, INT64_MAX, INT64_MAX};
  return Lanes(reinterpret_cast<Lanes::Vector>(reinterpret_cast<LaneMask::Vector>(a.values) & all_but_sign));
}
inline double with_sign(double size, double of) { return std::copysign(size, of); }
inline Lanes with_sign(Lanes size, Lanes of) {
  const LaneMask::Vector sign = {INT64_MIN, INT64_MIN, INT64_MIN, INT64_MIN};
  return Lanes(reinterpret_cast<Lanes::Vector>((reinterpret_cast<LaneMask::Vector>(size.values) & ~sign) |
                                               (reinterpret_cast<LaneMask::Vector>(of.values) & sign)));
}
/// False of NaN and of infinite numbers.
template <class V>
Truth<V> finite(V a) {
  return a - a == V(0.0);
}

}  // namespace wheelhop
