// The grid and the surfaces in integers: multiples of one power of two, to which everything is rounded once.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace cut {

using Integers3 = std::array<std::int64_t, 3>;
using Point3 = std::array<double, 3>;

constexpr int fine_bits = 48;    // of the smallest cell
constexpr int coarse_bits = 61;  // of all coordinates: differences of two fit into 64 bits, see cut_planes.hpp

struct Lattice {
  std::array<std::vector<std::int64_t>, 3> lines;
  std::array<int, 3> cells;
  Point3 origin;                          // [m]
  double quantum;                         // [m], a power of two
  std::vector<Integers3> vertices;
  std::vector<std::array<int, 3>> facets;
  std::vector<int> body;                  // of each facet
  std::vector<std::vector<int>> of_body;  // facets of each body
  std::array<int, 3> first_plane;         // number of the first grid plane of each axis
  int planes = 0;                         // grid planes

  Lattice(const std::array<std::vector<double>, 3>& edges, const double* x, std::size_t vertex_count,
          const std::int64_t* nodes, const std::int64_t* bodies_of_facets, std::size_t facet_count) {
    double smallest = INFINITY, largest = 0;
    for (int d = 0; d < 3; ++d) {
      origin[d] = edges[d].front();
      cells[d] = static_cast<int>(edges[d].size()) - 1;
      first_plane[d] = planes;
      planes += cells[d] + 1;
      for (int i = 0; i < cells[d]; ++i) smallest = std::min(smallest, edges[d][i + 1] - edges[d][i]);
      largest = std::max(largest, edges[d].back() - origin[d]);
    }
    for (std::size_t k = 0; k < 3 * vertex_count; ++k) largest = std::max(largest, std::abs(x[k] - origin[k % 3]));
    int exponent = 0, top = 0;
    std::frexp(smallest, &exponent);
    std::frexp(largest, &top);
    exponent = std::max(exponent - 1 - fine_bits, top - coarse_bits);
    quantum = std::ldexp(1.0, exponent);
    const auto rounded = [&](double value, int d) { return std::llrint(std::ldexp(value - origin[d], -exponent)); };
    for (int d = 0; d < 3; ++d) {
      for (const double value : edges[d]) lines[d].push_back(rounded(value, d));
      for (int i = 0; i < cells[d]; ++i)
        if (lines[d][i + 1] - lines[d][i] < (std::int64_t{1} << 20))
          throw std::invalid_argument("the smallest cell is too small beside the extent of the box and the bodies");
    }
    vertices.resize(vertex_count);
    for (std::size_t v = 0; v < vertex_count; ++v)
      for (int d = 0; d < 3; ++d) vertices[v][d] = rounded(x[3 * v + d], d);
    facets.resize(facet_count);
    body.resize(facet_count);
    for (std::size_t f = 0; f < facet_count; ++f) {
      for (int v = 0; v < 3; ++v) facets[f][v] = static_cast<int>(nodes[3 * f + v]);
      body[f] = static_cast<int>(bodies_of_facets[f]);
      of_body.resize(std::max(of_body.size(), static_cast<std::size_t>(body[f]) + 1));
      of_body[body[f]].push_back(static_cast<int>(f));
    }
  }

  int count() const { return cells[0] * cells[1] * cells[2]; }
  std::array<int, 3> index(int cell) const {
    return {cell % cells[0], cell / cells[0] % cells[1], cell / cells[0] / cells[1]};
  }
  int number(const std::array<int, 3>& at) const { return at[0] + cells[0] * (at[1] + cells[1] * at[2]); }
  int stride(int axis) const { return axis == 0 ? 1 : axis == 1 ? cells[0] : cells[0] * cells[1]; }
  Integers3 low(const std::array<int, 3>& at) const { return {lines[0][at[0]], lines[1][at[1]], lines[2][at[2]]}; }
  Integers3 high(const std::array<int, 3>& at) const {
    return {lines[0][at[0] + 1], lines[1][at[1] + 1], lines[2][at[2] + 1]};
  }
};

}  // namespace cut
