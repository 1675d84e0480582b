// Python names of the mortar kernel: nodal_normals, basis_transformation, mortar.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <limits>
#include <optional>

#include "bindings.hpp"
#include "mortar.hpp"

using namespace mortar;

namespace {

using Reals = Values<const double, 2>;
using Facets = Values<const std::int64_t, 2>;
using Flags = Values<const std::uint8_t, 1>;
using Direction = Values<const double, 1>;
using Pairs = Values<const std::int32_t, 2>;

using ::to_numpy;

// (data, indices, indptr), as scipy.sparse.csr_matrix takes it.
nb::object to_numpy(Csr csr) {
    const std::size_t entries = csr.data.size(), rows = csr.indptr.size();
    return nb::make_tuple(to_numpy(std::move(csr.data), {entries}), to_numpy(std::move(csr.indices), {entries}),
                          to_numpy(std::move(csr.indptr), {rows}));
}

template <typename Use>
void dispatch(const std::string& facet_type, std::size_t dim, Use&& use) {
    require(with_facet_type(facet_type.c_str(), static_cast<int>(dim), use),
            "no facet type '" + facet_type + "' in " + std::to_string(dim) +
                "D (2D: line2, line3; 3D: tri3, tri6, quad4, quad9)");
}

void check_surface(const std::string& name, const Reals& x, const Facets& facets, int nodes) {
    require(facets.shape(1) == static_cast<std::size_t>(nodes),
            name + " facets have " + std::to_string(facets.shape(1)) + " nodes, their type has " +
                std::to_string(nodes));
    require(x.shape(0) <= std::numeric_limits<std::int32_t>::max() / 8, name + ": too many nodes");
    for (std::size_t i = 0; i < facets.size(); ++i)
        require(facets.data()[i] >= 0 && facets.data()[i] < static_cast<std::int64_t>(x.shape(0)),
                name + " facets name node " + std::to_string(facets.data()[i]) + ", there are " +
                    std::to_string(x.shape(0)));
}

void check_nodal(const std::string& name, const Reals& values, const Reals& x) {
    require(values.shape(0) == x.shape(0) && values.shape(1) == x.shape(1),
            name + " must have the shape of the positions, (" + std::to_string(x.shape(0)) + ", " +
                std::to_string(x.shape(1)) + ")");
}

nb::object py_nodal_normals(const Reals& x, const Facets& facets, const std::string& facet_type,
                            const std::optional<Reals>& mask, bool derivatives, const std::optional<Flags>& chosen) {
    nb::object result;
    dispatch(facet_type, x.shape(1), [&](auto facet) {
        using Facet = decltype(facet);
        check_surface("surface", x, facets, Facet::nodes);
        if (mask) check_nodal("mask", *mask, x);
        require(!chosen || chosen->shape(0) == x.shape(0), "chosen must have one entry for each node");
        const int n_nodes = static_cast<int>(x.shape(0));
        BlockRows<Facet::dim, Facet::dim> blocks;
        std::vector<double> normals;
        Csr slopes;
        {
            nb::gil_scoped_release release;
            normals = nodal_normals<Facet>(x.data(), n_nodes, facets.data(), facets.shape(0),
                                           mask ? mask->data() : nullptr, derivatives ? &blocks : nullptr,
                                           chosen ? chosen->data() : nullptr);
            if (derivatives) slopes = blocks.sum(n_nodes, n_nodes);
        }
        result = nb::make_tuple(to_numpy(std::move(normals), {x.shape(0), x.shape(1)}),
                                derivatives ? to_numpy(std::move(slopes)) : nb::none());
    });
    return result;
}

struct MortarResult {
    nb::object D, gap, area, used, force, M, W, dD, dD_dn, dgap, dgap_dn, dforce, dforce_dn;
};

template <int dim>
MortarResult to_result(MortarSums<dim> sums, int n_slave, int n_master, bool derivatives, bool forces, bool own) {
    const std::size_t pairs = sums.used.size(), nodes = sums.gap.size(), facets = sums.area.size(), dofs = sums.force.size();
    const int all = n_slave + n_master;
    auto sparse = [](const auto& blocks, int rows, int columns, bool wanted) -> nb::object {
        if (!wanted) return nb::none();
        Csr csr;
        {
            nb::gil_scoped_release release;
            csr = blocks.sum(rows, columns);
        }
        return to_numpy(std::move(csr));
    };
    return {.D = to_numpy(std::move(sums.diagonal), {nodes}),
            .gap = to_numpy(std::move(sums.gap), {nodes}),
            .area = to_numpy(std::move(sums.area), {facets}),
            .used = to_numpy(std::move(sums.used), {pairs}),
            .force = to_numpy(std::move(sums.force), {dofs}),
            .M = sparse(sums.coupling, n_slave, n_master, true),
            .W = sparse(sums.own_coupling, n_slave, n_slave, own),
            .dD = sparse(sums.d_diagonal, n_slave, all, derivatives),
            .dD_dn = sparse(sums.d_diagonal_normal, n_slave, n_slave, derivatives),
            .dgap = sparse(sums.d_gap, n_slave, all, derivatives),
            .dgap_dn = sparse(sums.d_gap_normal, n_slave, n_slave, derivatives),
            .dforce = sparse(sums.d_force, all, all, derivatives && forces),
            .dforce_dn = sparse(sums.d_force_normal, all, n_slave, derivatives && forces)};
}

MortarResult py_mortar(const Reals& xs, const Facets& fs, const std::string& type_s, const Reals& xm, const Facets& fm,
                       const std::string& type_m, const Reals& normals, const Pairs& pairs,
                       const std::optional<Reals>& z, const std::string& method, bool derivatives, double reach, double near, double facing,
                       const std::optional<Flags>& kept, const std::optional<Direction>& along, bool rise, bool own) {
    require(method == "segments" || method == "elements", "method must be 'segments' or 'elements'");
    require(xs.shape(1) == xm.shape(1), "slave and master must have the same dimension");
    require(pairs.shape(1) == 2, "pairs must have shape (p, 2)");
    require(!kept || kept->shape(0) == pairs.shape(0), "kept must have one entry for each pair");
    require(!along || along->shape(0) == xs.shape(1), "along must have as many entries as there are dimensions");
    require(along || !rise, "rise needs along");
    check_nodal("normals", normals, xs);
    if (z) check_nodal("z", *z, xs);
    const int dim = static_cast<int>(xs.shape(1));
    const int n_slave = static_cast<int>(xs.shape(0)), n_master = static_cast<int>(xm.shape(0));
    for (std::size_t p = 0; p < pairs.shape(0); ++p) {
        const std::int32_t *pair = pairs.data() + 2 * p;
        require(pair[0] >= 0 && pair[0] < static_cast<std::int64_t>(fs.shape(0)) && pair[1] >= 0 &&
                    pair[1] < static_cast<std::int64_t>(fm.shape(0)),
                "pair " + std::to_string(p) + " names a facet that does not exist");
        require(p == 0 || pair[-2] <= pair[0], "pairs must be sorted by slave facet");
    }
    const MortarInput input{xs.data(), xm.data(), normals.data(), z ? z->data() : nullptr, fs.data(), fm.data(),
                            n_slave,   n_master,  pairs.data(),   pairs.shape(0),          method == "elements", reach, near, facing,
                            kept ? kept->data() : nullptr, along ? along->data() : nullptr, rise};
    MortarResult result;
    dispatch(type_s, dim, [&](auto slave) {
        using Slave = decltype(slave);
        dispatch(type_m, dim, [&](auto master) {
            using Master = decltype(master);
            if constexpr (Slave::dim == Master::dim) {
                check_surface("slave", xs, fs, Slave::nodes);
                check_surface("master", xm, fm, Master::nodes);
                MortarSums<Slave::dim> sums(n_slave, n_master, fs.shape(0), pairs.shape(0));
                {
                    nb::gil_scoped_release release;
                    if (derivatives)
                        sum_facets<Slave, Master, true>(input, sums);
                    else
                        sum_facets<Slave, Master, false>(input, sums);
                }
                result = to_result(std::move(sums), n_slave, n_master, derivatives, z.has_value(), own);
            }
        });
    });
    return result;
}

// T with N~ = N T, and its inverse: the identity but for tri6.
nb::object py_basis_transformation(const Facets& facets, const std::string& facet_type, int n_nodes) {
    require(facet_type != "tri6" || facets.shape(1) == 6, "tri6 facets have 6 nodes");
    std::vector<std::int64_t> edge(n_nodes * 2, -1);  // the corners next to a mid-edge node
    if (facet_type == "tri6")
        for (std::size_t f = 0; f < facets.shape(0); ++f)
            for (int i = 0; i < 3; ++i) {
                const std::int64_t* nodes = facets.data() + 6 * f;
                require(nodes[3 + i] >= 0 && nodes[3 + i] < n_nodes, "a facet names a node that does not exist");
                edge[2 * nodes[3 + i]] = nodes[i];
                edge[2 * nodes[3 + i] + 1] = nodes[(i + 1) % 3];
            }
    constexpr double a = tri6_blend;
    auto matrix = [&](double corner, double middle) {
        Csr csr;
        csr.indptr.push_back(0);
        for (int j = 0; j < n_nodes; ++j) {
            csr.indices.push_back(j);
            csr.data.push_back(edge[2 * j] < 0 ? 1.0 : middle);
            if (edge[2 * j] >= 0)
                for (int end = 0; end < 2; ++end) {
                    csr.indices.push_back(static_cast<std::int32_t>(edge[2 * j + end]));
                    csr.data.push_back(corner);
                }
            csr.indptr.push_back(static_cast<std::int32_t>(csr.indices.size()));
        }
        return to_numpy(std::move(csr));
    };
    return nb::make_tuple(matrix(a, 1.0 - 2.0 * a), matrix(-a / (1.0 - 2.0 * a), 1.0 / (1.0 - 2.0 * a)));
}

}  // namespace

void bind_mortar(nb::module_& module) {
    nb::class_<MortarResult>(module, "MortarResult",
                             "Mortar integrals of a slave surface against a master surface.\n\n"
                             "Sparse matrices are (data, indices, indptr), as scipy.sparse.csr_matrix takes them; None "
                             "if not asked for.\nColumns of positions: slave dof dim*node + c, then master dof dim*(ns "
                             "+ node) + c; columns of normals (_dn): dim*node + c.")
        .def_ro("D", &MortarResult::D, "diagonal of D: integral of the slave's basis over what is covered, (ns,)")
        .def_ro("gap", &MortarResult::gap, "weighted gap, positive where open, (ns,)")
        .def_ro("area", &MortarResult::area, "covered area (2D: length) of each slave facet, (k,)")
        .def_ro("used", &MortarResult::used, "which pairs took part, (p,) of 0 and 1")
        .def_ro("force", &MortarResult::force, "slave -D z, master M^T z, (dim*(ns + nm),); zero without z")
        .def_ro("M", &MortarResult::M, "coupling matrix, (ns, nm)")
        .def_ro("W", &MortarResult::W, "integrals of multiplier functions times the slave's basis, (ns, ns): D but on slivers")
        .def_ro("dD", &MortarResult::dD, "derivative of D, (ns, dim*(ns + nm))")
        .def_ro("dD_dn", &MortarResult::dD_dn, "the same with respect to the nodal normals; empty in 3D")
        .def_ro("dgap", &MortarResult::dgap, "derivative of gap, (ns, dim*(ns + nm))")
        .def_ro("dgap_dn", &MortarResult::dgap_dn, "the same with respect to the nodal normals, (ns, dim*ns)")
        .def_ro("dforce", &MortarResult::dforce, "derivative of force at fixed z, square")
        .def_ro("dforce_dn", &MortarResult::dforce_dn, "the same with respect to the nodal normals; empty in 3D");

    module.def("nodal_normals", &py_nodal_normals, "x"_a, "facets"_a, "facet_type"_a, "mask"_a = nb::none(),
               "derivatives"_a = true, "chosen"_a = nb::none(),
               "Averaged unit nodal normals (ns, dim) and dn/dx as (data, indices, indptr) or None.\n\n"
               "x: positions (ns, dim); facets: (k, nodes), oriented outward; mask: (ns, dim) of 0 and 1, components "
               "to drop before normalising; chosen: (ns,) of 0 and 1, nodes whose derivatives are wanted.");
    module.def("basis_transformation", &py_basis_transformation, "facets"_a, "facet_type"_a, "n_nodes"_a,
               "T and its inverse, (ns, ns), each as (data, indices, indptr); the identity but for tri6.\n\n"
               "D, M and gap belong to the slave basis N~ = N T: positions x = T x~, so a slave force on the nodes is "
               "T^-T times the rows here.");
    module.def("mortar", &py_mortar, "xs"_a, "fs"_a, "facet_type_s"_a, "xm"_a, "fm"_a, "facet_type_m"_a, "normals"_a,
               "pairs"_a, "z"_a = nb::none(), nb::kw_only(), "method"_a = "segments", "derivatives"_a = true,
               "reach"_a = std::numeric_limits<double>::infinity(), "near"_a = std::numeric_limits<double>::infinity(), "facing"_a = -0.2,
               "kept"_a = nb::none(), "along"_a = nb::none(), "rise"_a = false, "own"_a = false,
               "Mortar integrals between a slave and a master surface.\n\n"
               "xs (ns, dim), xm (nm, dim): current positions; fs, fm: facets, oriented outward, of types line2, line3 "
               "(2D), tri3, tri6, quad4, quad9 (3D), VTK node order; normals (ns, dim) of the slave; pairs (p, 2): "
               "slave and master facets that may meet, sorted by slave facet, all pairs of a slave facet in one call; "
               "z (ns, dim): multipliers for the force; method: 'segments' or 'elements' (fixed points on the slave "
               "facet); reach: facets farther apart than this do not see each other; near: slave facets to which no master is as near as "
               "this are left out; facing: facets see each other if the product of their unit normals is below; kept "
               "(p,) of 0 and 1: pairs for which none of these three is asked; along (dim,): unit vector along which gaps are measured "
               "instead of the normals; rise: instead of gaps, by how much those along the normals grow as the masters move in that direction; "
               "own: also compute W.");
}
