// Regions of the fluid in cells that surfaces of several bodies cut: what is outside of all bodies, and its boundary.
//
// Surface lies in faces of convex parts (convex_cells.hpp). A part is inside of a body if its middle is behind the
// polygon of the body that is seen from there. So planes that nearly coincide, and meet beside the edges of their polygons, do no harm:
// whatever is inside or open, the boundary of a region consists of whole faces and is closed. Parts and slits between two
// bodies that are thinner than `gap` are closed.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "convex_cells.hpp"
#include "least_surface.hpp"

namespace division {

constexpr double nothing = 1e-13;  // volume, in cells, that is rounding error
constexpr double enclosed = 1e-6;    // volume, in cells, up to which fluid enclosed within a cell counts as solid
constexpr double close = 1e-9;       // distance, in cells, from the edge of a polygon at which rounding decides
constexpr double sliver = 1e-8;      // height, in cells, of parts whose side of a surface is doubtful; far above `coplanar`
constexpr double no_passage = 1e-9;  // area, in faces of cells, below which parts of two cells are not linked
constexpr double no_piece = 1e-15;    // area of a part of a polygon, in faces of cells, that is rounding error
constexpr double beside = 1e-6;    // distance, in cells, of polygons that a face may be part of from its middle
constexpr double unsound = 1e-7;   // difference of volumes, in cells, that is no rounding error

struct Input {
  std::vector<Shape> polygons;  // counterclockwise as seen from outside of their solids
  std::vector<Plane> planes;    // of the polygons, normals out of the solids
  std::vector<int> body;        // of each polygon, from 0
  double fraction;              // volumes of all bodies in the cell, added up
};

enum Kind : int { closing = -2, surface = -1 };  // from 0 on: 2 axis + side, a face of the cell

struct Boundary {
  int region, kind, polygon;  // polygon: that bounds the region, or the one that is nearest
  Shape shape;                // counterclockwise as seen from outside of the fluid
};

struct Regions {
  std::vector<double> volumes;
  std::vector<Boundary> boundary;
  std::array<int, 8> corners;  // wetness of the cell's corners: 1 wet, 0 dry, -1 unknown
  bool closes = false;         // some part is closed because it is thin, or surfaces of two bodies lie on each other
  bool overlapping = false;    // some part is inside of two bodies
  bool sound = true;           // the volumes of the bodies are those given
};

class Groups {
public:
  explicit Groups(std::size_t size) : up_(size) { std::iota(up_.begin(), up_.end(), 0); }
  int of(int k) {
    while (up_[k] != k) k = up_[k] = up_[up_[k]];
    return k;
  }
  void join(int a, int b) { up_[of(a)] = of(b); }

private:
  std::vector<int> up_;
};

inline Point middle(const Shape& shape) {
  Point sum{};
  for (const auto& x : shape)
    for (int d = 0; d < 3; ++d) sum[d] += x[d] / static_cast<double>(shape.size());
  return sum;
}

// The point of a convex polygon that is nearest to another one.
inline Point nearest_point(const Shape& shape, const Plane& plane, const Point& x) {
  bool inside = true;
  double least = std::numeric_limits<double>::infinity();
  Point found = shape[0];
  for (std::size_t k = 0; k < shape.size(); ++k) {
    const Point &a = shape[k], way = minus(shape[(k + 1) % shape.size()], a), to = minus(x, a);
    inside = inside && dot(cross(plane.n, way), to) >= 0.0;
    const double length = dot(way, way), t = length > 0.0 ? std::clamp(dot(to, way) / length, 0.0, 1.0) : 0.0;
    const Point at{a[0] + t * way[0], a[1] + t * way[1], a[2] + t * way[2]}, off = minus(x, at);
    if (dot(off, off) < least) least = dot(off, off), found = at;
  }
  if (!inside) return found;
  const double d = plane.distance(x);
  return {x[0] - d * plane.n[0], x[1] - d * plane.n[1], x[2] - d * plane.n[2]};
}

// What a polygon has in common with another one in its plane, with normal n; what it has not is added to `rest`.
inline Shape divided_by(const Shape& shape, const Shape& other, const Point& n, std::vector<Shape>& rest) {
  Shape left = shape;
  std::vector<Shape> outside;
  for (std::size_t k = 0; k < other.size(); ++k) {
    Point inward = cross(n, minus(other[(k + 1) % other.size()], other[k]));
    const double size = std::sqrt(dot(inward, inward));
    if (size < on_plane) continue;
    for (double& coordinate : inward) coordinate /= size;
    const Plane plane{inward, dot(inward, other[k])};
    if (Shape beyond = clipped(left, plane, -1.0); beyond.size() > 2 && area(beyond) > no_piece)
      outside.push_back(std::move(beyond));
    left = clipped(left, plane, 1.0);
    if (left.size() < 3 || area(left) < no_piece) {
      rest.push_back(shape);
      return {};
    }
  }
  rest.insert(rest.end(), outside.begin(), outside.end());
  return left;
}

class Cell {
public:
  Cell(const Input& input, double gap) : input_(input), gap_(gap) {
    for (int axis = 0; axis < 3; ++axis)
      for (int side = 0; side < 2; ++side) {
        Point n{};
        n[axis] = side == 1 ? 1.0 : -1.0;
        planes_.push_back({n, static_cast<double>(side)});
      }
    std::vector<int> number;  // the plane of each polygon
    for (std::size_t k = 0; k < input.polygons.size(); ++k) {
      std::size_t same = 6;
      while (same < planes_.size() && !lies_in(input.polygons[k], planes_[same])) ++same;
      if (same == planes_.size()) planes_.push_back(input.planes[k]);
      number.push_back(static_cast<int>(same));
    }
    parts_.emplace(input.polygons, number, planes_);
  }

  Regions regions() {
    Regions found;
    classify(found);
    settle();
    const int count = parts_->size();
    std::vector<char> open(count);
    for (int p = 0; p < count; ++p) {
      open[p] = inside_[p].empty();
      if (open[p] && thin(p)) open[p] = false, found.closes = true;
    }
    Groups groups(count);
    for (const auto& face : parts_->faces) {
      if (face.above < 0) continue;
      const auto &a = inside_[face.below], &b = inside_[face.above];
      if (open[face.below] && open[face.above]) {
        if (narrow(face.shape)) found.closes = true;
        else groups.join(face.below, face.above);
      }
      if (a.size() == 1 && b.size() == 1 && a != b && area(face.shape) > beside) found.closes = true;
    }
    std::map<int, double> volumes, passages;
    for (int p = 0; p < count; ++p)
      if (open[p]) volumes[groups.of(p)] += parts_->volume(p);
    for (const auto& face : parts_->faces)
      if (face.above < 0 && open[face.below])
        passages[groups.of(face.below)] = std::max(passages[groups.of(face.below)], area(face.shape));
    std::map<int, int> number;
    for (const auto& [group, size] : volumes)
      if (size > enclosed || (size > nothing && passages[group] > no_passage)) {
        number[group] = static_cast<int>(found.volumes.size());
        found.volumes.push_back(size);
      }
    std::vector<int> region(count, -1);
    for (int p = 0; p < count; ++p)
      if (const auto at = number.find(groups.of(p)); open[p] && at != number.end()) region[p] = at->second;
    for (const auto& face : parts_->faces) {
      const int below = region[face.below], above = face.above < 0 ? -1 : region[face.above];
      if (face.above < 0 && below >= 0) {
        const int kind = narrow(face.shape) ? static_cast<int>(closing) : face.plane;
        found.boundary.push_back({below, kind, nearest(middle(face.shape)), face.shape});
      } else if (below != above) {
        if (below >= 0) bound(found, below, face, true);
        if (above >= 0) bound(found, above, face, false);
      }
    }
    corners(found, region);
    return found;
  }

private:
  // Bodies that each part is inside of.
  void classify(Regions& found) {
    const int bodies = input_.body.empty() ? 0 : 1 + *std::max_element(input_.body.begin(), input_.body.end());
    inside_.resize(parts_->size());
    double solid = 0.0, twice = 0.0;
    for (int p = 0; p < parts_->size(); ++p) {
      Point x{};
      double count = 0.0;
      for (const int f : parts_->faces_of[p])
        for (const auto& corner : parts_->faces[f].shape) {
          for (int d = 0; d < 3; ++d) x[d] += corner[d];
          count += 1.0;
        }
      for (double& coordinate : x) coordinate /= count;
      for (int b = 0; b < bodies; ++b)
        if (behind(b, x)) inside_[p].insert(b);
      const double size = parts_->volume(p);
      solid += size * static_cast<double>(inside_[p].size());
      if (inside_[p].size() > 1) twice += size;
    }
    found.overlapping = twice > nothing;
    const double others = std::round(input_.fraction - solid);
    found.sound = std::abs(input_.fraction - solid - others) < unsound;
    if (others > 0.5)
      for (auto& part : inside_) part.insert(bodies);
  }

  // Slivers between planes that nearly coincide: their middle does not say on which side of a body they are, because
  // polygons that nearly lie in one plane count as part of it. The surface takes the shortest way through them. Where it
  // ran to and fro, penalties would be counted several times.
  void settle() {
    const int count = parts_->size(), bodies = 1 + *std::max_element(input_.body.begin(), input_.body.end());
    std::vector<char> doubtful(count);
    for (int p = 0; p < count; ++p) {
      double largest = 0.0;
      for (const int f : parts_->faces_of[p]) largest = std::max(largest, area(parts_->faces[f].shape));
      doubtful[p] = parts_->volume(p) < sliver * largest;
    }
    std::vector<Border> borders;
    for (const auto& face : parts_->faces)
      if (face.above >= 0 && (doubtful[face.below] || doubtful[face.above]))
        borders.push_back({face.below, face.above, area(face.shape)});
    if (borders.empty()) return;
    for (int b = 0; b < bodies; ++b) {
      std::vector<int> known(count);
      for (int p = 0; p < count; ++p) known[p] = doubtful[p] ? -1 : inside_[p].contains(b);
      const auto inside = least_surface(known, borders, no_piece);
      for (int p = 0; p < count; ++p)
        if (doubtful[p]) inside[p] ? (void)inside_[p].insert(b) : (void)inside_[p].erase(b);
    }
  }

  // Whether a point is inside of a body: it is behind the first polygon of it on the way to one of them.
  bool behind(int body, const Point& x) const {
    double least = std::numeric_limits<double>::infinity(), sign = 1.0;
    for (std::size_t k = 0; k < input_.polygons.size(); ++k) {
      if (input_.body[k] != body) continue;
      if (const double side = first_side(body, x, middle(input_.polygons[k])); side != 0.0) return side < 0.0;
      const Point way = minus(x, nearest_point(input_.polygons[k], input_.planes[k], x));
      if (dot(way, way) < least) least = dot(way, way), sign = dot(way, input_.planes[k].n);
    }
    return sign < 0.0;
  }

  // Distance of a point from the plane of the first polygon of a body on the way to another point; 0 if rounding decides.
  double first_side(int body, const Point& x, const Point& to) const {
    double first = 1.0 + close, side = 0.0;
    for (std::size_t k = 0; k < input_.polygons.size(); ++k) {
      if (input_.body[k] != body) continue;
      const double from = input_.planes[k].distance(x), there = input_.planes[k].distance(to);
      if (std::abs(from - there) < close) {
        if (std::abs(from) < close) return 0.0;
        continue;
      }
      const double t = from / (from - there);
      if (t < 0.0 || t > first + close) continue;
      const Point at{x[0] + t * (to[0] - x[0]), x[1] + t * (to[1] - x[1]), x[2] + t * (to[2] - x[2])};
      const double off = margin(input_.polygons[k], input_.planes[k].n, at);
      if (off < -close) continue;
      if (off < close || (side != 0.0 && std::abs(t - first) < close)) return 0.0;
      if (t < first) first = t, side = from;
    }
    return side;
  }

  // Distance of a point in the plane of a convex polygon from its edges, negative outside.
  static double margin(const Shape& shape, const Point& n, const Point& x) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < shape.size(); ++k) {
      const Point inward = cross(n, minus(shape[(k + 1) % shape.size()], shape[k]));
      if (const double size = std::sqrt(dot(inward, inward)); size > on_plane)
        least = std::min(least, dot(inward, minus(x, shape[k])) / size);
    }
    return least;
  }

  // Whether an open part is a film: it is thin, and most of it is between surfaces of two bodies.
  bool thin(int part) const {
    const auto& faces = parts_->faces;
    double largest = 0.0;
    for (const int f : parts_->faces_of[part]) largest = std::max(largest, area(faces[f].shape));
    for (const int wall : parts_->faces_of[part]) {
      if (faces[wall].above < 0 || inside_[other(wall, part)].empty()) continue;
      const Plane& plane = planes_[faces[wall].plane];
      double low = 0.0, high = 0.0;
      for (const int f : parts_->faces_of[part])
        for (const auto& x : faces[f].shape) {
          low = std::min(low, plane.distance(x));
          high = std::max(high, plane.distance(x));
        }
      if (high - low >= gap_) continue;
      double mine = 0.0, others = 0.0;  // others face this wall: tops of two bodies beside each other do not
      for (const int f : parts_->faces_of[part]) {
        if (faces[f].above < 0) continue;
        const double along = dot(outward(f, part), outward(wall, part));
        const auto& there = inside_[other(f, part)];
        if (there.empty()) continue;
        if (const bool same = there == inside_[other(wall, part)]; same && along > 0.5) mine += area(faces[f].shape);
        else if (!same && along < -0.5) others += area(faces[f].shape);
      }
      if (std::min(mine, others) > 0.25 * largest) return true;
    }
    return false;
  }

  // Whether a polygon is a slit between two bodies.
  bool narrow(const Shape& shape) const {
    if (area(shape) > gap_ * diameter(shape)) return false;
    const Point x = middle(shape);
    std::set<int> near;
    for (std::size_t k = 0; k < input_.polygons.size(); ++k) {
      const Point way = minus(x, nearest_point(input_.polygons[k], input_.planes[k], x));
      if (dot(way, way) < gap_ * gap_) near.insert(input_.body[k]);
    }
    return near.size() > 1;
  }

  int other(int number, int part) const {
    return parts_->faces[number].below == part ? parts_->faces[number].above : parts_->faces[number].below;
  }

  // Normal of a face out of a part.
  Point outward(int number, int part) const {
    const Point& n = planes_[parts_->faces[number].plane].n;
    return parts_->faces[number].below == part ? n : Point{-n[0], -n[1], -n[2]};
  }

  int nearest(const Point& x) const {
    double least = std::numeric_limits<double>::infinity();
    int found = 0;
    for (std::size_t k = 0; k < input_.polygons.size(); ++k) {
      const Point way = minus(x, nearest_point(input_.polygons[k], input_.planes[k], x));
      if (dot(way, way) < least) least = dot(way, way), found = static_cast<int>(k);
    }
    return found;
  }

  // The boundary of a region at a face that nothing passes: parts of polygons, or what closes a gap.
  void bound(Regions& found, int region, const Face& one, bool first) const {
    const auto& bodies = inside_[first ? one.above : one.below];
    const Point x = middle(one.shape), n = planes_[one.plane].n;
    const auto add = [&](int kind, int polygon, const Shape& shape) {
      found.boundary.push_back({region, kind, polygon, first ? shape : reversed(shape)});
    };
    std::map<int, std::vector<int>> facing;  // polygons of each body that the face may be part of
    for (std::size_t k = 0; k < input_.polygons.size(); ++k) {
      const double along = dot(input_.planes[k].n, n) * (first ? -1.0 : 1.0);
      if (bodies.contains(input_.body[k]) && along > 0.9 && std::abs(input_.planes[k].distance(x)) < beside)
        facing[input_.body[k]].push_back(static_cast<int>(k));
    }
    if (facing.empty()) {
      add(closing, nearest(x), one.shape);
      return;
    }
    std::vector<Shape> left{one.shape}, rest;
    for (const int k : facing.begin()->second) {
      rest.clear();
      for (const auto& shape : left)
        if (Shape part = divided_by(shape, first ? reversed(input_.polygons[k]) : input_.polygons[k], n, rest); !part.empty())
          add(surface, k, part);
      left.swap(rest);
    }
    for (const auto& shape : left) add(surface, nearest(middle(shape)), shape);
  }

  void corners(Regions& found, const std::vector<int>& region) const {
    found.corners.fill(-1);
    for (int corner = 0; corner < 8; ++corner) {
      const Point x{static_cast<double>(corner & 1), static_cast<double>(corner >> 1 & 1),
                    static_cast<double>(corner >> 2)};
      std::set<bool> wet;
      for (const auto& face : parts_->faces)
        if (face.above < 0 && std::find(face.shape.begin(), face.shape.end(), x) != face.shape.end())
          wet.insert(region[face.below] >= 0);
      if (wet.size() == 1) found.corners[corner] = *wet.begin();
    }
  }

  const Input& input_;
  double gap_;
  std::vector<Plane> planes_;  // of the cell's faces, then of polygons
  std::optional<Parts> parts_;
  std::vector<std::set<int>> inside_;  // bodies that each part is inside of
};

}  // namespace division
