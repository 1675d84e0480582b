// Integers of fixed width, in two's complement. A product is as wide as its factors together, so that none is cut off.
#pragma once

#include <array>
#include <cstdint>

namespace cut {

template <int N>
struct Integer {
  std::array<std::uint64_t, N> limb{};  // the lowest first

  Integer() = default;
  Integer(std::int64_t value) {
    limb.fill(value < 0 ? ~std::uint64_t{0} : 0);
    limb[0] = static_cast<std::uint64_t>(value);
  }

  template <int M>
  explicit Integer(const Integer<M>& narrow) {
    static_assert(M < N);
    limb.fill(narrow.negative() ? ~std::uint64_t{0} : 0);
    for (int i = 0; i < M; ++i) limb[i] = narrow.limb[i];
  }

  bool negative() const { return limb[N - 1] >> 63; }

  int sign() const {
    if (negative()) return -1;
    for (const auto part : limb)
      if (part) return 1;
    return 0;
  }

  Integer operator-() const { return Integer() - *this; }

  Integer& operator+=(const Integer& other) {
    unsigned __int128 carry = 0;
    for (int i = 0; i < N; ++i) {
      carry += static_cast<unsigned __int128>(limb[i]) + other.limb[i];
      limb[i] = static_cast<std::uint64_t>(carry);
      carry >>= 64;
    }
    return *this;
  }

  Integer& operator-=(const Integer& other) {
    std::uint64_t borrow = 0;
    for (int i = 0; i < N; ++i) {
      const unsigned __int128 difference = static_cast<unsigned __int128>(limb[i]) - other.limb[i] - borrow;
      limb[i] = static_cast<std::uint64_t>(difference);
      borrow = static_cast<std::uint64_t>(difference >> 64) & 1;
    }
    return *this;
  }

  friend Integer operator+(Integer a, const Integer& b) { return a += b; }
  friend Integer operator-(Integer a, const Integer& b) { return a -= b; }

  // The nearest number but for a few units in its last place.
  double value() const {
    if (negative()) return -(-*this).value();
    double sum = 0;
    for (int i = N; i-- > 0;) sum = sum * 18446744073709551616.0 + static_cast<double>(limb[i]);
    return sum;
  }
};

template <int A, int B>
[[gnu::always_inline]] inline Integer<A + B> operator*(const Integer<A>& a, const Integer<B>& b) {
  Integer<A + B> product;
  if constexpr (A == 1 && B == 1) {
    const auto one = static_cast<std::int64_t>(a.limb[0]), two = static_cast<std::int64_t>(b.limb[0]);
    const auto value = static_cast<__int128>(one) * two;
    product.limb = {static_cast<std::uint64_t>(value), static_cast<std::uint64_t>(value >> 64)};
    return product;
  }
  for (int i = 0; i < A; ++i) {
    if (a.limb[i] == 0) continue;
    unsigned __int128 carry = 0;
    for (int j = 0; j < B; ++j) {
      carry += static_cast<unsigned __int128>(a.limb[i]) * b.limb[j] + product.limb[i + j];
      product.limb[i + j] = static_cast<std::uint64_t>(carry);
      carry >>= 64;
    }
    product.limb[i + B] = static_cast<std::uint64_t>(carry);
  }
  // As unsigned numbers, negative ones are too large by 2^(64 limbs).
  const auto take = [&](const auto& other, int count, int from) {
    std::uint64_t borrow = 0;
    for (int i = 0; i < count; ++i) {
      const unsigned __int128 difference =
        static_cast<unsigned __int128>(product.limb[from + i]) - other.limb[i] - borrow;
      product.limb[from + i] = static_cast<std::uint64_t>(difference);
      borrow = static_cast<std::uint64_t>(difference >> 64) & 1;
    }
  };
  if (a.negative()) take(b, B, A);
  if (b.negative()) take(a, A, B);
  return product;
}

}  // namespace cut
