// Python names of the division of cells: divide_cells.
#include <nanobind/stl/tuple.h>

#include <algorithm>
#include <map>
#include <tuple>

#include "bindings.hpp"
#include "open_regions.hpp"

namespace {

using Integers = Values<const std::int64_t, 1>;

auto divide_cells(const Integers& first, const Values<const double, 1>& fraction, const Integers& count,
                  const Values<const double, 3>& corners, const Values<const double, 2>& planes, const Integers& body,
                  double gap) {
  const std::size_t cells = fraction.size(), polygons = count.size();
  if (first.size() != cells + 1 || corners.shape(0) != polygons ||
      planes.shape(0) != polygons || planes.shape(1) != 4 || body.size() != polygons || corners.shape(2) != 3 ||
      first.data()[0] != 0 || first.data()[cells] != static_cast<std::int64_t>(polygons))
    throw std::invalid_argument("arrays of cells and polygons do not fit");
  if (std::any_of(count.data(), count.data() + polygons,
                  [&](std::int64_t n) { return n < 3 || n > static_cast<std::int64_t>(corners.shape(1)); }))
    throw std::invalid_argument("polygons have at least three corners");
  std::vector<double> volumes, triangles;
  std::vector<std::int64_t> cell_of_region, state, wet, row;
  {
    nb::gil_scoped_release released;
    for (std::size_t cell = 0; cell < cells; ++cell) {
      division::Input input;
      input.fraction = fraction.data()[cell];
      std::map<std::int64_t, int> number;
      std::vector<std::int64_t> original;
      for (auto k = first.data()[cell]; k < first.data()[cell + 1]; ++k) {
        division::Shape shape;
        for (std::int64_t v = 0; v < count.data()[k]; ++v) {
          const double* x = corners.data() + (k * corners.shape(1) + v) * 3;
          shape.push_back({x[0], x[1], x[2]});
        }
        if (division::area(shape) < division::no_area) continue;
        input.polygons.push_back(std::move(shape));
        const double* plane = planes.data() + 4 * k;
        input.planes.push_back({{plane[0], plane[1], plane[2]}, plane[3]});
        original.push_back(k);
        input.body.push_back(number.try_emplace(body.data()[k], static_cast<int>(number.size())).first->second);
      }
      const auto regions = division::Cell(input, gap).regions();
      const auto start = static_cast<std::int64_t>(volumes.size());
      volumes.insert(volumes.end(), regions.volumes.begin(), regions.volumes.end());
      cell_of_region.insert(cell_of_region.end(), regions.volumes.size(), static_cast<std::int64_t>(cell));
      state.push_back(regions.sound ? (regions.closes ? 1 : 0) + (regions.overlapping ? 2 : 0) : -1);
      wet.insert(wet.end(), regions.corners.begin(), regions.corners.end());
      for (const auto& one : regions.boundary)
        for (std::size_t k = 1; k + 1 < one.shape.size(); ++k) {
          row.insert(row.end(), {start + one.region, one.kind, original.empty() ? -1 : original[one.polygon]});
          for (const auto& x : {one.shape[0], one.shape[k], one.shape[k + 1]})
            triangles.insert(triangles.end(), x.begin(), x.end());
        }
    }
  }
  const std::size_t regions = volumes.size(), rows = row.size() / 3;
  return std::tuple(to_numpy(std::move(cell_of_region), {regions}), to_numpy(std::move(volumes), {regions}),
                    to_numpy(std::move(row), {rows, 3}), to_numpy(std::move(triangles), {rows, 3, 3}),
                    to_numpy(std::move(state), {cells}), to_numpy(std::move(wet), {cells, 8}));
}

}  // namespace

void bind_division(nb::module_& module) {
  module.def("divide_cells", &divide_cells, "first"_a, "fraction"_a, "count"_a, "corners"_a, "planes"_a, "body"_a,
             "gap"_a,
             R"(Regions of fluid in cells cut by surfaces of several bodies in 3D, which may touch and overlap.

first: the first polygon of each cell and the end, int64, (C + 1,); fraction: volumes of the bodies in each cell, added
up, (C,); count: corners of each polygon, int64, (P,); corners: (P, most, 3) in [0, 1]^3 of the cell, counterclockwise
as seen from outside of the solid; planes: of each polygon, (unit normal out of the solid, its product with a point),
(P, 4); body: of each polygon, int64, (P,); gap: fluid thinner than that between two bodies
is closed. Returns (cell of each region, (R,); its volume, (R,); (region, kind, polygon) of triangles that bound
regions, (T, 3), kind -1: surface, -2: closes a thin gap, from 0 on: 2 axis + side of a face of the cell; their
corners, counterclockwise as seen from outside of the fluid, (T, 3, 3); state of each cell, (C,), -1: not found, 1:
something is closed, 2: bodies overlap, 3: both; wetness of its corners, the first axis fastest, 1, 0, or -1: unknown,
(C, 8)). ValueError for arrays that do not fit.)");
}
