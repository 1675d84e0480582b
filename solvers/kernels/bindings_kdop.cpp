// Python names of the contact search: KdopTree2 and KdopTree3, the same class in 2D and 3D.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "bindings.hpp"
#include "kdop.hpp"

namespace {

using FacetArray = Values<const std::int64_t, 2>;
using Positions = Values<const double, 2>;
using Radii = Values<const double, 1>;

// Gives a container of rows to Python without copying it.
template <typename Rows>
auto to_numpy(Rows rows) {
  using Row = typename Rows::value_type;
  using Scalar = typename Row::value_type;
  auto* owned = new Rows(std::move(rows));
  nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<Rows*>(p); });
  Scalar* data = owned->empty() ? nullptr : owned->data()->data();
  const auto shape = {owned->size(), std::tuple_size_v<Row>};
  return nb::ndarray<nb::numpy, Scalar, nb::ndim<2>>(data, shape, owner);
}

template <int Dim>
kdop::Facets<Dim> to_facets(const FacetArray& facets) {
  constexpr std::int64_t limit = std::numeric_limits<std::int32_t>::max() / 2;  // 2 k - 1 tree nodes
  if (static_cast<std::int64_t>(facets.shape(0)) > limit)
    throw std::invalid_argument("a surface has too many facets");
  std::vector<std::int32_t> nodes(facets.size());
  const auto narrow = [](std::int64_t node) {
    if (node < 0 || node > limit)
      throw std::invalid_argument("a facet has the node index " + std::to_string(node));
    return static_cast<std::int32_t>(node);
  };
  std::transform(facets.data(), facets.data() + facets.size(), nodes.begin(), narrow);
  return {std::move(nodes), static_cast<int>(facets.shape(1))};
}

// Where Python's arrays enter: behind it all shapes fit and all numbers are finite.
template <int Dim>
kdop::Placement to_placement(const kdop::Facets<Dim>& facets, const Positions& x,
                             const std::optional<Positions>& x_previous,
                             const std::optional<Radii>& inflation) {
  kdop::Placement placement;
  const auto add = [&](const Positions& positions) {
    const std::size_t rows = positions.shape(0), columns = positions.shape(1);
    if (columns != Dim || rows < facets.nodes_needed())
      throw std::invalid_argument(
        "positions must have shape (n >= " + std::to_string(facets.nodes_needed()) + ", " +
        std::to_string(Dim) + "), not (" + std::to_string(rows) + ", " + std::to_string(columns) + ")");
    const double* end = positions.data() + positions.size();
    if (!std::all_of(positions.data(), end, [](double value) { return std::isfinite(value); }))
      throw std::invalid_argument("positions must be finite");
    placement.positions.push_back(positions.data());
  };
  add(x);
  if (x_previous) add(*x_previous);
  if (inflation) {
    placement.inflation = {inflation->data(), inflation->size()};
    if (inflation->size() != static_cast<std::size_t>(facets.count()))
      throw std::invalid_argument("inflation must have one radius per facet");
    for (const double radius : placement.inflation)
      if (!(radius >= 0 && std::isfinite(radius)))
        throw std::invalid_argument("inflation must be finite and not negative");
  }
  return placement;
}

template <int Dim>
using Tree = kdop::Tree<Dim>;

template <int Dim>
auto box(const Tree<Dim>& self, const Positions& x, const std::optional<Positions>& x_previous) {
  const auto placement = to_placement<Dim>(self.facets(), x, x_previous, {});
  std::vector<std::array<double, Dim>> corners;
  {
    nb::gil_scoped_release released;
    const auto bounds = self.box(placement);
    corners.assign(bounds.begin(), bounds.end());
  }
  return to_numpy(std::move(corners));
}

template <int Dim>
void build(Tree<Dim>& self, const Positions& x, const Radii& inflation,
           const std::optional<Positions>& x_previous) {
  const auto placement = to_placement<Dim>(self.facets(), x, x_previous, inflation);
  nb::gil_scoped_release released;
  self.build(placement);
}

template <int Dim>
void refit(Tree<Dim>& self, const Positions& x, const Radii& inflation,
           const std::optional<Positions>& x_previous) {
  const auto placement = to_placement<Dim>(self.facets(), x, x_previous, inflation);
  nb::gil_scoped_release released;
  self.refit(placement);
}

template <int Dim>
auto candidates(const Tree<Dim>& self, const Tree<Dim>& master) {
  kdop::Candidates found;
  {
    nb::gil_scoped_release released;
    found = kdop::candidates(self, master);
  }
  return std::pair(to_numpy(std::move(found.pairs)), found.tests);
}

template <int Dim>
void bind_tree(nb::module_& module, const char* name) {
  nb::class_<Tree<Dim>>(module, name, R"(Binary tree of k-DOPs over the facets of one surface.

facets: node indices in VTK order, int64, (k, nodes per facet). The methods take x: positions [m], (n, dim);
x_previous: a second configuration, the k-DOPs then hold the straight way between both; inflation: radius [m]
of each facet, (k,). ValueError for shapes that do not fit and numbers that are not finite.)")
    .def(
      "__init__",
      [](Tree<Dim>* self, const FacetArray& facets) { new (self) Tree<Dim>(to_facets<Dim>(facets)); },
      "facets"_a)
    .def("box", &box<Dim>, "x"_a, "x_previous"_a = nb::none(),
         "Lower and upper corner of the surface, (2, dim), not inflated; needs no build.")
    .def("build", &build<Dim>, "x"_a, "inflation"_a, "x_previous"_a = nb::none(),
         "Sort the facets into a new tree: O(k log k).")
    .def("refit", &refit<Dim>, "x"_a, "inflation"_a, "x_previous"_a = nb::none(),
         "New k-DOPs in the old tree: O(k). Does nothing before the first build.")
    .def("quality", &Tree<Dim>::quality, nb::call_guard<nb::gil_scoped_release>(),
         "How much more the tree's nodes cover than when it was built: 1 as new, infinite before.")
    .def("candidates", &candidates<Dim>, "master"_a,
         "(pairs, tests): all pairs (own facet, master facet) whose k-DOPs meet, int32 (p, 2), sorted;\n"
         "and how many k-DOP tests that took.");
}

}  // namespace

void bind_kdop(nb::module_& module) {
  bind_tree<2>(module, "KdopTree2");
  bind_tree<3>(module, "KdopTree3");
}
