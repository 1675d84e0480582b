// Gauss rules on segments and triangles, and the one-dimensional Lagrange basis of the moments.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace moments {

struct LinePoint {
  double s, weight;
};

// P_0(x) ... P_m(x) of the Jacobi polynomials P^(0,power), orthogonal on [-1, 1] under (1 + x)^power.
// Recurrence: Abramowitz & Stegun (1964), 22.7.1 with alpha = 0.
inline std::vector<long double> jacobi(int m, int power, long double x) {
  const long double b = power;
  std::vector<long double> p{1.0L, 1.0L + (b + 2) * (x - 1) / 2};
  for (int k = 2; k <= m; ++k) {
    const long double c = 2 * k + b;
    p.push_back(((c - 1) * (c * (c - 2) * x - b * b) * p[k - 1] - 2 * (k - 1) * (k - 1 + b) * c * p[k - 2]) /
                (2 * k * (k + b) * (c - 2)));
  }
  return p;
}

// Gauss rule with m points on [0, 1] under the weight s^power, exact for degree 2 m - 1. The roots of
// P_k lie one between each two neighbours among -1, the roots of P_(k-1), 1, so bisection finds them all.
// Weights: 1 / sum over k < m of the squares of the orthonormal polynomials (Christoffel); the square of
// the norm of P_k on [0, 1] is 1 / (2 k + power + 1).
inline std::vector<LinePoint> gauss(int m, int power) {
  std::vector<long double> roots;
  for (int k = 1; k <= m; ++k) {
    std::vector<long double> ends{-1.0L}, found;
    ends.insert(ends.end(), roots.begin(), roots.end());
    ends.push_back(1.0L);
    for (int i = 0; i < k; ++i) {
      long double low = ends[i], high = ends[i + 1];
      const bool sign = jacobi(k, power, low)[k] < 0;
      for (int bit = 0; bit < 64; ++bit) {
        const long double middle = low + (high - low) / 2;
        ((jacobi(k, power, middle)[k] < 0) == sign ? low : high) = middle;
      }
      found.push_back(high);
    }
    roots = found;
  }
  std::vector<LinePoint> rule;
  for (const long double x : roots) {
    const auto p = jacobi(m, power, x);
    long double sum = 0;
    for (int k = 0; k < m; ++k) sum += p[k] * p[k] * (2 * k + power + 1);
    rule.push_back({static_cast<double>((1 + x) / 2), static_cast<double>(1 / sum)});
  }
  return rule;
}

// Point of a segment (Dim = 2) or triangle (Dim = 3): its barycentric coordinates.
template <int Dim>
struct SimplexPoint {
  std::array<double, Dim> corner;
  double weight;  // the weights of a rule sum to 1
};

template <int Dim>
constexpr int simplex_rule_size(int n) {
  return Dim == 2 ? n : (3 * n / 2) * (3 * n / 2);
}

// Exact for total degree 3 n - 2 on triangles: collapsed Gauss rule, x = v0 + s ((1 - t) v1 + t v2 - v0),
// dA = 2 A s ds dt (Stroud 1971, ch. 2). On segments n Gauss points, exact for degree 2 n - 1.
template <int Dim>
std::vector<SimplexPoint<Dim>> simplex_rule(int n) {
  std::vector<SimplexPoint<Dim>> rule;
  if constexpr (Dim == 2) {
    for (const auto [s, weight] : gauss(n, 0)) rule.push_back({{1 - s, s}, weight});
  } else {
    const int m = 3 * n / 2;  // 2 m - 1 >= 3 n - 2
    for (const auto [s, weight_s] : gauss(m, 1))
      for (const auto [t, weight_t] : gauss(m, 0))
        rule.push_back({{1 - s, s * (1 - t), s * t}, 2 * weight_s * weight_t});
  }
  return rule;
}

// Lagrange basis l_a on N points in (0, 1).
template <int N>
struct Basis {
  std::array<double, N> point;
  std::array<double, N> scale;                // 1 / prod (x_a - x_b)
  std::array<double, N> full;                 // integral of l_a over [0, 1]
  std::array<std::array<double, N>, N> mean;  // [a][q]: mean of l_a over [0, x_q]

  explicit Basis(const double* points) {
    for (int a = 0; a < N; ++a) point[a] = points[a];
    for (int a = 0; a < N; ++a) {
      double product = 1;
      for (int b = 0; b < N; ++b)
        if (b != a) product *= point[a] - point[b];
      scale[a] = 1 / product;
    }
    full.fill(0);
    for (auto& row : mean) row.fill(0);
    static const std::vector<LinePoint> rule = gauss(N, 0);
    for (const auto [s, weight] : rule) {
      const auto l = values(s);
      for (int a = 0; a < N; ++a) full[a] += weight * l[a];
      for (int q = 0; q < N; ++q) {
        const auto part = values(s * point[q]);
        for (int a = 0; a < N; ++a) mean[a][q] += weight * part[a];
      }
    }
  }

  // Products, not powers: exact zeros at the points, no cancellation elsewhere.
  std::array<double, N> values(double x) const {
    std::array<double, N> l = scale;
    double left = 1, right = 1;
    for (int a = 0; a < N; ++a) {
      l[a] *= left;
      left *= x - point[a];
    }
    for (int a = N; a-- > 0;) {
      l[a] *= right;
      right *= x - point[a];
    }
    return l;
  }
};

}  // namespace moments
