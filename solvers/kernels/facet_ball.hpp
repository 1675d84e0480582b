// The ball around a facet, with the normal at its centre: whether two facets are near each other and face each other.
#pragma once

#include <algorithm>
#include <cmath>

#include "plane_frame.hpp"
#include "points_line.hpp"

namespace mortar {

// Centre, unit normal there and radius of a facet.
template <typename Facet>
struct FacetBall {
    double centre[3] = {}, normal[3] = {}, radius = 0.0;

    explicit FacetBall(const double (*x)[Facet::dim]) {
        constexpr int dim = Facet::dim;
        if constexpr (dim == 3) {
            const Shape<Facet> shape(Facet::centre);
            const SurfacePoint<Facet> point(shape.N, shape.dN, x);
            std::copy_n(point.x, 3, centre);
            cross(point.tangent[0], point.tangent[1], normal);
        } else {
            const FieldPoint<Facet, double> point(x, Facet::centre[0]);
            std::copy_n(point.value, 2, centre);
            normal[0] = point.slope[1];
            normal[1] = -point.slope[0];
        }
        const double length = std::sqrt(dot(normal, normal));
        for (double& component : normal) component /= length;
        for (int i = 0; i < Facet::nodes; ++i) {
            double square = 0.0;
            for (int c = 0; c < dim; ++c) square += (x[i][c] - centre[c]) * (x[i][c] - centre[c]);
            radius = std::max(radius, std::sqrt(square));
        }
    }
    template <typename Other>
    bool sees(const FacetBall<Other>& other, double reach, double facing) const {
        const double r[3] = {other.centre[0] - centre[0], other.centre[1] - centre[1], other.centre[2] - centre[2]};
        return dot(normal, other.normal) < facing && std::sqrt(dot(r, r)) <= radius + other.radius + reach;
    }
};

}  // namespace mortar
