// Masters that lie behind other masters, as a slave facet sees them: of each place on the slave the first one counts.
#pragma once

#include <algorithm>
#include <vector>

#include "facet_assembly.hpp"

namespace mortar {

// Distance between two masters, in diameters of the slave facet, from which on the nearer one hides the other. Results of
// bodies side by side are the same from 0.005 to 5. With 0.002 Newton's method may jump between them
// (docs/verification_contact.md).
constexpr double thinnest_layer = 0.05;

// Whether the master of a pair lies over this place of the slave, too, with a gap there that is smaller than the given one
// by more than the thinnest layer.
template <typename Slave, typename Master, bool derivatives>
inline bool FacetAssembly<Slave, Master, derivatives>::is_nearer(const Pair& pair, double gap,
                                                                 const double* place) const {
    if constexpr (dim == 3) {
        double nodes[m][2], x[1][2] = {{place[0], place[1]}}, on_plane[n][2], x_s[1][2] = {{place[0], place[1]}};
        for (int l = 0; l < m; ++l)
            for (int a = 0; a < 2; ++a) nodes[l][a] = value_of(pair.geometry.master[l][a]);
        for (int i = 0; i < n; ++i)
            for (int a = 0; a < 2; ++a) on_plane[i][a] = value_of(pair.geometry.slave[i][a]);
        PointOn<Master, double> on_master;
        PointOn<Slave, double> on_slave;
        bool found;
        MapBack<Master, double>(nodes).find(x, 1, &on_master, &found);
        if (!found || !Master::inside(on_master.xi, 0.0)) return false;
        MapBack<Slave, double>(on_plane).find(x_s, 1, &on_slave, &found);
        return found && gap_at(on_slave, on_master, slave_, pair.nodes) < gap - thinnest_layer * 2.0 * radius_;
    } else {
        T eta = 0.0;
        if (!pair.geometry.project_to_master(T(*place), eta)) return false;
        const double at = value_of(eta);
        return Master::inside(&at, 0.0) && gap_at(*place, at, slave_, pair.nodes) < gap - thinnest_layer * 2.0 * radius_;
    }
}

// Facets that have a node in common lie side by side; others may lie behind each other if their boxes overlap.
template <typename Slave, typename Master, bool derivatives>
inline bool FacetAssembly<Slave, Master, derivatives>::may_hide(const Pair& a, const Pair& b) const {
    for (int l : a.place)
        if (std::find(std::begin(b.place), std::end(b.place), l) != std::end(b.place)) return false;
    if constexpr (dim == 3)
        for (int axis = 0; axis < 2; ++axis) {
            double low[2], high[2];
            for (int side = 0; side < 2; ++side) {
                const Pair& pair = side ? b : a;
                low[side] = high[side] = value_of(pair.geometry.master[0][axis]);
                for (int l = 1; l < m; ++l) {
                    low[side] = std::min(low[side], value_of(pair.geometry.master[l][axis]));
                    high[side] = std::max(high[side], value_of(pair.geometry.master[l][axis]));
                }
            }
            if (high[0] <= low[1] + slack || high[1] <= low[0] + slack) return false;
        }
    return true;
}

// Of masters behind each other the first one that the slave meets counts, point by point. Masters at nearly the same
// place (bodies side by side that bulge into each other) both count: to choose between them would be arbitrary, and
// the choice would change from iterate to iterate.
template <typename Slave, typename Master, bool derivatives>
inline void FacetAssembly<Slave, Master, derivatives>::hide_behind_each_other() {
    std::vector<std::vector<std::size_t>> rivals(pairs_.size());
    for (std::size_t p = 0; p < pairs_.size(); ++p)
        for (std::size_t q = 0; q < p; ++q)
            if (may_hide(pairs_[p], pairs_[q])) {
                rivals[p].push_back(q);
                rivals[q].push_back(p);
            }
    for (std::size_t p = 0; p < pairs_.size(); ++p) {
        if (rivals[p].empty()) continue;
        pairs_[p].integrals = {};
        add_segments(pairs_[p], [&](double gap, const double* place) {
            return std::none_of(rivals[p].begin(), rivals[p].end(),
                                [&](std::size_t q) { return is_nearer(pairs_[q], gap, place); });
        });
    }
    std::erase_if(pairs_, [](const Pair& pair) { return value_of(pair.integrals.cover) == 0.0; });
}

}  // namespace mortar
