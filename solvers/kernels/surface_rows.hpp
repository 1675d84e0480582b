// Rows of the flow by the motion of the surface: the sums over pieces of `solvers/fluid/terms/shape_derivatives/cut_shape.py`.
#pragma once

#include <cstddef>
#include <cstdint>

// Arrays of momentum, of continuity, or of both, whose components are last.
struct SurfaceRows {
    std::size_t points;
    const double* moments;     // (pieces, q, c): int L_q N_c
    const double* density;     // (cells, q, a, i): integrand at the points of cells for each test function
    const std::int64_t* cell;  // (pieces,): row of `density`
    const double* normal;      // (pieces, j)
    const double* fields;      // (pieces, a, c, 1 + j): int phi_a N_c, int grad phi_a N_c
    const double* by_motion;   // (pieces, c, j, i): of the traction and the leak through the piece
    const double* leak;        // (pieces,): (u - g) . n
};

// rows (pieces, a, c, j, i) = n_j sum_q moments density - sum_c' int phi_a N_c' by_motion, and in the last i, unless
// there is momentum alone, that of the continuity equation, - leak int d_j phi_a N_c.
template <int dim, int functions, int size>
void surface_rows(std::size_t pieces, const SurfaceRows& at, double* rows) {
    constexpr int vertices = dim, area = functions * size;
    for (std::size_t p = 0; p < pieces; ++p) {
        const double* moment = at.moments + p * at.points * vertices;
        const double* integrand = at.density + static_cast<std::size_t>(at.cell[p]) * at.points * area;
        double bulk[vertices][area] = {};
        for (std::size_t q = 0; q < at.points; ++q)
            for (int c = 0; c < vertices; ++c)
                for (int e = 0; e < area; ++e) bulk[c][e] += moment[q * vertices + c] * integrand[q * area + e];
        const double* n = at.normal + p * dim;
        const double* motion = at.by_motion + p * vertices * dim * size;
        for (int a = 0; a < functions; ++a) {
            const double* field = at.fields + (p * functions + a) * vertices * (1 + dim);
            double phi = 0.0;
            for (int c = 0; c < vertices; ++c) phi += field[c * (1 + dim)];
            for (int c = 0; c < vertices; ++c)
                for (int j = 0; j < dim; ++j) {
                    double* entry = rows + (((p * functions + a) * vertices + c) * dim + j) * size;
                    for (int i = 0; i < size; ++i)
                        entry[i] = bulk[c][a * size + i] * n[j] - phi * motion[(c * dim + j) * size + i];
                    if (size != dim) entry[size - 1] -= at.leak[p] * field[c * (1 + dim) + 1 + j];
                }
        }
    }
}
