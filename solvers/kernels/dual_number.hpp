// Forward-mode automatic differentiation with a fixed number of directions.
//
// A dual number a + a' e, e^2 = 0, carries a value and its derivatives in N directions; arithmetic on it is arithmetic
// plus the chain rule. The derivatives are held in whole vector registers.
#pragma once

#include <cmath>
#include <type_traits>

namespace mortar {

// As many numbers as a vector register of the machine holds: wider ones would go through memory.
#if defined(__AVX512F__)
constexpr int pack_size = 8;
#elif defined(__AVX__)
constexpr int pack_size = 4;
#else
constexpr int pack_size = 2;
#endif
using Pack = double __attribute__((vector_size(pack_size * sizeof(double))));

template <int N>
struct Gradient {
    static constexpr int packs = (N + pack_size - 1) / pack_size;
    Pack pack[packs];  // not set to zero unless value-initialised, as double

    double operator[](int i) const { return pack[i / pack_size][i % pack_size]; }
    void set(int i, double value) { pack[i / pack_size][i % pack_size] = value; }

    Gradient& operator+=(const Gradient& other) {
        for (int k = 0; k < packs; ++k) pack[k] += other.pack[k];
        return *this;
    }
    Gradient& operator-=(const Gradient& other) {
        for (int k = 0; k < packs; ++k) pack[k] -= other.pack[k];
        return *this;
    }
    // this += factor * other
    void add(double factor, const Gradient& other) {
        for (int k = 0; k < packs; ++k) pack[k] += factor * other.pack[k];
    }
};

template <int N>
struct Dual {
    static constexpr int directions = N;
    double value;
    Gradient<N> gradient;

    Dual() = default;
    Dual(double constant) : value(constant), gradient{} {}
    static Dual variable(double value, int direction) {
        Dual result(value);
        result.gradient.set(direction, 1.0);
        return result;
    }

    Dual& operator+=(const Dual& b) {
        value += b.value;
        gradient += b.gradient;
        return *this;
    }
    Dual& operator-=(const Dual& b) {
        value -= b.value;
        gradient -= b.gradient;
        return *this;
    }
    // this += a b, the inner loop of every integral
    void add_product(const Dual& a, const Dual& b) {
        value += a.value * b.value;
        for (int k = 0; k < Gradient<N>::packs; ++k)
            gradient.pack[k] += a.value * b.gradient.pack[k] + b.value * a.gradient.pack[k];
    }

    friend Dual operator+(Dual a, const Dual& b) { return a += b; }
    friend Dual operator-(Dual a, const Dual& b) { return a -= b; }
    friend Dual operator-(const Dual& a) { return -1.0 * a; }
    friend Dual operator*(const Dual& a, const Dual& b) {
        Dual result{};
        result.add_product(a, b);
        return result;
    }
    friend Dual operator*(double a, const Dual& b) {
        Dual result;
        result.value = a * b.value;
        for (int k = 0; k < Gradient<N>::packs; ++k) result.gradient.pack[k] = a * b.gradient.pack[k];
        return result;
    }
    friend Dual operator*(const Dual& a, double b) { return b * a; }
    friend Dual operator/(const Dual& a, const Dual& b) {
        const double inverse = 1.0 / b.value;
        Dual result(a.value * inverse);
        result.gradient.add(inverse, a.gradient);
        result.gradient.add(-result.value * inverse, b.gradient);
        return result;
    }
    friend Dual operator/(const Dual& a, double b) { return (1.0 / b) * a; }
};

template <typename T>
constexpr bool is_dual = !std::is_same_v<T, double>;

inline double value_of(double a) { return a; }
template <int N>
double value_of(const Dual<N>& a) {
    return a.value;
}

// sum += a b and sum += factor a for either scalar
template <typename T>
void add_product(T& sum, const T& a, const T& b) {
    if constexpr (is_dual<T>)
        sum.add_product(a, b);
    else
        sum += a * b;
}
template <typename T>
void add_scaled(T& sum, double factor, const T& a) {
    if constexpr (is_dual<T>) {
        sum.value += factor * a.value;
        sum.gradient.add(factor, a.gradient);
    } else {
        sum += factor * a;
    }
}

// f(x) from its value and slope at x.
template <typename T>
T chain(double f, double slope, const T& x) {
    if constexpr (is_dual<T>) {
        T result(f);
        result.gradient.add(slope, x.gradient);
        return result;
    } else {
        return f;
    }
}
// f(x[0], x[1]) from its value and slopes at x.
template <typename T>
T chain(double f, double slope_0, double slope_1, const T* x) {
    if constexpr (is_dual<T>) {
        T result(f);
        result.gradient.add(slope_0, x[0].gradient);
        result.gradient.add(slope_1, x[1].gradient);
        return result;
    } else {
        return f;
    }
}

// The square root, with slope zero at zero: lengths that vanish have no direction in which they would grow.
template <typename T>
T square_root(const T& a) {
    const double root = std::sqrt(value_of(a));
    return chain(root, root > 0.0 ? 0.5 / root : 0.0, a);
}

}  // namespace mortar
