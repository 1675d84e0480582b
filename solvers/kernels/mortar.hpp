// The mortar integrals between two surfaces and their derivatives: from arrays to arrays.
//
// Dual mortar method: Popp, Gee & Wall (2009) in 2D, Popp, Gitterle, Gee & Wall (2010) in 3D; the exact derivatives
// they derive by hand are obtained by automatic differentiation. Facets of the slave are independent of each other.
#pragma once

#include "facet_assembly.hpp"
#include "facet_derivatives.hpp"
#include "hidden_masters.hpp"
#include "normals.hpp"

namespace mortar {

template <typename Slave, typename Master, bool derivatives>
void sum_facets(const MortarInput& input, MortarSums<Slave::dim>& sums) {
    FacetAssembly<Slave, Master, derivatives> assembly(input, sums);
    for (std::size_t first = 0, last; first < input.n_pairs; first = last) {
        for (last = first + 1; last < input.n_pairs && input.pairs[2 * last] == input.pairs[2 * first];) ++last;
        assembly.add(first, last);
    }
}

// Calls use(Facet{}) for the facet type of this name in this dimension; false if there is none.
template <typename Use>
bool with_facet_type(const char* name, int dim, Use&& use) {
    bool found = false;
    auto try_type = [&](auto facet) {
        using Facet = decltype(facet);
        if (found || Facet::dim != dim || std::string_view(name) != Facet::name) return;
        found = true;
        use(facet);
    };
    try_type(Line2{});
    try_type(Line3{});
    try_type(Tri3{});
    try_type(Tri6{});
    try_type(Quad4{});
    try_type(Quad9{});
    return found;
}

}  // namespace mortar
