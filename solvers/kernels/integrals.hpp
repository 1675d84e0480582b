// The integrals of one pair over its integration points, differentiated in the pair's own directions.
//
//     mass_kj = int N~_k N~_j,   coupling_kl = int N~_k N^m_l,   gap_k = int N~_k g,   g = n_h.(x_m - x_s)
//
// with N~ the slave's basis (transformed for tri6), n_h = sum_i N_i n_i normalised again, x_m and x_s the points of
// both facets on one line of projection (Popp, Gitterle, Gee & Wall 2010). In 3D lengths are those of the plane's
// coordinates; the factor |g_1 x g_2| comes in later (facet_assembly.hpp).
#pragma once

#include <cmath>

#include "points_line.hpp"
#include "points_plane.hpp"

namespace mortar {

template <typename Slave, typename Master>
constexpr int pair_directions = [] {
    if constexpr (Slave::dim == 3)
        return plane_directions<Slave, Master>;
    else
        return line_directions<Slave, Master>;
}();

template <typename Slave, typename Master, typename T>
using PairGeometry =
    std::conditional_t<Slave::dim == 3, PlanePair<Slave, Master, T>, LinePair<Slave, Master, T>>;

// Nodes of one facet: positions, and the nodal normals if it is a slave. Its gap may be measured along another, fixed
// direction.
template <typename Facet>
struct FacetNodes {
    double x[Facet::nodes][Facet::dim], normal[Facet::nodes][Facet::dim];
    const double* along = nullptr;
    bool rise = false;  // instead of the gap, by how much it grows as the master moves in that direction
};

// m.e / (m.n) with the master's normal m = x_m,1 x x_m,2 at a point in 3D, and its derivatives; nothing without e.
template <typename Master>
struct MasterRise {
    double value = 0.0, turn[3] = {}, slope[2] = {}, by_node[Master::nodes][3] = {};  // by n, by xi, by the nodes

    template <typename T>
    MasterRise(const double* e, const double* n, const SurfacePoint<Master>& xm,
               const FacetNodes<Master>& nodes, const PointOn<Master, T>& at) {
        if (!e) return;
        double m[3], by_m[3], along[2][3];
        cross(xm.tangent[0], xm.tangent[1], m);
        const double inverse = 1.0 / dot(m, n);
        value = dot(m, e) * inverse;
        for (int c = 0; c < 3; ++c) {
            by_m[c] = (e[c] - value * n[c]) * inverse;
            turn[c] = -value * inverse * m[c];
        }
        cross(xm.tangent[1], by_m, along[0]);  // by each tangent
        cross(by_m, xm.tangent[0], along[1]);
        for (int l = 0; l < Master::nodes; ++l)
            for (int c = 0; c < 3; ++c) by_node[l][c] = at.dN[0][l] * along[0][c] + at.dN[1][l] * along[1][c];

        using Local = Dual<2>;
        Local xi[2], N[Master::nodes], dN[2][Master::nodes];
        for (int a = 0; a < 2; ++a) xi[a] = Local::variable(value_of(at.xi[a]), a);
        Master::shape(xi, N, dN);
        for (int a = 0; a < 2; ++a)
            for (int b = 0; b < 2; ++b)
                for (int l = 0; l < Master::nodes; ++l) slope[a] += dN[b][l].gradient[a] * dot(along[b], nodes.x[l]);
    }
};

template <typename Slave, typename Master, typename T>
struct PairIntegrals {
    static constexpr int n = Slave::nodes, m = Master::nodes, dim = Slave::dim;
    T mass[n][n] = {}, coupling[n][m] = {}, gap[n] = {};  // of mass the upper triangle
    T cover = 0.0;                                        // share of the slave's reference domain
    // 3D: the gap's derivative with respect to nodes and normals where they enter g directly, not through the points
    static constexpr int direct = dim == 3 && is_dual<T> ? n : 0;
    double gap_slave[direct + 1][3 * n] = {}, gap_normal[direct + 1][3 * n] = {}, gap_master[direct + 1][3 * m] = {};

    const T& mass_at(int k, int j) const { return k <= j ? mass[k][j] : mass[j][k]; }

    void add(const T* test, const T* master, const T& weight, const T& g) {
        for (int k = 0; k < n; ++k) {
            const T weighted = test[k] * weight;
            for (int j = k; j < n; ++j) add_product(mass[k][j], weighted, test[j]);
            for (int l = 0; l < m; ++l) add_product(coupling[k][l], weighted, master[l]);
            add_product(gap[k], weighted, g);
        }
    }

    void add(const PointOn<Slave, T>& on_slave, const PointOn<Master, T>& on_master, const T& weight,
             const FacetNodes<Slave>& slave, const FacetNodes<Master>& master) {
        const SurfacePoint<Slave> xs(on_slave.N, on_slave.dN, slave.x);
        const SurfacePoint<Slave> field(on_slave.N, on_slave.dN, slave.normal);
        const SurfacePoint<Master> xm(on_master.N, on_master.dN, master.x);
        const double length = std::sqrt(dot(field.x, field.x));
        double normal[3] = {field.x[0] / length, field.x[1] / length, field.x[2] / length};
        const double r[3] = {xm.x[0] - xs.x[0], xm.x[1] - xs.x[1], xm.x[2] - xs.x[2]};
        const MasterRise<Master> rise(slave.rise ? slave.along : nullptr, normal, xm, master, on_master);
        if (slave.along && !slave.rise) std::copy_n(slave.along, 3, normal);
        const double g = slave.rise ? rise.value : dot(normal, r);
        double turn[3] = {};  // dg/dn_h
        if (slave.rise)
            for (int c = 0; c < 3; ++c) turn[c] = (rise.turn[c] - dot(rise.turn, normal) * normal[c]) / length;
        else if (!slave.along)
            for (int c = 0; c < 3; ++c) turn[c] = (r[c] - g * normal[c]) / length;

        T test[n], N_master[m], gap_point = g;
        for (int k = 0; k < n; ++k)
            test[k] = chain(on_slave.N[k], on_slave.dN[0][k], on_slave.dN[1][k], on_slave.xi);
        transform_basis<Slave>(test);
        for (int l = 0; l < m; ++l)
            N_master[l] = chain(on_master.N[l], on_master.dN[0][l], on_master.dN[1][l], on_master.xi);
        if constexpr (is_dual<T>)
            for (int a = 0; a < 2; ++a) {
                const double by_slave = slave.rise ? 0.0 : -dot(normal, xs.tangent[a]);
                gap_point.gradient.add(dot(turn, field.tangent[a]) + by_slave, on_slave.xi[a].gradient);
                gap_point.gradient.add(slave.rise ? rise.slope[a] : dot(normal, xm.tangent[a]), on_master.xi[a].gradient);
            }
        add(test, N_master, weight, gap_point);
        cover += (1.0 / Slave::size) * weight;

        if constexpr (is_dual<T>) {
            double along_slave[3 * n], along_normal[3 * n], along_master[3 * m];
            for (int i = 0; i < n; ++i)
                for (int c = 0; c < 3; ++c) {
                    along_slave[3 * i + c] = slave.rise ? 0.0 : -on_slave.N[i] * normal[c];
                    along_normal[3 * i + c] = on_slave.N[i] * turn[c];
                }
            for (int l = 0; l < m; ++l)
                for (int c = 0; c < 3; ++c)
                    along_master[3 * l + c] = slave.rise ? rise.by_node[l][c] : on_master.N[l] * normal[c];
            for (int k = 0; k < n; ++k) {
                const double weighted = test[k].value * weight.value;
                for (int i = 0; i < 3 * n; ++i) gap_slave[k][i] += weighted * along_slave[i];
                for (int i = 0; i < 3 * n; ++i) gap_normal[k][i] += weighted * along_normal[i];
                for (int l = 0; l < 3 * m; ++l) gap_master[k][l] += weighted * along_master[l];
            }
        }
    }

    void add(const LinePoint<T>& point, const LinePair<Slave, Master, T>& pair, const FacetNodes<Slave>& slave) {
        T test[n], N_master[m], slope[1][n], slope_master[1][m];
        Slave::shape(&point.slave, test, slope);
        Master::shape(&point.master, N_master, slope_master);
        const FieldPoint<Slave, T> xs(pair.slave, point.slave), normal(pair.normal, point.slave);
        const FieldPoint<Master, T> xm(pair.master, point.master);
        T g = 0.0, square = 0.0;
        if (slave.rise) {
            const T along[2] = {slave.along[0], slave.along[1]};
            const T length = square_root(normal.value[0] * normal.value[0] + normal.value[1] * normal.value[1]);
            add(test, N_master, point.weight, length * cross(along, xm.slope) / cross(normal.value, xm.slope));
            cover += point.cover;
            return;
        }
        for (int c = 0; c < 2; ++c) {
            const T along = slave.along ? T(slave.along[c]) : normal.value[c];
            add_product(g, along, xm.value[c] - xs.value[c]);
            add_product(square, along, along);
        }
        add(test, N_master, point.weight, g / square_root(square));
        cover += point.cover;
    }
};

// The gap g at a point, in plain numbers: to choose among several masters.
template <typename Slave, typename Master, typename T>
double gap_at(const PointOn<Slave, T>& on_slave, const PointOn<Master, T>& on_master, const FacetNodes<Slave>& slave,
              const FacetNodes<Master>& master) {
    const SurfacePoint<Slave> xs(on_slave.N, on_slave.dN, slave.x);
    const SurfacePoint<Slave> field(on_slave.N, on_slave.dN, slave.normal);
    const SurfacePoint<Master> xm(on_master.N, on_master.dN, master.x);
    const double r[3] = {xm.x[0] - xs.x[0], xm.x[1] - xs.x[1], xm.x[2] - xs.x[2]};
    return dot(field.x, r) / std::sqrt(dot(field.x, field.x));
}
template <typename Slave, typename Master>
double gap_at(double on_slave, double on_master, const FacetNodes<Slave>& slave, const FacetNodes<Master>& master) {
    const FieldPoint<Slave, double> xs(slave.x, on_slave), field(slave.normal, on_slave);
    const FieldPoint<Master, double> xm(master.x, on_master);
    const double r[2] = {xm.value[0] - xs.value[0], xm.value[1] - xs.value[1]};
    return (field.value[0] * r[0] + field.value[1] * r[1]) / std::hypot(field.value[0], field.value[1]);
}

}  // namespace mortar
