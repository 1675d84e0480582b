// Regions of fluid in one cell, exactly: a BSP of the cell by the planes of the facets in it (Thibault & Naylor 1987),
// in convex parts with portals between them. A portal is covered by facets or not, uniformly, since the neighbours of a
// facet divide it along their common edges; so are the parts of the cell's faces (cut_faces.hpp). Facets that coincide,
// or that lie in one plane or in a plane of the grid, cover one portal together. The winding number of each body
// changes by one across its facets; fluid is where all are zero.
#pragma once

#include <algorithm>
#include <functional>
#include <iterator>
#include <numeric>
#include <string>
#include <vector>

#include "cut_faces.hpp"
#include "cut_regions.hpp"

namespace cut {

class ExactCell {
public:
  // winding: number of turns of a body about a point, given relative to the cell in units of 2^fine_bits quanta
  using Winding = std::function<int(int body, const Point3& x)>;

  ExactCell(const Lattice& lattice, const Zones& zones) : lattice_(lattice), zones_(zones), context_(lattice, zones) {}

  // zones: pairs of facets whose zones may meet the cell
  void compute(const std::array<int, 3>& at, const std::vector<int>& facets, std::span<const int> zones,
               const std::array<const FaceParts*, 6>& faces, const Winding& winding, CellRegions& out) {
    context_.start(lattice_.low(at));
    portals_.clear();
    covers_.clear();
    parts_ = 0;
    new_part();
    for (int k = 0; k < 6; ++k) sides_[k] = context_.plane(context_.grid_plane(k / 2, at[k / 2] + k % 2));
    for (int k = 0; k < 6; ++k) add_face(k, *faces[k]);
    for (const int facet : facets) add_facet(facet, at);
    out.exact = true;
    out.cut = !inside_[0].empty() || !covers_.empty();
    if (!out.cut && zones.empty()) return;
    for (int k = 0; k < parts_; ++k)
      while (!inside_[k].empty()) divide(k);
    find_solid(at, winding, out);
    close(zones);
    if (!out.cut && std::find(closed_.begin(), closed_.end(), 1) == closed_.end()) return;
    out.cut = true;
    finish(at, faces, out);
    if (!zones.empty()) find_closed(at, zones, out);
  }

private:
  struct Fragment {
    Polygon shape;
    int facet, sign;  // of its normal along that of the plane
    bool reversed;    // order of corners
  };
  struct Cover {
    Fragment of;
    int next;
  };
  struct Portal {
    Polygon shape;
    std::array<int, 2> part;  // below and above; -1: outside of the cell
    int cover = -1;           // first of its covers
    int face = -1, of_face = -1;  // of the cell, and part of it
  };

  void new_part() {
    if (parts_ == static_cast<int>(of_part_.size())) {
      of_part_.emplace_back();
      inside_.emplace_back();
    }
    of_part_[parts_].clear();
    inside_[parts_++].clear();
  }

  void cover(int portal, const Fragment& fragment) {
    covers_.push_back({fragment, portals_[portal].cover});
    portals_[portal].cover = static_cast<int>(covers_.size()) - 1;
  }

  void add_face(int k, const FaceParts& face) {
    for (std::size_t j = 0; j < face.parts.size(); ++j) {
      const FacePart& part = face.parts[j];
      scratch_.clear();
      for (const auto& [point, edge] : part.corners) {
        const int corner = context_.point(point);
        scratch_.push_back({corner, context_.plane(edge)});
      }
      Portal portal;
      portal.shape = context_.polygon_of(sides_[k], scratch_);
      portal.part = k % 2 ? std::array<int, 2>{0, -1} : std::array<int, 2>{-1, 0};
      portal.face = k;
      portal.of_face = static_cast<int>(j);
      portals_.push_back(portal);
      const int number = static_cast<int>(portals_.size()) - 1;
      of_part_[0].push_back(number);
      for (const int facet : part.cover) {
        const int sign = context_.planes[context_.plane(context_.facet_plane(facet))].n[k / 2] > 0 ? 1 : -1;
        cover(number, {portal.shape, facet, sign, sign < 0});
      }
    }
  }

  void add_facet(int facet, const std::array<int, 3>& at) {
    if (context_.degenerate(facet)) return;
    const auto& v = lattice_.facets[facet];
    for (int d = 0; d < 3; ++d) {  // in a plane of the grid: it covers parts of the face
      const auto x = lattice_.vertices[v[0]][d];
      const bool flat = x == lattice_.vertices[v[1]][d] && x == lattice_.vertices[v[2]][d];
      if (flat && (x == lattice_.lines[d][at[d]] || x == lattice_.lines[d][at[d] + 1])) return;
    }
    scratch_.clear();
    for (int i = 0; i < 3; ++i) {
      const int corner = context_.vertex(v[i]);
      scratch_.push_back({corner, context_.plane(context_.edge_plane(facet, i))});
    }
    Polygon shape = context_.polygon_of(context_.plane(context_.facet_plane(facet)), scratch_);
    for (int k = 0; k < 6; ++k) {
      const int s = context_.side(shape, sides_[k]), keep = k % 2 ? -1 : 1;
      if (s == -keep) return;
      if (s != 2) continue;
      const auto [low, high] = context_.split(shape, sides_[k]);
      shape = keep < 0 ? low : high;
    }
    inside_[0].push_back({shape, facet, 1, false});
  }

  // Divides a part by a plane: what is above becomes a new part. The portal between them.
  int split(int k, int plane) {
    const int up = parts_;
    new_part();
    old_.clear();
    old_.swap(of_part_[k]);
    Polygon door = whole(plane);
    for (const int f : old_) {
      const Portal& portal = portals_[f];
      if (context_.side(door, portal.shape.plane) != 2) continue;
      const auto [low, high] = context_.split(door, portal.shape.plane);
      door = portal.part[0] == k ? low : high;
    }
    for (const int f : old_) divide_portal(f, plane, k, up);
    Portal made;
    made.shape = door;
    made.part = {k, up};
    portals_.push_back(made);
    const int number = static_cast<int>(portals_.size()) - 1;
    of_part_[k].push_back(number);
    of_part_[up].push_back(number);
    return number;
  }

  // Divides a part by the plane of a facet in it.
  void divide(int k) {
    const Fragment chosen = inside_[k].back();
    inside_[k].pop_back();
    const int plane = chosen.shape.plane, up = parts_, number = split(k, plane);
    cover(number, chosen);
    fragments_.clear();
    fragments_.swap(inside_[k]);
    for (Fragment& fragment : fragments_) {
      const int s = context_.side(fragment.shape, plane);
      if (s == 2) {
        const auto [low, high] = context_.split(fragment.shape, plane);
        inside_[k].push_back({low, fragment.facet, fragment.sign, fragment.reversed});
        inside_[up].push_back({high, fragment.facet, fragment.sign, fragment.reversed});
      } else if (s) {
        inside_[s > 0 ? up : k].push_back(fragment);
      } else {
        const auto &p = context_.planes[fragment.shape.plane].n, &q = context_.planes[plane].n;
        if (p[0] * q[0] + p[1] * q[1] + p[2] * q[2] < 0) fragment.sign = -fragment.sign;
        fragment.shape.plane = plane;
        cover(number, fragment);
      }
    }
  }

  void divide_portal(int f, int plane, int k, int up) {
    const int s = context_.side(portals_[f].shape, plane);
    const auto replace = [&](Portal& portal) { (portal.part[0] == k ? portal.part[0] : portal.part[1]) = up; };
    if (s == 1) {
      replace(portals_[f]);
      of_part_[up].push_back(f);
      return;
    }
    of_part_[k].push_back(f);
    if (s != 2) return;
    const auto [low, high] = context_.split(portals_[f].shape, plane);
    Portal other = portals_[f];
    other.shape = high;
    other.cover = -1;
    portals_[f].shape = low;
    replace(other);
    const int number = static_cast<int>(portals_.size());
    portals_.push_back(other);
    int c = portals_[f].cover;
    portals_[f].cover = -1;
    while (c >= 0) {
      const int following = covers_[c].next;
      const int t = context_.side(covers_[c].of.shape, plane);
      if (t == 2) {
        Fragment above = covers_[c].of;
        const auto [below, rest] = context_.split(above.shape, plane);
        covers_[c].of.shape = below;
        above.shape = rest;
        cover(number, above);
      }
      const int to = t == 1 ? number : f;
      covers_[c].next = portals_[to].cover;
      portals_[to].cover = c;
      c = following;
    }
    const int beyond = other.part[0] == up ? other.part[1] : other.part[0];
    if (beyond >= 0) of_part_[beyond].push_back(number);
    of_part_[up].push_back(number);
  }

  // A plane in the column of the cell along its steepest axis.
  Polygon whole(int plane) {
    const Plane& p = context_.planes[plane];
    const int e = next(p.axis), f = next(e);
    const std::array<int, 4> around{sides_[2 * f], sides_[2 * e + 1], sides_[2 * f + 1], sides_[2 * e]};
    scratch_.clear();
    for (int i = 0; i < 4; ++i)
      scratch_.push_back({context_.meet(around[(i + 3) % 4], around[i], plane), around[i]});
    return context_.polygon_of(plane, scratch_);
  }

  // -1, 1: a part is on one side of a plane; 2: it is divided by it.
  int side(int part, int plane) {
    bool below = false, above = false;
    for (const int f : of_part_[part]) {
      const int s = context_.side(portals_[f].shape, plane);
      below |= s < 0 || s == 2;
      above |= s > 0;
      if (below && above) return 2;
    }
    return above ? 1 : -1;
  }

  // Takes fluid in zones for solid.
  void close(std::span<const int> zones) {
    closed_.assign(parts_, 0);
    if (zones.empty()) return;
    bounds_.clear();
    for (const int pair : zones) bounds_.push_back(context_.bounds_of_zone(pair));
    std::vector<std::pair<int, std::size_t>> ahead;  // parts, and the first zone that may meet them
    for (int k = 0; k < parts_; ++k)
      if (!solid_[k]) ahead.push_back({k, 0});
    while (!ahead.empty()) {
      auto [k, z] = ahead.back();
      ahead.pop_back();
      for (; z < bounds_.size(); ++z) {
        bool within = true;
        for (const auto& [plane, keep] : bounds_[z]) within = within && side(k, plane) != -keep;
        for (const auto& [plane, keep] : bounds_[z]) {
          if (!within) break;
          const int s = side(k, plane);
          within = s != -keep;
          if (s != 2) continue;
          const int up = parts_;
          split(k, plane);
          solid_.push_back(0);
          closed_.push_back(0);
          ahead.push_back({keep > 0 ? k : up, z + 1});
          k = keep > 0 ? up : k;
        }
        if (!within) continue;
        solid_[k] = closed_[k] = 1;
        break;
      }
    }
  }

  // Pieces of facets in zones, with no fluid ahead of them.
  void find_closed(const std::array<int, 3>& at, std::span<const int> zones, CellRegions& out) {
    for (const Portal& portal : portals_)
      for (int c = portal.cover; c >= 0; c = covers_[c].next) {
        const Fragment& of = covers_[c].of;
        const int slot = zones_.slot[of.facet], ahead = portal.part[of.sign > 0 ? 1 : 0];
        if (slot < 0 || ahead < 0 || !solid_[ahead]) continue;
        old_.clear();
        const auto& pairs = zones_.of_slot[slot];
        std::set_intersection(pairs.begin(), pairs.end(), zones.begin(), zones.end(), std::back_inserter(old_));
        find_closed(of, old_, at, out);
      }
  }

  void find_closed(const Fragment& fragment, const std::vector<int>& pairs, const std::array<int, 3>& at,
                   CellRegions& out) {
    std::vector<std::pair<Polygon, std::size_t>> ahead{{fragment.shape, 0}};
    while (!ahead.empty()) {
      auto [polygon, z] = ahead.back();
      ahead.pop_back();
      for (; z < pairs.size(); ++z) {
        const auto& [a, b] = zones_.pairs[pairs[z]];
        Context::Bounds bounds;
        for (const int which : {0, 1}) context_.bounds_of_gap(pairs[z], which, bounds);
        context_.bounds_over(a == fragment.facet ? b : a, bounds);
        bool within = true;
        for (const auto& [plane, keep] : bounds) within = within && context_.side(polygon, plane) != -keep;
        for (const auto& [plane, keep] : bounds) {
          if (!within) break;
          const int s = context_.side(polygon, plane);
          within = s != -keep;
          if (s != 2) continue;
          const auto [low, high] = context_.split(polygon, plane);
          ahead.push_back({keep > 0 ? low : high, z + 1});
          polygon = keep > 0 ? high : low;
        }
        if (!within) continue;
        add_piece({polygon, fragment.facet, fragment.sign, fragment.reversed}, -1, at, out.closed, out);
        break;
      }
    }
  }

  void find_solid(const std::array<int, 3>& at, const Winding& winding, CellRegions& out) {
    for (const Cover& c : covers_) out.bodies.push_back(lattice_.body[c.of.facet]);
    std::sort(out.bodies.begin(), out.bodies.end());
    out.bodies.erase(std::unique(out.bodies.begin(), out.bodies.end()), out.bodies.end());
    solid_.assign(parts_, 0);
    for (const int body : out.bodies) turn(body, at, winding);
  }

  void finish(const std::array<int, 3>& at, const std::array<const FaceParts*, 6>& faces, CellRegions& out) {
    up_.resize(parts_);
    std::iota(up_.begin(), up_.end(), 0);
    for (const Portal& portal : portals_) {
      const auto [a, b] = portal.part;
      if (a >= 0 && b >= 0 && portal.cover < 0 && !solid_[a] && !solid_[b]) up_[root(a)] = root(b);
    }
    number_.assign(parts_, -1);
    for (int k = 0; k < parts_; ++k)
      if (!solid_[k] && number_[root(k)] < 0) number_[root(k)] = out.regions++;
    const auto region = [&](int part) { return part < 0 || solid_[part] ? -1 : number_[root(part)]; };
    for (int k = 0; k < 6; ++k) regions_[k].assign(faces[k]->parts.size(), -2);
    for (const Portal& portal : portals_) {
      for (int above = 0; above < 2; ++above)
        if (region(portal.part[above]) >= 0) add_surface(portal, above, region(portal.part[above]), at, out);
      if (portal.face < 0) continue;
      int& known = regions_[portal.face][portal.of_face];
      const int here = region(portal.part[portal.face % 2 ? 0 : 1]);
      if (known != -2 && known != here) throw std::logic_error("a part of a face belongs to two regions" + place(at));
      known = here;
    }
    for (int k = 0; k < 6; ++k) {
      chords_[k].clear();
      const int axis = k / 2, e = next(axis), f = next(e);
      for (int j = 0; j < 4; ++j) {
        const int corner = (k % 2) << axis | (j & 1) << e | (j >> 1) << f;
        if (faces[k]->at_corner[j] >= 0) out.at_corner[corner] = regions_[k][faces[k]->at_corner[j]];
      }
      for (std::size_t j = 0; j < faces[k]->parts.size(); ++j)
        for (const int facet : faces[k]->parts[j].beside)
          if (regions_[k][j] >= 0) chords_[k].push_back({facet, regions_[k][j], {}});
    }
    out.of_part.assign(regions_);
    out.chords.assign(chords_);
  }

  int root(int k) {
    while (up_[k] != k) k = up_[k] = up_[up_[k]];
    return k;
  }

  // Change of the winding number of a body from below to above a portal.
  int step(const Portal& portal, int body) const {
    bool up = false, down = false;
    for (int c = portal.cover; c >= 0; c = covers_[c].next)
      if (lattice_.body[covers_[c].of.facet] == body) (covers_[c].of.sign > 0 ? up : down) = true;
    return down - up;
  }

  void turn(int body, const std::array<int, 3>& at, const Winding& winding) {
    constexpr int unknown = 1 << 20;
    turns_.assign(parts_, unknown);
    turns_[0] = 0;
    stack_.assign(1, 0);
    int least = 0, most = 0;
    while (!stack_.empty()) {
      const int k = stack_.back();
      stack_.pop_back();
      for (const int f : of_part_[k]) {
        const Portal& portal = portals_[f];
        const int change = portal.cover < 0 ? 0 : step(portal, body);
        const bool below = portal.part[0] == k;
        const int other = portal.part[below ? 1 : 0], there = turns_[k] + (below ? change : -change);
        least = std::min(least, there);
        most = std::max(most, there);
        if (other < 0) continue;
        if (turns_[other] == unknown) {
          turns_[other] = there;
          stack_.push_back(other);
        } else if (turns_[other] != there) {
          throw std::invalid_argument("the surface of body " + std::to_string(body) + " is not closed" + place(at));
        }
      }
    }
    if (least == most) {  // layers of one body that coincide
      Point3 middle{};
      double count = 0;
      for (const int f : of_part_[0])
        for (int i = 0; i < portals_[f].shape.count; ++i, ++count)
          for (int d = 0; d < 3; ++d)
            middle[d] += context_.points[context_.corners[portals_[f].shape.first + i].point].x[d];
      for (double& x : middle) x /= count;
      least = -winding(body, middle);
    }
    for (int k = 0; k < parts_; ++k) solid_[k] |= turns_[k] > least;
  }

  std::string place(const std::array<int, 3>& at) const {
    return " in cell (" + std::to_string(at[0]) + ", " + std::to_string(at[1]) + ", " + std::to_string(at[2]) + ")";
  }

  // Facets that coincide are those of the first body; without facets it is where a zone ends.
  void add_surface(const Portal& portal, int above, int region, const std::array<int, 3>& at, CellRegions& out) {
    const int other = portal.part[1 - above];
    if (portal.cover < 0 && other >= 0 && closed_[other]) {
      const Plane& plane = context_.planes[portal.shape.plane];
      add_piece({portal.shape, -1, 1, (plane.n[plane.axis] > 0) != (above == 1)}, region, at, out.surface, out);
    }
    int first = static_cast<int>(lattice_.of_body.size());
    const auto mine = [&](const Fragment& of) { return (of.sign > 0) == (above == 1); };
    for (int c = portal.cover; c >= 0; c = covers_[c].next)
      if (mine(covers_[c].of)) first = std::min(first, lattice_.body[covers_[c].of.facet]);
    for (int c = portal.cover; c >= 0; c = covers_[c].next) {
      const Fragment& of = covers_[c].of;
      if (mine(of) && lattice_.body[of.facet] == first) add_piece(of, region, at, out.surface, out);
    }
  }

  void add_piece(const Fragment& of, int region, const std::array<int, 3>& at, std::vector<SurfacePiece>& pieces,
                 CellRegions& out) const {
    const auto low = lattice_.low(at), high = lattice_.high(at);
    Point3 size;
    for (int d = 0; d < 3; ++d) size[d] = to_unit * static_cast<double>(high[d] - low[d]);
    pieces.push_back({region, of.facet, out.corners.size(), of.shape.count});
    for (int i = 0; i < of.shape.count; ++i) {
      const int k = of.reversed ? of.shape.count - 1 - i : i;
      const Point3& x = context_.points[context_.corners[of.shape.first + k].point].x;
      out.corners.push_back({x[0] / size[0], x[1] / size[1], x[2] / size[2]});
    }
  }

  const Lattice& lattice_;
  const Zones& zones_;
  Context context_;
  std::array<int, 6> sides_{};
  std::vector<Portal> portals_;
  std::vector<Cover> covers_;
  std::vector<std::vector<int>> of_part_;          // portals of each part
  std::vector<std::vector<Fragment>> inside_;      // facets within each part
  int parts_ = 0;
  std::vector<Corner> scratch_;
  std::vector<int> old_, up_, number_, turns_, stack_;
  std::vector<Fragment> fragments_;
  std::vector<char> solid_, closed_;
  std::vector<Context::Bounds> bounds_;      // of zones
  std::array<std::vector<int>, 6> regions_;  // of the parts of the faces
  std::array<std::vector<Chord>, 6> chords_;
};

}  // namespace cut
