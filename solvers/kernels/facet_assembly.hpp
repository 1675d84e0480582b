// Everything one slave facet contributes: the pairs' integrals, the dual basis they share, and the derivatives of
//
//     D_j = int N~_j,   g_j = int Phi_j g,   f_j = -D_j z_j (slave),   f_l = sum_j int Phi_j N^m_l z_j (master).
//
// The multipliers z are contracted before anything is differentiated: with y_k = sum_j A_jk z_j the master's force is
// sum_k y_k int N~_k N^m_l and no array has more than two indices. With A = (1 - b) D M^-1 + b I, q = M^-1 gap,
// y0 = (D M^-1)^T z:
//     dg = A dgap + (1 - b) (dD q - D M^-1 dM q) + db (gap - D M^-1 gap)
//     dy = (1 - b) M^-1 (dD z - dM y0) + db (z - y0)
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "block_rows.hpp"
#include "dual_basis.hpp"
#include "facet_ball.hpp"
#include "integrals.hpp"

namespace mortar {

struct MortarInput {
    const double *slave_x, *master_x, *normals, *z;  // z may be null
    const std::int64_t *slave_facets, *master_facets;
    int n_slave, n_master;
    const std::int32_t* pairs;  // (slave facet, master facet), sorted by slave facet
    std::size_t n_pairs;
    bool elements;  // fixed points on the slave facet instead of segments
    double reach;   // facets farther apart than this do not see each other
    double near;    // slave facets with no master as near as this are left out
    double facing;  // facets see each other if the product of their normals is below
    const std::uint8_t* kept;  // pairs that take part whatever reach, near and facing are; may be null
    const double* along;       // fixed unit vector along which gaps are measured instead of the normals; may be null
    bool rise;                 // by how much gaps grow as the masters move along that vector, instead of gaps

    bool is_kept(std::size_t pair) const { return kept && kept[pair]; }
};

// Sums over facets. Column nodes: the slave's, then the master's; those of d*_normal: the slave's.
template <int dim>
struct MortarSums {
    std::vector<double> diagonal, gap, area, force;
    std::vector<std::uint8_t> used;  // of the pairs: it took part
    BlockRows<1, 1> coupling, own_coupling;
    BlockRows<1, dim> d_diagonal, d_diagonal_normal, d_gap, d_gap_normal;
    BlockRows<dim, dim> d_force, d_force_normal;

    MortarSums(int n_slave, int n_master, std::size_t n_facets, std::size_t n_pairs)
        : diagonal(n_slave), gap(n_slave), area(n_facets), force(dim * (n_slave + n_master)), used(n_pairs) {}
};

template <typename Slave, typename Master, bool derivatives>
class FacetAssembly {
    static constexpr int n = Slave::nodes, m = Master::nodes, dim = Slave::dim;
    static constexpr int directions = pair_directions<Slave, Master>;
    using T = std::conditional_t<derivatives, Dual<directions>, double>;

    using Geometry = PairGeometry<Slave, Master, T>;
    using PointType = std::conditional_t<dim == 3, Point<Slave, Master, T>, LinePoint<T>>;

    struct Pair {
        Geometry geometry;
        FacetNodes<Master> nodes;
        PairIntegrals<Slave, Master, T> integrals{};
        int place[m] = {};       // of its nodes among the facet's masters
        std::size_t number = 0;  // in the input

        template <typename... Shape>
        explicit Pair(const FacetNodes<Master>& nodes, const Shape&... shape) : geometry(shape...), nodes(nodes) {}
    };

  public:
    FacetAssembly(const MortarInput& input, MortarSums<dim>& sums) : in_(input), sums_(sums) {}

    // The pairs first..last of the input, all of one slave facet.
    void add(std::size_t first, std::size_t last) {
        const int facet = in_.pairs[2 * first];
        gather(in_.slave_facets + std::size_t(facet) * n, in_.slave_x, slave_nodes_, slave_.x);
        gather(in_.slave_facets + std::size_t(facet) * n, in_.normals, slave_nodes_, slave_.normal);
        slave_.along = in_.along;
        slave_.rise = in_.rise;
        integrate(first, last);
        if (pairs_.empty()) return;

        double mass[n][n] = {}, cover = 0.0;
        for (double& g : gap_) g = 0.0;
        for (const Pair& pair : pairs_) {
            for (int k = 0; k < n; ++k) {
                for (int j = 0; j < n; ++j) mass[k][j] += value_of(pair.integrals.mass_at(k, j));
                gap_[k] += value_of(pair.integrals.gap[k]);
            }
            cover += value_of(pair.integrals.cover);
        }
        for (const Pair& pair : pairs_) sums_.used[pair.number] = 1;
        const DualBasis<Slave> basis(mass, cover);
        sum_values(facet, mass, basis);
        if constexpr (derivatives) sum_derivatives(basis);
    }

  private:
    template <typename Nodes, int width>
    static void gather(const std::int64_t* facet, const double* from, Nodes& nodes, double (*to)[width]) {
        for (int i = 0; i < static_cast<int>(std::size(nodes)); ++i) {
            nodes[i] = static_cast<int>(facet[i]);
            for (int c = 0; c < width; ++c) to[i][c] = from[facet[i] * width + c];
        }
    }

    void integrate(std::size_t first, std::size_t last) {
        pairs_.clear();
        pairs_.reserve(last - first);
        masters_.clear();
        const FacetBall<Slave> ball(slave_.x);
        radius_ = ball.radius;
        if constexpr (dim == 3) {
            const PlaneFrame<Slave> frame(slave_.x);
            scale_ = frame.area;
            if constexpr (derivatives) frame.area_slopes(scale_slopes_);
            if (!may_be_near(first, last, ball, frame)) return;
            collect(first, last, ball, [&](const FacetNodes<Master>& master, const int* nodes, std::size_t number) {
                if (frame.template apart<n, m>(slave_.x, master.x)) return;
                Pair& pair = pairs_.emplace_back(master, frame, slave_.x, master.x);
                if (!in_.elements) add_segments(pair, Everywhere{});
                keep_if_met(nodes, number);
            });
        } else {
            collect(first, last, ball, [&](const FacetNodes<Master>& master, const int* nodes, std::size_t number) {
                Pair& pair = pairs_.emplace_back(master, slave_.normal, slave_.x, master.x);
                if (!in_.elements) add_segments(pair, Everywhere{});
                keep_if_met(nodes, number);
            });
        }
        if (in_.elements)
            add_element_points(element_rule<Slave>());
        else
            hide_behind_each_other();
        if (!is_near()) pairs_.clear();
    }

    template <typename Visit>
    void collect(std::size_t first, std::size_t last, const FacetBall<Slave>& ball, Visit&& visit) const {
        for (std::size_t p = first; p < last; ++p) {
            FacetNodes<Master> master;
            int nodes[m];
            gather(in_.master_facets + std::size_t(in_.pairs[2 * p + 1]) * m, in_.master_x, nodes, master.x);
            if (!in_.is_kept(p) && !ball.sees(FacetBall<Master>(master.x), in_.reach, in_.facing)) continue;
            visit(master, nodes, p);
        }
    }

    // False only if `is_near` would be, for linear facets in 3D, before anything is integrated. The points of a pair lie
    // on a line along the normal of the plane, at a distance of at least that between the nodes of both facets. Nodal
    // normals have lengths of 1, and their means are shorter.
    bool may_be_near(std::size_t first, std::size_t last, const FacetBall<Slave>& ball,
                     const PlaneFrame<Slave>& frame) const {
        if constexpr (Slave::order > 1 || Master::order > 1) return true;
        double top = dot(frame.normal, slave_.x[0]), least = 1.0;
        for (int i = 0; i < n; ++i) {
            top = std::max(top, dot(frame.normal, slave_.x[i]));
            least = std::min(least, dot(frame.normal, slave_.along ? slave_.along : slave_.normal[i]));
        }
        bool near = false;
        collect(first, last, ball, [&](const FacetNodes<Master>& master, const int*, std::size_t number) {
            if (near || frame.template apart<n, m>(slave_.x, master.x)) return;
            double bottom = dot(frame.normal, master.x[0]);
            for (int l = 1; l < m; ++l) bottom = std::min(bottom, dot(frame.normal, master.x[l]));
            near = in_.is_kept(number) || !(least > 0.0) || (bottom - top) * least <= in_.near * (1.0 + 1e-9);
        });
        return near;
    }

    static double mean_gap(const Pair& pair) {
        double gap = 0.0, measure = 0.0;
        for (int k = 0; k < n; ++k) {
            gap += value_of(pair.integrals.gap[k]);
            for (int j = 0; j < n; ++j) measure += value_of(pair.integrals.mass_at(k, j));
        }
        return gap / measure;
    }

    // A slave facet counts as a whole or not at all: dual functions are negative in places, so that a facet of which
    // only a far part sees a master would weigh an open gap as a closed one.
    bool is_near() const {
        return std::any_of(pairs_.begin(), pairs_.end(), [&](const Pair& pair) {
            return in_.is_kept(pair.number) || mean_gap(pair) <= in_.near;
        });
    }

    // Drops the last pair if it has no points, or lies behind the slave by more than the reach (segments); else gives
    // its nodes their places.
    void keep_if_met(const int* nodes, std::size_t number) {
        pairs_.back().number = number;
        if (!in_.elements && (value_of(pairs_.back().integrals.cover) == 0.0 ||
                              (!in_.is_kept(number) && mean_gap(pairs_.back()) < -in_.reach))) {
            pairs_.pop_back();
            return;
        }
        for (int l = 0; l < m; ++l) {
            const auto found = std::find(masters_.begin(), masters_.end(), nodes[l]);
            pairs_.back().place[l] = static_cast<int>(found - masters_.begin());
            if (found == masters_.end()) masters_.push_back(nodes[l]);
        }
    }

    struct Everywhere {};

    // Adds the points of a pair for which wanted(gap, place on the slave) holds. The place is that in the plane in 3D.
    template <typename Wanted>
    void add_segments(Pair& pair, Wanted&& wanted) {
        constexpr bool all = std::is_same_v<std::decay_t<Wanted>, Everywhere>;
        if constexpr (dim == 3)
            visit_cells(pair.geometry, [&](const auto& on_slave, const auto& on_master, const T& weight) {
                if constexpr (!all) {
                    double place[2] = {};
                    for (int i = 0; i < n; ++i)
                        for (int a = 0; a < 2; ++a) place[a] += on_slave.N[i] * value_of(pair.geometry.slave[i][a]);
                    if (!wanted(gap_at(on_slave, on_master, slave_, pair.nodes), place)) return;
                }
                pair.integrals.add(on_slave, on_master, weight, slave_, pair.nodes);
            });
        else
            visit_segment(pair.geometry, [&](const auto& point) {
                if constexpr (!all) {
                    const double xi = value_of(point.slave), eta = value_of(point.master);
                    if (!wanted(gap_at(xi, eta, slave_, pair.nodes), &xi)) return;
                }
                pair.integrals.add(point, pair.geometry, slave_);
            });
    }

    bool is_nearer(const Pair& pair, double gap, const double* place) const;  // hidden_masters.hpp
    bool may_hide(const Pair& a, const Pair& b) const;                        // hidden_masters.hpp
    void hide_behind_each_other();                                            // hidden_masters.hpp

    // Every fixed point goes to the first master that it meets.
    void add_element_points(const std::vector<RulePoint>& rule) {
        const std::size_t n_points = rule.size();
        std::vector<PointType> points(pairs_.size() * n_points);
        const auto found = std::make_unique<bool[]>(points.size());
        for (std::size_t p = 0; p < pairs_.size(); ++p)
            find_element_points(pairs_[p].geometry, rule, points.data() + p * n_points, found.get() + p * n_points);
        for (std::size_t q = 0; q < n_points; ++q) {
            std::size_t best = pairs_.size();
            double nearest = 0.0;
            for (std::size_t p = 0; p < pairs_.size(); ++p) {
                if (!found[p * n_points + q]) continue;
                const double gap = gap_at_point(pairs_[p], points[p * n_points + q]);
                if (!in_.is_kept(pairs_[p].number) && gap < -in_.reach) continue;
                if (best < pairs_.size() && gap >= nearest) continue;
                best = p;
                nearest = gap;
            }
            if (best < pairs_.size()) add_point(pairs_[best], points[best * n_points + q]);
        }
        std::erase_if(pairs_, [](const Pair& pair) { return value_of(pair.integrals.cover) == 0.0; });
    }

    double gap_at_point(const Pair& pair, const PointType& point) const {
        if constexpr (dim == 3)
            return gap_at(point.slave, point.master, slave_, pair.nodes);
        else
            return gap_at(value_of(point.slave), value_of(point.master), slave_, pair.nodes);
    }

    void add_point(Pair& pair, const PointType& point) {
        if constexpr (dim == 3)
            pair.integrals.add(point.slave, point.master, point.weight, slave_, pair.nodes);
        else
            pair.integrals.add(point, pair.geometry, slave_);
    }

    void sum_values(int facet, const double (*mass)[n], const DualBasis<Slave>& basis) {
        double* own = sums_.own_coupling.add(slave_nodes_, slave_nodes_);
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                *own = 0.0;
                for (int k = 0; k < n; ++k) *own += scale_ * basis.A[j][k] * mass[k][i];
                ++own;
            }

        coupling_.assign(n * masters_.size(), 0.0);
        for (const Pair& pair : pairs_)
            for (int k = 0; k < n; ++k)
                for (int l = 0; l < m; ++l)
                    coupling_[k * masters_.size() + pair.place[l]] += value_of(pair.integrals.coupling[k][l]);

        double* M = sums_.coupling.add(slave_nodes_, masters_);
        std::fill_n(M, n * masters_.size(), 0.0);
        for (int j = 0; j < n; ++j) {
            sums_.diagonal[slave_nodes_[j]] += scale_ * basis.D[j];
            sums_.area[facet] += scale_ * basis.D[j];
            for (int k = 0; k < n; ++k) {
                sums_.gap[slave_nodes_[j]] += scale_ * basis.A[j][k] * gap_[k];
                for (std::size_t l = 0; l < masters_.size(); ++l)
                    M[j * masters_.size() + l] += scale_ * basis.A[j][k] * coupling_[k * masters_.size() + l];
            }
        }
        if (!in_.z) return;
        for (int j = 0; j < n; ++j)
            for (int c = 0; c < dim; ++c) {
                const double z = in_.z[slave_nodes_[j] * dim + c];
                sums_.force[slave_nodes_[j] * dim + c] -= scale_ * basis.D[j] * z;
                for (std::size_t l = 0; l < masters_.size(); ++l)
                    sums_.force[(in_.n_slave + masters_[l]) * dim + c] += M[j * masters_.size() + l] * z;
            }
    }

    void sum_derivatives(const DualBasis<Slave>& basis);  // facet_derivatives.hpp

    const MortarInput& in_;
    MortarSums<dim>& sums_;
    int slave_nodes_[n];
    FacetNodes<Slave> slave_;
    std::vector<Pair> pairs_;
    std::vector<int> masters_;                         // distinct master nodes of all pairs
    std::vector<double> coupling_;                     // int N~_k N^m_l over all pairs, n x masters
    double radius_ = 0.0, gap_[n], scale_ = 1.0, scale_slopes_[3 * n];  // int N~_k g; |g_1 x g_2| and its derivative (3D)

    // local derivatives, one row per function; columns: slave normals, slave nodes, masters
    std::vector<double> d_diagonal_, d_gap_, d_y_, d_force_;
};

}  // namespace mortar
