// What both kernels find in one cell.
#pragma once

#include <algorithm>
#include <array>
#include <numeric>
#include <span>
#include <vector>

#include "cut_lattice.hpp"

namespace cut {

// A part of a face of the cell's boundary that ends at a facet; ends relative to the face, the fluid on their left as
// seen from the upper side.
struct Chord {
  int facet, region;
  std::array<std::array<double, 2>, 2> ends;
};

// A wet part of an edge of the cell: where the first axis after the normal's of the face is one.
struct WetEdge {
  int region, facet, corner;  // one of them says what is on the other side of the face: facet, or if -1 the corner
  double from, to;
};

struct SurfacePiece {
  int region, facet;          // facet -1: where a zone ends, see cut_zones.hpp
  std::size_t first;  // of its corners in CellRegions::corners, counterclockwise as seen from the fluid
  int count;
};

// Rows of the six faces of a cell, one face after the other.
template <typename Row>
class OfFaces {
public:
  void assign(const std::array<std::vector<Row>, 6>& faces) {
    std::size_t size = 0;
    for (const auto& face : faces) size += face.size();
    rows_.clear();
    rows_.reserve(size);
    for (int k = 0; k < 6; ++k) {
      rows_.insert(rows_.end(), faces[k].begin(), faces[k].end());
      end_[k] = static_cast<int>(rows_.size());
    }
  }
  std::span<const Row> operator[](int face) const {
    const int begin = face ? end_[face - 1] : 0;
    return {rows_.data() + begin, rows_.data() + end_[face]};
  }
  std::span<Row> all() { return rows_; }

private:
  std::vector<Row> rows_;
  std::array<int, 6> end_{};
};

struct CellRegions {
  bool exact = false;
  bool cut = false;   // there is surface in the cell or in its faces
  bool alone = true;  // only facets in the cell decided
  int regions = 0;
  std::vector<SurfacePiece> surface;
  std::vector<SurfacePiece> closed;                    // where another facet touches; exact kernel only
  std::vector<Point3> corners;                         // relative to the cell
  OfFaces<Chord> chords;                               // of faces 2 axis + side; exact kernel: without ends
  OfFaces<WetEdge> wet;                                // fast kernel only
  OfFaces<int> of_part;                                // exact kernel only: region of each part of a face, -1: solid
  std::array<int, 8> at_corner{-1, -1, -1, -1, -1, -1, -1, -1};  // region at each corner, the first axis fastest
  std::vector<int> bodies;                             // with surface here
};

// Orders regions by the facets that bound them, so that neither kernel nor rounding decides; those with the same facets
// stay as they are.
inline void put_in_order(CellRegions& here) {
  if (here.regions < 2) return;
  std::vector<std::vector<int>> facets(here.regions);
  for (const auto& piece : here.surface) facets[piece.region].push_back(piece.facet);
  for (auto& of : facets) std::sort(of.begin(), of.end());
  std::vector<int> order(here.regions), place(here.regions);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return facets[a] < facets[b]; });
  for (int k = 0; k < here.regions; ++k) place[order[k]] = k;
  const auto renumber = [&](int& region) {
    if (region >= 0) region = place[region];
  };
  for (auto& piece : here.surface) renumber(piece.region);
  for (auto& chord : here.chords.all()) renumber(chord.region);
  for (auto& edge : here.wet.all()) renumber(edge.region);
  for (int& region : here.of_part.all()) renumber(region);
  for (int& region : here.at_corner) renumber(region);
}

}  // namespace cut
