// Moments of the solid in the cells of a box grid, and of its surface, from the surface alone.
//
// The characteristic function of a solid is a sum over the facets t of its surface,
//
//     chi(x, y, z) = sum_t s_t 1[(y, z) in the projection of t along x] 1[x < x_t(y, z)],
//
// s_t the sign of the outward normal's x component. Hence with the Lagrange basis L_abc = l_a(x) l_b(y) l_c(z)
// on the tensor points of a cell, and A_a(x) the integral of l_a from the left side of the cell,
//
//     integral of L_abc over the solid in a cell
//       =   sum over the pieces of facets in the cell             of  integral A_a(x) l_b l_c d(y, z)
//         + sum over those to its right in the same column, A_a(1) times  integral l_b l_c d(y, z),
//
// d(y, z) signed, i.e. the x component of n ds. All integrands are polynomials on plane polygons and get a Gauss
// rule that is exact. No rays, no question whether a point is inside; bodies that overlap count twice where they
// do. Same in 2D with segments.
//
// Every sum is done in an order that does not depend on which cells are wanted, and the compiler is told not to
// fuse multiplications and additions (CMakeLists.txt), which it would do here and not there: processes that ask
// for the same cell get the same bits.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numeric>
#include <vector>

#include "moments_clip.hpp"
#include "moments_rule.hpp"

namespace moments {

// Numbers without an initial value: some of these arrays are large and all are written once.
template <typename T>
struct Array {
  std::unique_ptr<T[]> data;
  std::size_t size = 0;

  Array() = default;
  explicit Array(std::size_t n) : data(std::make_unique_for_overwrite<T[]>(n)), size(n) {}
  T& operator[](std::size_t i) { return data[i]; }
};

struct Result {
  Array<double> fraction;
  Array<std::int64_t> cells;
  Array<double> solid;
  Array<std::int64_t> piece_cell, piece_facet;
  Array<double> piece_moments, piece_mass;
};

template <int Dim, int N>
class Integrator {
public:
  static constexpr int face_size = Dim == 2 ? N : N * N;
  static constexpr int size = N * face_size;
  static constexpr int rule_size = simplex_rule_size<Dim>(N);

  using Face = std::array<double, face_size>;  // integrals of l_b l_c d(y, z), f = b + N c

  Integrator(const Grid<Dim>& grid, const Surface<Dim>& surface, const double* points)
    : grid_(grid), surface_(surface), basis_(points), rule_(rule()) {}

  Result compute() {
    const Cutter<Dim> cutter(grid_, surface_);
    sort(cutter);
    integrate(cutter);
    return std::move(result_);
  }

private:
  static const std::vector<SimplexPoint<Dim>>& rule() {
    static const auto computed = simplex_rule<Dim>(N);
    return computed;
  }

  static bool before(const Piece<Dim>& p, const Piece<Dim>& q) {
    return p.i != q.i ? p.i < q.i : p.facet < q.facet;
  }

  // By column, then along x, then by facet; without those that have no area.
  void sort(const Cutter<Dim>& cutter) {
    std::vector<Piece<Dim>> pieces;
    pieces.reserve(cutter.pieces.size());
    for (const auto& piece : cutter.pieces) {
      double measure = 0;
      for_simplices(piece, &cutter.vertices[piece.first], [&](const Simplex& s) { measure += s.measure; });
      if (measure > 0) pieces.push_back(piece);  // false also for a facet without a normal
    }
    begin_.assign(static_cast<std::size_t>(grid_.columns()) + 1, 0);
    for (const auto& piece : pieces) ++begin_[piece.column + 1];
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    sorted_.resize(pieces.size());
    auto next = begin_;
    for (const auto& piece : pieces) sorted_[next[piece.column]++] = piece;
    for (std::size_t column = 0; column + 1 < begin_.size(); ++column)
      std::sort(sorted_.begin() + begin_[column], sorted_.begin() + begin_[column + 1], before);
  }

  bool detailed(const Piece<Dim>& piece) const { return piece.i < grid_.cells(0) && grid_.wanted(number(piece)); }

  std::int64_t number(const Piece<Dim>& piece) const { return piece.i + grid_.cells(0) * piece.column; }

  void allocate() {
    std::size_t cells = 0, pieces = 0;
    std::int64_t last = -1;
    for (const auto& piece : sorted_) {
      if (!detailed(piece)) continue;
      cells += number(piece) != last;
      last = number(piece);
      ++pieces;
    }
    result_.fraction = Array<double>(static_cast<std::size_t>(grid_.count()));
    result_.cells = Array<std::int64_t>(cells);
    result_.solid = Array<double>(cells * size);
    result_.piece_cell = Array<std::int64_t>(pieces);
    result_.piece_facet = Array<std::int64_t>(pieces);
    result_.piece_moments = Array<double>(pieces * size * Dim);
    result_.piece_mass = Array<double>(pieces * Dim * Dim);
    cell_ = cells;
    piece_ = pieces;
  }

  // Backwards through everything, so that each column is scanned from its right end.
  void integrate(const Cutter<Dim>& cutter) {
    allocate();
    const int nx = grid_.cells(0);
    for (std::int64_t column = grid_.columns(); column-- > 0;) {
      double* fraction = &result_.fraction[static_cast<std::size_t>(column * nx)];
      Face right{};  // of all pieces to the right
      double covered = 0;
      std::size_t p = begin_[column + 1];
      for (int i = nx; i >= 0; --i) {
        Face here{};
        const std::int64_t cell = i + nx * column;
        const bool wanted = i < nx && grid_.wanted(cell);
        if (i < nx) fraction[i] = wanted ? covered : std::numeric_limits<double>::quiet_NaN();
        if (p == begin_[column] || sorted_[p - 1].i != i) continue;
        std::array<double, size> own{};
        for (; p > begin_[column] && sorted_[p - 1].i == i; --p) {
          const Piece<Dim>& piece = sorted_[p - 1];
          const Vertex<Dim>* corner = &cutter.vertices[piece.first];
          if (wanted)
            add_piece(piece, corner, own, here);
          else
            add_face(piece, corner, here);
        }
        if (wanted) fraction[i] = add_cell(cell, own, right);
        for (int f = 0; f < face_size; ++f) right[f] += here[f];
        covered = std::accumulate(right.begin(), right.end(), 0.0);
      }
    }
  }

  double add_cell(std::int64_t cell, const std::array<double, size>& own, const Face& right) {
    --cell_;
    result_.cells[cell_] = cell;
    double* solid = &result_.solid[cell_ * size];
    double sum = 0;
    for (int f = 0; f < face_size; ++f)
      for (int a = 0; a < N; ++a) {
        double value = basis_.full[a] * right[f];
        for (int q = 0; q < N; ++q) value += basis_.mean[a][q] * own[f * N + q];
        solid[f * N + a] = value;
        sum += value;
      }
    return sum;
  }

  // A segment, or a triangle of the fan that makes up a polygon.
  struct Simplex {
    std::array<const Vertex<Dim>*, Dim> corner;
    double measure;    // length or area [m^(Dim - 1)]
    double projected;  // along x, signed, relative to the cell's cross-section
  };

  // Calls use(simplex) for each simplex of a piece.
  template <typename Use>
  void for_simplices(const Piece<Dim>& piece, const Vertex<Dim>* corner, Use&& use) const {
    const auto n = surface_.normal(piece.facet);
    const std::int64_t j = piece.column % grid_.cells(1), k = piece.column / grid_.cells(1);
    const auto width = [&](int d, std::int64_t i) { return grid_.edges(d)[i + 1] - grid_.edges(d)[i]; };
    const double hx = piece.i < grid_.cells(0) ? width(0, piece.i) : 1, hy = width(1, j);
    Simplex simplex;
    if constexpr (Dim == 2) {
      const double length = std::hypot(n[0], n[1]);
      const double dx = corner[1].x[0] - corner[0].x[0], dy = corner[1].x[1] - corner[0].x[1];
      simplex.corner = {corner, corner + 1};
      simplex.measure = (n[0] * (hy * dy) - n[1] * (hx * dx)) / length;
      simplex.projected = dy;
      use(simplex);
    } else {
      const double hz = width(2, k), length = std::hypot(n[0], n[1], n[2]);
      const std::array<double, 3> to_area{n[0] / length * hy * hz, n[1] / length * hz * hx,
                                          n[2] / length * hx * hy};
      for (int v = 1; v + 1 < piece.corners; ++v) {
        std::array<double, 3> p, q;
        for (int d = 0; d < 3; ++d) {
          p[d] = corner[v].x[d] - corner[0].x[d];
          q[d] = corner[v + 1].x[d] - corner[0].x[d];
        }
        const std::array<double, 3> twice{p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2],
                                          p[0] * q[1] - p[1] * q[0]};
        simplex.corner = {corner, corner + v, corner + v + 1};
        simplex.measure = 0.5 * (to_area[0] * twice[0] + to_area[1] * twice[1] + to_area[2] * twice[2]);
        simplex.projected = 0.5 * twice[0];
        use(simplex);
      }
    }
  }

  // At the Gauss points of a simplex.
  struct Samples {
    std::array<Vertex<Dim>, rule_size> at;
    std::array<std::array<double, N>, rule_size> along;          // l_a(x)
    std::array<std::array<double, face_size>, rule_size> across;  // weight l_b(y) l_c(z)
  };

  void sample(const Simplex& simplex, Samples& samples) const {
    for (int p = 0; p < rule_size; ++p) {
      const auto& point = rule_[p];
      Vertex<Dim> at{};
      for (int v = 0; v < Dim; ++v)
        for (int d = 0; d < Dim; ++d) {
          at.x[d] += point.corner[v] * simplex.corner[v]->x[d];
          at.lambda[d] += point.corner[v] * simplex.corner[v]->lambda[d];
        }
      samples.at[p] = at;
      samples.along[p] = basis_.values(at.x[0]);
      const auto b = basis_.values(at.x[1]);
      if constexpr (Dim == 2) {
        for (int f = 0; f < N; ++f) samples.across[p][f] = point.weight * b[f];
      } else {
        const auto c = basis_.values(at.x[2]);
        for (int f = 0; f < face_size; ++f) samples.across[p][f] = point.weight * b[f % N] * c[f / N];
      }
    }
  }

  static void add_face(const Simplex& simplex, const Samples& samples, Face& face) {
    Face sum{};
    for (const auto& across : samples.across)
      for (int f = 0; f < face_size; ++f) sum[f] += across[f];
    for (int f = 0; f < face_size; ++f) face[f] += simplex.projected * sum[f];
  }

  void add_face(const Piece<Dim>& piece, const Vertex<Dim>* corner, Face& face) const {
    Samples samples;
    for_simplices(piece, corner, [&](const Simplex& simplex) {
      sample(simplex, samples);
      add_face(simplex, samples, face);
    });
  }

  // Four numbers the processor works on at once. Of them Dim are integrals of L_q lambda_v ds, then comes that
  // of L_q x d(y, z).
  using Lanes [[gnu::vector_size(4 * sizeof(double))]] = double;
  using Values = std::array<Lanes, size>;

  static void add_values(const Simplex& simplex, const Samples& samples, Values& values) {
    std::array<std::array<Lanes, N>, rule_size> along;
    for (int p = 0; p < rule_size; ++p) {
      Lanes factor{};
      for (int v = 0; v < Dim; ++v) factor[v] = simplex.measure * samples.at[p].lambda[v];
      factor[Dim] = simplex.projected * samples.at[p].x[0];
      for (int a = 0; a < N; ++a) along[p][a] = samples.along[p][a] * factor;
    }
    for (int f = 0; f < face_size; ++f) {
      std::array<Lanes, N> sum{};
      for (int p = 0; p < rule_size; ++p)
        for (int a = 0; a < N; ++a) sum[a] += samples.across[p][f] * along[p][a];
      for (int a = 0; a < N; ++a) values[f * N + a] += sum[a];
    }
  }

  void add_piece(const Piece<Dim>& piece, const Vertex<Dim>* corner, std::array<double, size>& own, Face& face) {
    --piece_;
    result_.piece_cell[piece_] = static_cast<std::int64_t>(cell_) - 1;  // add_cell comes after its pieces
    result_.piece_facet[piece_] = piece.facet;
    std::array<std::array<double, Dim>, Dim> mass{};
    Values values{};
    Samples samples;
    for_simplices(piece, corner, [&](const Simplex& simplex) {
      add_mass(simplex, mass);
      sample(simplex, samples);
      add_face(simplex, samples, face);
      add_values(simplex, samples, values);
    });
    double* moments = &result_.piece_moments[piece_ * size * Dim];
    for (int q = 0; q < size; ++q) {
      for (int v = 0; v < Dim; ++v) moments[q * Dim + v] = values[q][v];
      own[q] += values[q][Dim];
    }
    for (int v = 0; v < Dim; ++v)
      for (int w = 0; w < Dim; ++w) result_.piece_mass[(piece_ * Dim + v) * Dim + w] = mass[v][w];
  }

  // Of two linear functions on a segment or triangle with Dim corners:
  // integral of f g = measure / (Dim (Dim + 1)) (sum_i f_i g_i + sum_i f_i sum_i g_i).
  static void add_mass(const Simplex& simplex, std::array<std::array<double, Dim>, Dim>& mass) {
    std::array<double, Dim> sum{};
    for (const auto* corner : simplex.corner)
      for (int v = 0; v < Dim; ++v) sum[v] += corner->lambda[v];
    for (int v = 0; v < Dim; ++v)
      for (int w = 0; w < Dim; ++w) {
        double products = sum[v] * sum[w];
        for (const auto* corner : simplex.corner) products += corner->lambda[v] * corner->lambda[w];
        mass[v][w] += simplex.measure / (Dim * (Dim + 1)) * products;
      }
  }

  const Grid<Dim>& grid_;
  const Surface<Dim>& surface_;
  Basis<N> basis_;
  const std::vector<SimplexPoint<Dim>>& rule_;

  std::vector<std::size_t> begin_;  // where a column begins in sorted_
  std::vector<Piece<Dim>> sorted_;
  std::size_t cell_ = 0, piece_ = 0;  // one past the next to be written
  Result result_;
};

}  // namespace moments
