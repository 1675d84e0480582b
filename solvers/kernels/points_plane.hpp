// Integration points of a pair in 3D: cells on the auxiliary plane, or fixed points on the slave facet.
//
// Cells (Puso & Laursen 2004): the linear parts of both facets are projected onto the plane and clipped; the overlap is
// cut into triangles around a centre. The centre is that of the polygon's boundary: always inside, and continuous
// when vertices appear or vanish, so that the quadrature error is too. Points are mapped back to both facets along the
// plane's normal.
#pragma once

#include <algorithm>
#include <vector>

#include "clipping.hpp"
#include "plane_frame.hpp"
#include "quadrature.hpp"

namespace mortar {

// Reference coordinates on both facets and the weight (area times quadrature weight), all differentiated.
template <typename T>
struct Point {
    T slave[2], master[2], weight;
};

// The reference coordinates xi at which a facet passes over the point x of the plane. The root is found in plain
// numbers; one more Newton step with derivatives then differentiates it (implicit function theorem). False if there is
// none nearby.
template <typename Facet, typename T>
bool map_back(const T (*nodes)[2], const T* x, const double* guess, T* xi) {
    constexpr int n = Facet::nodes;
    double plain[n][2], at[2] = {guess[0], guess[1]}, N[n], dN[2][n], inverse[2][2];
    for (int i = 0; i < n; ++i)
        for (int a = 0; a < 2; ++a) plain[i][a] = value_of(nodes[i][a]);

    auto linearize = [&] {
        Facet::shape(at, N, dN);
        double J[2][2] = {};
        for (int i = 0; i < n; ++i)
            for (int a = 0; a < 2; ++a)
                for (int b = 0; b < 2; ++b) J[a][b] += dN[b][i] * plain[i][a];
        const double determinant = J[0][0] * J[1][1] - J[0][1] * J[1][0];
        inverse[0][0] = J[1][1] / determinant;
        inverse[0][1] = -J[0][1] / determinant;
        inverse[1][0] = -J[1][0] / determinant;
        inverse[1][1] = J[0][0] / determinant;
    };
    bool found = false;
    for (int iteration = 0; iteration < 15 && !found; ++iteration) {
        linearize();
        double r[2] = {-value_of(x[0]), -value_of(x[1])};
        for (int i = 0; i < n; ++i)
            for (int a = 0; a < 2; ++a) r[a] += N[i] * plain[i][a];
        double step = 0.0;
        for (int a = 0; a < 2; ++a) {
            const double change = inverse[a][0] * r[0] + inverse[a][1] * r[1];
            at[a] -= change;
            step = std::max(step, std::abs(change));
        }
        found = step < 1e-7;  // the next one would be its square
        if (!(step < 1e3)) return false;
    }
    if (!found) return false;
    linearize();
    T r[2] = {-1.0 * x[0], -1.0 * x[1]};
    for (int i = 0; i < n; ++i)
        for (int a = 0; a < 2; ++a) add_scaled(r[a], N[i], nodes[i][a]);
    for (int a = 0; a < 2; ++a) {
        xi[a] = at[a];
        add_scaled(xi[a], -inverse[a][0], r[0]);
        add_scaled(xi[a], -inverse[a][1], r[1]);
    }
    return true;
}

// Maps points of the plane to both facets of a pair.
template <typename Slave, typename Master, typename T>
struct MapBack {
    const PlanePair<Slave, Master, T>& pair;
    double centre[2] = {}, inverse[2][2] = {};  // first guess on the master: its affine part

    explicit MapBack(const PlanePair<Slave, Master, T>& pair) : pair(pair) {
        double N[Master::nodes], dN[2][Master::nodes], J[2][2] = {};
        Master::shape(Master::centre, N, dN);
        for (int l = 0; l < Master::nodes; ++l)
            for (int a = 0; a < 2; ++a) {
                centre[a] += N[l] * value_of(pair.master[l][a]);
                for (int b = 0; b < 2; ++b) J[a][b] += dN[b][l] * value_of(pair.master[l][a]);
            }
        const double determinant = J[0][0] * J[1][1] - J[0][1] * J[1][0];
        inverse[0][0] = J[1][1] / determinant;
        inverse[0][1] = -J[0][1] / determinant;
        inverse[1][0] = -J[1][0] / determinant;
        inverse[1][1] = J[0][0] / determinant;
    }
    bool to_slave(const T* x, T* xi) const {
        if constexpr (Slave::modes == 0) {  // the plane coordinates are the reference coordinates
            xi[0] = x[0];
            xi[1] = x[1];
            return true;
        } else {
            const double guess[2] = {value_of(x[0]), value_of(x[1])};
            return map_back<Slave>(pair.slave, x, guess, xi);
        }
    }
    bool to_master(const T* x, T* xi) const {
        const double r[2] = {value_of(x[0]) - centre[0], value_of(x[1]) - centre[1]};
        double guess[2];
        for (int a = 0; a < 2; ++a) guess[a] = Master::centre[a] + inverse[a][0] * r[0] + inverse[a][1] * r[1];
        return map_back<Master>(pair.master, x, guess, xi);
    }
};

// Calls visit(point) for the integration points of the cells of a pair.
template <typename Slave, typename Master, typename T, typename Visit>
void visit_cells(const PlanePair<Slave, Master, T>& pair, Visit&& visit) {
    constexpr int ns = Slave::corners, nm = Master::corners;
    static const std::vector<RulePoint> rule = triangle_rule(Slave::order == 1 && Master::order == 1 ? 7 : 12);
    const MapBack<Slave, Master, T> map(pair);

    for (const auto& slave_part : Slave::part)
        for (const auto& master_part : Master::part) {
            const T *slave[ns], *master[nm];
            double slave_plain[ns][2], master_plain[nm][2];
            for (int i = 0; i < ns; ++i) slave[i] = pair.slave[slave_part[i]];
            for (int l = 0; l < nm; ++l) master[l] = pair.master[master_part[nm - 1 - l]];  // it faces the other way
            bool apart = false;
            for (int a = 0; a < 2; ++a) {
                for (int i = 0; i < ns; ++i) slave_plain[i][a] = value_of(slave[i][a]);
                for (int l = 0; l < nm; ++l) master_plain[l][a] = value_of(master[l][a]);
                auto component = [a](const double* p, const double* q) { return p[a] < q[a]; };
                auto [s_low, s_high] = std::minmax_element(slave_plain, slave_plain + ns, component);
                auto [m_low, m_high] = std::minmax_element(master_plain, master_plain + nm, component);
                apart |= (*s_high)[a] <= (*m_low)[a] || (*m_high)[a] <= (*s_low)[a];
            }
            if (apart) continue;

            const Polygon polygon = clip<ns, nm>(slave_plain, master_plain);
            if (polygon.size < 3 || !(polygon.area() > slack * Slave::size)) continue;

            auto line = [&](int edge) -> Line<T> {
                return edge < master_edge ? Line<T>{slave[edge], slave[(edge + 1) % ns]}
                                          : Line<T>{master[edge - master_edge], master[(edge - master_edge + 1) % nm]};
            };
            T vertex[max_vertices][2], length[max_vertices];
            for (int k = 0; k < polygon.size; ++k) {
                const auto& [position, first, second, edge] = polygon.vertex[k];
                if (first == second)
                    std::copy_n(line(first).a, 2, vertex[k]);
                else
                    crossing(line(first), line(second), vertex[k]);
            }
            T centre[2] = {0.0, 0.0}, perimeter = 0.0;
            for (int k = 0; k < polygon.size; ++k) {
                const T *a = vertex[k], *b = vertex[(k + 1) % polygon.size];
                const T dx = b[0] - a[0], dy = b[1] - a[1];
                length[k] = square_root(dx * dx + dy * dy);
                perimeter += length[k];
                for (int c = 0; c < 2; ++c) add_product(centre[c], length[k], 0.5 * (a[c] + b[c]));
            }
            for (T& component : centre) component = component / perimeter;

            for (int k = 0; k < polygon.size; ++k) {
                const T *a = vertex[k], *b = vertex[(k + 1) % polygon.size];
                const T u[2] = {a[0] - centre[0], a[1] - centre[1]}, v[2] = {b[0] - centre[0], b[1] - centre[1]};
                const T twice_area = u[0] * v[1] - u[1] * v[0];
                for (const RulePoint& q : rule) {
                    T x[2] = {centre[0], centre[1]};
                    for (int c = 0; c < 2; ++c) {
                        add_scaled(x[c], q.x[0], u[c]);
                        add_scaled(x[c], q.x[1], v[c]);
                    }
                    Point<T> point;
                    if (!map.to_slave(x, point.slave) || !map.to_master(x, point.master)) continue;
                    point.weight = q.weight * twice_area;
                    visit(point);
                }
            }
        }
}

// Fixed points on the slave facet (element-based integration; Farah, Popp & Wall 2015).
template <typename Slave>
const std::vector<RulePoint>& element_rule() {
    static const std::vector<RulePoint> rule = Slave::corners == 3 ? triangle_rule(12) : square_rule(3 + Slave::order);
    return rule;
}

// The point q of the slave facet seen on the plane and on the master; false if it does not pass over the master.
template <typename Slave, typename Master, typename T>
bool element_point(const PlanePair<Slave, Master, T>& pair, const RulePoint& q, Point<T>& point) {
    double N[Slave::nodes], dN[2][Slave::nodes];
    Slave::shape(q.x, N, dN);
    T x[2] = {0.0, 0.0}, J[2][2] = {{0.0, 0.0}, {0.0, 0.0}};
    for (int i = 0; i < Slave::nodes; ++i)
        for (int a = 0; a < 2; ++a) {
            add_scaled(x[a], N[i], pair.slave[i][a]);
            for (int b = 0; b < 2; ++b) add_scaled(J[a][b], dN[b][i], pair.slave[i][a]);
        }
    if (!MapBack<Slave, Master, T>(pair).to_master(x, point.master)) return false;
    const double xi[2] = {value_of(point.master[0]), value_of(point.master[1])};
    if (!Master::inside(xi, 1e-10)) return false;
    point.slave[0] = q.x[0];
    point.slave[1] = q.x[1];
    point.weight = q.weight * (J[0][0] * J[1][1] - J[0][1] * J[1][0]);
    return true;
}

}  // namespace mortar
