// A face of the grid, divided along all facets that meet it: a BSP of the square by the lines of the facets, in which
// both cells at the face find the same convex parts, and each part belongs to one region of either cell.
#pragma once

#include <span>
#include <vector>

#include "cut_planes.hpp"

namespace cut {

struct FacePart {
  std::vector<std::pair<PointName, std::int64_t>> corners;  // and the plane through the edge that follows
  std::vector<int> cover;                                   // facets in the face that cover the part
  std::vector<int> beside;                                  // facets that end at its boundary and face it
  std::vector<std::array<double, 2>> outline;               // corners, relative to the face
  double area;                                              // relative to the face
};

struct FaceParts {
  std::vector<FacePart> parts;
  std::array<int, 4> at_corner{-1, -1, -1, -1};  // part at each corner: first axis after the normal's, then second
};

class FaceDivision {
public:
  FaceDivision(const Lattice& lattice, const Zones& zones)
    : lattice_(lattice), zones_(zones), context_(lattice, zones) {}

  // The face between the cell `at` and the one below it along an axis; at[axis] may be one past the last cell.
  // zones: pairs of facets whose zones may meet it.
  FaceParts divide(int axis, const std::array<int, 3>& at, const std::vector<int>& facets, std::span<const int> zones) {
    context_.start({lattice_.lines[0][at[0]], lattice_.lines[1][at[1]], lattice_.lines[2][at[2]]});
    const int e = next(axis), f = next(e);
    face_ = context_.plane(context_.grid_plane(axis, at[axis]));
    const std::array<int, 4> sides{
      context_.plane(context_.grid_plane(e, at[e])), context_.plane(context_.grid_plane(e, at[e] + 1)),
      context_.plane(context_.grid_plane(f, at[f])), context_.plane(context_.grid_plane(f, at[f] + 1))};
    found_ = {};
    covering_.clear();
    std::vector<Segment> segments;
    for (const int facet : facets) add(axis, at[axis], facet, segments);
    std::vector<Segment> kept;
    for (Segment& segment : segments)
      if (clip(segment, sides)) kept.push_back(segment);
    std::array<int, 4> corner;
    for (int k = 0; k < 4; ++k) corner[k] = context_.meet(face_, sides[k & 1], sides[2 + (k >> 1)]);
    const Polygon square = context_.polygon_of(
      face_, {{corner[0], sides[2]}, {corner[1], sides[1]}, {corner[3], sides[3]}, {corner[2], sides[0]}});
    const Point3& far = context_.points[corner[3]].x;
    size_ = {far[e], far[f]};
    corner_ = corner;
    axis_ = axis;
    find_bounds(at, zones);
    divide(square, std::move(kept), {});
    return std::move(found_);
  }

private:
  struct Segment {
    int plane, a, b, facet;  // facet -1: an edge of one in the face
  };

  void add(int axis, int line, int facet, std::vector<Segment>& segments) {
    if (context_.degenerate(facet)) return;
    const auto& v = lattice_.facets[facet];
    std::array<int, 3> s;
    for (int i = 0; i < 3; ++i) {
      const auto above = lattice_.vertices[v[i]][axis] - lattice_.lines[axis][line];
      s[i] = (above > 0) - (above < 0);
    }
    if (!s[0] && !s[1] && !s[2]) {
      covering_.push_back(facet);
      for (int i = 0; i < 3; ++i)
        segments.push_back({context_.plane(context_.edge_plane(facet, i)), context_.vertex(v[i]),
                            context_.vertex(v[(i + 1) % 3]), -1});
      return;
    }
    int count = 0;
    std::array<int, 2> ends{};
    const int plane = context_.plane(context_.facet_plane(facet));
    for (int i = 0; i < 3 && count < 2; ++i) {
      if (s[i] == 0) ends[count++] = context_.vertex(v[i]);
      if (s[i] * s[(i + 1) % 3] < 0)
        ends[count++] = context_.meet(face_, plane, context_.plane(context_.edge_plane(facet, i)));
    }
    if (count == 2) segments.push_back({plane, ends[0], ends[1], facet});
  }

  bool clip(Segment& segment, const std::array<int, 4>& sides) {
    for (int k = 0; k < 4; ++k) {
      const int keep = k % 2 ? -1 : 1;
      const int s = keep * context_.side(segment.a, sides[k]), t = keep * context_.side(segment.b, sides[k]);
      if (s <= 0 && t <= 0 && (s || t)) return false;
      if (s * t < 0) (s < 0 ? segment.a : segment.b) = context_.meet(face_, segment.plane, sides[k]);
    }
    return true;
  }

  // Gives a segment to the parts below and above a plane.
  void give(const Segment& segment, int plane, std::vector<Segment>& low, std::vector<Segment>& high) {
    const int s = context_.side(segment.a, plane), t = context_.side(segment.b, plane);
    if (s * t < 0) {
      Segment below = segment, above = segment;
      const int between = context_.meet(face_, segment.plane, plane);
      (s < 0 ? below.b : below.a) = between;
      (s < 0 ? above.a : above.b) = between;
      low.push_back(below);
      high.push_back(above);
      return;
    }
    if (s <= 0 && t <= 0) low.push_back(segment);
    if (s >= 0 && t >= 0) high.push_back(segment);
  }

  void divide(const Polygon& polygon, std::vector<Segment> inside, std::vector<Segment> beside) {
    while (!inside.empty()) {
      const Segment chosen = inside.back();
      inside.pop_back();
      const int side = context_.side(polygon, chosen.plane);
      if (side != 2) {  // it is on the boundary of the part
        if (side == 1 && chosen.facet >= 0) beside.push_back(chosen);
        continue;
      }
      const auto [low, high] = context_.split(polygon, chosen.plane);
      std::vector<Segment> inside_low{chosen}, inside_high{chosen}, beside_low, beside_high;
      for (const auto& segment : inside) give(segment, chosen.plane, inside_low, inside_high);
      for (const auto& segment : beside) give(segment, chosen.plane, beside_low, beside_high);
      divide(low, std::move(inside_low), std::move(beside_low));
      divide(high, std::move(inside_high), std::move(beside_high));
      return;
    }
    divide_by_zones(polygon, std::move(beside), 0);
  }

  // Zones that meet the face: the same ones from both of its cells.
  void find_bounds(const std::array<int, 3>& at, std::span<const int> zones) {
    bounds_.clear();
    for (const int pair : zones) {
      const Extent& around = zones_.extent[pair];
      bool meets = true;
      for (int d = 0; d < 3; ++d) {
        const auto& lines = lattice_.lines[d];
        meets &= around.low[d] <= lines[at[d] + (d != axis_)] && around.high[d] >= lines[at[d]];
      }
      if (meets) bounds_.push_back(context_.bounds_of_zone(pair));
    }
  }

  // Divides a part of the face so that each zone, that of either cell, is on all of it or on nothing.
  void divide_by_zones(Polygon polygon, std::vector<Segment> beside, std::size_t from) {
    for (std::size_t k = from; k < bounds_.size(); ++k) {
      const auto outside = [&](const std::pair<int, int>& bound) {
        return context_.side(polygon, bound.first) == -bound.second;
      };
      bool within = true;
      for (const auto& bound : bounds_[k]) within &= !outside(bound);
      if (!within) continue;
      for (const auto& [plane, keep] : bounds_[k]) {
        const int side = context_.side(polygon, plane);
        if (side == -keep) break;
        if (side != 2) continue;
        const auto [low, high] = context_.split(polygon, plane);
        std::vector<Segment> beside_low, beside_high;
        for (const auto& segment : beside) give(segment, plane, beside_low, beside_high);
        divide_by_zones(keep > 0 ? low : high, keep > 0 ? beside_low : beside_high, k + 1);
        polygon = keep > 0 ? high : low;
        beside = keep > 0 ? std::move(beside_high) : std::move(beside_low);
      }
    }
    finish(polygon, beside);
  }

  void finish(const Polygon& polygon, const std::vector<Segment>& beside) {
    FacePart part;
    const int e = next(axis_), f = next(e), number = static_cast<int>(found_.parts.size());
    for (int i = 0; i < polygon.count; ++i) {
      const Corner& corner = context_.corners[polygon.first + i];
      part.corners.push_back({context_.name(corner.point), context_.planes[corner.edge].name});
      const Point3& x = context_.points[corner.point].x;
      part.outline.push_back({x[e] / size_[0], x[f] / size_[1]});
      for (int k = 0; k < 4; ++k)
        if (corner.point == corner_[k]) found_.at_corner[k] = number;
    }
    part.area = 0.5 * context_.twice_area(polygon)[axis_] / (size_[0] * size_[1]);
    for (const auto& segment : beside)
      if (bounds_.empty() || context_.side(polygon, segment.plane) == 1) part.beside.push_back(segment.facet);
    for (const int facet : covering_) {
      bool covered = true;
      for (int i = 0; i < 3 && covered; ++i) {
        const int plane = context_.plane(context_.edge_plane(facet, i));
        const int inner = context_.side(context_.vertex(lattice_.facets[facet][(i + 2) % 3]), plane);
        covered = context_.side(polygon, plane) == inner;
      }
      if (covered) part.cover.push_back(facet);
    }
    found_.parts.push_back(std::move(part));
  }

  const Lattice& lattice_;
  const Zones& zones_;
  Context context_;
  std::vector<Context::Bounds> bounds_;  // of zones
  int face_ = -1, axis_ = 0;
  std::array<double, 2> size_{};
  std::array<int, 4> corner_{};
  std::vector<int> covering_;  // facets in the face
  FaceParts found_;
};

}  // namespace cut
