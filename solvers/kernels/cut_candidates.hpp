// Which facets may meet which cells: bounding boxes in integers, and the plane of the facet beside the cell in double.
#pragma once

#include <algorithm>
#include <iterator>
#include <span>
#include <vector>

#include "cut_planes.hpp"

namespace cut {

struct Candidates {
  std::vector<int> cells;          // increasing
  std::vector<std::size_t> first;  // of the facets of each cell, and the end
  std::vector<int> facets;

  int find(int cell) const {
    const auto at = std::lower_bound(cells.begin(), cells.end(), cell);
    return at != cells.end() && *at == cell ? static_cast<int>(at - cells.begin()) : -1;
  }

  std::span<const int> of(int cell) const {
    const int k = find(cell);
    if (k < 0) return {};
    return {facets.data() + first[k], facets.data() + first[k + 1]};
  }

  // Cells without facets.
  void add(const std::vector<int>& others) {
    if (others.empty()) return;
    Candidates merged;
    std::set_union(cells.begin(), cells.end(), others.begin(), others.end(), std::back_inserter(merged.cells));
    for (const int cell : merged.cells) {
      merged.first.push_back(merged.facets.size());
      const auto mine = of(cell);
      merged.facets.insert(merged.facets.end(), mine.begin(), mine.end());
    }
    merged.first.push_back(merged.facets.size());
    *this = std::move(merged);
  }
};

// From keys of a cell in the upper and a facet in the lower 32 bits.
inline Candidates by_cell(std::vector<std::uint64_t>& pairs) {
  std::sort(pairs.begin(), pairs.end());
  Candidates found;
  for (const auto pair : pairs) {
    const int cell = static_cast<int>(pair >> 32);
    if (found.cells.empty() || found.cells.back() != cell) {
      found.cells.push_back(cell);
      found.first.push_back(found.facets.size());
    }
    found.facets.push_back(static_cast<int>(pair & 0xffffffffu));
  }
  found.first.push_back(found.facets.size());
  return found;
}

// Never leaves out a facet that comes nearer to a cell than `reach` quanta, or meets its boundary.
inline Candidates candidates(const Lattice& lattice, std::int64_t reach = 0) {
  std::vector<std::uint64_t> pairs;
  for (int facet = 0; facet < static_cast<int>(lattice.facets.size()); ++facet) {
    const auto& v = lattice.facets[facet];
    std::array<int, 3> from, to;
    bool any = true;
    for (int d = 0; d < 3; ++d) {
      auto [least, most] =
        std::minmax({lattice.vertices[v[0]][d], lattice.vertices[v[1]][d], lattice.vertices[v[2]][d]});
      least -= reach;
      most += reach;
      const auto& lines = lattice.lines[d];
      // cells [lines[i], lines[i + 1]] with lines[i + 1] >= least and lines[i] <= most
      const auto below = std::lower_bound(lines.begin(), lines.end(), least) - lines.begin() - 1;
      const auto above = std::upper_bound(lines.begin(), lines.end(), most) - lines.begin();
      from[d] = std::max(0, static_cast<int>(below));
      to[d] = std::min(lattice.cells[d], static_cast<int>(above)) - 1;
      any &= least <= lines.back() && most >= lines.front() && from[d] <= to[d];
    }
    if (!any) continue;
    const bool one = from == to;
    Point3 n{}, size{};
    const auto step = [&](int i, int d) {
      return static_cast<double>(lattice.vertices[v[i]][d] - lattice.vertices[v[0]][d]);
    };
    for (int d = 0; d < 3 && !one; ++d) {
      const int e = next(d), f = next(e);
      const double a = step(1, e) * step(2, f), b = step(1, f) * step(2, e);
      n[d] = a - b;
      size[d] = std::abs(a) + std::abs(b);
    }
    std::array<int, 3> at;
    for (at[2] = from[2]; at[2] <= to[2]; ++at[2])
      for (at[1] = from[1]; at[1] <= to[1]; ++at[1])
        for (at[0] = from[0]; at[0] <= to[0]; ++at[0]) {
          if (!one) {
            const auto low = lattice.low(at), high = lattice.high(at);
            double middle = 0, extent = 0, error = 0;
            for (int d = 0; d < 3; ++d) {
              const double inner = 0.5 * static_cast<double>(high[d] - low[d]), half = inner + static_cast<double>(reach);
              const double way = static_cast<double>(low[d] - lattice.vertices[v[0]][d]) + inner;
              middle += n[d] * way;
              extent += std::abs(n[d]) * half;
              error += size[d] * (std::abs(way) + half);
            }
            if (std::abs(middle) > extent + doubt * error) continue;
          }
          pairs.push_back(static_cast<std::uint64_t>(lattice.number(at)) << 32 | static_cast<std::uint32_t>(facet));
        }
  }
  return by_cell(pairs);
}

}  // namespace cut
