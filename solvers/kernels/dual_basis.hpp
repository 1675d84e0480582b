// The dual shape functions of one slave facet, from the part of it that is integrated.
//
// Phi_j = sum_k A_jk N~_k with A = D M^-1, D = diag(int N~_j), M_jk = int N~_j N~_k over the cells of all pairs of the
// facet (the consistent dual basis; Cichosz & Bischoff 2011, Popp, Seitz, Gee & Wall 2013). Then, with the same cells,
//     int Phi_j N~_k = delta_jk D_j   and   sum_j Phi_j = 1.
// On a sliver M is nearly singular and Phi, though bounded in the mean, would amplify any roughness of the gap. Below a
// covered fraction `whole` A is therefore blended into the identity, which it is below `none`: standard functions with
// lumped D. The blend is smooth and differentiated, and keeps sum_j Phi_j = 1 and int Phi_j = D_j, hence constant
// pressures and momentum; only the biorthogonality is given up there.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

namespace mortar {

// Second-order facets degrade with a higher power of the size of the covered part.
template <typename Facet>
struct Coverage {
    // Share of a facet that a master covers from which on dual functions are those of the covered part.
    static constexpr double whole = Facet::order == 1 ? 1e-2 : 0.25;
    // Share up to which they are the shape functions. Between both they change smoothly.
    static constexpr double none = Facet::order == 1 ? 1e-3 : 0.05;
};

// The inverse of a small symmetric matrix, scaled to unit diagonal first (functions of nodes far from the covered part
// are small there). False if it is singular to working precision.
template <int n>
bool invert(const double (*matrix)[n], double (*inverse)[n]) {
    double scale[n], rows[n][2 * n];
    for (int i = 0; i < n; ++i) {
        if (!(matrix[i][i] > 0.0)) return false;
        scale[i] = 1.0 / std::sqrt(matrix[i][i]);
    }
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            rows[i][j] = scale[i] * matrix[i][j] * scale[j];
            rows[i][n + j] = i == j;
        }
    for (int column = 0; column < n; ++column) {
        int pivot = column;
        for (int i = column + 1; i < n; ++i)
            if (std::abs(rows[i][column]) > std::abs(rows[pivot][column])) pivot = i;
        if (!(std::abs(rows[pivot][column]) > 1e-13)) return false;
        for (int j = 0; j < 2 * n; ++j) std::swap(rows[pivot][j], rows[column][j]);
        const double factor = 1.0 / rows[column][column];
        for (int j = 0; j < 2 * n; ++j) rows[column][j] *= factor;
        for (int i = 0; i < n; ++i) {
            if (i == column) continue;
            const double multiple = rows[i][column];
            for (int j = 0; j < 2 * n; ++j) rows[i][j] -= multiple * rows[column][j];
        }
    }
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) inverse[i][j] = scale[i] * rows[i][n + j] * scale[j];
    return true;
}

template <typename Facet>
struct DualBasis {
    static constexpr int n = Facet::nodes;
    double A[n][n] = {};          // with the blend
    double full[n][n] = {};       // D M^-1
    double inverse[n][n] = {};    // M^-1
    double D[n] = {};
    double blend = 0.0, blend_slope = 0.0;  // and its slope in the covered fraction

    DualBasis(const double (*M)[n], double cover) {
        constexpr double whole = Coverage<Facet>::whole, none = Coverage<Facet>::none;
        const double t = std::clamp((whole - cover) / (whole - none), 0.0, 1.0);
        blend = t * t * (3.0 - 2.0 * t);
        blend_slope = -6.0 * t * (1.0 - t) / (whole - none);
        for (int j = 0; j < n; ++j)
            for (int k = 0; k < n; ++k) D[j] += M[j][k];

        if (t == 1.0 || !invert<n>(M, inverse)) {
            blend = 1.0;
            blend_slope = 0.0;
            for (auto& row : inverse) std::fill(row, row + n, 0.0);
        }
        for (int j = 0; j < n; ++j)
            for (int k = 0; k < n; ++k) {
                full[j][k] = D[j] * inverse[j][k];
                A[j][k] = (1.0 - blend) * full[j][k] + blend * (j == k);
            }
    }
};

}  // namespace mortar
