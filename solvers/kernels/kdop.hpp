// Bounding-volume binary tree of k-DOPs over the facets of a surface (k = 8 in 2D, 18 in 3D).
//
// A k-DOP is a box in k/2 directions instead of dim: the axes and all face diagonals x_i +- x_j. The
// slab of direction d is [min d.x, max d.x]. It is convex, hence bounds the convex hull of the points
// it was made of.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace kdop {

template <int Dim>
constexpr int directions = Dim * Dim;  // Dim axes, Dim (Dim - 1) face diagonals

// The diagonals are not normalised (d.x stays a plain sum); lengths along them carry this factor.
constexpr double diagonal_length = 1.4142135623730951;

template <int Dim>
constexpr double direction_length(int direction) {
  return direction < Dim ? 1.0 : diagonal_length;
}

template <int Dim>
using Projections = std::array<double, directions<Dim>>;

template <int Dim>
Projections<Dim> project(const std::array<double, Dim>& x) {
  if constexpr (Dim == 2)
    return {x[0], x[1], x[0] + x[1], x[0] - x[1]};
  else
    return {x[0],        x[1],        x[2],        x[0] + x[1], x[0] - x[1],
            x[1] + x[2], x[1] - x[2], x[0] + x[2], x[0] - x[2]};
}

template <int Dim>
struct Slabs {
  Projections<Dim> low, high;

  static Slabs empty() {
    Slabs slabs;
    slabs.low.fill(std::numeric_limits<double>::infinity());
    slabs.high.fill(-std::numeric_limits<double>::infinity());
    return slabs;
  }

  void include(const Projections<Dim>& point) {
    for (int d = 0; d < directions<Dim>; ++d) {
      low[d] = std::min(low[d], point[d]);
      high[d] = std::max(high[d], point[d]);
    }
  }

  void include(const Slabs& other) {
    for (int d = 0; d < directions<Dim>; ++d) {
      low[d] = std::min(low[d], other.low[d]);
      high[d] = std::max(high[d], other.high[d]);
    }
  }

  // Contains the set grown by a ball of this radius.
  void inflate(double radius) {
    for (int d = 0; d < directions<Dim>; ++d) {
      low[d] -= radius * direction_length<Dim>(d);
      high[d] += radius * direction_length<Dim>(d);
    }
  }

  // Closed: touching counts.
  bool meets(const Slabs& other) const {
    for (int d = 0; d < directions<Dim>; ++d)
      if (low[d] > other.high[d] || other.low[d] > high[d]) return false;
    return true;
  }

  double mean_width() const {
    double sum = 0;
    for (int d = 0; d < directions<Dim>; ++d) sum += (high[d] - low[d]) / direction_length<Dim>(d);
    return sum / directions<Dim>;
  }
};

// Facet types by node count, nodes in VTK order: corners, then one node per edge, then the centre.
struct FacetType {
  int corners, edges;
  bool centre;
};

template <int Dim>
FacetType facet_type(int nodes) {
  if constexpr (Dim == 2) {
    if (nodes == 2) return {2, 0, false};
    if (nodes == 3) return {2, 1, false};
    throw std::invalid_argument("a facet in 2D has 2 or 3 nodes, not " + std::to_string(nodes));
  } else {
    if (nodes == 3) return {3, 0, false};
    if (nodes == 4) return {4, 0, false};
    if (nodes == 6) return {3, 3, false};
    if (nodes == 9) return {4, 4, true};
    throw std::invalid_argument("a facet in 3D has 3, 4, 6 or 9 nodes, not " +
                                std::to_string(nodes));
  }
}

// Replaces the nodes of a facet by its Bezier control points, whose convex hull contains the facet.
//
// A quadratic Lagrange facet leaves the hull of its nodes, since its functions are negative in parts:
// a line3 with nodes 0, 0.9, 1 reaches 1.06. Bernstein functions span the same space, are nonnegative
// and sum to one, so the hull of their coefficients holds the facet. Both agree in the middle of an
// edge with nodes a, m, b if m = a/4 + c/2 + b/4, so its control point is c = 2 m - (a + b)/2. The
// tensor product of that rule, (-1/2, 2, -1/2) x (-1/2, 2, -1/2), gives the centre of quad9:
// 4 z - sum of edge nodes + sum of corners / 4. A straight facet with its nodes in the middle keeps
// them, so it pays no margin. Linear and bilinear facets lie in the hull of their corners already.
template <int Dim>
void to_control_points(const FacetType& type, std::array<std::array<double, Dim>, 9>& point) {
  const auto [corners, edges, centre] = type;
  for (int c = 0; c < Dim; ++c) {
    if (centre) {
      double sum_corners = 0, sum_edges = 0;
      for (int i = 0; i < corners; ++i) sum_corners += point[i][c];
      for (int i = 0; i < edges; ++i) sum_edges += point[corners + i][c];
      auto& z = point[corners + edges][c];
      z = 4 * z - sum_edges + 0.25 * sum_corners;
    }
    for (int i = 0; i < edges; ++i) {
      auto& m = point[corners + i][c];
      m = 2 * m - 0.5 * (point[i][c] + point[(i + 1) % corners][c]);
    }
  }
}

// The node indices of all facets of one surface.
template <int Dim>
class Facets {
public:
  // nodes: facet after facet, nodes_per_facet each, none negative.
  Facets(std::vector<std::int32_t> nodes, int nodes_per_facet)
    : nodes_(std::move(nodes)),
      nodes_per_facet_(nodes_per_facet),
      type_(facet_type<Dim>(nodes_per_facet)) {
    if (nodes_.empty()) throw std::invalid_argument("a surface needs at least one facet");
    nodes_needed_ = static_cast<std::size_t>(*std::max_element(nodes_.begin(), nodes_.end())) + 1;
  }

  int count() const { return static_cast<int>(nodes_.size()) / nodes_per_facet_; }

  // How many node positions the indices ask for.
  std::size_t nodes_needed() const { return nodes_needed_; }

  std::array<std::array<double, Dim>, 9> control_points(int facet, const double* x) const {
    std::array<std::array<double, Dim>, 9> points;
    const std::int32_t* node = nodes_.data() + static_cast<std::size_t>(facet) * nodes_per_facet_;
    for (int i = 0; i < nodes_per_facet_; ++i)
      std::copy_n(x + static_cast<std::size_t>(node[i]) * Dim, Dim, points[i].begin());
    if (type_.edges > 0) to_control_points<Dim>(type_, points);
    return points;
  }

  int nodes_per_facet() const { return nodes_per_facet_; }

private:
  std::vector<std::int32_t> nodes_;
  int nodes_per_facet_;
  FacetType type_;
  std::size_t nodes_needed_ = 0;
};

// Where a surface is while it is searched. With two configurations the slabs hold every facet on its
// straight way from one to the other: each point of it stays in the hull of both.
struct Placement {
  std::vector<const double*> positions;  // one or two arrays (n, Dim), row-major
  std::span<const double> inflation;     // radius per facet
};

// Nodes in depth-first order: the left child follows its parent, every child comes after its parent,
// so the bottom-up pass is one loop backwards through memory.
template <int Dim>
class Tree {
public:
  struct Node {
    Slabs<Dim> slabs;
    double width;        // mean slab width
    std::int32_t right;  // index of the right child; 0 in a leaf
    std::int32_t facet;  // in a leaf
  };

  explicit Tree(Facets<Dim> facets) : facets_(std::move(facets)) {}

  // Axis-aligned box of the surface, without inflation; needs no built tree.
  std::array<std::array<double, Dim>, 2> box(const Placement& placement) const {
    std::array<std::array<double, Dim>, 2> bounds;
    auto& [low, high] = bounds;
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
    for (const double* x : placement.positions)
      for (int facet = 0; facet < facets_.count(); ++facet) {
        const auto points = facets_.control_points(facet, x);
        for (int i = 0; i < facets_.nodes_per_facet(); ++i)
          for (int c = 0; c < Dim; ++c) {
            low[c] = std::min(low[c], points[i][c]);
            high[c] = std::max(high[c], points[i][c]);
          }
      }
    return bounds;
  }

  void build(const Placement& placement) {
    const int count = facets_.count();
    centres_.resize(count);
    for (int facet = 0; facet < count; ++facet) {
      const Slabs<Dim> slabs = facet_slabs(facet, placement);
      for (int d = 0; d < directions<Dim>; ++d)
        centres_[facet][d] = 0.5 * (slabs.low[d] + slabs.high[d]) / direction_length<Dim>(d);
    }
    std::vector<std::int32_t> order(count);
    std::iota(order.begin(), order.end(), 0);
    nodes_.clear();
    nodes_.reserve(2 * static_cast<std::size_t>(count) - 1);
    split(order);
    centres_ = {};
    refit(placement);
    cost_when_built_ = cost();
  }

  void refit(const Placement& placement) {
    for (std::size_t i = nodes_.size(); i-- > 0;) {
      Node& node = nodes_[i];
      if (node.right == 0) {
        node.slabs = facet_slabs(node.facet, placement);
      } else {
        node.slabs = nodes_[i + 1].slabs;
        node.slabs.include(nodes_[node.right].slabs);
      }
      node.width = node.slabs.mean_width();
    }
  }

  // How much more the inner nodes cover than when the tree was built, hence how many more of them a
  // search may have to enter: 1 at first, grows as siblings drift apart; infinite before the first
  // build.
  double quality() const {
    if (nodes_.empty()) return std::numeric_limits<double>::infinity();
    return cost_when_built_ > 0 ? cost() / cost_when_built_ : 1.0;
  }

  const Facets<Dim>& facets() const { return facets_; }
  const std::vector<Node>& nodes() const { return nodes_; }

private:
  Slabs<Dim> facet_slabs(int facet, const Placement& placement) const {
    auto slabs = Slabs<Dim>::empty();
    for (const double* x : placement.positions) {
      const auto points = facets_.control_points(facet, x);
      for (int i = 0; i < facets_.nodes_per_facet(); ++i)
        slabs.include(project<Dim>(points[i]));
    }
    slabs.inflate(placement.inflation[facet]);
    return slabs;
  }

  // Sum over the inner nodes of width^(Dim - 1), the chance that a small thing on a nearby surface
  // meets the node, relative to that of the leaves: a surface that only grows or turns does not
  // make its tree worse.
  double cost() const {
    double inner = 0, leaves = 0;
    for (const Node& node : nodes_) {
      const double size = Dim == 2 ? node.width : node.width * node.width;
      (node.right == 0 ? leaves : inner) += size;
    }
    return leaves > 0 ? inner / leaves : 0;
  }

  void split(std::span<std::int32_t> facets) {
    const std::size_t self = nodes_.size();
    nodes_.push_back({.slabs = {}, .width = 0, .right = 0, .facet = facets[0]});
    if (facets.size() == 1) return;
    const std::size_t left = divide(facets);
    split(facets.first(left));
    nodes_[self].right = static_cast<std::int32_t>(nodes_.size());
    split(facets.subspan(left));
  }

  // Sorts the facets into two groups by the middle of the longest slab of their centres; returns
  // the size of the first. When that cuts off less than a sixteenth (graded meshes, coincident
  // centres) the median takes over, which keeps the depth O(log n) whatever the mesh.
  std::size_t divide(std::span<std::int32_t> facets) const {
    auto extent = Slabs<Dim>::empty();
    for (const int facet : facets) extent.include(centres_[facet]);
    int longest = 0;
    for (int d = 1; d < directions<Dim>; ++d)
      if (extent.high[d] - extent.low[d] > extent.high[longest] - extent.low[longest]) longest = d;
    const auto place = [&](int facet) { return std::pair(centres_[facet][longest], facet); };

    const double middle = 0.5 * (extent.low[longest] + extent.high[longest]);
    const auto cut = std::partition(facets.begin(), facets.end(),
                                    [&](int facet) { return place(facet).first < middle; });
    const auto left = static_cast<std::size_t>(cut - facets.begin());
    if (16 * std::min(left, facets.size() - left) >= facets.size()) return left;

    const std::size_t half = facets.size() / 2;
    std::nth_element(facets.begin(), facets.begin() + half, facets.end(),
                     [&](int a, int b) { return place(a) < place(b); });
    return half;
  }

  Facets<Dim> facets_;
  std::vector<Node> nodes_;
  std::vector<Projections<Dim>> centres_;  // of the facets, unit directions; only while building
  double cost_when_built_ = 0;
};

struct Candidates {
  std::vector<std::array<std::int32_t, 2>> pairs;  // (slave facet, master facet), sorted
  std::int64_t tests = 0;                          // k-DOP against k-DOP, the work of the descent
};

// Descends both trees at once, always into the wider of the two nodes.
template <int Dim>
Candidates candidates(const Tree<Dim>& slave, const Tree<Dim>& master) {
  if (slave.nodes().empty() || master.nodes().empty())
    throw std::invalid_argument("a tree must be built before it is searched");
  Candidates result;
  std::vector<std::array<std::int32_t, 2>> found;
  std::vector<std::array<std::int32_t, 2>> waiting{{0, 0}};
  std::vector<std::size_t> first(static_cast<std::size_t>(slave.facets().count()) + 1, 0);
  while (!waiting.empty()) {
    const auto [i, j] = waiting.back();
    waiting.pop_back();
    const auto& a = slave.nodes()[i];
    const auto& b = master.nodes()[j];
    ++result.tests;
    if (!a.slabs.meets(b.slabs)) continue;
    if (a.right == 0 && b.right == 0) {
      found.push_back({a.facet, b.facet});
      ++first[a.facet + 1];
    } else if (b.right == 0 || (a.right != 0 && a.width >= b.width)) {
      waiting.push_back({a.right, j});
      waiting.push_back({i + 1, j});
    } else {
      waiting.push_back({i, b.right});
      waiting.push_back({i, j + 1});
    }
  }

  // Buckets by slave facet, then each bucket by master: linear but for the tiny sorts.
  std::partial_sum(first.begin(), first.end(), first.begin());
  result.pairs.resize(found.size());
  auto next = first;
  for (const auto& pair : found) result.pairs[next[pair[0]]++] = pair;
  for (std::size_t s = 0; s + 1 < first.size(); ++s)
    std::sort(result.pairs.begin() + first[s], result.pairs.begin() + first[s + 1]);
  return result;
}

}  // namespace kdop
