// Integration points of a pair in 3D: cells on the auxiliary plane, or fixed points on the slave facet.
//
// Cells (Puso & Laursen 2004): the linear parts of both facets are projected onto the plane and clipped; the overlap is
// cut into triangles around a centre. The centre is that of the polygon's boundary: always inside, and continuous
// when vertices appear or vanish, so that the quadrature error is too. Points are mapped back to both facets along the
// plane's normal.
#pragma once

#include <algorithm>
#include <cstring>
#include <vector>

#include "clipping.hpp"
#include "plane_frame.hpp"
#include "quadrature.hpp"

namespace mortar {

// Where a point is on a facet: reference coordinates, and the shape functions there.
template <typename Facet, typename T>
struct PointOn {
    T xi[2];
    double N[Facet::nodes], dN[2][Facet::nodes];
};

// A point on both facets and its weight (area times quadrature weight).
template <typename Slave, typename Master, typename T>
struct Point {
    PointOn<Slave, T> slave;
    PointOn<Master, T> master;
    T weight;
};

// Finds the points of a facet that lie over given points of the plane. The roots are found in plain numbers by Newton's
// method, one to a lane of a vector register; one more step, with derivatives, differentiates them (implicit function
// theorem).
template <typename Facet, typename T>
class MapBack {
    static constexpr int n = Facet::nodes;

  public:
    explicit MapBack(const T (*nodes)[2]) : nodes_(nodes) {
        for (int i = 0; i < n; ++i)
            for (int a = 0; a < 2; ++a) plain_[i][a] = value_of(nodes[i][a]);
        double N[n], dN[2][n];
        Facet::shape(Facet::centre, N, dN);
        guess_by(plain_, N, dN, Facet::centre);
    }

    // From now on, points are expected in this linear part of the facet.
    void expect_in(const int* part) {
        if constexpr (Facet::order == 2) {
            using Part = std::conditional_t<Facet::corners == 3, Tri3, Quad4>;
            double corner[Part::nodes][2], N[Part::nodes], dN[2][Part::nodes];
            Part::shape(Part::centre, N, dN);
            double centre[2] = {}, slope[2][2] = {};  // of the parent's reference coordinates in the part's
            for (int i = 0; i < Part::nodes; ++i)
                for (int a = 0; a < 2; ++a) {
                    corner[i][a] = plain_[part[i]][a];
                    centre[a] += N[i] * Facet::reference[part[i]][a];
                    for (int b = 0; b < 2; ++b) slope[a][b] += dN[b][i] * Facet::reference[part[i]][a];
                }
            guess_by(corner, N, dN, centre, slope);
        }
    }

    // points[k] over x[k], k < count <= pack_size; found[k] is false where there is none.
    void find(const T (*x)[2], int count, PointOn<Facet, T>* points, bool* found) const {
        Pack target[2], xi[2], step[2], N[n], dN[2][n], inverse[2][2];
        double lanes[2][pack_size];
        for (int k = 0; k < pack_size; ++k)
            for (int a = 0; a < 2; ++a) lanes[a][k] = value_of(x[k < count ? k : 0][a]);
        std::memcpy(target, lanes, sizeof lanes);
        for (int a = 0; a < 2; ++a)
            xi[a] = guess_[a] + guess_slope_[a][0] * (target[0] - centre_[0]) +
                    guess_slope_[a][1] * (target[1] - centre_[1]);
        auto linearize = [&] {
            Facet::shape(xi, N, dN);
            Pack J[2][2] = {};
            for (int i = 0; i < n; ++i)
                for (int a = 0; a < 2; ++a)
                    for (int b = 0; b < 2; ++b) J[a][b] += dN[b][i] * plain_[i][a];
            invert(J, inverse);
        };
        bool settled = n == 3;  // an affine facet is its affine part
        for (int k = 0; k < count; ++k) found[k] = settled;
        for (int iteration = 0; iteration < 15 && !settled; ++iteration) {
            linearize();
            Pack r[2] = {-target[0], -target[1]};
            for (int i = 0; i < n; ++i)
                for (int a = 0; a < 2; ++a) r[a] += N[i] * plain_[i][a];
            for (int a = 0; a < 2; ++a) {
                step[a] = inverse[a][0] * r[0] + inverse[a][1] * r[1];
                xi[a] -= step[a];
            }
            const auto small = step[0] * step[0] + step[1] * step[1] < 1e-14;  // the next step would be this squared
            settled = true;
            for (int k = 0; k < count; ++k) settled &= found[k] = small[k];
        }
        linearize();
        for (int k = 0; k < count; ++k) {
            PointOn<Facet, T>& point = points[k];
            for (int i = 0; i < n; ++i) {
                point.N[i] = N[i][k];
                point.dN[0][i] = dN[0][i][k];
                point.dN[1][i] = dN[1][i][k];
            }
            for (int a = 0; a < 2; ++a) point.xi[a] = xi[a][k];
            if constexpr (is_dual<T>) {
                auto r = x[k][0].gradient, s = x[k][1].gradient;  // dx - N_i dx_i
                for (int i = 0; i < n; ++i) {
                    r.add(-point.N[i], nodes_[i][0].gradient);
                    s.add(-point.N[i], nodes_[i][1].gradient);
                }
                for (int a = 0; a < 2; ++a) {
                    point.xi[a].gradient.add(inverse[a][0][k], r);
                    point.xi[a].gradient.add(inverse[a][1][k], s);
                }
            }
        }
    }

  private:
    template <typename Number>
    static void invert(const Number (*J)[2], Number (*inverse)[2]) {
        const Number factor = 1.0 / (J[0][0] * J[1][1] - J[0][1] * J[1][0]);
        inverse[0][0] = factor * J[1][1];
        inverse[0][1] = -factor * J[0][1];
        inverse[1][0] = -factor * J[1][0];
        inverse[1][1] = factor * J[0][0];
    }

    // First guess: the affine part of a shape with nodes x; shape functions at its centre, whose reference coordinates
    // are `at` and change by `slope` with those of the shape functions.
    template <int count>
    void guess_by(const double (*x)[2], const double* N, const double (*dN)[count], const double* at,
                  const double (&slope)[2][2] = {{1.0, 0.0}, {0.0, 1.0}}) {
        double J[2][2] = {}, inverse[2][2];
        centre_[0] = centre_[1] = 0.0;
        for (int i = 0; i < count; ++i)
            for (int a = 0; a < 2; ++a) {
                centre_[a] += N[i] * x[i][a];
                for (int b = 0; b < 2; ++b) J[a][b] += dN[b][i] * x[i][a];
            }
        invert(J, inverse);
        for (int a = 0; a < 2; ++a) {
            guess_[a] = at[a];
            for (int b = 0; b < 2; ++b) guess_slope_[a][b] = slope[a][0] * inverse[0][b] + slope[a][1] * inverse[1][b];
        }
    }

    const T (*nodes_)[2];
    double plain_[n][2], centre_[2], guess_[2], guess_slope_[2][2];
};

// Calls visit(point on slave, point on master, weight) for the integration points of the cells of a pair.
template <typename Slave, typename Master, typename T, typename Visit>
void visit_cells(const PlanePair<Slave, Master, T>& pair, Visit&& visit) {
    constexpr int ns = Slave::corners, nm = Master::corners;
    static const std::vector<RulePoint> rule = triangle_rule(Slave::order == 1 && Master::order == 1 ? 7 : 12);
    MapBack<Slave, T> to_slave(pair.slave);
    MapBack<Master, T> to_master(pair.master);

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

            to_slave.expect_in(slave_part);
            to_master.expect_in(master_part);
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
                for (std::size_t first = 0; first < rule.size(); first += pack_size) {
                    const int count = static_cast<int>(std::min<std::size_t>(pack_size, rule.size() - first));
                    T x[pack_size][2];
                    for (int q = 0; q < count; ++q)
                        for (int c = 0; c < 2; ++c) {
                            x[q][c] = centre[c];
                            add_scaled(x[q][c], rule[first + q].x[0], u[c]);
                            add_scaled(x[q][c], rule[first + q].x[1], v[c]);
                        }
                    PointOn<Slave, T> on_slave[pack_size];
                    PointOn<Master, T> on_master[pack_size];
                    bool found_slave[pack_size], found_master[pack_size];
                    to_slave.find(x, count, on_slave, found_slave);
                    to_master.find(x, count, on_master, found_master);
                    for (int q = 0; q < count; ++q)
                        if (found_slave[q] && found_master[q])
                            visit(on_slave[q], on_master[q], rule[first + q].weight * twice_area);
                }
            }
        }
}

// The points of the rule seen on the plane and on the master; found[q] is false where they do not pass over it.
template <typename Slave, typename Master, typename T>
void find_element_points(const PlanePair<Slave, Master, T>& pair, const std::vector<RulePoint>& rule,
                         Point<Slave, Master, T>* points, bool* found) {
    const MapBack<Master, T> to_master(pair.master);
    for (std::size_t first = 0; first < rule.size(); first += pack_size) {
        const int count = static_cast<int>(std::min<std::size_t>(pack_size, rule.size() - first));
        T x[pack_size][2];
        PointOn<Master, T> on_master[pack_size];
        for (int q = 0; q < count; ++q) {
            auto& [slave, master, weight] = points[first + q];
            Slave::shape(rule[first + q].x, slave.N, slave.dN);
            T J[2][2] = {};
            for (int a = 0; a < 2; ++a) {
                slave.xi[a] = rule[first + q].x[a];
                x[q][a] = 0.0;
                for (int i = 0; i < Slave::nodes; ++i) {
                    add_scaled(x[q][a], slave.N[i], pair.slave[i][a]);
                    for (int b = 0; b < 2; ++b) add_scaled(J[a][b], slave.dN[b][i], pair.slave[i][a]);
                }
            }
            weight = rule[first + q].weight * (J[0][0] * J[1][1] - J[0][1] * J[1][0]);
        }
        to_master.find(x, count, on_master, found + first);
        for (int q = 0; q < count; ++q) {
            points[first + q].master = on_master[q];
            const double xi[2] = {value_of(on_master[q].xi[0]), value_of(on_master[q].xi[1])};
            found[first + q] = found[first + q] && Master::inside(xi, 1e-10);
        }
    }
}

}  // namespace mortar
