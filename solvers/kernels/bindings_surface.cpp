// Python names of surface_rows.hpp and windings.hpp: surface_rows, seen_angles.
#include "bindings.hpp"
#include "surface_rows.hpp"
#include "windings.hpp"

namespace {

template <class Array, class... Sizes>
void require_shape(const char* name, const Array& values, Sizes... sizes) {
    const std::size_t wanted[] = {static_cast<std::size_t>(sizes)...};
    for (std::size_t k = 0; k < sizeof...(sizes); ++k)
        require(values.shape(k) == wanted[k], std::string(name) + " has another shape");
}

void py_surface_rows(const Values<const double, 3>& moments, const Values<const double, 4>& density,
                     const Values<const std::int64_t, 1>& cell, const Values<const double, 2>& normal,
                     const Values<const double, 4>& fields, const Values<const double, 4>& by_motion,
                     const Values<const double, 1>& leak, const Values<double, 5>& rows) {
    const std::size_t pieces = normal.shape(0), dim = normal.shape(1), points = density.shape(1);
    const std::size_t functions = density.shape(2), size = density.shape(3);
    void (*of)(std::size_t, const SurfaceRows&, double*) = nullptr;
    const auto is = [&](std::size_t d, std::size_t f, std::size_t s) { return dim == d && functions == f && size == s; };
    if (is(2, 4, 3)) of = surface_rows<2, 4, 3>;  // first degree: momentum and continuity
    if (is(3, 8, 4)) of = surface_rows<3, 8, 4>;
    if (is(2, 9, 2)) of = surface_rows<2, 9, 2>;  // second degree: momentum
    if (is(3, 27, 3)) of = surface_rows<3, 27, 3>;
    if (is(2, 4, 1)) of = surface_rows<2, 4, 1>;  // and continuity
    if (is(3, 8, 1)) of = surface_rows<3, 8, 1>;
    require(of != nullptr, "no element has such rows");
    require_shape("moments", moments, pieces, points, dim);
    require_shape("cell", cell, pieces);
    require_shape("fields", fields, pieces, functions, dim, dim + 1);
    require_shape("by_motion", by_motion, pieces, dim, dim, size);
    require_shape("leak", leak, pieces);
    require_shape("rows", rows, pieces, functions, dim, dim, size);
    for (std::size_t p = 0; p < pieces; ++p)
        require(cell.data()[p] >= 0 && static_cast<std::size_t>(cell.data()[p]) < density.shape(0),
                "a piece is in no cell of the density");
    const SurfaceRows at{points,        moments.data(), density.data(),   cell.data(),
                         normal.data(), fields.data(),  by_motion.data(), leak.data()};
    nb::gil_scoped_release release;
    of(pieces, at, rows.data());
}

nb::object py_seen_angles(const Values<const double, 2>& points, const Values<const double, 2>& vertices,
                          const Values<const std::int64_t, 2>& facets, double in_plane) {
    const std::size_t dim = vertices.shape(1), count = points.shape(0), size = vertices.shape(0);
    require(dim == 2 || dim == 3, "vertices have two or three coordinates");
    require_shape("points", points, count, dim);
    require_shape("facets", facets, facets.shape(0), dim);
    for (std::size_t k = 0; k < facets.size(); ++k)
        require(facets.data()[k] >= 0 && static_cast<std::size_t>(facets.data()[k]) < size,
                "facets name vertices that are not there");
    std::vector<double> found(count);
    {
        nb::gil_scoped_release release;
        const auto of = dim == 2 ? seen_angles<2> : seen_angles<3>;
        of(points.data(), count, vertices.data(), size, facets.data(), facets.shape(0), in_plane, found.data());
    }
    return to_numpy(std::move(found), {count});
}

}  // namespace

void bind_surface(nb::module_& module) {
    module.def("surface_rows", &py_surface_rows, "moments"_a, "density"_a, "cell"_a, "normal"_a, "fields"_a, "by_motion"_a,
               "leak"_a, "rows"_a,
               "Set `rows`, (pieces, functions, vertices, dim, components), to the rows of the flow by the motion of vertices.\n\n"
               "rows[p, a, c, j, i] = n_j sum_q moments[p, q, c] density[cell, q, a, i] - int phi_a by_motion[p, c, j, i],\n"
               "and - leak int d_j phi_a N_c in the last i, unless the components are those of momentum alone.");
    module.def("seen_angles", &py_seen_angles, "points"_a, "vertices"_a, "facets"_a, "in_plane"_a,
               "Sum of the angles of segments, or of halves of solid angles of triangles, seen from points, shape (points,).\n\n"
               "in_plane: sine of the angle between a point and the plane of a facet up to which the facet is not seen.");
}
