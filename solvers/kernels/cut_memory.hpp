// What a table leaves for the next one of the same facets: regions and integrals of cells none of whose facets moved.
#pragma once

#include <unordered_map>
#include <vector>

#include "cut_candidates.hpp"
#include "cut_faces.hpp"
#include "cut_regions.hpp"

namespace cut {

// Rows of each candidate; first: of each, and the end.
struct MemoryRows {
  std::vector<std::size_t> first;
  std::vector<std::int64_t> region, facet;  // region in its cell
  std::vector<double> moments;
};

struct Memory {
  bool filled = false;
  double quantum = 0;
  std::vector<Integers3> vertices;
  Zones zones;
  Candidates zones_of, candidates;
  std::vector<CellRegions> cells;                     // of candidates
  std::vector<char> whole;                            // candidates with all of their rows in the table
  std::unordered_map<std::int64_t, FaceParts> faces;
  MemoryRows pieces, closed;
  std::vector<std::size_t> first_region;              // of candidates
  std::vector<double> flux;                           // integrals over regions without what faces add

  // Facets with a vertex that is somewhere else; all of them if the multiples are others.
  std::vector<char> moved(const Lattice& lattice) const {
    const bool same = filled && quantum == lattice.quantum && vertices.size() == lattice.vertices.size();
    std::vector<char> found(lattice.facets.size(), !same);
    if (!same) return found;
    for (std::size_t f = 0; f < found.size(); ++f)
      for (const int v : lattice.facets[f]) found[f] |= vertices[v] != lattice.vertices[v];
    return found;
  }
};

}  // namespace cut
