// The facet types: node numbering (VTK), shape functions, linear parts.
//
// Facets are oriented: the normal points out of the body. In 3D the nodes run counter-clockwise seen from outside; in
// 2D the body lies to the left of the way from node 0 to node 1.
#pragma once

#include <cmath>

namespace mortar {

// What all types tell: nodes, dim (of space), order (1, 2), reference coordinates of the nodes, centre, size of the
// reference domain, the linear parts a facet is clipped by (corner nodes, counter-clockwise), and
//     shape(xi, N, dN)    values N[i] and slopes dN[a][i] = dN_i/dxi_a, for any scalar
//     inside(xi, slack)   whether xi lies in the reference domain.
// modes counts the ways the facet's shape can deviate from an affine image of the reference domain (plane_frame.hpp).

struct Line2 {
    static constexpr const char* name = "line2";
    static constexpr int nodes = 2, dim = 2, order = 1;
    static constexpr double size = 2.0, centre[2] = {0.0, 0.0};
    static constexpr double reference[nodes][2] = {{-1, 0}, {1, 0}};

    template <typename T>
    static void shape(const T* xi, T* N, T (*dN)[nodes]) {
        N[0] = 0.5 * (1.0 - xi[0]);
        N[1] = 0.5 * (1.0 + xi[0]);
        dN[0][0] = -0.5;
        dN[0][1] = 0.5;
    }
    static bool inside(const double* xi, double slack) { return std::abs(xi[0]) <= 1.0 + slack; }
};

struct Line3 {
    static constexpr const char* name = "line3";
    static constexpr int nodes = 3, dim = 2, order = 2;
    static constexpr double size = 2.0, centre[2] = {0.0, 0.0};
    static constexpr double reference[nodes][2] = {{-1, 0}, {1, 0}, {0, 0}};

    template <typename T>
    static void shape(const T* xi, T* N, T (*dN)[nodes]) {
        const T& s = xi[0];
        N[0] = 0.5 * s * (s - 1.0);
        N[1] = 0.5 * s * (s + 1.0);
        N[2] = (1.0 - s) * (1.0 + s);
        dN[0][0] = s - 0.5;
        dN[0][1] = s + 0.5;
        dN[0][2] = -2.0 * s;
    }
    static bool inside(const double* xi, double slack) { return std::abs(xi[0]) <= 1.0 + slack; }
};

struct Tri3 {
    static constexpr const char* name = "tri3";
    static constexpr int nodes = 3, dim = 3, order = 1, modes = 0;
    static constexpr double size = 0.5, centre[2] = {1.0 / 3.0, 1.0 / 3.0};
    static constexpr double reference[nodes][2] = {{0, 0}, {1, 0}, {0, 1}};
    static constexpr int parts = 1, corners = 3, part[parts][corners] = {{0, 1, 2}};

    template <typename T>
    static void shape(const T* xi, T* N, T (*dN)[nodes]) {
        N[0] = 1.0 - xi[0] - xi[1];
        N[1] = xi[0];
        N[2] = xi[1];
        const double slopes[2][nodes] = {{-1, 1, 0}, {-1, 0, 1}};
        for (int a = 0; a < 2; ++a)
            for (int i = 0; i < nodes; ++i) dN[a][i] = slopes[a][i] + T{};
    }
    static bool inside(const double* xi, double slack) {
        return xi[0] >= -slack && xi[1] >= -slack && xi[0] + xi[1] <= 1.0 + slack;
    }
};

struct Tri6 {
    static constexpr const char* name = "tri6";
    static constexpr int nodes = 6, dim = 3, order = 2, modes = 6;
    static constexpr double size = 0.5, centre[2] = {1.0 / 3.0, 1.0 / 3.0};
    static constexpr double reference[nodes][2] = {{0, 0}, {1, 0}, {0, 1}, {0.5, 0}, {0.5, 0.5}, {0, 0.5}};
    static constexpr int parts = 4, corners = 3;
    static constexpr int part[parts][corners] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};

    template <typename T>
    static void shape(const T* xi, T* N, T (*dN)[nodes]) {
        const T L[3] = {1.0 - xi[0] - xi[1], xi[0], xi[1]};
        const double dL[2][3] = {{-1, 1, 0}, {-1, 0, 1}};
        for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3;
            N[i] = L[i] * (2.0 * L[i] - 1.0);
            N[3 + i] = 4.0 * L[i] * L[j];
            for (int a = 0; a < 2; ++a) {
                dN[a][i] = (4.0 * L[i] - 1.0) * dL[a][i];
                dN[a][3 + i] = 4.0 * (L[i] * dL[a][j] + L[j] * dL[a][i]);
            }
        }
    }
    static bool inside(const double* xi, double slack) { return Tri3::inside(xi, slack); }
};

struct Quad4 {
    static constexpr const char* name = "quad4";
    static constexpr int nodes = 4, dim = 3, order = 1, modes = 1;
    static constexpr double size = 4.0, centre[2] = {0.0, 0.0};
    static constexpr double reference[nodes][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    static constexpr int parts = 1, corners = 4, part[parts][corners] = {{0, 1, 2, 3}};

    template <typename T>
    static void shape(const T* xi, T* N, T (*dN)[nodes]) {
        for (int i = 0; i < nodes; ++i) {
            const double s = reference[i][0], t = reference[i][1];
            N[i] = 0.25 * (1.0 + s * xi[0]) * (1.0 + t * xi[1]);
            dN[0][i] = 0.25 * s * (1.0 + t * xi[1]);
            dN[1][i] = 0.25 * t * (1.0 + s * xi[0]);
        }
    }
    static bool inside(const double* xi, double slack) {
        return std::abs(xi[0]) <= 1.0 + slack && std::abs(xi[1]) <= 1.0 + slack;
    }
};

struct Quad9 {
    static constexpr const char* name = "quad9";
    static constexpr int nodes = 9, dim = 3, order = 2, modes = 9;
    static constexpr double size = 4.0, centre[2] = {0.0, 0.0};
    static constexpr double reference[nodes][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {0, -1},
                                                   {1, 0},   {0, 1},  {-1, 0}, {0, 0}};
    static constexpr int parts = 4, corners = 4;
    static constexpr int part[parts][corners] = {{0, 4, 8, 7}, {4, 1, 5, 8}, {8, 5, 2, 6}, {7, 8, 6, 3}};

    template <typename T>
    static void shape(const T* xi, T* N, T (*dN)[nodes]) {
        T line[2][3], slope[2][1][3];
        for (int a = 0; a < 2; ++a) Line3::shape(xi + a, line[a], slope[a]);
        for (int i = 0; i < nodes; ++i) {  // node of Line3 at -1, 1, 0: 0, 1, 2
            const int s = reference[i][0] < 0 ? 0 : reference[i][0] > 0 ? 1 : 2;
            const int t = reference[i][1] < 0 ? 0 : reference[i][1] > 0 ? 1 : 2;
            N[i] = line[0][s] * line[1][t];
            dN[0][i] = slope[0][0][s] * line[1][t];
            dN[1][i] = line[0][s] * slope[1][0][t];
        }
    }
    static bool inside(const double* xi, double slack) { return Quad4::inside(xi, slack); }
};

// The slave's displacement basis as the dual functions see it: N itself, but for tri6, whose corner functions have
// integral zero. There N~_corner = N_corner + a (its two edge functions), N~_edge = (1 - 2a) N_edge with a = 1/5, all
// of positive integral and still a partition of unity (Popp, Wohlmuth, Gee & Wall 2012).
constexpr double tri6_blend = 0.2;

template <typename Facet, typename T>
void transform_basis(T* N) {
    if constexpr (Facet::nodes == 6) {
        for (int corner = 0; corner < 3; ++corner)
            N[corner] += tri6_blend * (N[3 + corner] + N[3 + (corner + 2) % 3]);
        for (int edge = 3; edge < 6; ++edge) N[edge] = (1.0 - 2.0 * tri6_blend) * N[edge];
    }
}

}  // namespace mortar
