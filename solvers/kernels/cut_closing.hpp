// Pairs of facets that face each other at less than the closing length, before the cells: see cut_zones.hpp. Here only
// pairs are found, in double and on the safe side; what is in a zone is decided exactly.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "cut_candidates.hpp"
#include "cut_zones.hpp"

namespace cut {

class ZoneFinder {
public:
  // length in quanta
  ZoneFinder(const Lattice& lattice, double length) : lattice_(lattice), length_(length) {}

  Zones find() {
    normals();
    find_pairs();
    count_edges();
    zones_.slot.assign(lattice_.facets.size(), -1);
    for (std::size_t p = 0; p < zones_.pairs.size(); ++p)
      for (const int facet : zones_.pairs[p]) {
        int& slot = zones_.slot[facet];
        if (slot < 0) {
          slot = static_cast<int>(zones_.over.size());
          zones_.over.push_back(over(facet, margin_[facet]));
          zones_.of_slot.emplace_back();
        }
        zones_.of_slot[slot].push_back(static_cast<int>(p));
      }
    for (const auto& [a, b] : zones_.pairs) zones_.extent.push_back(extent(a, b));
    return std::move(zones_);
  }

private:
  static constexpr double facing = -0.5;  // cosine of normals: a wedge of fluid of less than 60 degrees
  static constexpr double same = 16;      // quanta: layers of one body that touch, rather than both sides of a thin one

  static double dot(const Point3& a, const Point3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
  static Point3 cross(const Point3& a, const Point3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  }
  static Point3 unit(const Point3& a) {
    const double length = std::sqrt(dot(a, a));
    return {a[0] / length, a[1] / length, a[2] / length};
  }

  const Integers3& vertex(int facet, int v) const { return lattice_.vertices[lattice_.facets[facet][v]]; }
  Point3 way(const Integers3& from, const Integers3& to) const {
    Point3 found;
    for (int d = 0; d < 3; ++d) found[d] = static_cast<double>(to[d] - from[d]);
    return found;
  }

  // Unit normals; zero where the facet has no area to rounding.
  void normals() {
    normal_.assign(lattice_.facets.size(), {});
    margin_.assign(lattice_.facets.size(), 0);
    for (std::size_t f = 0; f < normal_.size(); ++f) {
      const int facet = static_cast<int>(f);
      const Point3 p = way(vertex(facet, 0), vertex(facet, 1)), q = way(vertex(facet, 0), vertex(facet, 2));
      const Point3 n = cross(p, q);
      if (dot(n, n) > doubt * doubt * dot(p, p) * dot(q, q)) normal_[f] = unit(n);
    }
  }

  void find_pairs() {
    const auto reach = static_cast<std::int64_t>(std::ceil(2 * length_)) + 4;
    const Candidates near = candidates(lattice_, reach);
    std::vector<std::array<int, 2>> some;
    for (std::size_t c = 0; c < near.cells.size(); ++c)
      for (std::size_t i = near.first[c]; i < near.first[c + 1]; ++i)
        for (std::size_t j = i + 1; j < near.first[c + 1]; ++j)
          if (may_face(near.facets[i], near.facets[j], reach)) some.push_back({near.facets[i], near.facets[j]});
    std::sort(some.begin(), some.end());
    some.erase(std::unique(some.begin(), some.end()), some.end());
    for (const auto& [a, b] : some) add(a, b);
  }

  bool may_face(int a, int b, std::int64_t reach) const {
    if (!(dot(normal_[a], normal_[b]) < facing)) return false;
    for (int d = 0; d < 3; ++d) {
      const auto [low_a, high_a] = std::minmax({vertex(a, 0)[d], vertex(a, 1)[d], vertex(a, 2)[d]});
      const auto [low_b, high_b] = std::minmax({vertex(b, 0)[d], vertex(b, 1)[d], vertex(b, 2)[d]});
      if (high_a + reach < low_b || high_b + reach < low_a) return false;
    }
    return true;
  }

  void add(int a, int b) {
    const auto [least, most] = gap(a, b);
    const bool one_body = lattice_.body[a] == lattice_.body[b];
    if (least > length_ || most < (one_body ? -same : -length_)) return;
    const Point3 &n = normal_[a], &m = normal_[b];
    const double apart = -dot(m, way(vertex(b, 0), vertex(a, 0)));  // gap at a vertex of A: minus this
    double size = 0;
    for (const int facet : {a, b})
      for (int v = 0; v < 3; ++v) {
        const Point3 x = way(vertex(a, 0), vertex(facet, v));
        size = std::max(size, std::sqrt(dot(x, x)));
      }
    std::array<HalfSpace, 2> opening;
    for (int k = 0; k < 2; ++k) {
      const double sign = k ? -1 : 1;
      opening[k].base = vertex(a, 0);
      opening[k].shift = static_cast<std::int64_t>(std::floor(length_ + sign * apart));
      for (int d = 0; d < 3; ++d) opening[k].N[d] = integer(sign * (n[d] + m[d]));
      double change = 0;  // of the gap along both facets; below one quantum they are parallel
      for (int d = 0; d < 3; ++d) change += std::abs(std::ldexp(static_cast<double>(opening[k].N[d]), -normal_bits));
      if (change * size >= 1) continue;
      opening[k].N = {};
      if (opening[k].shift < 0) return;
    }
    for (const int facet : {a, b}) margin_[facet] = std::max(margin_[facet], std::min(most, length_));
    zones_.pairs.push_back({a, b});
    zones_.opening.push_back(opening);
  }

  static std::int64_t integer(double x) { return std::llrint(std::ldexp(x, normal_bits)); }

  // Bounds of the gap in the part of A that may lie over B; none: {inf, -inf}.
  std::array<double, 2> gap(int a, int b) const {
    const Integers3& origin = vertex(a, 0);
    const double reach = 2 * length_ + 4;
    std::vector<Point3> polygon, kept;
    for (int v = 0; v < 3; ++v) polygon.push_back(way(origin, vertex(a, v)));
    for (int e = 0; e < 3; ++e) {
      const Point3 from = way(origin, vertex(b, e)), side = outward(b, e);
      const auto over = [&](const Point3& x) { return dot(side, x) - dot(side, from) - 2 * reach; };
      kept.clear();
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Point3 &x = polygon[i], &y = polygon[(i + 1) % polygon.size()];
        const double s = over(x), t = over(y);
        if (s <= 0) kept.push_back(x);
        if ((s <= 0) == (t <= 0)) continue;
        Point3 between;
        for (int d = 0; d < 3; ++d) between[d] = x[d] + s / (s - t) * (y[d] - x[d]);
        kept.push_back(between);
      }
      polygon.swap(kept);
    }
    std::array<double, 2> found{INFINITY, -INFINITY};
    const double far = dot(normal_[b], way(origin, vertex(b, 0)));
    for (const Point3& x : polygon) {
      const double at = dot(normal_[b], x) - far;
      found = {std::min(found[0], at - reach), std::max(found[1], at + 4)};
    }
    return found;
  }

  // Edges of facets with pairs.
  void count_edges() {
    std::vector<int> some;
    for (const auto& [a, b] : zones_.pairs) some.insert(some.end(), {a, b});
    std::sort(some.begin(), some.end());
    some.erase(std::unique(some.begin(), some.end()), some.end());
    for (const int facet : some)
      for (int e = 0; e < 3; ++e) ++count_[edge(facet, e)];
  }

  std::pair<int, int> edge(int facet, int e) const {
    return std::minmax(lattice_.facets[facet][e], lattice_.facets[facet][(e + 1) % 3]);
  }

  // Unit vector in the plane of a facet, out of it beside an edge.
  Point3 outward(int facet, int edge) const {
    return unit(cross(way(vertex(facet, edge), vertex(facet, (edge + 1) % 3)), normal_[facet]));
  }

  // The zones of neighbours that both face something overlap by the gap, so that none is left between them where the
  // surface bends.
  std::array<HalfSpace, 3> over(int facet, double margin) const {
    std::array<HalfSpace, 3> found;
    for (int e = 0; e < 3; ++e) {
      const Point3 side = outward(facet, e), along = way(vertex(facet, e), vertex(facet, (e + 1) % 3));
      for (int d = 0; d < 3; ++d) found[e].N[d] = integer(side[d]);
      found[e].base = vertex(facet, e);
      const double bend = count_.at(edge(facet, e)) > 1 ? margin : 0;
      found[e].shift = static_cast<std::int64_t>(std::ceil(bend + 4 + 16 * rounding_error * std::sqrt(dot(along, along))));
    }
    return found;
  }

  // Around the part over a facet that is at most the length away from it.
  Extent around(int facet) const {
    const auto& sides = zones_.over[zones_.slot[facet]];
    Extent found;
    found.low.fill(std::numeric_limits<std::int64_t>::max());
    found.high.fill(std::numeric_limits<std::int64_t>::min());
    for (int v = 0; v < 3; ++v) {
      const Point3 p = outward(facet, (v + 2) % 3), q = outward(facet, v);
      const double shift = static_cast<double>(std::max(sides[v].shift, sides[(v + 2) % 3].shift));
      const double factor = shift / std::max(1 + dot(p, q), 1e-12);
      for (int d = 0; d < 3; ++d) {
        const double out = factor * (p[d] + q[d]);
        const auto beyond = [&](double x) -> std::int64_t {
          return vertex(facet, v)[d] + std::llrint(std::clamp(x, -0x1p60, 0x1p60));
        };
        found.low[d] = std::min(found.low[d], beyond(out - length_ - 4));
        found.high[d] = std::max(found.high[d], beyond(out + length_ + 4));
      }
    }
    return found;
  }

  Extent extent(int a, int b) const {
    Extent found = around(a);
    const Extent other = around(b);
    for (int d = 0; d < 3; ++d) {
      found.low[d] = std::max(found.low[d], other.low[d]);
      found.high[d] = std::min(found.high[d], other.high[d]);
    }
    return found;
  }

  const Lattice& lattice_;
  double length_;
  std::vector<Point3> normal_;
  std::vector<double> margin_;  // quanta
  std::map<std::pair<int, int>, int> count_;
  Zones zones_;
};

// Zones that may meet each cell, its boundary included.
inline Candidates zones_by_cell(const Lattice& lattice, const Zones& zones, double length) {
  std::vector<std::uint64_t> keys;
  for (std::size_t p = 0; p < zones.pairs.size(); ++p) {
    const Extent& around = zones.extent[p];
    std::array<int, 3> from, to;
    bool any = true;
    for (int d = 0; d < 3; ++d) {
      const auto& lines = lattice.lines[d];
      const auto below = std::lower_bound(lines.begin(), lines.end(), around.low[d]) - lines.begin() - 1;
      const auto above = std::upper_bound(lines.begin(), lines.end(), around.high[d]) - lines.begin();
      from[d] = std::max(0, static_cast<int>(below));
      to[d] = std::min(lattice.cells[d], static_cast<int>(above)) - 1;
      any &= around.low[d] <= around.high[d] && from[d] <= to[d];
    }
    if (!any) continue;
    const auto& v = lattice.facets[zones.pairs[p][0]];
    const Integers3& a = lattice.vertices[v[0]];
    std::array<Point3, 2> step;
    for (int k = 0; k < 2; ++k)
      for (int d = 0; d < 3; ++d) step[k][d] = static_cast<double>(lattice.vertices[v[k + 1]][d] - a[d]);
    Point3 n;
    double square = 0;
    for (int d = 0; d < 3; ++d) {
      const int e = next(d), f = next(e);
      n[d] = step[0][e] * step[1][f] - step[0][f] * step[1][e];
      square += n[d] * n[d];
    }
    std::array<int, 3> at;
    for (at[2] = from[2]; at[2] <= to[2]; ++at[2])
      for (at[1] = from[1]; at[1] <= to[1]; ++at[1])
        for (at[0] = from[0]; at[0] <= to[0]; ++at[0]) {
          const auto low = lattice.low(at), high = lattice.high(at);
          double middle = 0, reach = 0;
          for (int d = 0; d < 3; ++d) {
            const double half = 0.5 * static_cast<double>(high[d] - low[d]);
            middle += n[d] * (static_cast<double>(low[d] - a[d]) + half);
            reach += std::abs(n[d]) * half;
          }
          const double slack = 1e-6 * reach + (length + 4) * std::sqrt(square);  // on the safe side
          if (std::abs(middle) <= reach + slack)
            keys.push_back(static_cast<std::uint64_t>(lattice.number(at)) << 32 | p);
        }
  }
  return by_cell(keys);
}

}  // namespace cut
