// Regions of fluid in one cell whose surfaces are apart, in double. They are the connected components of the polygons
// of surface and the corners of the cell, by names alone: polygons are joined at common edges of facets and along the
// wet parts of the cell's edges. Volumes follow by Gauss' theorem. What rounding could decide is declined, and so are
// bodies whose polygons may meet, and surfaces that meet no edge of the cell: then the exact kernel decides.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "cut_planes.hpp"
#include "cut_regions.hpp"

namespace cut {

class FastCell {
public:
  explicit FastCell(const Lattice& lattice) : lattice_(lattice) {}

  // False: declined.
  bool compute(const std::array<int, 3>& at, const int* facets, int count, CellRegions& out) {
    const auto low = lattice_.low(at), high = lattice_.high(at);
    for (int d = 0; d < 3; ++d) size_[d] = to_unit * static_cast<double>(high[d] - low[d]);
    polygons_.clear();
    for (auto& crossings : edges_) crossings.clear();
    for (int k = 0; k < count; ++k)
      if (clip(facets[k], low) == Clipped::unknown) return false;
    if (polygons_.empty()) return true;
    if (!apart() || !join_polygons() || !join_along_edges()) return false;
    return finish(out);
  }

private:
  static constexpr int most = 10;  // corners: three, and two for each axis

  struct Shape {
    int count, facet;
    Point3 n;
    Point3 x[most];
    double error[most];
    int label[most];  // of the edge that follows: below 3 of the facet, then 3 + 2 axis + side
  };
  enum class Clipped { nothing, some, unknown };
  struct Crossing {
    double at, error;
    int sign, polygon;  // sign 1: the fluid begins
  };
  struct Entry {
    std::int64_t key;
    int polygon;
  };

  // Edge 4 axis + 2 side + side: the sides are those of the next two axes.
  static int edge_number(int axis, int first, int second) { return 4 * axis + 2 * first + second; }

  Clipped clip(int facet, const Integers3& low) {
    Shape shapes[2];
    Shape *p = &shapes[0], *q = &shapes[1];
    p->count = 3;
    p->facet = facet;
    double most_size = 0;
    for (int v = 0; v < 3; ++v) {
      for (int d = 0; d < 3; ++d)
        p->x[v][d] =
          to_unit * static_cast<double>(lattice_.vertices[lattice_.facets[facet][v]][d] - low[d]);
      p->label[v] = v;
      for (int d = 0; d < 3; ++d) most_size = std::max({most_size, std::abs(p->x[v][d]), size_[d]});
    }
    for (int v = 0; v < 3; ++v) p->error[v] = 4 * rounding_error * most_size;
    for (int d = 0; d < 3; ++d) {
      bool below = true, above = true, within = true;
      for (int v = 0; v < p->count; ++v) {
        const double x = p->x[v][d], error = p->error[v];
        if (std::abs(x) <= error || std::abs(x - size_[d]) <= error) return Clipped::unknown;
        below &= x < 0;
        above &= x > size_[d];
        within &= x > 0 && x < size_[d];
      }
      if (below || above) return Clipped::nothing;
      if (within) continue;
      if (!slab(*p, *q, d, most_size)) return Clipped::nothing;
      std::swap(p, q);
    }
    double n_size = 0, n_most = 0;  // a facet without area has no side
    const auto& v = lattice_.facets[facet];
    const auto step = [&](int i, int axis) {
      return to_unit * static_cast<double>(lattice_.vertices[v[i]][axis] - lattice_.vertices[v[0]][axis]);
    };
    for (int d = 0; d < 3; ++d) {
      const int e = next(d), f = next(e);
      const double one = step(1, e) * step(2, f), two = step(1, f) * step(2, e), sum = std::abs(one) + std::abs(two);
      p->n[d] = one - two;
      n_size = std::max(n_size, sum);
      n_most = std::max(n_most, std::abs(p->n[d]));
    }
    if (n_most <= doubt * n_size) return Clipped::unknown;
    polygons_.push_back(*p);
    return Clipped::some;
  }

  // Whether the polygons of different bodies are apart, and those of layers of one body that face each other: each pair
  // along the normal of some polygon.
  bool apart() const {
    for (std::size_t i = 0; i < polygons_.size(); ++i) {
      const Shape& a = polygons_[i];
      const auto [low, high] = extent(a.n, a);
      for (std::size_t j = i + 1; j < polygons_.size(); ++j) {
        const Shape& b = polygons_[j];
        if (lattice_.body[a.facet] == lattice_.body[b.facet] && (!facing(a, b) || have_vertex(a, b))) continue;
        const auto [low_b, high_b] = extent(a.n, b);  // along its own normal a polygon takes least room
        if (high < low_b || high_b < low) continue;
        if (std::none_of(polygons_.begin(), polygons_.end(), [&](const Shape& c) { return apart_along(c.n, a, b); }))
          return false;
      }
    }
    return true;
  }

  static bool facing(const Shape& a, const Shape& b) { return a.n[0] * b.n[0] + a.n[1] * b.n[1] + a.n[2] * b.n[2] < 0; }

  bool have_vertex(const Shape& a, const Shape& b) const {
    const auto &v = lattice_.facets[a.facet], &w = lattice_.facets[b.facet];
    return std::find_first_of(v.begin(), v.end(), w.begin(), w.end()) != v.end();
  }

  static bool apart_along(const Point3& n, const Shape& a, const Shape& b) {
    const auto [low_a, high_a] = extent(n, a);
    const auto [low_b, high_b] = extent(n, b);
    return high_a < low_b || high_b < low_a;
  }

  // Bounds of n.x over a polygon.
  static std::array<double, 2> extent(const Point3& n, const Shape& shape) {
    std::array<double, 2> found{INFINITY, -INFINITY};
    for (int i = 0; i < shape.count; ++i) {
      double sum = 0, error = 0;
      for (int d = 0; d < 3; ++d) {
        sum += n[d] * shape.x[i][d];
        error += std::abs(n[d]) * (shape.error[i] + 4 * rounding_error * std::abs(shape.x[i][d]));
      }
      found = {std::min(found[0], sum - error), std::max(found[1], sum + error)};
    }
    return found;
  }

  bool slab(const Shape& p, Shape& q, int d, double most_size) const {
    q.count = 0;
    q.facet = p.facet;
    const auto place = [&](double x) { return x < 0 ? -1 : x > size_[d] ? 1 : 0; };
    const auto add = [&](int label) { q.label[q.count++] = label; };
    const auto cross = [&](int i, int j, int side) {
      // from the lower end: both facets at an edge, and both cells at a face, compute alike
      const bool up = p.x[i][d] < p.x[j][d];
      const Point3 &a = p.x[up ? i : j], &b = p.x[up ? j : i];
      const double at = side < 0 ? 0.0 : size_[d], run = b[d] - a[d], t = (at - a[d]) / run;
      double way = 0;
      for (int k = 0; k < 3; ++k) {
        const double x = a[k] + t * (b[k] - a[k]);
        q.x[q.count][k] = std::clamp(x, std::min(a[k], b[k]), std::max(a[k], b[k]));
        way = std::max(way, std::abs(b[k] - a[k]));
      }
      q.x[q.count][d] = at;
      q.error[q.count] = std::max(p.error[i], p.error[j]) * (1 + 2 * way / run) + 8 * rounding_error * most_size;
    };
    for (int i = 0; i < p.count; ++i) {
      const int j = i + 1 == p.count ? 0 : i + 1, s = place(p.x[i][d]), t = place(p.x[j][d]);
      if (s == 0) {
        q.x[q.count] = p.x[i];
        q.error[q.count] = p.error[i];
        add(p.label[i]);
      }
      if (s == t) continue;
      if (s != 0) {
        cross(i, j, s);
        add(p.label[i]);
      }
      if (t != 0) {
        cross(i, j, t);
        add(3 + 2 * d + (t > 0));
      }
    }
    return q.count >= 3;
  }

  int root(int k) {
    while (up_[k] != k) k = up_[k] = up_[up_[k]];
    return k;
  }
  void join(int a, int b) { up_[root(a)] = root(b); }

  bool join_polygons() {
    const int count = static_cast<int>(polygons_.size());
    up_.resize(count + 8);
    for (int k = 0; k < count + 8; ++k) up_[k] = k;
    std::size_t size = 16;
    while (size < 6u * count) size *= 2;
    table_.assign(size, {-1, -1});
    meets_.assign(count, 0);
    int open = 0;
    for (int p = 0; p < count; ++p) {
      const Shape& shape = polygons_[p];
      const auto& v = lattice_.facets[shape.facet];
      for (int i = 0; i < shape.count; ++i) {
        const int label = shape.label[i], before = shape.label[i ? i - 1 : shape.count - 1];
        if (label < 3) {
          const std::int64_t a = v[label], b = v[(label + 1) % 3], key = std::min(a, b) << 32 | std::max(a, b);
          std::size_t h = static_cast<std::uint64_t>(key) * 0x9E3779B97F4A7C15ull >> 40 & (size - 1);
          while (table_[h].key >= 0 && table_[h].key != key) h = (h + 1) & (size - 1);
          if (table_[h].key < 0) {
            table_[h] = {key, p};
            ++open;
          } else if (table_[h].polygon < 0) {
            return false;  // more than two facets at an edge
          } else {
            join(table_[h].polygon, p);
            table_[h].polygon = -1;
            --open;
          }
        } else if (before >= 3 && before != label) {
          if (!add_crossing(shape, i, before - 3, label - 3, p)) return false;
          meets_[p] = 1;
        }
      }
    }
    if (open) return false;
    for (int p = 0; p < count; ++p)
      if (meets_[p]) meets_[root(p)] = 1;
    for (int p = 0; p < count; ++p)
      if (!meets_[root(p)]) return false;
    return true;
  }

  bool add_crossing(const Shape& shape, int i, int before, int after, int polygon) {
    if (before / 2 == after / 2) return false;
    const int axis = 3 - before / 2 - after / 2, e = next(axis);
    const auto turn = [&](int k) { return k / 2 == e ? (k % 2 ? 1 : 3) : (k % 2 ? 2 : 0); };  // about the axis
    const int sign = (turn(before) + 1) % 4 == turn(after) ? 1 : -1;
    const int first = (before / 2 == e ? before : after) % 2, second = (before / 2 == e ? after : before) % 2;
    edges_[edge_number(axis, first, second)].push_back({shape.x[i][axis], shape.error[i], sign, polygon});
    return true;
  }

  static std::array<int, 2> ends_of_edge(int k) {
    const int axis = k / 4, low = (k / 2 % 2) << next(axis) | (k % 2) << next(next(axis));
    return {low, low | 1 << axis};
  }

  bool join_along_edges() {
    const int count = static_cast<int>(polygons_.size());
    // Of corners: wet, in which body, or not known. A part of an edge within solid is in one body at both of its ends:
    // else bodies overlap, though their surfaces are apart.
    constexpr int unknown = -2, wet = -1;
    at_corner_.fill(unknown);
    const auto mark = [&](int corner, int what) {
      const bool agree = at_corner_[corner] == unknown || what == unknown || at_corner_[corner] == what;
      if (what != unknown) at_corner_[corner] = what;
      return agree;
    };
    const auto body = [&](const Crossing& c) { return lattice_.body[polygons_[c.polygon].facet]; };
    for (int k = 0; k < 12; ++k) {
      auto& crossings = edges_[k];
      const auto [low, high] = ends_of_edge(k);
      if (crossings.empty()) {
        join(count + low, count + high);
        continue;
      }
      std::sort(crossings.begin(), crossings.end(), [](const auto& a, const auto& b) { return a.at < b.at; });
      for (std::size_t i = 0; i + 1 < crossings.size(); ++i) {
        const auto &a = crossings[i], &b = crossings[i + 1];
        if (a.sign == b.sign || b.at - a.at <= a.error + b.error) return false;
        if (a.sign < 0 && body(a) != body(b)) return false;
        if (a.sign > 0) join(a.polygon, b.polygon);
      }
      const auto &first = crossings.front(), &last = crossings.back();
      if (!mark(low, first.sign < 0 ? wet : body(first)) || !mark(high, last.sign > 0 ? wet : body(last))) return false;
      if (first.sign < 0) join(first.polygon, count + low);
      if (last.sign > 0) join(last.polygon, count + high);
    }
    for (int pass = 0; pass < 3; ++pass)  // along edges that nothing crosses, at most three from corner to corner
      for (int k = 0; k < 12; ++k) {
        if (!edges_[k].empty()) continue;
        const auto [low, high] = ends_of_edge(k);
        if (!mark(high, at_corner_[low]) || !mark(low, at_corner_[high])) return false;
      }
    return true;
  }

  bool finish(CellRegions& out) {
    const int count = static_cast<int>(polygons_.size());
    number_.assign(count + 8, -1);
    out.regions = 0;
    for (int p = 0; p < count; ++p)
      if (number_[root(p)] < 0) number_[root(p)] = out.regions++;
    const auto region = [&](int k) { return number_[root(k)]; };
    areas_.assign(out.regions, {});
    out.surface.clear();
    out.corners.clear();
    out.surface.reserve(count);
    int corners = 0;
    for (const Shape& shape : polygons_) corners += shape.count;
    out.corners.reserve(corners);
    for (int k = 0; k < 6; ++k) {
      chords_[k].clear();
      wet_edges_[k].clear();
    }
    for (int p = 0; p < count; ++p) {
      const Shape& shape = polygons_[p];
      out.surface.push_back({region(p), shape.facet, out.corners.size(), shape.count});
      for (int i = 0; i < shape.count; ++i) {
        Point3 x;
        for (int d = 0; d < 3; ++d) x[d] = shape.x[i][d] / size_[d];
        out.corners.push_back(x);
      }
      for (int i = 0; i < shape.count; ++i)
        if (shape.label[i] >= 3) add_chord(shape, i, region(p));
    }
    for (int k = 0; k < 12; ++k)
      if (k % 2) add_wet_edges(k);
    for (int k = 0; k < 8; ++k) out.at_corner[k] = at_corner_[k] >= 0 ? -1 : region(count + k);
    for (const auto& area : areas_)
      for (const double a : area)
        if (a < -1e3 * rounding_error) return false;  // a hole in a face
    out.chords.assign(chords_);
    out.wet.assign(wet_edges_);
    out.cut = true;
    out.bodies.clear();
    for (const Shape& shape : polygons_)
      if (std::find(out.bodies.begin(), out.bodies.end(), lattice_.body[shape.facet]) == out.bodies.end())
        out.bodies.push_back(lattice_.body[shape.facet]);
    return true;
  }

  void add_chord(const Shape& shape, int i, int region) {
    const int face = shape.label[i] - 3, e = next(face / 2), f = next(e), j = i + 1 == shape.count ? 0 : i + 1;
    const int from = face % 2 ? i : j, to = face % 2 ? j : i;
    Chord chord{shape.facet, region, {}};
    const auto relative = [&](int k) -> std::array<double, 2> {
      return {shape.x[k][e] / size_[e], shape.x[k][f] / size_[f]};
    };
    chord.ends = {relative(from), relative(to)};
    areas_[region][face] += 0.5 * (chord.ends[0][0] + chord.ends[1][0]) * (chord.ends[1][1] - chord.ends[0][1]);
    chords_[face].push_back(chord);
  }

  // Of edge k of the upper side of the axis before its own.
  void add_wet_edges(int k) {
    const int axis = k / 4, face = 2 * next(axis) + k / 2 % 2, count = static_cast<int>(polygons_.size());
    const auto [low, high] = ends_of_edge(k);
    const auto add = [&](int region, int facet, int corner, double from, double to) {
      if (region < 0) return;
      wet_edges_[face].push_back({region, facet, corner, from / size_[axis], to / size_[axis]});
      areas_[region][face] += (to - from) / size_[axis];
    };
    const auto& crossings = edges_[k];
    if (crossings.empty()) {
      if (at_corner_[low] < 0) add(number_[root(count + low)], -1, low, 0, size_[axis]);
      return;
    }
    const auto region = [&](const Crossing& c) { return number_[root(c.polygon)]; };
    const auto facet = [&](const Crossing& c) { return polygons_[c.polygon].facet; };
    const auto &first = crossings.front(), &last = crossings.back();
    if (first.sign < 0) add(region(first), facet(first), -1, 0, first.at);
    for (std::size_t i = 0; i + 1 < crossings.size(); ++i) {
      const auto &begin = crossings[i], &end = crossings[i + 1];
      if (begin.sign > 0) add(region(begin), facet(begin), -1, begin.at, end.at);
    }
    if (last.sign > 0) add(region(last), facet(last), -1, last.at, size_[axis]);
  }

  const Lattice& lattice_;
  Point3 size_{};
  std::vector<Shape> polygons_;
  std::vector<int> up_, number_;
  std::vector<Entry> table_;  // polygons by edges of facets
  std::array<std::vector<Crossing>, 12> edges_;
  std::vector<char> meets_;   // an edge of the cell
  std::array<int, 8> at_corner_{};  // the body there, or negative
  std::array<std::vector<Chord>, 6> chords_;
  std::array<std::vector<WetEdge>, 6> wet_edges_;
  std::vector<std::array<double, 6>> areas_;  // of the faces of each region
};

}  // namespace cut
