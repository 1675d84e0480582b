// Averaged unit nodal normals of a surface and their derivatives.
//
//     n_j = m_j s_j / |m_j s_j|,  s_j = sum over the facets at node j of their unit normal at that node
//
// (no weights; m_j an optional mask of 0 and 1 that removes the components a symmetry plane forbids). With x,a the
// tangents of a facet and P = I - n n^T: 3D dn = P (dx,1 x x,2 + x,1 x dx,2)/|x,1 x x,2|, 2D dn = P R dx,1/|x,1| where
// R turns clockwise.
#pragma once

#include <cmath>
#include <vector>

#include "block_rows.hpp"
#include "plane_frame.hpp"

namespace mortar {

// The unit normal of a facet at its node j and, if wanted, its derivative slope[c][dim i + b] = dn_c/dx_ib.
template <typename Facet>
void facet_normal(const double (*x)[Facet::dim], int j, double* normal, double (*slope)[Facet::dim * Facet::nodes]) {
    constexpr int n = Facet::nodes, dim = Facet::dim;
    double N[n], dN[2][n], turned[dim][dim * n] = {};  // derivative of the normal before it is made unit
    double length;
    if constexpr (dim == 2) {
        Facet::shape(Facet::reference[j], N, dN);
        double t[2] = {};
        for (int i = 0; i < n; ++i)
            for (int c = 0; c < 2; ++c) t[c] += dN[0][i] * x[i][c];
        length = std::hypot(t[0], t[1]);
        normal[0] = t[1] / length;
        normal[1] = -t[0] / length;
        if (!slope) return;
        for (int i = 0; i < n; ++i) {
            turned[0][2 * i + 1] = dN[0][i];
            turned[1][2 * i] = -dN[0][i];
        }
    } else {
        Facet::shape(Facet::reference[j], N, dN);
        const SurfacePoint<Facet> point(N, dN, x);
        const double *u = point.tangent[0], *v = point.tangent[1];
        cross(u, v, normal);
        length = std::sqrt(dot(normal, normal));
        for (int c = 0; c < 3; ++c) normal[c] /= length;
        if (!slope) return;
        for (int i = 0; i < n; ++i)
            for (int b = 0; b < 3; ++b) {  // e_b x (N,1 v - N,2 u)
                const int c = (b + 1) % 3, d = (b + 2) % 3;
                turned[d][3 * i + b] += dN[0][i] * v[c] - dN[1][i] * u[c];
                turned[c][3 * i + b] -= dN[0][i] * v[d] - dN[1][i] * u[d];
            }
    }
    for (int column = 0; column < dim * n; ++column) {
        double along = 0.0;
        for (int c = 0; c < dim; ++c) along += normal[c] * turned[c][column];
        for (int c = 0; c < dim; ++c) slope[c][column] = (turned[c][column] - along * normal[c]) / length;
    }
}

// The normals n (nodes x dim) and, if wanted, dn/dx in blocks of dim x dim, of the nodes that `chosen` marks or of all.
// Nodes without a facet, or whose facets cancel, have normal zero.
template <typename Facet>
std::vector<double> nodal_normals(const double* x, int n_nodes, const std::int64_t* facets, std::size_t n_facets,
                                  const double* mask, BlockRows<Facet::dim, Facet::dim>* derivative,
                                  const std::uint8_t* chosen = nullptr) {
    constexpr int n = Facet::nodes, dim = Facet::dim;
    std::vector<double> normals(static_cast<std::size_t>(n_nodes) * dim, 0.0), length(n_nodes, 0.0);
    double nodes[n][dim], unit[dim], slope[dim][dim * n];
    auto gather = [&](const std::int64_t* facet) {
        for (int i = 0; i < n; ++i)
            for (int c = 0; c < dim; ++c) nodes[i][c] = x[facet[i] * dim + c];
    };
    for (std::size_t f = 0; f < n_facets; ++f) {
        gather(facets + f * n);
        for (int j = 0; j < n; ++j) {
            facet_normal<Facet>(nodes, j, unit, nullptr);
            for (int c = 0; c < dim; ++c) normals[facets[f * n + j] * dim + c] += unit[c];
        }
    }
    for (int j = 0; j < n_nodes; ++j) {
        double* normal = normals.data() + static_cast<std::size_t>(j) * dim;
        for (int c = 0; c < dim; ++c) {
            if (mask) normal[c] *= mask[j * dim + c];
            length[j] += normal[c] * normal[c];
        }
        length[j] = std::sqrt(length[j]);
        for (int c = 0; c < dim && length[j] > 0.0; ++c) normal[c] /= length[j];
    }
    if (!derivative) return normals;

    for (std::size_t f = 0; f < n_facets; ++f) {
        gather(facets + f * n);
        int columns[n];
        for (int i = 0; i < n; ++i) columns[i] = static_cast<int>(facets[f * n + i]);
        for (int j = 0; j < n; ++j) {
            const int node = columns[j];
            if (length[node] == 0.0 || (chosen && !chosen[node])) continue;
            facet_normal<Facet>(nodes, j, unit, slope);
            const double* normal = normals.data() + static_cast<std::size_t>(node) * dim;
            double* block = derivative->add({&node, 1}, columns);
            for (int column = 0; column < dim * n; ++column) {
                double along = 0.0;
                for (int c = 0; c < dim; ++c) {
                    if (mask) slope[c][column] *= mask[node * dim + c];
                    along += normal[c] * slope[c][column];
                }
                for (int c = 0; c < dim; ++c)
                    block[c * dim * n + column] = (slope[c][column] - along * normal[c]) / length[node];
            }
        }
    }
    return normals;
}

}  // namespace mortar
