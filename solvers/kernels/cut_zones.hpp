// What is closed between facets that face each other: for each pair (A, B) a convex zone, where fluid is taken for solid.
// x is in it if it is ahead of both facets, n_A.(x - a) >= 0 and n_B.(x - b) >= 0, if the gap at it, the sum of both, is
// at most the closing length, and if it lies over both facets. Half-spaces have integer coefficients: they are exact, and
// all cells see the same ones.
#pragma once

#include <array>
#include <vector>

#include "cut_lattice.hpp"

namespace cut {

constexpr int normal_bits = 52;

// N.(x - base) <= 2^normal_bits shift, in quanta; N = 0: everywhere.
struct HalfSpace {
  Integers3 N, base;
  std::int64_t shift;

  bool everywhere() const { return !N[0] && !N[1] && !N[2]; }
  bool operator==(const HalfSpace&) const = default;
};

struct Extent {
  Integers3 low, high;
  bool operator==(const Extent&) const = default;
};

struct Zones {
  std::vector<std::array<int, 2>> pairs;             // of facets
  std::vector<std::array<HalfSpace, 2>> opening;     // of each pair: the gap is at most the length, at least minus it
  std::vector<Extent> extent;                        // of each pair
  std::vector<int> slot;                             // of each facet, -1: without pairs; empty: there are no pairs
  std::vector<std::array<HalfSpace, 3>> over;        // of each slot: over the facet, beside each edge
  std::vector<std::vector<int>> of_slot;             // pairs of each slot

  bool operator==(const Zones&) const = default;
};

}  // namespace cut
