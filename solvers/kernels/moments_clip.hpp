// Cuts the facets of a surface into pieces, one for each cell of a box grid they cross.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace moments {

// Where a corner of a piece is, and its barycentric coordinates in the facet. The latter are carried along
// and not computed from the position afterwards, which would fail for needles.
template <int Dim>
struct Vertex {
  std::array<double, Dim> x, lambda;
};

// A convex piece of a facet: two corners in 2D, three or more in 3D.
template <int Dim>
struct Polygon {
  // A triangle has three corners, and each of the six planes of a cell adds one at most.
  std::array<Vertex<Dim>, Dim == 2 ? 2 : 9> corner;
  int size = 0;

  void add(const Vertex<Dim>& vertex) { corner[size++] = vertex; }
};

// Where an edge meets the plane x[d] = place, a.x[d] < place <= b.x[d]. Always from a to b, so that both
// facets at an edge get the same point whichever way they run along it. In floating point too, it lies between
// a and b in every coordinate and moves from a to b as the plane does; see clip().
template <int Dim>
Vertex<Dim> crossing(const Vertex<Dim>& a, const Vertex<Dim>& b, int d, double place) {
  if (b.x[d] == place) return b;
  const double t = (place - a.x[d]) / (b.x[d] - a.x[d]);
  const auto between = [t](double from, double to) {
    const double value = from + t * (to - from);
    return from < to ? std::clamp(value, from, to) : std::clamp(value, to, from);
  };
  Vertex<Dim> c;
  for (int i = 0; i < Dim; ++i) {
    c.x[i] = between(a.x[i], b.x[i]);
    c.lambda[i] = between(a.lambda[i], b.lambda[i]);
  }
  c.x[d] = place;
  return c;
}

// The part with low <= x[d] < high (Sutherland & Hodgman 1974, both planes at once), closed by the plane.
//
// A corner on a plane belongs to the upper part only, and to the lower one as the end of the cut. Then both
// parts share one chord and add up to the whole, even if rounding has put several corners of a slanted piece
// on the plane; were these in both parts, so would be the area between them. There is one chord because
// along a facet's boundary each coordinate rises once and falls once, which crossing() preserves.
template <int Dim>
void clip(const Polygon<Dim>& whole, int d, double low, double high, Polygon<Dim>& part) {
  part.size = 0;
  const int edges = Dim == 2 ? 1 : whole.size;
  for (int i = 0; i < edges; ++i) {
    const Vertex<Dim>& p = whole.corner[i];
    const Vertex<Dim>& q = whole.corner[i + 1 == whole.size ? 0 : i + 1];
    const double a = p.x[d], b = q.x[d];
    if (low <= a && a < high) part.add(p);
    if (a < b) {
      if (a < low && low < b) part.add(crossing(p, q, d, low));
      if (a < high && high <= b) part.add(crossing(p, q, d, high));
    } else {
      if (b < high && high <= a) part.add(crossing(q, p, d, high));
      if (b < low && low < a) part.add(crossing(q, p, d, low));
    }
    if (Dim == 2 && low <= b && b < high) part.add(q);
  }
}

// The grid lines in each direction, and which cells are wanted.
template <int Dim>
class Grid {
public:
  Grid(std::array<std::vector<double>, Dim> edges, const bool* wanted)
    : edges_(std::move(edges)), wanted_(wanted) {
    for (int d = 0; d < Dim; ++d) cells_[d] = static_cast<int>(edges_[d].size()) - 1;
    first_wanted_.assign(static_cast<std::size_t>(columns()), wanted == nullptr ? 0 : cells_[0]);
    if (wanted == nullptr) return;
    for (std::int64_t column = 0; column < columns(); ++column) {
      const bool* begin = wanted + column * cells_[0];
      first_wanted_[column] = static_cast<int>(std::find(begin, begin + cells_[0], true) - begin);
    }
  }

  int cells(int d) const { return cells_[d]; }
  std::int64_t columns() const { return Dim == 2 ? cells_[1] : std::int64_t{cells_[1]} * cells_[Dim - 1]; }
  std::int64_t count() const { return columns() * cells_[0]; }
  const std::vector<double>& edges(int d) const { return edges_[d]; }
  bool wanted(std::int64_t cell) const { return wanted_ == nullptr || wanted_[cell]; }
  bool restricted() const { return wanted_ != nullptr; }

  // The leftmost wanted cell of a column along x; cells(0) if there is none.
  int first_wanted(std::int64_t column) const { return first_wanted_[column]; }

private:
  std::array<std::vector<double>, Dim> edges_;
  std::array<int, Dim> cells_;
  const bool* wanted_;
  std::vector<int> first_wanted_;
};

template <int Dim>
struct Surface {
  const double* vertices;      // (n, Dim)
  const std::int64_t* facets;  // (count, Dim)
  std::int64_t count;

  std::array<double, Dim> corner(std::int64_t facet, int v) const {
    std::array<double, Dim> x;
    std::copy_n(vertices + facets[facet * Dim + v] * Dim, Dim, x.begin());
    return x;
  }

  // Normal out of the solid, its length that of the segment or twice the area of the triangle.
  std::array<double, Dim> normal(std::int64_t facet) const {
    const auto a = corner(facet, 0), b = corner(facet, 1);
    if constexpr (Dim == 2) {
      return {b[1] - a[1], a[0] - b[0]};
    } else {
      const auto c = corner(facet, 2);
      const std::array<double, 3> p{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
      const std::array<double, 3> q{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
      return {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]};
    }
  }
};

// The piece of one facet in one cell, or right of the box in one column; x in [0, 1]^Dim of the cell.
template <int Dim>
struct Piece {
  std::int64_t column;  // j + ny k
  int i;                // nx: right of the box, x[0] means nothing
  int corners;
  std::int64_t facet;
  std::size_t first;  // its corners are vertices[first], ...
};

// All pieces of a surface, facet after facet.
//
// A facet is cut into slabs along z, these along y into columns, these along x into cells; neighbours share
// the points of their common cut exactly. What touches a slab without area in it is no piece, so a facet that
// meets a grid plane in an edge or a corner needs no decision. A facet within a grid plane belongs to the
// cell its normal points into, or to the cell inside if that one is outside the box. Nothing is compared
// with a tolerance.
//
// Cut in the coordinates given, so that facets that share an edge share its cuts to the last bit; the corners
// of a piece are then taken relative to its cell, which is exact for those near its lower planes.
template <int Dim>
class Cutter {
public:
  std::vector<Piece<Dim>> pieces;
  std::vector<Vertex<Dim>> vertices;

  Cutter(const Grid<Dim>& grid, const Surface<Dim>& surface) : grid_(grid) {
    for (int d = 0; d < Dim; ++d) {
      low_[d] = grid.cells(d);
      high_[d] = -1;
    }
    std::int64_t column = 0;
    for (int k = 0; k < (Dim == 2 ? 1 : grid.cells(Dim - 1)); ++k)
      for (int j = 0; j < grid.cells(1); ++j, ++column) {
        if (grid.first_wanted(column) == grid.cells(0)) continue;
        low_[1] = std::min(low_[1], j);
        high_[1] = std::max(high_[1], j);
        low_[Dim - 1] = std::min(low_[Dim - 1], Dim == 2 ? j : k);
        high_[Dim - 1] = std::max(high_[Dim - 1], Dim == 2 ? j : k);
      }
    pieces.reserve(2 * static_cast<std::size_t>(surface.count));
    vertices.reserve(2 * Dim * static_cast<std::size_t>(surface.count));
    for (facet_ = 0; facet_ < surface.count; ++facet_) cut(surface);
  }

private:
  void cut(const Surface<Dim>& surface) {
    Polygon<Dim> polygon;
    for (int v = 0; v < Dim; ++v) {
      polygon.add({surface.corner(facet_, v), {}});
      polygon.corner[v].lambda[v] = 1;
    }
    for (int d = Dim; d-- > 0;) {
      const auto [min, max] = extent(polygon, d);
      const auto& edges = grid_.edges(d);
      if (max < edges.front() || (d > 0 && min > edges.back())) return;
      const auto above = std::upper_bound(edges.begin(), edges.end() - 1, min) - edges.begin();
      first_[d] = std::max(0, static_cast<int>(above) - 1);
      // First slab above the wanted ones, or below them all.
      if (d > 0 && (first_[d] > high_[d] + 1 || max < edges[std::min(low_[d], grid_.cells(d))])) return;
    }
    normal_ = surface.normal(facet_);
    if (!std::all_of(normal_.begin(), normal_.end(), [](double n) { return std::isfinite(n); }))
      throw std::invalid_argument("facet " + std::to_string(facet_) + " is too large to have an area");
    split<Dim - 1>(polygon);
  }

  static std::array<double, 2> extent(const Polygon<Dim>& polygon, int d) {
    double min = polygon.corner[0].x[d], max = min;
    for (int v = 1; v < polygon.size; ++v) {
      min = std::min(min, polygon.corner[v].x[d]);
      max = std::max(max, polygon.corner[v].x[d]);
    }
    return {min, max};
  }

  double plane(int d, int k) const { return grid_.edges(d)[k]; }

  template <int D>
  void split(const Polygon<Dim>& polygon) {
    const auto [min, max] = extent(polygon, D);
    const int cells = grid_.cells(D);
    int k = first_[D];
    while (k < cells && plane(D, k + 1) <= min) ++k;  // plane(k) <= min unless k is 0
    if (min == max) {
      const bool outside = min < plane(D, 0) || min > plane(D, cells);
      if (outside) {
        if (D == 0 && k == cells) keep<D>(polygon, cells);
        return;
      }
      if (k > 0 && (k == cells || (plane(D, k) == min && !(normal_[D] > 0)))) --k;
      keep<D>(polygon, k);
      return;
    }
    for (; k < cells && plane(D, k) < max; ++k) {
      if (skipped<D>(k)) continue;
      const double low = plane(D, k), high = plane(D, k + 1);
      if (low <= min && max <= high) {
        keep<D>(polygon, k);
      } else {
        Polygon<Dim> part;
        clip(polygon, D, low, max <= high ? infinity : high, part);
        keep<D>(part, k);
      }
    }
    if (D == 0 && max > plane(D, cells)) {
      Polygon<Dim> part;
      clip(polygon, D, plane(D, cells), infinity, part);
      keep<D>(part, cells);
    }
  }

  // Nothing in this slab is wanted: no cell in its columns, or only cells to its right.
  template <int D>
  bool skipped(int k) const {
    if constexpr (D == 0) return k < grid_.first_wanted(column());
    return k < low_[D] || k > high_[D];
  }

  std::int64_t column() const {
    return cell_[1] + (Dim == 2 ? 0 : std::int64_t{grid_.cells(1)} * cell_[Dim - 1]);
  }

  template <int D>
  void keep(const Polygon<Dim>& polygon, int k) {
    cell_[D] = k;
    if (polygon.size < Dim || skipped<D>(k)) return;
    if constexpr (D > 0) {
      if (D > 1 || grid_.first_wanted(column()) < grid_.cells(0)) split<D - 1>(polygon);
    } else {
      const std::size_t first = vertices.size();
      for (int v = 0; v < polygon.size; ++v) vertices.push_back(polygon.corner[v]);
      for (int d = 0; d < Dim; ++d) {
        if (cell_[d] == grid_.cells(d)) continue;
        const double low = plane(d, cell_[d]), width = plane(d, cell_[d] + 1) - low;
        for (std::size_t v = first; v < vertices.size(); ++v) vertices[v].x[d] = (vertices[v].x[d] - low) / width;
      }
      pieces.push_back({column(), k, polygon.size, facet_, first});
    }
  }

  static constexpr double infinity = std::numeric_limits<double>::infinity();

  const Grid<Dim>& grid_;
  std::array<int, Dim> low_, high_;  // range of wanted slabs in y and z
  std::int64_t facet_ = 0;
  std::array<double, Dim> normal_{};
  std::array<int, Dim> first_{}, cell_{};  // the lowest cell the facet may meet; the one of the piece
};

}  // namespace moments
