// Integrals of the Lagrange basis over regions, over their surface and over their parts of faces, by Gauss' theorem:
// int l_a l_b l_c dV = int (int_0^x l_a) l_b l_c n_x dS, and the same in the plane of a face.
#pragma once

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "cut_regions.hpp"
#include "moments_rule.hpp"

namespace cut {

// N points along x and y, M along z: N, or 1 in a layer of cells between walls that stand across it, of which all
// integrands are constant along z.
template <int N, int M>
class Integrals {
public:
  static constexpr int face_size = N * M, size = N * face_size;  // faces: those along x

  explicit Integrals(const double* points)
    : basis_(points), triangle_(rules().first), line_(rules().second) {}

  // Adds the integrals of L_q lambda_v [m^2] over a piece of surface to `piece`, shape (size, 3), and those of
  // L_q x n_x, n into the fluid, relative to the cell, to `flux`, shape (size,). facet: corners of the whole facet,
  // relative to the cell; cell: its size [m].
  void add_surface(const Point3* corners, int count, const std::array<Point3, 3>& facet, const Point3& cell,
                   double* flux, double* piece) {
    Point3 steps[2];
    for (int k = 0; k < 2; ++k)
      for (int d = 0; d < 3; ++d) steps[k][d] = (facet[k + 1][d] - facet[0][d]) * cell[d];
    const Point3 n = cross(steps[0], steps[1]);
    const double square = dot(n, n), length = std::sqrt(square);
    const Point3 to_area{n[0] / length * cell[1] * cell[2], n[1] / length * cell[2] * cell[0],
                         n[2] / length * cell[0] * cell[1]};
    const Point3 one = cross(steps[1], n), two = cross(n, steps[0]);  // gradients of lambda times n^2
    lambda_.resize(count);
    for (int k = 0; k < count; ++k) {
      Point3 way;
      for (int d = 0; d < 3; ++d) way[d] = (corners[k][d] - facet[0][d]) * cell[d];
      const double second = dot(way, one) / square, third = dot(way, two) / square;
      lambda_[k] = {1 - second - third, second, third};
    }
    std::array<Lanes, size> values{};
    for (int k = 1; k + 1 < count; ++k) {
      const std::array<int, 3> at{0, k, k + 1};
      Point3 p, q;
      for (int d = 0; d < 3; ++d) {
        p[d] = corners[k][d] - corners[0][d];
        q[d] = corners[k + 1][d] - corners[0][d];
      }
      const Point3 twice = cross(p, q);
      const double measure = 0.5 * dot(twice, to_area), projected = 0.5 * twice[0];
      std::array<std::array<Lanes, N>, rule_size> along;
      std::array<std::array<double, face_size>, rule_size> across;
      for (int g = 0; g < rule_size; ++g) {
        const auto& point = triangle_[g];
        Point3 x{};
        Lanes factor{};
        for (int v = 0; v < 3; ++v)
          for (int d = 0; d < 3; ++d) {
            x[d] += point.corner[v] * corners[at[v]][d];
            factor[d] += measure * point.corner[v] * lambda_[at[v]][d];
          }
        factor[3] = projected * x[0];
        const auto a = basis_.values(x[0]), b = basis_.values(x[1]);
        const auto c = along_z(x[2]);
        for (int i = 0; i < N; ++i) along[g][i] = a[i] * factor;
        for (int f = 0; f < face_size; ++f) across[g][f] = point.weight * b[f % N] * c[f / N];
      }
      for (int f = 0; f < face_size; ++f) {
        std::array<Lanes, N> sum{};
        for (int g = 0; g < rule_size; ++g)
          for (int i = 0; i < N; ++i) sum[i] += across[g][f] * along[g][i];
        for (int i = 0; i < N; ++i) values[f * N + i] += sum[i];
      }
    }
    for (int i = 0; i < size; ++i) {
      for (int v = 0; v < 3; ++v) piece[3 * i + v] += values[i][v];
      flux[i] += values[i][3];
    }
  }

  // Adds the integrals of L_q x n_x alone.
  void add_flux(const Point3* corners, int count, double* flux) const {
    for (int k = 1; k + 1 < count; ++k) {
      const std::array<const Point3*, 3> at{corners, corners + k, corners + k + 1};
      const double projected = 0.5 * (((*at[1])[1] - (*at[0])[1]) * ((*at[2])[2] - (*at[0])[2]) -
                                      ((*at[1])[2] - (*at[0])[2]) * ((*at[2])[1] - (*at[0])[1]));
      for (const auto& point : triangle_) {
        Point3 x{};
        for (int v = 0; v < 3; ++v)
          for (int d = 0; d < 3; ++d) x[d] += point.corner[v] * (*at[v])[d];
        const auto a = basis_.values(x[0]), b = basis_.values(x[1]);
        const auto c = along_z(x[2]);
        const double factor = point.weight * projected * x[0];
        for (int i = 0; i < size; ++i) flux[i] += factor * a[i % N] * b[i / N % N] * c[i / N / N];
      }
    }
  }

  // From the flux through the surface of a region to what it adds to the integrals over the region: the fluid lies
  // ahead of its surface, and int_0^x l_a = x sum_q mean_aq l_q(x).
  void to_volume(double* region) const {
    for (int f = 0; f < face_size; ++f) {
      std::array<double, N> sum{};
      for (int a = 0; a < N; ++a)
        for (int q = 0; q < N; ++q) sum[a] -= basis_.mean[a][q] * region[f * N + q];
      for (int a = 0; a < N; ++a) region[f * N + a] = sum[a];
    }
  }

  // Adds the part of a side of a polygon in a face; ends: relative to the face, the inside on the left.
  // l_a of the first coordinate, l_b of the second: [a + N b], N points along both.
  void add_side(const std::array<double, 2>& from, const std::array<double, 2>& to, double* face) const {
    const double rise = to[1] - from[1];
    if (rise == 0) return;
    for (const auto& [s, weight] : line_) {
      const auto inner = from_zero(from[0] + s * (to[0] - from[0]));
      const auto b = basis_.values(from[1] + s * rise);
      for (int f = 0; f < N * N; ++f) face[f] += weight * rise * inner[f % N] * b[f / N];
    }
  }

  // Adds to a region the flux through its part of the face x = 1, whose first coordinate is y.
  void add_far_face(const double* face, double* region) const {
    for (int f = 0; f < face_size; ++f)
      for (int a = 0; a < N; ++a) region[f * N + a] += basis_.full[a] * face[f];
  }

private:
  // Four numbers the processor works on at once: those of the three lambda_v, and the flux.
  using Lanes [[gnu::vector_size(4 * sizeof(double))]] = double;

  // Total degree of the integrands: 2 N - 1 in a layer, else 3 N - 2.
  static constexpr int rule = M == 1 ? (2 * N + 2) / 3 : N, rule_size = moments::simplex_rule_size<3>(rule);

  using Rules = std::pair<std::vector<moments::SimplexPoint<3>>, std::vector<moments::LinePoint>>;

  static const Rules& rules() {
    static const Rules computed{moments::simplex_rule<3>(rule), moments::gauss(N, 0)};
    return computed;
  }

  std::array<double, M> along_z(double z) const {
    if constexpr (M == 1)
      return {1.0};
    else
      return basis_.values(z);
  }

  static Point3 cross(const Point3& a, const Point3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  }
  static double dot(const Point3& a, const Point3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

  // int_0^x l_a: degree N, by N Gauss points.
  std::array<double, N> from_zero(double x) const {
    std::array<double, N> sum{};
    const auto l = basis_.values(x);
    for (int q = 0; q < N; ++q)  // x times the mean on [0, x], which is a polynomial of degree N - 1
      for (int a = 0; a < N; ++a) sum[a] += l[q] * basis_.mean[a][q];
    for (double& value : sum) value *= x;
    return sum;
  }

  moments::Basis<N> basis_;
  std::vector<Point3> lambda_;  // at the corners of a polygon
  const std::vector<moments::SimplexPoint<3>>& triangle_;
  const std::vector<moments::LinePoint>& line_;
};

}  // namespace cut
