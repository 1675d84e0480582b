// The table of the fluid in cut cells: candidates, regions of each cell by one of two kernels, bodies around cells that
// they do not cut, and parts of faces between regions.
#pragma once

#include <cstring>
#include <limits>
#include <unordered_map>

#include "cut_candidates.hpp"
#include "cut_closing.hpp"
#include "cut_exact.hpp"
#include "cut_fast.hpp"
#include "cut_memory.hpp"
#include "cut_moments.hpp"

namespace cut {

enum State : std::int8_t { fluid = 0, solid = 1, mixed = 2 };

struct Table {
  std::vector<std::int8_t> state;               // of each cell
  std::vector<std::int8_t> kernel;              // 0: no surface, 1: fast, 2: exact
  std::vector<std::int64_t> cell;               // of each region
  std::vector<double> share, moments;
  std::vector<std::int64_t> piece_region, piece_facet;
  std::vector<double> piece_area, piece_moments;
  std::vector<std::int64_t> face_axis, face_cells, face_regions;
  std::vector<double> face_area, face_moments;
  std::vector<std::int64_t> closed_cell, closed_facet;
  std::vector<double> closed_moments;
};

// N points along x and y and M along z, see `Integrals`.
template <int N, int M>
class TableMaker {
public:
  // closing: length in quanta, 0: none; old: of a table of the same grid, facets, points and choices
  TableMaker(const Lattice& lattice, const double* points, double closing, bool only_exact, Memory old,
             bool keep)
    : lattice_(lattice), integrals_(points), only_exact_(only_exact), keep_(keep), old_(std::move(old)),
      zones_(closing > 0 ? ZoneFinder(lattice, closing).find() : Zones{}),
      zones_of_(zones_by_cell(lattice, zones_, closing)), candidates_(candidates(lattice)) {
    candidates_.add(zones_of_.cells);
    cells_.resize(candidates_.cells.size());
    kept_.assign(cells_.size(), -1);
  }

  Table make() {
    table_.state.assign(lattice_.count(), fluid);
    table_.kernel.assign(lattice_.count(), 0);
    compute_cells();
    for (std::size_t body = 0; body < lattice_.of_body.size(); ++body) fill(static_cast<int>(body));
    number_regions();
    integrate_surface();
    if (keep_) flux_ = table_.moments;
    link_faces();
    return std::move(table_);
  }

  // After `make` with `keep`, of what it made.
  Memory memory(const Table& table) {
    Memory made;
    made.filled = true;
    made.quantum = lattice_.quantum;
    made.vertices = lattice_.vertices;
    for (const char filled : filled_) made.whole.push_back(!filled);
    made.pieces = {std::move(first_piece_), {}, table.piece_facet, table.piece_moments};
    made.closed = {std::move(first_closed_), {}, table.closed_facet, table.closed_moments};
    made.first_region.assign(first_region_.begin(), first_region_.end());
    made.first_region.push_back(table.cell.size());
    made.pieces.region = table.piece_region;
    for (std::size_t c = 0; c < cells_.size(); ++c)
      for (std::size_t k = made.pieces.first[c]; k < made.pieces.first[c + 1]; ++k)
        made.pieces.region[k] -= first_region_[c];
    made.closed.region.assign(table.closed_facet.size(), -1);
    made.flux = std::move(flux_);
    made.zones = std::move(zones_);
    made.zones_of = std::move(zones_of_);
    made.candidates = std::move(candidates_);
    made.cells = std::move(cells_);
    made.faces = std::move(faces_);
    return made;
  }

private:
  static constexpr int size = N * N * M, face_size = N * M;
  static constexpr int axes = M == N ? 3 : 2;  // a layer has no faces across it

  void compute_cells() {
    keep_cells();
    FastCell fast(lattice_);
    ExactCell exact(lattice_, zones_);
    std::vector<int> facets;
    const ExactCell::Winding winding = [&](int body, const Point3& x) {
      alone_ = false;
      return turns(body, x);
    };
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      if (kept_[c] >= 0) continue;
      const auto at = lattice_.index(candidates_.cells[c]);
      const int* begin = candidates_.facets.data() + candidates_.first[c];
      const int count = static_cast<int>(candidates_.first[c + 1] - candidates_.first[c]);
      const std::span<const int> zones = zones_of_.of(candidates_.cells[c]);
      if (!only_exact_ && zones.empty() && fast.compute(at, begin, count, cells_[c])) continue;
      facets.assign(begin, begin + count);
      cells_[c] = {};
      std::array<const FaceParts*, 6> faces;
      for (int k = 0; k < 6; ++k) faces[k] = &parts(k, at, facets, zones);
      origin_ = lattice_.low(at);
      alone_ = true;
      exact.compute(at, facets, zones, faces, winding, cells_[c]);
      cells_[c].alone = alone_;
    }
  }

  // Cells none of whose facets moved, with the same zones, and their faces.
  void keep_cells() {
    if (!old_.filled) return;
    const auto moved = old_.moved(lattice_);
    const bool same_zones = zones_ == old_.zones;
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      const int cell = candidates_.cells[c], k = old_.candidates.find(cell);
      if (k < 0 || !old_.cells[k].alone) continue;
      const auto facets = candidates_.of(cell), before = old_.candidates.of(cell);
      const auto zones = zones_of_.of(cell), zones_before = old_.zones_of.of(cell);
      if (!std::ranges::equal(facets, before) || !std::ranges::equal(zones, zones_before)) continue;
      if (!zones.empty() && !same_zones) continue;
      if (std::any_of(facets.begin(), facets.end(), [&](int facet) { return moved[facet]; })) continue;
      kept_[c] = k;
      cells_[c] = std::move(old_.cells[k]);
      if (!cells_[c].exact) continue;
      for (int face = 0; face < 6; ++face)
        faces_.insert(old_.faces.extract(face_key(face, lattice_.index(cell))));
    }
  }

  std::int64_t face_key(int face, std::array<int, 3> at) const {
    at[face / 2] += face % 2;
    return face / 2 + 3 * (at[0] + (lattice_.cells[0] + std::int64_t{1}) *
                                     (at[1] + (lattice_.cells[1] + std::int64_t{1}) * at[2]));
  }

  const FaceParts& parts(int face, std::array<int, 3> at, const std::vector<int>& facets, std::span<const int> zones) {
    const auto [found, fresh] = faces_.try_emplace(face_key(face, at));
    at[face / 2] += face % 2;
    if (fresh) found->second = division_.divide(face / 2, at, facets, zones);
    return found->second;
  }

  // Turns of a body about a point relative to `origin_`: its solid angle (Van Oosterom & Strackee 1983).
  int turns(int body, const Point3& x) const {
    double sum = 0;
    for (const int f : lattice_.of_body[body]) {
      std::array<Point3, 3> way;
      std::array<double, 3> length;
      for (int v = 0; v < 3; ++v) {
        const auto& at = lattice_.vertices[lattice_.facets[f][v]];
        for (int d = 0; d < 3; ++d) way[v][d] = to_unit * static_cast<double>(at[d] - origin_[d]) - x[d];
        length[v] = std::sqrt(dot(way[v], way[v]));
      }
      const auto& [a, b, c] = way;
      const double volume = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                            a[2] * (b[0] * c[1] - b[1] * c[0]);
      const double below = length[0] * length[1] * length[2] + dot(a, b) * length[2] + dot(b, c) * length[0] +
                           dot(c, a) * length[1];
      sum += 2 * std::atan2(volume, below);
    }
    return static_cast<int>(std::lround(sum / (4 * 3.14159265358979323846)));
  }

  static double dot(const Point3& a, const Point3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

  // Cells around which a body is but which it does not cut: connected ones are alike.
  void fill(int body) {
    std::array<int, 3> from, to;
    for (int d = 0; d < 3; ++d) {
      std::int64_t least = std::numeric_limits<std::int64_t>::max(), most = std::numeric_limits<std::int64_t>::min();
      for (const int f : lattice_.of_body[body])
        for (const int v : lattice_.facets[f]) {
          least = std::min(least, lattice_.vertices[v][d]);
          most = std::max(most, lattice_.vertices[v][d]);
        }
      const auto& lines = lattice_.lines[d];
      from[d] = 0;
      to[d] = lattice_.cells[d] - 1;
      while (from[d] <= to[d] && lines[from[d] + 1] < least) ++from[d];
      while (from[d] <= to[d] && lines[to[d]] > most) --to[d];
      if (from[d] > to[d]) return;
    }
    const std::array<int, 3> n{to[0] - from[0] + 1, to[1] - from[1] + 1, to[2] - from[2] + 1};
    std::vector<char> seen(static_cast<std::size_t>(n[0]) * n[1] * n[2], 0);
    const auto local = [&](const std::array<int, 3>& at) {
      const std::size_t column = (at[1] - from[1]) + static_cast<std::size_t>(n[1]) * (at[2] - from[2]);
      return (at[0] - from[0]) + n[0] * column;
    };
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      const auto& bodies = cells_[c].bodies;
      if (std::find(bodies.begin(), bodies.end(), body) == bodies.end()) continue;
      seen[local(lattice_.index(candidates_.cells[c]))] = 1;
    }
    std::vector<std::array<int, 3>> stack;
    std::array<int, 3> at;
    for (at[2] = from[2]; at[2] <= to[2]; ++at[2])
      for (at[1] = from[1]; at[1] <= to[1]; ++at[1])
        for (at[0] = from[0]; at[0] <= to[0]; ++at[0]) {
          if (seen[local(at)]) continue;
          origin_ = lattice_.low(at);
          Point3 middle;
          for (int d = 0; d < 3; ++d)
            middle[d] = 0.5 * to_unit * static_cast<double>(lattice_.high(at)[d] - origin_[d]);
          const bool inside = turns(body, middle) > 0;
          stack.assign(1, at);
          seen[local(at)] = 1;
          while (!stack.empty()) {
            auto here = stack.back();
            stack.pop_back();
            if (inside) table_.state[lattice_.number(here)] = solid;
            for (int d = 0; d < 3; ++d)
              for (const int step : {-1, 1}) {
                auto there = here;
                there[d] += step;
                if (there[d] < from[d] || there[d] > to[d] || seen[local(there)]) continue;
                seen[local(there)] = 1;
                stack.push_back(there);
              }
          }
        }
  }

  void number_regions() {
    first_region_.assign(cells_.size(), 0);
    filled_.assign(cells_.size(), 0);
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      const int cell = candidates_.cells[c];
      CellRegions& here = cells_[c];
      if (kept_[c] < 0) put_in_order(here);
      first_region_[c] = static_cast<std::int64_t>(table_.cell.size());
      if (!here.cut) continue;
      filled_[c] = table_.state[cell] == solid;
      table_.kernel[cell] = here.exact ? 2 : 1;
      if (table_.state[cell] == solid || here.regions == 0) {
        table_.state[cell] = solid;
        continue;
      }
      table_.state[cell] = mixed;
      for (int k = 0; k < here.regions; ++k) table_.cell.push_back(cell);
    }
    table_.share.assign(table_.cell.size(), 0);
    table_.moments.assign(table_.cell.size() * size, 0);
  }

  bool is_mixed(std::size_t c) const { return table_.state[candidates_.cells[c]] == mixed && cells_[c].cut; }

  Point3 cell_size(const std::array<int, 3>& at) const {
    const auto low = lattice_.low(at), high = lattice_.high(at);
    Point3 size;
    for (int d = 0; d < 3; ++d) size[d] = static_cast<double>(high[d] - low[d]);
    return size;
  }

  void integrate_surface() {
    std::size_t pieces = 0;  // at least as many as rows: without it rows move as the table grows
    for (const CellRegions& here : cells_) pieces += here.surface.size();
    table_.piece_moments.reserve(pieces * 3 * size);
    std::vector<int> order;
    std::array<double, size> no_flux{};
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      if (keep_) note_rows();
      if (kept_[c] >= 0 && !filled_[c] && old_.whole[kept_[c]]) {
        copy_rows(c);
        continue;
      }
      const CellRegions& here = cells_[c];
      const auto at = lattice_.index(candidates_.cells[c]);
      const auto low = lattice_.low(at);
      const Point3 relative = cell_size(at);
      Point3 metres;
      for (int d = 0; d < 3; ++d) metres[d] = relative[d] * lattice_.quantum;
      // Pieces by region and facet; `start` begins the row of a new one and gives its moments and the flux.
      const auto add = [&](const std::vector<SurfacePiece>& pieces, const auto& start, std::vector<double>& moments,
                           const auto& flux) {
        order.resize(pieces.size());
        std::iota(order.begin(), order.end(), 0);
        const auto key = [&](int k) { return std::pair(pieces[k].region, pieces[k].facet); };
        std::sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b); });
        for (std::size_t i = 0; i < order.size(); ++i) {
          const SurfacePiece& piece = pieces[order[i]];
          const Point3* corners = here.corners.data() + piece.first;
          if (piece.facet < 0) {
            integrals_.add_flux(corners, piece.count, flux(piece));
            continue;
          }
          if (i == 0 || key(order[i - 1]) != key(order[i])) {
            start(piece);
            moments.resize(moments.size() + 3 * size, 0);
          }
          std::array<Point3, 3> facet;
          for (int v = 0; v < 3; ++v) {
            const auto& corner = lattice_.vertices[lattice_.facets[piece.facet][v]];
            for (int d = 0; d < 3; ++d) facet[v][d] = static_cast<double>(corner[d] - low[d]) / relative[d];
          }
          integrals_.add_surface(corners, piece.count, facet, metres, flux(piece),
                                 moments.data() + moments.size() - 3 * size);
        }
      };
      const auto start_closed = [&](const SurfacePiece& piece) {
        table_.closed_cell.push_back(candidates_.cells[c]);
        table_.closed_facet.push_back(piece.facet);
      };
      if (!filled_[c]) add(here.closed, start_closed, table_.closed_moments, [&](const SurfacePiece&) { return no_flux.data(); });
      if (!is_mixed(c)) continue;
      const auto start = [&](const SurfacePiece& piece) {
        table_.piece_region.push_back(first_region_[c] + piece.region);
        table_.piece_facet.push_back(piece.facet);
      };
      add(here.surface, start, table_.piece_moments, [&](const SurfacePiece& piece) {
        return table_.moments.data() + (first_region_[c] + piece.region) * size;
      });
      for (int k = 0; k < here.regions; ++k)
        integrals_.to_volume(table_.moments.data() + (first_region_[c] + k) * size);
    }
    if (keep_) note_rows();
  }

  void note_rows() {
    first_piece_.push_back(table_.piece_facet.size());
    first_closed_.push_back(table_.closed_facet.size());
  }

  void copy_rows(std::size_t c) {
    const int k = kept_[c];
    const auto copy = [&](const MemoryRows& rows, std::vector<double>& moments, const auto& start) {
      const std::size_t begin = rows.first[k], end = rows.first[k + 1];
      for (std::size_t r = begin; r < end; ++r) start(rows.region[r], rows.facet[r]);
      const auto from = rows.moments.begin();
      moments.insert(moments.end(), from + 3 * size * begin, from + 3 * size * end);
    };
    copy(old_.closed, table_.closed_moments, [&](std::int64_t, std::int64_t facet) {
      table_.closed_cell.push_back(candidates_.cells[c]);
      table_.closed_facet.push_back(facet);
    });
    if (!is_mixed(c)) return;
    copy(old_.pieces, table_.piece_moments, [&](std::int64_t region, std::int64_t facet) {
      table_.piece_region.push_back(first_region_[c] + region);
      table_.piece_facet.push_back(facet);
    });
    std::copy(old_.flux.begin() + old_.first_region[k] * size, old_.flux.begin() + old_.first_region[k + 1] * size,
              table_.moments.begin() + first_region_[c] * size);
  }

  // What is on one side of a face.
  struct Side {
    int cell = -1;      // -1: outside of the box
    int candidate = -1;
    bool fluid = false;
    const CellRegions* regions = nullptr;  // of a mixed cell
    std::int64_t first = 0;
  };

  Side side(std::array<int, 3> at) const {
    Side found;
    for (int d = 0; d < 3; ++d)
      if (at[d] < 0 || at[d] >= lattice_.cells[d]) return found;
    found.cell = lattice_.number(at);
    found.fluid = table_.state[found.cell] != solid;
    found.candidate = candidates_.find(found.cell);
    if (found.candidate < 0 || !is_mixed(found.candidate)) return found;
    found.regions = &cells_[found.candidate];
    found.first = first_region_[found.candidate];
    return found;
  }

  void link_faces() {
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      if (!is_mixed(c)) continue;
      const auto at = lattice_.index(candidates_.cells[c]);
      for (int axis = 0; axis < axes; ++axis) {
        auto beyond = at;
        ++beyond[axis];
        const Side here = side(at), above = side(beyond);
        link(axis, beyond, here, above);
        beyond[axis] -= 2;
        const Side below = side(beyond);
        if (!below.regions) link(axis, at, below, here);  // else it is done from there
      }
    }
    for (std::size_t k = 0; k < table_.cell.size(); ++k)
      for (int q = 0; q < size; ++q) table_.share[k] += table_.moments[k * size + q];
  }

  // The face at the lower side of the cell `at`.
  void link(int axis, const std::array<int, 3>& at, const Side& below, const Side& above) {
    const std::array<const Side*, 2> sides{&below, &above};
    rows_.clear();
    const bool by_parts = (!below.regions || below.regions->exact) && (!above.regions || above.regions->exact);
    if (by_parts) {
      const FaceParts& face = parts(2 * axis, at, {}, {});
      for (std::size_t j = 0; j < face.parts.size(); ++j) {
        const FacePart& part = face.parts[j];
        std::array<std::int64_t, 2> region;
        bool open = part.cover.empty();
        for (int s = 0; s < 2; ++s) {
          const Side& side = *sides[s];
          const int found = side.regions ? side.regions->of_part[2 * axis + 1 - s][j] : -1;
          region[s] = side.regions && found >= 0 ? side.first + found : -1;
          open &= side.cell < 0 || (side.regions ? found >= 0 : side.fluid);
        }
        if (!open) continue;
        double* moments = row(region);
        for (std::size_t i = 0; i < part.outline.size(); ++i)
          integrals_.add_side(part.outline[i], part.outline[(i + 1) % part.outline.size()], moments);
      }
    } else {
      const int s = below.regions && !below.regions->exact ? 0 : 1;  // the side that has outlines
      const Side &mine = *sides[s], &other = *sides[1 - s];
      const int face = 2 * axis + 1 - s;
      const auto beyond = [&](int facet, int corner) -> std::int64_t {
        if (!other.regions) return -1;
        if (facet < 0) {
          const int found = other.regions->at_corner[corner ^ 1 << axis];
          return found < 0 ? disagree(at) : other.first + found;
        }
        for (const Chord& chord : other.regions->chords[2 * axis + s])
          if (chord.facet == facet) return other.first + chord.region;
        return disagree(at);
      };
      if (other.cell >= 0 && !other.fluid) {
        if (!mine.regions->chords[face].empty() || !mine.regions->wet[face].empty()) disagree(at);
        return;
      }
      const auto moments = [&](int region, int facet, int corner) {
        std::array<std::int64_t, 2> pair;
        pair[s] = mine.first + region;
        pair[1 - s] = beyond(facet, corner);
        return row(pair);
      };
      for (const Chord& chord : mine.regions->chords[face])
        integrals_.add_side(chord.ends[0], chord.ends[1], moments(chord.region, chord.facet, -1));
      for (const WetEdge& wet : mine.regions->wet[face])
        integrals_.add_side({1, wet.from}, {1, wet.to}, moments(wet.region, wet.facet, wet.corner));
    }
    finish_rows(axis, below, above);
  }

  [[noreturn]] std::int64_t disagree(const std::array<int, 3>& at) const {
    throw std::logic_error("the cells at a face disagree on it, at (" + std::to_string(at[0]) + ", " +
                           std::to_string(at[1]) + ", " + std::to_string(at[2]) + ")");
  }

  struct Row {
    std::array<std::int64_t, 2> regions;
    std::array<double, N * N> moments;  // of the first axis after the normal's fastest
  };

  double* row(const std::array<std::int64_t, 2>& regions) {
    for (Row& known : rows_)
      if (known.regions == regions) return known.moments.data();
    rows_.push_back({regions, {}});
    return rows_.back().moments.data();
  }

  void finish_rows(int axis, const Side& below, const Side& above) {
    for (const Row& known : rows_) {
      if (known.regions[0] < 0 && known.regions[1] < 0) continue;
      double area = 0;
      std::array<double, face_size> moments{};  // the lower one of its axes fastest: of y these are z, x
      for (int f = 0; f < N * N; ++f) {
        const int first = axis == 1 ? f / N : f % N, second = axis == 1 ? f % N : f / N;
        area += known.moments[f];
        moments[first + N * (second % M)] += known.moments[f];
      }
      if (axis == 0 && known.regions[0] >= 0)
        integrals_.add_far_face(moments.data(), table_.moments.data() + known.regions[0] * size);
      table_.face_axis.push_back(axis);
      table_.face_cells.insert(table_.face_cells.end(), {below.cell, above.cell});
      table_.face_regions.insert(table_.face_regions.end(), known.regions.begin(), known.regions.end());
      table_.face_area.push_back(area);
      table_.face_moments.insert(table_.face_moments.end(), moments.begin(), moments.end());
    }
  }

  const Lattice& lattice_;
  Integrals<N, M> integrals_;
  bool only_exact_, keep_;
  Memory old_;
  Zones zones_;
  Candidates zones_of_;             // zones of each cell
  Candidates candidates_;
  std::vector<CellRegions> cells_;  // of each candidate
  std::vector<int> kept_;           // of each candidate, its number in the old table, -1: computed
  std::vector<char> filled_;        // candidates inside of a body that does not cut them
  std::vector<std::size_t> first_piece_, first_closed_;
  std::vector<double> flux_;
  bool alone_ = true;
  FaceDivision division_{lattice_, zones_};
  std::unordered_map<std::int64_t, FaceParts> faces_;
  Integers3 origin_{};
  std::vector<std::int64_t> first_region_;
  std::vector<Row> rows_;
  Table table_;
};

}  // namespace cut
