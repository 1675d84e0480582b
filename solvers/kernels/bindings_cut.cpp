// Python names of the geometry of cut cells: CellCutter, CutCells.
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <functional>
#include <utility>

#include "bindings.hpp"
#include "cut_table.hpp"

namespace {

using Doubles = Values<const double, 1>;
using Integers = Values<const std::int64_t, 1>;

struct CutCells {
  double quantum;
  nb::object vertices, state, kernel, cell, share, moments, piece_region, piece_facet, piece_moments, face_axis,
    face_cells, face_regions, face_area, face_moments, closed_cell, closed_facet, closed_moments;
};

// Grid, facets and choices of tables, and what the latest one left.
class CellCutter {
public:
  CellCutter(const std::vector<Doubles>& edges, const Doubles& points, const Values<const std::int64_t, 2>& facets,
             const Integers& body, double closing, bool only_exact, bool layer)
    : points_(points.data(), points.data() + points.size()), facets_(facets.data(), facets.data() + facets.size()),
      body_(body.data(), body.data() + body.size()), closing_(closing), only_exact_(only_exact), layer_(layer) {
    require(edges.size() == 3, "edges must be 3 arrays");
    require(facets.shape(1) == 3, "facets must have 3 columns");
    require(body.size() == facets.shape(0), "body must have one number for each facet");
    for (int d = 0; d < 3; ++d) {
      lines_[d].assign(edges[d].data(), edges[d].data() + edges[d].size());
      const auto& line = lines_[d];
      const auto found = std::adjacent_find(line.begin(), line.end(), std::greater_equal<>());
      require(line.size() >= 2 && found == line.end(), "edges must increase");
    }
    const std::size_t n = points_.size();
    require(n == 2 || n == 3 || n == 5 || (n == 7 && layer), "points must be 2, 3 or 5 numbers, in a layer also 7");
  }

  // keep: for the next table
  CutCells cut(const Values<const double, 2>& vertices, bool keep) {
    require(vertices.shape(1) == 3, "vertices must have 3 columns");
    const auto count = static_cast<std::int64_t>(vertices.shape(0));
    require(std::all_of(facets_.begin(), facets_.end(), [&](std::int64_t v) { return v >= 0 && v < count; }),
            "facets name vertices that are not there");
    cut::Table table;
    std::vector<double> rounded;
    double quantum = 0;
    const std::size_t n = points_.size();
    {
      nb::gil_scoped_release released;
      const cut::Lattice lattice(lines_, vertices.data(), vertices.shape(0), facets_.data(), body_.data(), body_.size());
      quantum = lattice.quantum;
      for (const auto& vertex : lattice.vertices)
        for (int d = 0; d < 3; ++d) rounded.push_back(static_cast<double>(vertex[d]) * quantum);
      switch (n) {
        case 2: table = layer_ ? make<2, 1>(lattice, keep) : make<2, 2>(lattice, keep); break;
        case 3: table = layer_ ? make<3, 1>(lattice, keep) : make<3, 3>(lattice, keep); break;
        case 5: table = layer_ ? make<5, 1>(lattice, keep) : make<5, 5>(lattice, keep); break;
        default: table = make<7, 1>(lattice, keep);
      }
    }
    const std::size_t cells = table.state.size(), regions = table.cell.size(), pieces = table.piece_facet.size();
    const std::size_t faces = table.face_axis.size(), closed = table.closed_facet.size();
    const std::size_t of_face = n * (layer_ ? 1 : n), all = n * of_face;
    return {quantum,
            to_numpy(std::move(rounded), {vertices.shape(0), 3}),
            to_numpy(std::move(table.state), {cells}),
            to_numpy(std::move(table.kernel), {cells}),
            to_numpy(std::move(table.cell), {regions}),
            to_numpy(std::move(table.share), {regions}),
            to_numpy(std::move(table.moments), {regions, all}),
            to_numpy(std::move(table.piece_region), {pieces}),
            to_numpy(std::move(table.piece_facet), {pieces}),
            to_numpy(std::move(table.piece_moments), {pieces, all, 3}),
            to_numpy(std::move(table.face_axis), {faces}),
            to_numpy(std::move(table.face_cells), {faces, 2}),
            to_numpy(std::move(table.face_regions), {faces, 2}),
            to_numpy(std::move(table.face_area), {faces}),
            to_numpy(std::move(table.face_moments), {faces, of_face}),
            to_numpy(std::move(table.closed_cell), {closed}),
            to_numpy(std::move(table.closed_facet), {closed}),
            to_numpy(std::move(table.closed_moments), {closed, all, 3})};
  }

private:
  template <int N, int M>
  cut::Table make(const cut::Lattice& lattice, bool keep) {
    cut::TableMaker<N, M> maker(lattice, points_.data(), closing_ / lattice.quantum, only_exact_,
                             std::exchange(memory_, {}), keep);
    cut::Table table = maker.make();
    if (keep) memory_ = maker.memory(table);
    return table;
  }

  std::array<std::vector<double>, 3> lines_;
  std::vector<double> points_;
  std::vector<std::int64_t> facets_, body_;
  double closing_;
  bool only_exact_, layer_;  // layer: one layer of cells between walls that stand across it
  cut::Memory memory_;
};

}  // namespace

void bind_cut(nb::module_& module) {
  nb::class_<CutCells>(module, "CutCells", "Columns of the table of the fluid in cut cells; see solvers.cut_cells.")
    .def_ro("quantum", &CutCells::quantum)
    .def_ro("vertices", &CutCells::vertices)
    .def_ro("state", &CutCells::state)
    .def_ro("kernel", &CutCells::kernel)
    .def_ro("cell", &CutCells::cell)
    .def_ro("share", &CutCells::share)
    .def_ro("moments", &CutCells::moments)
    .def_ro("piece_region", &CutCells::piece_region)
    .def_ro("piece_facet", &CutCells::piece_facet)
    .def_ro("piece_moments", &CutCells::piece_moments)
    .def_ro("face_axis", &CutCells::face_axis)
    .def_ro("face_cells", &CutCells::face_cells)
    .def_ro("face_regions", &CutCells::face_regions)
    .def_ro("face_area", &CutCells::face_area)
    .def_ro("face_moments", &CutCells::face_moments)
    .def_ro("closed_cell", &CutCells::closed_cell)
    .def_ro("closed_facet", &CutCells::closed_facet)
    .def_ro("closed_moments", &CutCells::closed_moments);
  nb::class_<CellCutter>(module, "CellCutter", "Makes tables of the fluid in cut cells, in 3D; see solvers.cut_cells.")
    .def(nb::init<const std::vector<Doubles>&, const Doubles&, const Values<const std::int64_t, 2>&, const Integers&,
                  double, bool, bool>(),
         "edges"_a, "points"_a, "facets"_a, "body"_a, "closing"_a, "only_exact"_a, "layer"_a)
    .def("cut", &CellCutter::cut, "vertices"_a, "keep"_a);
}
