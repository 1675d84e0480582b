// Planes of the grid, of facets and through their edges, points where three of them meet, and on which side of a plane
// a point is. Nothing is rounded for a decision: a determinant in double with a bound of its rounding error, or else in
// integers. Planes through integer points: n below 2^125, d = n.x below 2^189; three planes n_i.x = d_i meet in X / W,
// X = sum d_i n_j x n_k below 2^442, W = det(n_i) below 2^378; the side of it, n.X - d W, is below 2^570.
#pragma once

#include <cmath>
#include <cstdlib>
#include <stdexcept>
#include <utility>
#include <vector>

#include "cut_integers.hpp"
#include "cut_lattice.hpp"
#include "cut_zones.hpp"

namespace cut {

constexpr double to_unit = 1.0 / (std::int64_t{1} << fine_bits);  // from integers to numbers of the size of cells
constexpr double rounding_error = 1.1102230246251565e-16;  // half of the distance from 1 to the next number
// First-order bounds, in units of the rounding error, of sums of absolute values: n and d 4, X 17, W 17, side 26.
constexpr double doubt = 64 * rounding_error;

constexpr int next(int axis) { return axis == 2 ? 0 : axis + 1; }

struct Plane {
  std::int64_t name;
  Point3 n;             // normal, nearest numbers
  double d;
  int axis;             // along which it is not parallel: of a facet the steepest one
  std::array<int, 3> through;  // vertices in it by name, -1: none
  std::array<Integer<2>, 3> N;  // n.x = d in integers
  Integer<3> D;
};

struct ExactPoint {
  std::array<Integer<7>, 3> X;
  Integer<6> W;
};

struct Point {
  std::array<int, 3> planes;  // that meet in it; of a vertex {-1, number, 0}, of a corner of the cell {-2, .., ..}
  std::array<double, 4> X, size;
  Point3 x;                   // position in units of 2^fine_bits, relative to the cell
  int w = 1;                  // sign of X[3]
  std::array<int, 2> edge{-1, -1};  // of a facet that it lies on by name, and the plane it crosses there
  int across = -1;
  int exact = -1;
  int asked = -1, answer = 0; // the last plane, and the side of it
};

struct Corner {
  int point, edge;  // edge: plane through the edge that follows
};

// A convex polygon in a plane; its corners are in Context::corners.
struct Polygon {
  int plane = -1, first = 0, count = 0;
};

struct PointName {
  std::array<std::int64_t, 3> planes;  // names, sorted; of a vertex {-1, number, 0}
};

// Planes, points and polygons around one cell or face.
class Context {
public:
  Context(const Lattice& lattice, const Zones& zones)
    : lattice_(lattice), zones_(zones), first_over_(lattice.planes + 4 * lattice.facets.size()),
      first_opening_(first_over_ + 3 * zones.over.size()), local_(first_opening_ + 2 * zones.pairs.size()),
      stamp_(local_.size(), -1) {}

  std::vector<Plane> planes;
  std::vector<Point> points;
  std::vector<Corner> corners;

  void start(const Integers3& origin) {
    origin_ = origin;
    ++now_;
    planes.clear();
    points.clear();
    corners.clear();
    exact_.clear();
    known_count_ = 0;
  }

  std::int64_t grid_plane(int axis, int index) const { return lattice_.first_plane[axis] + index; }
  std::int64_t facet_plane(int facet) const { return lattice_.planes + std::int64_t{4} * facet; }
  std::int64_t edge_plane(int facet, int edge) const { return facet_plane(facet) + 1 + edge; }
  const Lattice& lattice() const { return lattice_; }

  // A plane, and the side of it where a zone is: -1, 1.
  using Bounds = std::vector<std::pair<int, int>>;

  // Over a facet.
  void bounds_over(int facet, Bounds& bounds) {
    const int slot = zones_.slot[facet];
    for (int e = 0; e < 3; ++e) bounds.push_back({plane(first_over_ + 3 * slot + e), -1});
  }

  // The gap of a pair is at most the closing length (0), or at least minus it (1).
  void bounds_of_gap(int pair, int which, Bounds& bounds) {
    if (!zones_.opening[pair][which].everywhere()) bounds.push_back({plane(first_opening_ + 2 * pair + which), -1});
  }

  Bounds bounds_of_zone(int pair) {
    Bounds bounds;
    const auto& [a, b] = zones_.pairs[pair];
    for (const int facet : {a, b}) bounds.push_back({plane(facet_plane(facet)), 1});
    bounds_of_gap(pair, 0, bounds);
    for (const int facet : {a, b}) bounds_over(facet, bounds);
    return bounds;
  }

  int plane(std::int64_t name) {
    if (stamp_[name] == now_) return local_[name];
    Plane made = name < lattice_.planes ? of_grid(name) : name < first_over_ ? of_facet(name) : of_zone(name);
    stamp_[name] = now_;
    planes.push_back(std::move(made));
    return local_[name] = static_cast<int>(planes.size()) - 1;
  }

  int vertex(int number) {
    int& known = known_point({-1, number, 0});
    if (known >= 0) return known;
    known = static_cast<int>(points.size());
    Point made{};
    made.planes = {-1, number, 0};
    for (int d = 0; d < 3; ++d) made.x[d] = made.X[d] = distance(number, d);
    for (int d = 0; d < 3; ++d) made.size[d] = std::abs(made.X[d]);
    made.X[3] = made.size[3] = 1;
    points.push_back(made);
    return static_cast<int>(points.size()) - 1;
  }

  // Where three planes meet in one point; on an edge of facets it is one for all planes through this edge.
  int meet(int a, int b, int c) {
    std::array<int, 3> of{a, b, c};
    std::sort(of.begin(), of.end());
    std::array<int, 2> edge{-1, -1};
    const auto key = point_key(of, edge);
    int& known = known_point(key);
    if (known >= 0) return known;
    known = static_cast<int>(points.size());
    Point made{};
    made.planes = of;
    made.edge = edge;
    if (edge[0] >= 0) {
      made.across = key[2];
      cross_edge(made);
    }
    for (int i = 0; i < 3 && edge[0] < 0; ++i) {
      const Plane &p = planes[of[i]], &q = planes[of[(i + 1) % 3]], &r = planes[of[(i + 2) % 3]];
      for (int d = 0; d < 3; ++d) {
        const int e = next(d), f = next(e);
        const double minor = q.n[e] * r.n[f] - q.n[f] * r.n[e];
        const double size = std::abs(q.n[e] * r.n[f]) + std::abs(q.n[f] * r.n[e]);
        made.X[d] += p.d * minor;
        made.size[d] += std::abs(p.d) * size;
        if (i > 0) continue;
        made.X[3] += p.n[d] * minor;
        made.size[3] += std::abs(p.n[d]) * size;
      }
    }
    points.push_back(made);
    const int number = static_cast<int>(points.size()) - 1;
    Point& point = points.back();
    const double w = std::abs(point.X[3]), most = std::max({point.size[0], point.size[1], point.size[2]});
    if (w > 16 * doubt * point.size[3] && most < 16 * w) {
      point.w = point.X[3] > 0 ? 1 : -1;
      for (int d = 0; d < 3; ++d) point.x[d] = point.X[d] / point.X[3];
    } else {
      const ExactPoint& at = exact_point(number);
      point.w = at.W.sign();
      if (point.w == 0) throw std::logic_error("planes do not meet in one point");
      for (int d = 0; d < 3; ++d) point.x[d] = to_unit * (at.X[d].value() / at.W.value());
    }
    for (const int p : of)  // on a plane of the grid it is there to the last bit
      if (planes[p].name < lattice_.planes) point.x[planes[p].axis] = planes[p].d;
    return number;
  }

  // Side of a plane that a point is on: -1, 0 or 1.
  int side(int number, int plane_number) {
    Point& point = points[number];
    if (point.asked == plane_number) return point.answer;
    point.asked = plane_number;
    return point.answer = computed_side(number, plane_number);
  }

  // -1, 1: on one side of a plane; 0: in it; 2: divided by it.
  int side(const Polygon& polygon, int plane_number) {
    if (polygon.plane == plane_number) return 0;
    bool below = false, above = false;
    for (int i = 0; i < polygon.count; ++i) {
      const int s = side(corners[polygon.first + i].point, plane_number);
      below |= s < 0;
      above |= s > 0;
    }
    return below && above ? 2 : below ? -1 : above ? 1 : 0;
  }

  // The parts of a polygon below and above a plane that divides it.
  std::pair<Polygon, Polygon> split(const Polygon& polygon, int plane_number) {
    low_.clear();
    high_.clear();
    for (int i = 0; i < polygon.count; ++i) {
      const Corner here = corners[polygon.first + i], there = corners[polygon.first + (i + 1) % polygon.count];
      const int s = side(here.point, plane_number), t = side(there.point, plane_number);
      if (s >= 0) high_.push_back({here.point, s == 0 && t < 0 ? plane_number : here.edge});
      if (s <= 0) low_.push_back({here.point, s == 0 && t > 0 ? plane_number : here.edge});
      if (s * t >= 0) continue;
      const int between = meet(polygon.plane, here.edge, plane_number);
      high_.push_back({between, t < 0 ? plane_number : here.edge});
      low_.push_back({between, t > 0 ? plane_number : here.edge});
    }
    return {polygon_of(polygon.plane, low_), polygon_of(polygon.plane, high_)};
  }

  Polygon polygon_of(int plane_number, const std::vector<Corner>& from) {
    const Polygon made{plane_number, static_cast<int>(corners.size()), static_cast<int>(from.size())};
    corners.insert(corners.end(), from.begin(), from.end());
    return made;
  }

  PointName name(int number) const {
    const auto& of = points[number].planes;
    if (of[0] < 0) return {{-1, of[1], 0}};
    return {{planes[of[0]].name, planes[of[1]].name, planes[of[2]].name}};
  }

  int point(const PointName& name) {
    if (name.planes[0] < 0) return vertex(static_cast<int>(name.planes[1]));
    const int a = plane(name.planes[0]), b = plane(name.planes[1]), c = plane(name.planes[2]);
    return meet(a, b, c);
  }

  // Twice the area of a polygon as a vector, by the order of its corners.
  Point3 twice_area(const Polygon& polygon) const {
    Point3 sum{};
    const Point3& a = points[corners[polygon.first].point].x;
    for (int i = 1; i + 1 < polygon.count; ++i) {
      const Point3& b = points[corners[polygon.first + i].point].x;
      const Point3& c = points[corners[polygon.first + i + 1].point].x;
      for (int d = 0; d < 3; ++d) {
        const int e = next(d), f = next(e);
        sum[d] += (b[e] - a[e]) * (c[f] - a[f]) - (b[f] - a[f]) * (c[e] - a[e]);
      }
    }
    return sum;
  }

  bool degenerate(int facet) {
    const Plane& p = planes[plane(facet_plane(facet))];
    return p.axis < 0;
  }

private:
  double distance(int vertex_number, int d) const {
    return to_unit * static_cast<double>(lattice_.vertices[vertex_number][d] - origin_[d]);
  }

  // Where an edge from a to b crosses a plane, s(x) = n.x - d: X = s(a) b - s(b) a, W = s(a) - s(b). Its facets may be
  // in nearly one plane.
  void cross_edge(Point& point) const {
    const Plane& p = planes[point.across];
    std::array<Point3, 2> x;
    std::array<double, 2> s, size;
    for (int v = 0; v < 2; ++v) {
      s[v] = -p.d;
      size[v] = std::abs(p.d);
      for (int d = 0; d < 3; ++d) {
        x[v][d] = distance(point.edge[v], d);
        s[v] += p.n[d] * x[v][d];
        size[v] += std::abs(p.n[d] * x[v][d]);
      }
    }
    for (int d = 0; d < 3; ++d) {
      point.X[d] = s[0] * x[1][d] - s[1] * x[0][d];
      point.size[d] = size[0] * std::abs(x[1][d]) + size[1] * std::abs(x[0][d]);
    }
    point.X[3] = s[0] - s[1];
    point.size[3] = size[0] + size[1];
  }

  ExactPoint exact_crossing(const Point& point) const {
    const Plane& p = planes[point.across];
    std::array<Integer<3>, 2> s;
    for (int v = 0; v < 2; ++v) {
      const auto& x = lattice_.vertices[point.edge[v]];
      for (int d = 0; d < 3; ++d) s[v] += p.N[d] * Integer<1>(x[d] - origin_[d]);
      s[v] -= p.D;
    }
    ExactPoint made;
    const auto &a = lattice_.vertices[point.edge[0]], &b = lattice_.vertices[point.edge[1]];
    for (int d = 0; d < 3; ++d)
      made.X[d] = Integer<7>(s[0] * Integer<1>(b[d] - origin_[d]) - s[1] * Integer<1>(a[d] - origin_[d]));
    made.W = Integer<6>(s[0] - s[1]);
    return made;
  }

  Plane of_grid(std::int64_t name) const {
    Plane made{};
    made.name = name;
    made.axis = name >= lattice_.first_plane[2] ? 2 : name >= lattice_.first_plane[1] ? 1 : 0;
    const std::int64_t at = lattice_.lines[made.axis][name - lattice_.first_plane[made.axis]] - origin_[made.axis];
    made.n[made.axis] = 1;
    made.d = to_unit * static_cast<double>(at);
    made.through.fill(-1);
    made.N[made.axis] = Integer<2>(1);
    made.D = Integer<3>(at);
    return made;
  }

  // In integers, of which doubles are the nearest numbers: a facet may be long beside the cell.
  Plane of_facet(std::int64_t name) {
    const auto facet = static_cast<std::size_t>((name - lattice_.planes) / 4);
    const int edge = static_cast<int>((name - lattice_.planes) % 4) - 1;
    const auto& v = lattice_.facets[facet];
    Plane made{};
    made.name = name;
    double unit = to_unit;
    if (edge < 0) {
      made.through = v;
      made.N = exact_normal(v);
      unit *= to_unit;
    } else {
      // n = edge x axis, along the steepest axis of the facet: it is neither parallel to the facet nor to the edge
      const int axis = planes[plane(name - 1 - edge)].axis, e = next(axis), f = next(e);
      made.through = {v[edge], v[(edge + 1) % 3], -1};
      const auto &a = lattice_.vertices[made.through[0]], &b = lattice_.vertices[made.through[1]];
      made.N[e] = Integer<2>(b[f] - a[f]);
      made.N[f] = Integer<2>(a[e] - b[e]);
    }
    return in_doubles(made, lattice_.vertices[made.through[0]], unit);
  }

  Plane of_zone(std::int64_t name) const {
    const std::int64_t over = name - first_over_, opening = name - first_opening_;
    const HalfSpace& half = opening < 0 ? zones_.over[over / 3][over % 3] : zones_.opening[opening / 2][opening % 2];
    Plane made{};
    made.name = name;
    made.through.fill(-1);
    made.D = Integer<2>(std::int64_t{1} << normal_bits) * Integer<1>(half.shift);
    for (int d = 0; d < 3; ++d) made.N[d] = Integer<2>(half.N[d]);
    return in_doubles(made, half.base, std::ldexp(1.0, -normal_bits));
  }

  // Adds N.x to D; unit: of N. The axis is the steepest one, -1: a facet without area.
  Plane in_doubles(Plane made, const Integers3& x, double unit) const {
    made.axis = -1;
    for (int d = 0; d < 3; ++d) {
      made.D += made.N[d] * Integer<1>(x[d] - origin_[d]);
      made.n[d] = unit * made.N[d].value();
      if (std::abs(made.n[d]) > (made.axis < 0 ? 0 : std::abs(made.n[made.axis]))) made.axis = d;
    }
    made.d = unit * (to_unit * made.D.value());
    return made;
  }

  std::array<Integer<2>, 3> exact_normal(const std::array<int, 3>& v) const {
    std::array<Integer<2>, 3> n;
    const auto step = [&](int a, int b, int d) {
      return Integer<1>(lattice_.vertices[v[b]][d] - lattice_.vertices[v[a]][d]);
    };
    for (int d = 0; d < 3; ++d) {
      const int e = next(d), f = next(e);
      n[d] = step(0, 1, e) * step(0, 2, f) - step(0, 1, f) * step(0, 2, e);
    }
    return n;
  }

  const ExactPoint& exact_point(int number) {
    if (points[number].exact >= 0) return exact_[points[number].exact];
    points[number].exact = static_cast<int>(exact_.size());
    ExactPoint made;
    const auto of = points[number].planes;
    if (points[number].across >= 0) {
      made = exact_crossing(points[number]);
    } else if (of[0] < 0) {
      for (int d = 0; d < 3; ++d) made.X[d] = Integer<7>(lattice_.vertices[of[1]][d] - origin_[d]);
      made.W = Integer<6>(1);
    } else {
      for (int i = 0; i < 3; ++i) {
        const Plane &p = planes[of[i]], &q = planes[of[(i + 1) % 3]], &r = planes[of[(i + 2) % 3]];
        for (int d = 0; d < 3; ++d) {
          const int e = next(d), f = next(e);
          const auto minor = q.N[e] * r.N[f] - q.N[f] * r.N[e];
          made.X[d] += p.D * minor;
          if (i == 0) made.W += p.N[d] * minor;
        }
      }
    }
    exact_.push_back(made);
    return exact_.back();
  }

  int computed_side(int number, int plane_number) {
    const Plane& p = planes[plane_number];
    const Point& point = points[number];
    if (point.planes[0] < 0) {
      if (holds(p, point.planes[1])) return 0;
    } else if (point.planes[0] == plane_number || point.planes[1] == plane_number || point.planes[2] == plane_number) {
      return 0;
    }
    if (point.edge[0] >= 0 && holds(p, point.edge[0]) && holds(p, point.edge[1])) return 0;
    double sum = -p.d * point.X[3], size = std::abs(p.d) * point.size[3];
    for (int d = 0; d < 3; ++d) {
      sum += p.n[d] * point.X[d];
      size += std::abs(p.n[d]) * point.size[d];
    }
    if (std::abs(sum) > doubt * size) return sum > 0 ? point.w : -point.w;
    const ExactPoint& at = exact_point(number);
    const auto value = p.N[0] * at.X[0] + p.N[1] * at.X[1] + p.N[2] * at.X[2] - p.D * at.W;
    return value.sign() * at.W.sign();
  }

  static bool holds(const Plane& p, int vertex_number) {
    return p.through[0] == vertex_number || p.through[1] == vertex_number || p.through[2] == vertex_number;
  }

  // Name of the point where planes meet: the planes, or an edge that two of them have in common, and the third one.
  std::array<int, 3> point_key(const std::array<int, 3>& of, std::array<int, 2>& edge) const {
    for (int i = 0; i < 3; ++i) {
      const Plane &p = planes[of[(i + 1) % 3]], &q = planes[of[(i + 2) % 3]];
      if (p.through[0] < 0 || q.through[0] < 0) continue;
      std::array<int, 3> common;
      int count = 0;
      for (const int v : p.through)
        if (v >= 0 && holds(q, v)) common[count++] = v;
      if (count != 2) continue;
      edge = {std::min(common[0], common[1]), std::max(common[0], common[1])};
      return {-2 - edge[0], edge[1], of[i]};
    }
    return of;
  }

  struct Known {
    std::array<int, 3> key;
    int stamp, point;
  };

  // The number of a point, -1: a new one, to be written here.
  int& known_point(const std::array<int, 3>& key) {
    if (2 * (known_count_ + 1) > static_cast<int>(known_.size())) enlarge();
    int& point = entry(key).point;
    known_count_ += point < 0;
    return point;
  }

  Known& entry(const std::array<int, 3>& key) {
    std::uint64_t hash = 0;
    for (const int part : key) hash = (hash ^ static_cast<std::uint32_t>(part)) * 0x9E3779B97F4A7C15ull;
    std::size_t at = hash >> 32 & (known_.size() - 1);
    while (known_[at].stamp == now_ && known_[at].key != key) at = (at + 1) & (known_.size() - 1);
    if (known_[at].stamp != now_) known_[at] = {key, now_, -1};
    return known_[at];
  }

  void enlarge() {
    std::vector<Known> old(std::max<std::size_t>(256, 2 * known_.size()), Known{{}, -1, -1});
    old.swap(known_);
    for (const Known& one : old)
      if (one.stamp == now_) entry(one.key) = one;
  }

  const Lattice& lattice_;
  const Zones& zones_;
  std::int64_t first_over_, first_opening_;  // names of planes of zones
  Integers3 origin_{};
  std::vector<int> local_, stamp_;  // number here of each plane, valid where the stamp is `now_`
  int now_ = -1;
  std::vector<ExactPoint> exact_;
  std::vector<Known> known_;        // points by name, valid where the stamp is `now_`
  int known_count_ = 0;
  std::vector<Corner> low_, high_;
};

}  // namespace cut
