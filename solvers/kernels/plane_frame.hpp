// The auxiliary plane of a slave facet and the coordinates in it.
//
// The plane passes through the facet's centre c with the facet's unit normal n there (Puso & Laursen 2004). Its frame
// are the tangents g_a = x,a(c). A point x has the plane coordinates xi_c^a + g^a.(x - c), with g^a the dual tangents
// in the plane: g^a.n = 0, so x is projected along n. In these coordinates an affine slave facet *is* its reference
// domain, and a pair's integrals, but for the factor |g_1 x g_2|, depend on the shapes in the plane alone:
//     2 numbers for each master node, 0 (tri3), 2 (quad4) or 2 for each node (tri6, quad9) for the slave.
// These are the directions of differentiation; how they depend on the nodes is known in closed form:
//     dg^a = -(g^a.dg_b) g^b + (g^a.g^b) (n.dg_b) n,    d|g_1 x g_2| = |g_1 x g_2| g^b.dg_b.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>

#include "dual_number.hpp"
#include "facets.hpp"

namespace mortar {

inline double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline void cross(const double* a, const double* b, double* result) {
    result[0] = a[1] * b[2] - a[2] * b[1];
    result[1] = a[2] * b[0] - a[0] * b[2];
    result[2] = a[0] * b[1] - a[1] * b[0];
}

// A nodal field of vectors on a facet (its position, its normals) at a point: value and slopes.
template <typename Facet>
struct SurfacePoint {
    double x[3] = {}, tangent[2][3] = {};

    SurfacePoint(const double* N, const double (*dN)[Facet::nodes], const double (*nodes)[3]) {
        for (int i = 0; i < Facet::nodes; ++i)
            for (int c = 0; c < 3; ++c) {
                x[c] += N[i] * nodes[i][c];
                tangent[0][c] += dN[0][i] * nodes[i][c];
                tangent[1][c] += dN[1][i] * nodes[i][c];
            }
    }
};

// Shape functions at a point.
template <typename Facet>
struct Shape {
    double N[Facet::nodes], dN[2][Facet::nodes];
    explicit Shape(const double* xi) { Facet::shape(xi, N, dN); }
};

template <typename Slave>
struct PlaneFrame {
    static constexpr int n = Slave::nodes;
    Shape<Slave> shape;
    SurfacePoint<Slave> centre;
    double normal[3], dual[2][3], metric[2][2], area;  // g^a, g^a.g^b, |g_1 x g_2|

    explicit PlaneFrame(const double (*x)[3]) : shape(Slave::centre), centre(shape.N, shape.dN, x) {
        cross(centre.tangent[0], centre.tangent[1], normal);
        area = std::sqrt(dot(normal, normal));
        for (double& component : normal) component /= area;
        cross(centre.tangent[1], normal, dual[0]);
        cross(normal, centre.tangent[0], dual[1]);
        for (auto& g : dual)
            for (double& component : g) component /= area;
        for (int a = 0; a < 2; ++a)
            for (int b = 0; b < 2; ++b) metric[a][b] = dot(dual[a], dual[b]);
    }

    // Whether two facets, given by their nodes, are seen side by side along the normal (by their boxes in the plane).
    template <int ns, int nm>
    bool apart(const double (*xs)[3], const double (*xm)[3]) const {
        for (const auto& g : dual) {
            double low[2] = {dot(g, xs[0]), dot(g, xm[0])}, high[2] = {low[0], low[1]};
            auto widen = [&](int side, double coordinate) {
                low[side] = std::min(low[side], coordinate);
                high[side] = std::max(high[side], coordinate);
            };
            for (int i = 1; i < ns; ++i) widen(0, dot(g, xs[i]));
            for (int l = 1; l < nm; ++l) widen(1, dot(g, xm[l]));
            if (high[0] <= low[1] || high[1] <= low[0]) return true;
        }
        return false;
    }

    // row[3 i + c] = d(g^a.r)/dx_ic for r = sum_i coefficient_i x_i + (what does not depend on the slave).
    void slopes(int a, const double* r, const double* coefficient, double* row) const {
        const double along[2] = {dot(dual[0], r), dot(dual[1], r)}, height = dot(normal, r);
        for (int i = 0; i < n; ++i) {
            const double tangential = coefficient[i] - shape.dN[0][i] * along[0] - shape.dN[1][i] * along[1];
            const double out = height * (metric[a][0] * shape.dN[0][i] + metric[a][1] * shape.dN[1][i]);
            for (int c = 0; c < 3; ++c) row[3 * i + c] = tangential * dual[a][c] + out * normal[c];
        }
    }
    // row[3 i + c] = d|g_1 x g_2|/dx_ic
    void area_slopes(double* row) const {
        for (int i = 0; i < n; ++i)
            for (int c = 0; c < 3; ++c)
                row[3 * i + c] = area * (shape.dN[0][i] * dual[0][c] + shape.dN[1][i] * dual[1][c]);
    }
};

// The shape of a slave facet beyond the affine: modes r_k = sum_i L_ki x_i; node i deviates by sum_k E_ik r_k.
template <typename Slave>
struct ShapeModes {
    static constexpr int n = Slave::nodes, modes = Slave::modes;
    double L[modes > 0 ? modes : 1][n] = {}, E[n][modes > 0 ? modes : 1] = {};

    ShapeModes() {
        if constexpr (n == 4) {  // the one mode of a bilinear facet: s t
            for (int i = 0; i < n; ++i) {
                E[i][0] = Slave::reference[i][0] * Slave::reference[i][1];
                L[0][i] = 0.25 * E[i][0];
            }
        } else if constexpr (modes > 0) {  // every node by itself
            double N[n], dN[2][n];
            Slave::shape(Slave::centre, N, dN);
            for (int k = 0; k < modes; ++k) {
                E[k][k] = 1.0;
                const double s = Slave::reference[k][0] - Slave::centre[0];
                const double t = Slave::reference[k][1] - Slave::centre[1];
                for (int i = 0; i < n; ++i) L[k][i] = (i == k) - N[i] - dN[0][i] * s - dN[1][i] * t;
            }
        }
    }
};

template <typename Slave, typename Master>
constexpr int plane_directions = 2 * (Slave::modes + Master::nodes);

// Both facets of a pair in plane coordinates, as functions of the directions of differentiation.
template <typename Slave, typename Master, typename T>
struct PlanePair {
    static constexpr int slave_columns = 3 * Slave::nodes, columns = slave_columns + 3 * Master::nodes;
    inline static const ShapeModes<Slave> shape_modes{};

    T slave[Slave::nodes][2], master[Master::nodes][2];
    // slopes[p][column] of direction p with respect to the nodes of the slave, then of the master
    Gradient<columns> slopes[is_dual<T> ? plane_directions<Slave, Master> : 1];

    PlanePair(const PlaneFrame<Slave>& frame, const double (*xs)[3], const double (*xm)[3]) {
        for (int i = 0; i < Slave::nodes; ++i)
            for (int a = 0; a < 2; ++a) slave[i][a] = Slave::reference[i][a];
        for (int k = 0; k < Slave::modes; ++k) {
            double r[3] = {};
            for (int i = 0; i < Slave::nodes; ++i)
                for (int c = 0; c < 3; ++c) r[c] += shape_modes.L[k][i] * xs[i][c];
            for (int a = 0; a < 2; ++a) {
                const T mode = variable(dot(frame.dual[a], r), 2 * k + a);
                for (int i = 0; i < Slave::nodes; ++i)
                    if (shape_modes.E[i][k] != 0.0) add_scaled(slave[i][a], shape_modes.E[i][k], mode);
                if constexpr (is_dual<T>) row(2 * k + a, frame, a, r, shape_modes.L[k]);
            }
        }
        double minus_N[Slave::nodes];
        for (int i = 0; i < Slave::nodes; ++i) minus_N[i] = -frame.shape.N[i];
        for (int l = 0; l < Master::nodes; ++l) {
            const double r[3] = {xm[l][0] - frame.centre.x[0], xm[l][1] - frame.centre.x[1],
                                 xm[l][2] - frame.centre.x[2]};
            for (int a = 0; a < 2; ++a) {
                const int p = 2 * (Slave::modes + l) + a;
                master[l][a] = variable(Slave::centre[a] + dot(frame.dual[a], r), p);
                if constexpr (is_dual<T>) {
                    row(p, frame, a, r, minus_N);
                    for (int c = 0; c < 3; ++c) slopes[p].set(slave_columns + 3 * l + c, frame.dual[a][c]);
                }
            }
        }
    }

  private:
    static T variable(double value, int direction) {
        if constexpr (is_dual<T>)
            return T::variable(value, direction);
        else
            return value;
    }
    void row(int p, const PlaneFrame<Slave>& frame, int a, const double* r, const double* coefficient) {
        double values[Gradient<columns>::packs * pack_size] = {};
        frame.slopes(a, r, coefficient, values);
        std::memcpy(slopes[p].pack, values, sizeof values);
    }
};

}  // namespace mortar
