// The derivatives of what one slave facet contributes (formulas at the top of facet_assembly.hpp): contracted in the
// directions of each pair, carried over to the nodes, added up over the pairs.
#pragma once

#include "facet_assembly.hpp"

namespace mortar {

// row[column] += g carried over to the columns of the facet: slave normals, slave nodes, masters.
template <typename PairType, typename Directions>
void carry_over(const PairType& pair, const Directions& g, int n, double* row) {
    using Geometry = decltype(pair.geometry);
    if constexpr (requires { Geometry::slave_columns; }) {
        constexpr int columns = Geometry::columns, slave_columns = Geometry::slave_columns;
        double factor[Directions::packs * pack_size], sum[Gradient<columns>::packs * pack_size];
        std::memcpy(factor, g.pack, sizeof factor);
        Gradient<columns> total{};
        for (int p = 0; p < static_cast<int>(std::size(pair.geometry.slopes)); ++p)
            total.add(factor[p], pair.geometry.slopes[p]);
        std::memcpy(sum, total.pack, sizeof sum);
        for (int c = 0; c < slave_columns; ++c) row[3 * n + c] += sum[c];
        for (std::size_t l = 0; l < std::size(pair.place); ++l)
            for (int c = 0; c < 3; ++c) row[3 * (2 * n + pair.place[l]) + c] += sum[slave_columns + 3 * l + c];
    } else {  // in 2D the directions are normals, slave nodes and master nodes themselves
        for (int c = 0; c < 4 * n; ++c) row[c] += g[c];
        for (std::size_t l = 0; l < std::size(pair.place); ++l)
            for (int c = 0; c < 2; ++c) row[2 * (2 * n + pair.place[l]) + c] += g[4 * n + 2 * l + c];
    }
}

template <typename Slave, typename Master, bool derivatives>
void FacetAssembly<Slave, Master, derivatives>::sum_derivatives(const DualBasis<Slave>& basis) {
    const int n_masters = static_cast<int>(masters_.size()), columns = dim * (2 * n + n_masters);
    const double fraction = 1.0 - basis.blend;
    d_diagonal_.assign(n * columns, 0.0);
    d_gap_.assign(n * columns, 0.0);
    d_y_.assign(n * dim * columns, 0.0);
    d_force_.assign((n + n_masters) * dim * columns, 0.0);

    double q[n] = {}, gap_0[n] = {}, z[n][dim] = {}, y_0[n][dim] = {}, y[n][dim] = {};
    for (int j = 0; j < n; ++j)
        for (int k = 0; k < n; ++k) {
            q[j] += basis.inverse[j][k] * gap_[k];
            gap_0[j] += basis.full[j][k] * gap_[k];
        }
    if (in_.z)
        for (int j = 0; j < n; ++j)
            for (int c = 0; c < dim; ++c) {
                z[j][c] = in_.z[slave_nodes_[j] * dim + c];
                for (int k = 0; k < n; ++k) {
                    y_0[k][c] += basis.full[j][k] * z[j][c];
                    y[k][c] += basis.A[j][k] * z[j][c];
                }
            }

    using Directions = Gradient<directions>;
    for (const Pair& pair : pairs_) {
        const auto& integrals = pair.integrals;
        Directions blend{}, diagonal[n] = {}, mass_q[n] = {};
        blend.add(basis.blend_slope, integrals.cover.gradient);
        for (int k = 0; k < n; ++k)
            for (int j = 0; j < n; ++j) {
                const Directions& mass = integrals.mass_at(k, j).gradient;
                diagonal[k] += mass;
                mass_q[k].add(q[j], mass);
            }
        for (int j = 0; j < n; ++j) {
            Directions g{};
            g.add(fraction * q[j], diagonal[j]);
            g.add(gap_[j] - gap_0[j], blend);
            for (int k = 0; k < n; ++k) {
                g.add(basis.A[j][k], integrals.gap[k].gradient);
                g.add(-fraction * basis.full[j][k], mass_q[k]);
            }
            double* row = d_gap_.data() + j * columns;
            carry_over(pair, diagonal[j], n, d_diagonal_.data() + j * columns);
            carry_over(pair, g, n, row);
            if constexpr (dim == 3)
                for (int k = 0; k < n; ++k) {
                    const double a = basis.A[j][k];
                    for (int c = 0; c < 3 * n; ++c) row[c] += a * integrals.gap_normal[k][c];
                    for (int c = 0; c < 3 * n; ++c) row[3 * n + c] += a * integrals.gap_slave[k][c];
                    for (int l = 0; l < m; ++l)
                        for (int c = 0; c < 3; ++c)
                            row[3 * (2 * n + pair.place[l]) + c] += a * integrals.gap_master[k][3 * l + c];
                }
        }
        if (!in_.z) continue;
        for (int c = 0; c < dim; ++c) {
            Directions rest[n] = {};  // dD z - dM y0
            for (int k = 0; k < n; ++k) {
                rest[k].add(z[k][c], diagonal[k]);
                for (int j = 0; j < n; ++j) rest[k].add(-y_0[j][c], integrals.mass_at(k, j).gradient);
            }
            for (int k = 0; k < n; ++k) {
                Directions d_y{};
                d_y.add(z[k][c] - y_0[k][c], blend);
                for (int j = 0; j < n; ++j) d_y.add(fraction * basis.inverse[k][j], rest[j]);
                carry_over(pair, d_y, n, d_y_.data() + (k * dim + c) * columns);
            }
            for (int l = 0; l < m; ++l) {
                Directions force{};
                for (int k = 0; k < n; ++k) force.add(y[k][c], integrals.coupling[k][l].gradient);
                carry_over(pair, force, n, d_force_.data() + ((n + pair.place[l]) * dim + c) * columns);
            }
        }
    }

    // the factor |g_1 x g_2|, and the masters' force through y
    auto finish = [&](double* row, double value) {
        if constexpr (dim == 3) {
            for (int c = 0; c < columns; ++c) row[c] *= scale_;
            for (int c = 0; c < 3 * n; ++c) row[3 * n + c] += value * scale_slopes_[c];
        }
    };
    for (int j = 0; j < n; ++j) {
        double gap = 0.0;
        for (int k = 0; k < n; ++k) gap += basis.A[j][k] * gap_[k];
        finish(d_gap_.data() + j * columns, gap);
        finish(d_diagonal_.data() + j * columns, basis.D[j]);
    }
    if (in_.z)
        for (int c = 0; c < dim; ++c) {
            for (int j = 0; j < n; ++j)
                for (int column = 0; column < columns; ++column)
                    d_force_[(j * dim + c) * columns + column] = -z[j][c] * d_diagonal_[j * columns + column];
            for (int l = 0; l < n_masters; ++l) {
                double *row = d_force_.data() + ((n + l) * dim + c) * columns, force = 0.0;
                for (int k = 0; k < n; ++k) {
                    const double coupling = coupling_[k * n_masters + l];
                    const double* d_y = d_y_.data() + (k * dim + c) * columns;
                    force += y[k][c] * coupling;
                    for (int column = 0; column < columns; ++column) row[column] += coupling * d_y[column];
                }
                finish(row, force);
            }
        }

    std::vector<int> all(slave_nodes_, slave_nodes_ + n);
    for (int master : masters_) all.push_back(in_.n_slave + master);
    const std::span<const int> slaves(slave_nodes_, n);
    auto emit = [&](auto& sums, std::span<const int> rows, std::span<const int> nodes, const double* local,
                    std::size_t height, int from) {
        double* block = sums.add(rows, nodes);
        for (std::size_t r = 0; r < height; ++r)
            block = std::copy_n(local + r * columns + from, nodes.size() * dim, block);
    };
    emit(sums_.d_gap, slaves, all, d_gap_.data(), n, dim * n);
    emit(sums_.d_gap_normal, slaves, slaves, d_gap_.data(), n, 0);
    emit(sums_.d_diagonal, slaves, all, d_diagonal_.data(), n, dim * n);
    if (in_.z) emit(sums_.d_force, all, all, d_force_.data(), all.size() * dim, dim * n);
    if constexpr (dim == 2) {
        emit(sums_.d_diagonal_normal, slaves, slaves, d_diagonal_.data(), n, 0);
        if (in_.z) emit(sums_.d_force_normal, all, slaves, d_force_.data(), all.size() * dim, 0);
    }
}

}  // namespace mortar
