// Python names of the moments kernel: moments, Moments.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>

#include "bindings.hpp"
#include "moments.hpp"

namespace {

using AnyArray = nb::ndarray<nb::ro, nb::device::cpu>;

template <typename Scalar>
std::string type_name() {
  if (std::is_same_v<Scalar, bool>) return "bool";
  return std::is_same_v<Scalar, double> ? "float64" : "int64";
}

template <typename Scalar>
struct View {
  const Scalar* data;
  std::size_t rows, columns;
};

// Checked here and not left to nanobind: it would convert, and so truncate node numbers given as floats.
template <typename Scalar>
View<Scalar> view(const std::string& name, const AnyArray& array, std::size_t ndim) {
  require(array.ndim() == ndim, name + " must have " + std::to_string(ndim) + (ndim == 1 ? " axis" : " axes") +
                                  ", not " + std::to_string(array.ndim()));
  require(array.dtype() == nb::dtype<Scalar>(), name + " must be of type " + type_name<Scalar>());
  std::int64_t stride = 1;
  for (std::size_t axis = ndim; axis-- > 0;) {
    require(array.shape(axis) <= 1 || array.size() == 0 || array.stride(axis) == stride,
            name + " must be contiguous, row by row (numpy.ascontiguousarray)");
    stride *= static_cast<std::int64_t>(array.shape(axis));
  }
  return {static_cast<const Scalar*>(array.data()), array.shape(0), ndim == 2 ? array.shape(1) : 1};
}

void require_finite(const std::string& name, const View<double>& values) {
  const double* end = values.data + values.rows * values.columns;
  const double* found = std::find_if_not(values.data, end, [](double value) { return std::isfinite(value); });
  require(found == end, name + " must be finite; row " +
                          std::to_string(static_cast<std::size_t>(found - values.data) / values.columns) + " is not");
}

template <int Dim>
moments::Grid<Dim> to_grid(const std::vector<AnyArray>& edges, const std::optional<AnyArray>& wanted) {
  std::array<std::vector<double>, Dim> lines;
  std::size_t cells = 1;
  for (int d = 0; d < Dim; ++d) {
    const std::string name = "edges[" + std::to_string(d) + "]";
    const auto line = view<double>(name, edges[d], 1);
    require(line.rows >= 2, name + " must have at least 2 entries");
    require(line.rows < std::numeric_limits<int>::max(), name + " has too many entries");
    require_finite(name, line);
    for (std::size_t i = 1; i < line.rows; ++i)
      require(line.data[i - 1] < line.data[i], name + " must increase; entries " + std::to_string(i - 1) + " and " +
                                                 std::to_string(i) + " do not");
    lines[d].assign(line.data, line.data + line.rows);
    cells *= line.rows - 1;
  }
  const bool* flags = nullptr;
  if (wanted) {
    const auto given = view<bool>("wanted", *wanted, 1);
    require(given.rows == cells, "wanted must have one flag for each of " + std::to_string(cells) + " cells, not " +
                                   std::to_string(given.rows));
    flags = given.data;
  }
  return {std::move(lines), flags};
}

template <int Dim>
moments::Surface<Dim> to_surface(const AnyArray& vertices, const AnyArray& facets) {
  const auto x = view<double>("vertices", vertices, 2);
  const auto nodes = view<std::int64_t>("facets", facets, 2);
  const auto columns = [](const std::string& name, std::size_t count) {
    require(count == Dim, name + " must have " + std::to_string(Dim) + " columns in " + std::to_string(Dim) +
                            "D, not " + std::to_string(count));
  };
  columns("vertices", x.columns);
  columns("facets", nodes.columns);
  require_finite("vertices", x);
  const std::int64_t* end = nodes.data + nodes.rows * Dim;
  const std::int64_t* found = std::find_if_not(
    nodes.data, end, [&](std::int64_t node) { return 0 <= node && node < static_cast<std::int64_t>(x.rows); });
  if (found != end)
    throw std::invalid_argument("facet " + std::to_string((found - nodes.data) / Dim) + " names vertex " +
                                std::to_string(*found) + ", there are " + std::to_string(x.rows));
  return {x.data, nodes.data, static_cast<std::int64_t>(nodes.rows)};
}

View<double> to_points(const AnyArray& points, std::size_t dim) {
  const auto given = view<double>("points", points, 1);
  require((given.rows >= 2 && given.rows <= 5) || (given.rows == 7 && dim == 2),
          "points must be 2 to 5 numbers, or 7 in 2D, not " + std::to_string(given.rows));
  for (std::size_t a = 0; a < given.rows; ++a)
    require(given.data[a] > (a == 0 ? 0.0 : given.data[a - 1]) && given.data[a] < 1,
            "points must increase within (0, 1)");
  return given;
}

// Gives an array to Python without copying it.
template <typename T>
nb::object to_numpy(moments::Array<T> array, std::initializer_list<std::size_t> shape) {
  T* data = array.data.release();
  nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<T*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, T>(data, shape.size(), shape.begin(), owner));
}

struct Moments {
  nb::object fraction, cells, solid, piece_cell, piece_facet, piece_moments, piece_mass;
};

template <int Dim>
Moments compute(const std::vector<AnyArray>& edges, const View<double>& points, const AnyArray& vertices,
                const AnyArray& facets, const std::optional<AnyArray>& wanted) {
  const auto surface = to_surface<Dim>(vertices, facets);
  const auto grid = to_grid<Dim>(edges, wanted);
  moments::Result result;
  {
    nb::gil_scoped_release released;
    const auto with = [&]<int N>() { return moments::Integrator<Dim, N>(grid, surface, points.data).compute(); };
    switch (points.rows) {
      case 2: result = with.template operator()<2>(); break;
      case 3: result = with.template operator()<3>(); break;
      case 4: result = with.template operator()<4>(); break;
      case 5: result = with.template operator()<5>(); break;
      default:
        if constexpr (Dim == 2) result = with.template operator()<7>();
    }
  }
  const std::size_t dim = Dim, cells = result.cells.size, pieces = result.piece_facet.size;
  const std::size_t size = points.rows * points.rows * (Dim == 2 ? 1 : points.rows);
  const std::size_t all = result.fraction.size;
  return {to_numpy(std::move(result.fraction), {all}),
          to_numpy(std::move(result.cells), {cells}),
          to_numpy(std::move(result.solid), {cells, size}),
          to_numpy(std::move(result.piece_cell), {pieces}),
          to_numpy(std::move(result.piece_facet), {pieces}),
          to_numpy(std::move(result.piece_moments), {pieces, size, dim}),
          to_numpy(std::move(result.piece_mass), {pieces, dim, dim})};
}

Moments py_moments(const std::vector<AnyArray>& edges, const AnyArray& points, const AnyArray& vertices,
                   const AnyArray& facets, const std::optional<AnyArray>& wanted) {
  const auto given = to_points(points, edges.size());
  if (edges.size() == 2) return compute<2>(edges, given, vertices, facets, wanted);
  require(edges.size() == 3, "edges must be 2 or 3 arrays, not " + std::to_string(edges.size()));
  return compute<3>(edges, given, vertices, facets, wanted);
}

}  // namespace

void bind_moments(nb::module_& module) {
  nb::class_<Moments>(module, "Moments", R"(Integrals over a solid and its surface, cell by cell; see moments().

C cells with surface in them, P pieces: the part of one facet in one cell. Sorted by cell, then by facet.)")
    .def_ro("fraction", &Moments::fraction,
            "volume of the solid / volume of the cell, all cells, (cells,); NaN where not wanted")
    .def_ro("cells", &Moments::cells, "numbers of the wanted cells with a piece of surface, increasing, (C,)")
    .def_ro("solid", &Moments::solid, "integral of L_q over the solid in the cell / volume of the cell, (C, n^dim)")
    .def_ro("piece_cell", &Moments::piece_cell, "cell of each piece, as index into `cells`, (P,)")
    .def_ro("piece_facet", &Moments::piece_facet, "facet of each piece, (P,)")
    .def_ro("piece_moments", &Moments::piece_moments,
            "integral of L_q lambda_v over the piece [m^(dim-1)], (P, n^dim, dim)")
    .def_ro("piece_mass", &Moments::piece_mass,
            "integral of lambda_v lambda_w over the piece [m^(dim-1)], (P, dim, dim)");

  module.def("moments", &py_moments, "edges"_a, "points"_a, "vertices"_a, "facets"_a, "wanted"_a = nb::none(),
             R"(Moments of a solid in the cells of a box grid and of its surface, exact to rounding.

edges: increasing grid lines [m] of each direction, 2 or 3 arrays; points: n = 2 to 5 increasing numbers in (0, 1), or 7 in 2D;
vertices [m]: (k, dim); facets: (m, dim), int64, the segments (2D) or triangles (3D) of one or several closed
surfaces; wanted: one flag per cell, the others are left out.

The normal of a facet points out of the solid: (dy, -dx) in 2D, so that its segments run counter-clockwise round it,
right-handed in 3D. L_q is the Lagrange basis on the tensor points of a cell, q = a + n b + n^2 c with a along x, b
along y, c along z; cells are numbered i + nx (j + ny k); lambda_v are the barycentric coordinates of a facet.
Surfaces may leave the box, touch and overlap; where bodies overlap, the solid counts twice. A facet within a grid
plane belongs to the cell its normal points into, or to the cell inside if that one is outside the box.
ValueError for arrays that do not fit.)");
}
