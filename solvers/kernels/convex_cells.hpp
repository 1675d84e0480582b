// A cell divided by polygons of surface into convex parts: the binary space partition of Thibault & Naylor (1987).
//
// A part is split by the plane of a polygon if a piece of the polygon is within it. So surface lies in faces of parts
// only. Each face overlaps with faces of other parts in the same plane; an overlap is covered by surface or not.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

namespace division {

using Point = std::array<double, 3>;
using Shape = std::vector<Point>;  // corners of a convex polygon in a plane

constexpr double on_plane = 1e-14;  // distance, in cells, up to which a point lies in a plane; far below `coplanar`
constexpr double coplanar = 1e-10;  // the same for polygons, which count as part of the first plane they are in
constexpr double no_area = 1e-13;   // area, in faces of cells, that is rounding error

inline Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

struct Plane {
  Point n;  // unit normal
  double c;
  double distance(const Point& x) const { return dot(n, x) - c; }
};

// Twice the vector area.
inline Point twice_area(const Shape& shape) {
  Point total{};
  for (std::size_t k = 1; k + 1 < shape.size(); ++k) {
    const Point w = cross(minus(shape[k], shape[0]), minus(shape[k + 1], shape[0]));
    for (int d = 0; d < 3; ++d) total[d] += w[d];
  }
  return total;
}

inline double area(const Shape& shape) {
  const Point w = twice_area(shape);
  return 0.5 * std::sqrt(dot(w, w));
}

inline double diameter(const Shape& shape) {
  double longest = 0.0;
  for (const auto& a : shape)
    for (const auto& b : shape) longest = std::max(longest, dot(minus(a, b), minus(a, b)));
  return std::sqrt(longest);
}

inline double offset(const Plane& plane, const Point& x) {
  const double d = plane.distance(x);
  return std::abs(d) < on_plane ? 0.0 : d;
}

inline Point between(const Point& below, const Point& above, double d_below, double d_above) {
  const double t = d_below / (d_below - d_above);
  Point x;
  for (int d = 0; d < 3; ++d) x[d] = below[d] + t * (above[d] - below[d]);
  return x;
}

// The part of a polygon on one side of a plane; sign: 1 above it, -1 below.
inline Shape clipped(const Shape& shape, const Plane& plane, double sign) {
  Shape kept;
  for (std::size_t k = 0; k < shape.size(); ++k) {
    const Point &a = shape[k], &b = shape[(k + 1) % shape.size()];
    const double da = offset(plane, a), db = offset(plane, b);
    if (sign * da >= 0.0) kept.push_back(a);
    if (da * db < 0.0) kept.push_back(da < 0.0 ? between(a, b, da, db) : between(b, a, db, da));
  }
  return kept;
}

// Replaces a polygon by its part on one side of a plane. Returns whether there is one.
inline bool clip(Shape& shape, const Plane& plane, double sign) {
  std::size_t outside = 0;
  for (const auto& x : shape) outside += sign * offset(plane, x) < 0.0;
  if (outside == shape.size()) return false;
  if (outside > 0) shape = clipped(shape, plane, sign);  // most polygons are on one side
  return shape.size() >= 3;
}

inline Shape reversed(const Shape& shape) { return {shape.rbegin(), shape.rend()}; }

// Between two parts, or at the boundary of the cell.
struct Face {
  std::vector<int> loop;  // corners, counterclockwise about the plane's normal
  int plane;              // 2 axis + side: a face of the cell, normal outward; from 6 on those of polygons
  int below, above;       // parts on both sides, above the plane where its normal points; -1: outside of the cell
  Shape shape;
};

inline bool lies_in(const Shape& shape, const Plane& plane) {
  return std::all_of(shape.begin(), shape.end(), [&](const Point& x) { return std::abs(plane.distance(x)) < coplanar; });
}

// Convex parts of the unit cell. Corners and edges are common to all faces there, so that each part is closed exactly,
// wherever rounding puts the corners between planes that nearly coincide.
class Parts {
public:
  std::vector<Face> faces;
  std::vector<std::vector<int>> faces_of;  // numbers of the faces of each part

  // planes: those of the cell's faces, then others; number: the plane of each polygon.
  Parts(const std::vector<Shape>& polygons, const std::vector<int>& number, const std::vector<Plane>& planes)
    : planes_(planes) {
    for (int k = 0; k < 8; ++k) points_.push_back({k % 2 * 1.0, k / 2 % 2 * 1.0, k / 4 * 1.0});
    faces_of.resize(1);
    for (int axis = 0; axis < 3; ++axis)
      for (int side = 0; side < 2; ++side) {
        const int first = side << axis, p = 1 << (axis + 1) % 3, q = 1 << (axis + 2) % 3;
        std::vector<int> loop{first, first + p, first + p + q, first + q};
        if (side == 0) std::reverse(loop.begin(), loop.end());
        faces_of[0].push_back(static_cast<int>(faces.size()));
        faces.push_back({std::move(loop), 2 * axis + side, 0, -1, {}});
      }
    for (std::size_t k = 0; k < polygons.size(); ++k)
      for (int count = size(), p = 0; p < count; ++p)
        if (within(polygons[k], number[k], p)) split(p, number[k]);
    for (auto& face : faces)
      for (const int corner : face.loop) face.shape.push_back(points_[corner]);
  }

  int size() const { return static_cast<int>(faces_of.size()); }

  double volume(int part) const {
    double total = 0.0;
    for (const int f : faces_of[part])
      total += dot(twice_area(faces[f].shape), faces[f].shape[0]) * (faces[f].below == part ? 1.0 : -1.0);
    return total / 6.0;
  }

private:
  // Whether a piece of a polygon is inside of a part, and not in one of its faces.
  bool within(const Shape& polygon, int number, int part) const {
    Shape left = polygon;
    for (const int f : faces_of[part]) {
      const int plane = faces[f].plane;
      if (plane == number || (plane < 6 && lies_in(left, planes_[plane]))) return false;
      if (!clip(left, planes_[plane], faces[f].below == part ? -1.0 : 1.0)) return false;
    }
    return area(left) > no_area;
  }

  // Splits a part by a plane: it becomes what is below, a new one what is above.
  void split(int part, int number) {
    const Plane& plane = planes_[number];
    std::vector<double> d(points_.size(), 0.0);  // offsets of the part's corners
    double low = 0.0, high = 0.0;
    for (const int f : faces_of[part])
      for (const int corner : faces[f].loop) {
        d[corner] = offset(plane, points_[corner]);
        low = std::min(low, d[corner]);
        high = std::max(high, d[corner]);
      }
    if (low == 0.0 || high == 0.0) return;
    divide_edges(d);
    d.resize(points_.size(), 0.0);
    const int upper = size();
    const std::vector<int> mine = std::move(faces_of[part]);
    faces_of[part].clear();
    faces_of.emplace_back();
    for (const int f : mine) {
      low = high = 0.0;
      for (const int corner : faces[f].loop) {
        low = std::min(low, d[corner]);
        high = std::max(high, d[corner]);
      }
      const bool outward = faces[f].below == part;
      const bool along = (dot(planes_[faces[f].plane].n, plane.n) > 0.0) == outward;
      int above = -1;  // the face of what is above
      if (low < 0.0 && high > 0.0) {
        auto [upper_loop, lower_loops] = divided(faces[f].loop, d);
        const int beyond = outward ? faces[f].above : faces[f].below;
        const auto add = [&](std::vector<int> loop) {
          Face other = faces[f];
          other.loop = std::move(loop);
          if (beyond >= 0) faces_of[beyond].push_back(static_cast<int>(faces.size()));
          faces.push_back(std::move(other));
          return static_cast<int>(faces.size()) - 1;
        };
        above = add(std::move(upper_loop));
        for (std::size_t k = 1; k < lower_loops.size(); ++k) faces_of[part].push_back(add(std::move(lower_loops[k])));
        faces[f].loop = std::move(lower_loops[0]);
      } else if (high > 0.0 || (low == 0.0 && along)) {
        above = f;
      }
      if (above >= 0) {
        (outward ? faces[above].below : faces[above].above) = upper;
        faces_of[upper].push_back(above);
      }
      if (above != f) faces_of[part].push_back(f);
    }
    cover(part, upper, number);
  }

  // What of a face is above a plane, and what is below; d: offsets of corners, with one in the plane between any two on
  // different sides. By rounding, a face that nearly lies in the plane may cross it more than twice. Both have the same
  // edges in the plane nevertheless, so that parts stay closed.
  static std::pair<std::vector<int>, std::vector<std::vector<int>>> divided(std::vector<int> loop, const std::vector<double>& d) {
    std::rotate(loop.begin(), std::find_if(loop.begin(), loop.end(), [&](int corner) { return d[corner] > 0.0; }), loop.end());
    std::vector<int> upper;
    std::vector<std::vector<int>> lower;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      if (d[loop[k]] < 0.0) {
        std::size_t end = k;  // the last corner below before one above
        for (std::size_t m = k; m < loop.size() && d[loop[m]] <= 0.0; ++m)
          if (d[loop[m]] < 0.0) end = m;
        lower.emplace_back(loop.begin() + static_cast<std::ptrdiff_t>(k) - 1, loop.begin() + static_cast<std::ptrdiff_t>(end) + 2);
        k = end + 1;
      }
      upper.push_back(loop[k]);
    }
    return {std::move(upper), std::move(lower)};
  }

  // New corners where edges cross a plane, for all faces at these edges.
  void divide_edges(const std::vector<double>& d) {
    std::map<std::pair<int, int>, int> middle;
    for (auto& face : faces) {
      const auto [low, high] = std::minmax_element(face.loop.begin(), face.loop.end(), [&](int a, int b) { return d[a] < d[b]; });
      if (!(d[*low] < 0.0 && d[*high] > 0.0)) continue;  // most faces are elsewhere
      std::vector<int> loop;
      for (std::size_t k = 0; k < face.loop.size(); ++k) {
        const int a = face.loop[k], b = face.loop[(k + 1) % face.loop.size()];
        loop.push_back(a);
        if (d[a] * d[b] >= 0.0) continue;
        const int below = d[a] < 0.0 ? a : b, above = a + b - below;
        const auto [at, is_new] = middle.try_emplace({below, above}, static_cast<int>(points_.size()));
        if (is_new) points_.push_back(between(points_[below], points_[above], d[below], d[above]));
        loop.push_back(at->second);
      }
      face.loop = std::move(loop);
    }
  }

  // Faces between two parts along the edges that the lower one has on one side only.
  void cover(int lower, int upper, int number) {
    std::map<int, std::vector<int>> next;  // the edges of the new faces, opposite to those of others
    for (const int f : faces_of[lower]) {
      const auto& loop = faces[f].loop;
      for (std::size_t k = 0; k < loop.size(); ++k) {
        int a = loop[k], b = loop[(k + 1) % loop.size()];
        if (faces[f].below != lower) std::swap(a, b);
        auto& back = next[a];
        if (const auto twin = std::find(back.begin(), back.end(), b); twin != back.end()) back.erase(twin);
        else next[b].push_back(a);
      }
    }
    for (auto& [start, ends] : next)
      while (!ends.empty()) {
        std::vector<int> loop;
        for (int corner = start; !next[corner].empty();) {
          loop.push_back(corner);
          const int to = next[corner].back();
          next[corner].pop_back();
          corner = to;
        }
        for (const int p : {lower, upper}) faces_of[p].push_back(static_cast<int>(faces.size()));
        faces.push_back({std::move(loop), number, lower, upper, {}});
      }
  }

  const std::vector<Plane>& planes_;
  std::vector<Point> points_;
};

}  // namespace division
