// Sides of a surface for parts whose own side is doubtful, so that the surface has the least area: a minimal cut.
// Source: Ford & Fulkerson (1956); shortest augmenting paths of Edmonds & Karp (1972).
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace division {

struct Border {
  int a, b;  // parts on both sides
  double area;
};

// Whether each part is inside: `known` is 1 inside, 0 outside, -1 if it is doubtful.
inline std::vector<char> least_surface(const std::vector<int>& known, const std::vector<Border>& borders, double no_area) {
  const int count = static_cast<int>(known.size()), inside = count, outside = count + 1;
  struct Edge {
    int to;
    double left;  // capacity
  };
  std::vector<Edge> edges;  // each is followed by the one back
  std::vector<std::vector<int>> at(count + 2);
  const auto node = [&](int part) { return known[part] < 0 ? part : known[part] > 0 ? inside : outside; };
  for (const auto& border : borders)
    if (const int a = node(border.a), b = node(border.b); a != b)
      for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, a}}) {
        at[from].push_back(static_cast<int>(edges.size()));
        edges.push_back({to, border.area});
      }
  std::vector<int> by;  // the edge by which a node was reached; -1: it was not, -2: start
  for (;;) {
    by.assign(count + 2, -1);
    by[inside] = -2;
    std::vector<int> reached{inside};
    for (std::size_t k = 0; k < reached.size() && by[outside] == -1; ++k)
      for (const int e : at[reached[k]])
        if (by[edges[e].to] == -1 && edges[e].left > no_area) {
          by[edges[e].to] = e;
          reached.push_back(edges[e].to);
        }
    if (by[outside] == -1) break;
    double least = std::numeric_limits<double>::infinity();
    for (int n = outside; n != inside; n = edges[by[n] ^ 1].to) least = std::min(least, edges[by[n]].left);
    for (int n = outside; n != inside; n = edges[by[n] ^ 1].to) {
      edges[by[n]].left -= least;
      edges[by[n] ^ 1].left += least;
    }
  }
  std::vector<char> found(count);
  for (int part = 0; part < count; ++part) found[part] = known[part] < 0 ? by[part] != -1 : known[part] > 0;
  return found;
}

}  // namespace division
