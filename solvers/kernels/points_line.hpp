// Integration points of a pair in 2D: segments between projected ends, or fixed points on the slave facet.
//
// Everything is projected along the slave's field of nodal normals n(xi) = sum_i N_i(xi) n_i (Yang, Laursen & Meng
// 2005; Popp, Gee & Wall 2009), so that neighbouring facets share their end points and nothing overlaps or is missed.
// Directions of differentiation: the slave's nodal normals, its nodes, the master's nodes.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "dual_number.hpp"
#include "facets.hpp"
#include "quadrature.hpp"

namespace mortar {

template <typename Slave, typename Master>
constexpr int line_directions = 2 * (2 * Slave::nodes + Master::nodes);

template <typename T>
struct LinePoint {
    T slave, master, weight, cover;  // weight: length; cover: its share of the facet's reference domain
};

template <typename T>
T cross(const T* a, const T* b) {
    return a[0] * b[1] - a[1] * b[0];
}

// A vector field on a facet from its nodal values: value and slope at xi.
template <typename Facet, typename T>
struct FieldPoint {
    T value[2] = {0.0, 0.0}, slope[2] = {0.0, 0.0};

    template <typename X>
    FieldPoint(const T (*nodal)[2], const X& xi) {
        X N[Facet::nodes], dN[1][Facet::nodes];
        Facet::shape(&xi, N, dN);
        for (int i = 0; i < Facet::nodes; ++i)
            for (int c = 0; c < 2; ++c) {
                value[c] += N[i] * nodal[i][c];
                slope[c] += dN[0][i] * nodal[i][c];
            }
    }
};

template <typename Slave, typename Master, typename T>
struct LinePair {
    T normal[Slave::nodes][2], slave[Slave::nodes][2], master[Master::nodes][2];
    double plain_normal[Slave::nodes][2], plain_slave[Slave::nodes][2], plain_master[Master::nodes][2];

    LinePair(const double (*normals)[2], const double (*xs)[2], const double (*xm)[2]) {
        int direction = 0;
        auto differentiate = [&direction](const double (*from)[2], int n, T (*to)[2], double (*plain)[2]) {
            for (int i = 0; i < n; ++i)
                for (int c = 0; c < 2; ++c) {
                    plain[i][c] = from[i][c];
                    if constexpr (is_dual<T>)
                        to[i][c] = T::variable(from[i][c], direction++);
                    else
                        to[i][c] = from[i][c];
                }
        };
        differentiate(normals, Slave::nodes, normal, plain_normal);
        differentiate(xs, Slave::nodes, slave, plain_slave);
        differentiate(xm, Master::nodes, master, plain_master);
    }

    // (x(xi) - p) x n(xi): zero where the normal through xi meets p, positive if that lies further on; and its slope.
    std::pair<double, double> miss(const double* p, double xi) const {
        const FieldPoint<Slave, double> x(plain_slave, xi), n(plain_normal, xi);
        const double r[2] = {x.value[0] - p[0], x.value[1] - p[1]};
        return {cross(r, n.value), cross(x.slope, n.value) + cross(r, n.slope)};
    }

    // Where on the slave the normal meets node l of the master, cut off at the ends of the slave. An end met within
    // rounding counts as the end itself: it stays there whichever way the master moves. False if there is no answer.
    bool project_to_slave(int l, T& xi) const {
        const double* p = plain_master[l];
        const auto [at_low, slope_low] = miss(p, -1.0);
        const auto [at_high, slope_high] = miss(p, 1.0);
        const bool before = at_low <= 1e-12 * std::abs(slope_low), behind = at_high >= -1e-12 * std::abs(slope_high);
        if (before && at_high <= 0.0) {
            xi = -1.0;
            return true;
        }
        if (behind && at_low >= 0.0) {
            xi = 1.0;
            return true;
        }
        if (before || behind || !(at_low > at_high)) return false;  // beyond the normals' focus
        double low = -1.0, high = 1.0, at = (at_low + at_high) / (at_low - at_high);
        for (int iteration = 0; iteration < 60; ++iteration) {  // Newton, kept inside by bisection
            const auto [r, slope] = miss(p, at);
            (r > 0.0 ? low : high) = at;
            double next = at - r / slope;
            if (!(next > low && next < high)) next = 0.5 * (low + high);
            const double step = std::abs(next - at);
            at = next;
            if (step < 1e-14) break;
        }
        const double slope = miss(p, at).second;
        const FieldPoint<Slave, T> x(slave, at), n(normal, at);
        const T r[2] = {x.value[0] - master[l][0], x.value[1] - master[l][1]};
        xi = at;
        add_scaled(xi, -1.0 / slope, cross(r, n.value));
        return true;
    }

    // The reference coordinate on the master seen from xi on the slave along the normal. False if there is none.
    bool project_to_master(const T& xi, T& eta) const {
        const FieldPoint<Slave, T> x(slave, xi), n(normal, xi);
        const double p[2] = {value_of(x.value[0]), value_of(x.value[1])};
        const double direction[2] = {value_of(n.value[0]), value_of(n.value[1])};
        double at = 0.0, slope = 0.0;
        bool found = false;
        for (int iteration = 0; iteration < 15 && !found; ++iteration) {
            const FieldPoint<Master, double> y(plain_master, at);
            const double r[2] = {y.value[0] - p[0], y.value[1] - p[1]};
            const double step = cross(r, direction) / cross(y.slope, direction);
            at -= step;
            if (!(std::abs(step) < 1e3)) return false;
            found = std::abs(step) < 1e-7;  // the next one would be its square
        }
        if (!found) return false;
        slope = cross(FieldPoint<Master, double>(plain_master, at).slope, direction);
        const FieldPoint<Master, T> y(master, at);
        const T r[2] = {y.value[0] - x.value[0], y.value[1] - x.value[1]};
        eta = at;
        add_scaled(eta, -1.0 / slope, cross(r, n.value));
        return true;
    }

    T length_slope(const T& xi) const {
        const FieldPoint<Slave, T> x(slave, xi);
        return square_root(x.slope[0] * x.slope[0] + x.slope[1] * x.slope[1]);
    }
};

// Calls visit(point) for the integration points of the segment of a pair: where both facets face each other.
template <typename Slave, typename Master, typename T, typename Visit>
void visit_segment(const LinePair<Slave, Master, T>& pair, Visit&& visit) {
    static const std::vector<RulePoint> rule = line_rule(5);
    T low, high;  // the master runs the other way
    if (!pair.project_to_slave(1, low) || !pair.project_to_slave(0, high)) return;
    if (!(value_of(high) - value_of(low) > 1e-12)) return;
    const T half = 0.5 * (high - low), middle = 0.5 * (high + low);
    for (const RulePoint& q : rule) {
        LinePoint<T> point;
        point.slave = middle + q.x[0] * half;
        if (!pair.project_to_master(point.slave, point.master)) continue;
        point.cover = (q.weight / Slave::size) * half;
        point.weight = q.weight * half * pair.length_slope(point.slave);
        visit(point);
    }
}

// The points of the rule seen on the master; found[q] is false where their normal misses it.
template <typename Slave, typename Master, typename T>
void find_element_points(const LinePair<Slave, Master, T>& pair, const std::vector<RulePoint>& rule,
                         LinePoint<T>* points, bool* found) {
    for (std::size_t q = 0; q < rule.size(); ++q) {
        points[q].slave = rule[q].x[0];
        points[q].master = 0.0;
        found[q] = pair.project_to_master(points[q].slave, points[q].master);
        const double eta = value_of(points[q].master);
        found[q] = found[q] && Master::inside(&eta, 1e-10);
        points[q].cover = rule[q].weight / Slave::size;
        points[q].weight = rule[q].weight * pair.length_slope(points[q].slave);
    }
}

}  // namespace mortar
