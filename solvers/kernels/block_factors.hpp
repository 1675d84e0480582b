// Incomplete factors of a matrix of dense blocks, in single precision: a preconditioner needs few digits, and half the
// memory takes half the time. L and U have the pattern of the matrix, which is sorted in each row and has a diagonal.
// Source: Saad, Iterative Methods for Sparse Linear Systems (2003), section 10.3.2 (the IKJ variant), for blocks.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <new>
#include <stdexcept>
#include <utility>
#include <vector>

// The same function for several generations of processors, of which the loader takes the best.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define FSCI_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define FSCI_CLONES
#endif
#define FSCI_INLINE inline __attribute__((always_inline))

namespace factors {

// A block fits one line of the cache.
template <class T>
struct Aligned {
    using value_type = T;
    Aligned() = default;
    template <class U>
    Aligned(const Aligned<U>&) {}
    T* allocate(std::size_t count) { return static_cast<T*>(::operator new(count * sizeof(T), std::align_val_t{64})); }
    void deallocate(T* at, std::size_t) { ::operator delete(at, std::align_val_t{64}); }
    template <class U>
    bool operator==(const Aligned<U>&) const { return true; }
};

// A column of a block, whose fourth row is empty if there are three: the compiler then needs no advice on how to use
// the registers of the processor.
typedef float Column __attribute__((vector_size(16)));

// A sum of products of blocks and vectors, of which those of different columns do not wait for each other.
template <int n>
struct Sum {
    Column parts[n] = {};

    FSCI_INLINE void add(const Column* block, const Column& x) {
        for (int c = 0; c < n; ++c) parts[c] += block[c] * x[c];
    }
    FSCI_INLINE Column total() const {
        Column sum = parts[0];
        for (int c = 1; c < n; ++c) sum += parts[c];
        return sum;
    }
};

// Overwrites a block with its inverse (Gauss and Jordan, pivots by columns); false if it has none.
template <int n>
FSCI_INLINE bool invert(Column* block) {
    double a[n][2 * n] = {};
    for (int r = 0; r < n; ++r) {
        for (int c = 0; c < n; ++c) a[r][c] = block[c][r];
        a[r][n + r] = 1.0;
    }
    for (int c = 0; c < n; ++c) {
        int best = c;
        for (int r = c + 1; r < n; ++r)
            if (std::abs(a[r][c]) > std::abs(a[best][c])) best = r;
        if (!(std::abs(a[best][c]) > 0.0) || !std::isfinite(a[best][c])) return false;
        for (int k = 0; k < 2 * n; ++k) std::swap(a[c][k], a[best][k]);
        const double scale = 1.0 / a[c][c];
        for (int k = 0; k < 2 * n; ++k) a[c][k] *= scale;
        for (int r = 0; r < n; ++r) {
            if (r == c) continue;
            const double factor = a[r][c];
            for (int k = 0; k < 2 * n; ++k) a[r][k] -= factor * a[c][k];
        }
    }
    for (int c = 0; c < n; ++c)
        for (int r = 0; r < n; ++r) block[c][r] = static_cast<float>(a[r][n + c]);
    return true;
}

// Blocks of L below the diagonal, row by row, then those of U, each row of which begins with the diagonal: what is read
// together lies together.
struct View {
    std::size_t rows;
    const std::int32_t *start, *columns, *lower, *upper;  // of the matrix; where rows of L and of U begin among `blocks`
    Column* blocks;       // of the factors of S A S, the diagonal of U inverted
    std::int32_t* place;  // block of each column in the present row, or one behind all
    Column* scale;        // S: 1 / sqrt(|a_ii|), so that units do not leave the range of the numbers
    const std::int32_t *node, *source;  // row of the caller's matrix for each row; its block for each block
};

template <int n>
FSCI_INLINE Column* block(const View& F, std::int32_t k) {
    return F.blocks + static_cast<std::size_t>(k) * n;
}

// Sum of `count` blocks, from `first` on, times the rows of x in their columns.
template <int n>
FSCI_INLINE Column product(const View& F, std::int32_t count, std::int32_t first, const std::int32_t* columns, const Column* x) {
    Sum<n> sum;
    for (std::int32_t k = 0; k < count; ++k) sum.add(block<n>(F, first + k), x[columns[k]]);
    return sum.total();
}

// Returns false if a block of the diagonal of U has no inverse.
template <int n>
FSCI_INLINE bool factor(View F, const double* values) {
    constexpr int area = n * n;
    const std::int32_t none = F.start[F.rows];
    for (std::size_t i = 0; i < F.rows; ++i) {
        const std::int32_t own = F.start[i] + F.lower[i + 1] - F.lower[i];
        for (int a = 0; a < n; ++a) {
            const double size = std::abs(values[static_cast<std::size_t>(F.source[own]) * area + a * n + a]);
            F.scale[i][a] = size > 0.0 ? static_cast<float>(1.0 / std::sqrt(size)) : 1.0f;
        }
    }
    for (std::size_t i = 0; i < F.rows; ++i) {
        const std::int32_t below = F.lower[i + 1] - F.lower[i], count = F.start[i + 1] - F.start[i];
        for (std::int32_t k = 0; k < count; ++k) {
            const std::int32_t from = F.start[i] + k, to = k < below ? F.lower[i] + k : F.upper[i] + k - below;
            const double* value = values + static_cast<std::size_t>(F.source[from]) * area;
            const Column left = F.scale[i], right = F.scale[F.columns[from]];
            for (int c = 0; c < n; ++c)
                for (int r = 0; r < n; ++r) block<n>(F, to)[c][r] = static_cast<float>(value[c * n + r] * right[c] * left[r]);
            F.place[F.columns[from]] = to;
        }
        for (std::int32_t k = 0; k < below; ++k) {
            const std::int32_t row = F.columns[F.start[i] + k];
            Column lower[n];  // L_ik
            for (int c = 0; c < n; ++c) {
                Sum<n> sum;
                sum.add(block<n>(F, F.lower[i] + k), block<n>(F, F.upper[row])[c]);
                lower[c] = sum.total();
            }
            for (int c = 0; c < n; ++c) block<n>(F, F.lower[i] + k)[c] = lower[c];
            const std::int32_t right = F.upper[row + 1] - F.upper[row] - 1;  // blocks of U right of the diagonal
            const std::int32_t* columns = F.columns + F.start[row + 1] - right;
            for (std::int32_t l = 0; l < right; ++l) {
                // entries outside of the pattern are dropped: a branch would take more time than their product
                const Column* upper = block<n>(F, F.upper[row] + 1 + l);
                Column* target = block<n>(F, F.place[columns[l]]);
                for (int c = 0; c < n; ++c) {
                    Column sum = target[c];
                    for (int m = 0; m < n; ++m) sum -= lower[m] * upper[c][m];
                    target[c] = sum;
                }
            }
        }
        if (!invert<n>(block<n>(F, F.upper[i]))) return false;
        for (std::int32_t k = F.start[i]; k < F.start[i + 1]; ++k) F.place[F.columns[k]] = none;
    }
    return true;
}

// x = S (L U)^-1 S b; work: one column per row.
template <int n>
FSCI_INLINE void solve(View F, const double* b, double* x, Column* work) {
    for (std::size_t i = 0; i < F.rows; ++i) {
        Column right = {};
        const double* own = b + static_cast<std::size_t>(F.node[i]) * n;
        for (int a = 0; a < n; ++a) right[a] = static_cast<float>(own[a] * F.scale[i][a]);
        work[i] = right - product<n>(F, F.lower[i + 1] - F.lower[i], F.lower[i], F.columns + F.start[i], work);
    }
    for (std::size_t i = F.rows; i-- > 0;) {
        const std::int32_t count = F.upper[i + 1] - F.upper[i] - 1;
        const Column known = product<n>(F, count, F.upper[i] + 1, F.columns + F.start[i + 1] - count, work);
        Sum<n> solved;
        solved.add(block<n>(F, F.upper[i]), work[i] - known);
        work[i] = solved.total();
        double* own = x + static_cast<std::size_t>(F.node[i]) * n;
        for (int a = 0; a < n; ++a) own[a] = static_cast<double>(work[i][a]) * F.scale[i][a];
    }
}

FSCI_CLONES inline bool factor_3(View F, const double* values) { return factor<3>(F, values); }
FSCI_CLONES inline bool factor_4(View F, const double* values) { return factor<4>(F, values); }
FSCI_CLONES inline void solve_3(View F, const double* b, double* x, Column* work) { solve<3>(F, b, x, work); }
FSCI_CLONES inline void solve_4(View F, const double* b, double* x, Column* work) { solve<4>(F, b, x, work); }

// Factors for matrices that share a pattern; order: that of elimination, a row of the matrix for each of the factors.
class Factors {
public:
    Factors(std::size_t rows, const std::int32_t* start, const std::int32_t* columns, int size, const std::int32_t* order)
        : size_(size), start_(rows + 1, 0), columns_(static_cast<std::size_t>(start[rows])), lower_(rows + 1, 0),
          upper_(rows + 1), place_(rows), node_(order, order + rows), source_(columns_.size()),
          blocks_((columns_.size() + 1) * static_cast<std::size_t>(size)), scale_(rows), work_(rows) {
        if (size != 3 && size != 4) throw std::invalid_argument("blocks must have 3 or 4 rows");
        std::vector<std::int32_t> number(rows, -1);
        for (std::size_t i = 0; i < rows; ++i) number[node_[i]] = static_cast<std::int32_t>(i);
        std::vector<std::pair<std::int32_t, std::int32_t>> row;
        for (std::size_t i = 0; i < rows; ++i) {
            const auto own = static_cast<std::int32_t>(i), begin = start[node_[i]], end = start[node_[i] + 1];
            row.clear();
            for (std::int32_t k = begin; k < end; ++k) row.emplace_back(number[columns[k]], k);
            const auto less = [](const auto& a, const auto& b) { return a.first < b.first; };
            std::sort(row.begin(), row.end(), less);
            const auto diagonal = std::lower_bound(row.begin(), row.end(), std::pair{own, 0}, less);
            if (!std::is_sorted(columns + begin, columns + end) || diagonal == row.end() || diagonal->first != own)
                throw std::invalid_argument("each row must have increasing columns and a block on the diagonal");
            lower_[i + 1] = lower_[i] + static_cast<std::int32_t>(diagonal - row.begin());
            start_[i + 1] = start_[i] + static_cast<std::int32_t>(row.size());
            for (std::size_t k = 0; k < row.size(); ++k) {
                columns_[start_[i] + k] = row[k].first;
                source_[start_[i] + k] = row[k].second;
            }
        }
        for (std::size_t i = 0; i <= rows; ++i) upper_[i] = lower_[rows] + start_[i] - lower_[i];
    }

    // Blocks by columns. False if the factors do not exist.
    bool update(const double* values) {
        std::fill(place_.begin(), place_.end(), start_.back());
        return size_ == 3 ? factor_3(view(), values) : factor_4(view(), values);
    }

    void solve(const double* b, double* x) {
        if (size_ == 3) solve_3(view(), b, x, work_.data());
        else solve_4(view(), b, x, work_.data());
    }

    std::size_t unknowns() const { return scale_.size() * static_cast<std::size_t>(size_); }
    std::size_t values() const { return columns_.size() * static_cast<std::size_t>(size_ * size_); }

private:
    View view() {
        return {scale_.size(), start_.data(), columns_.data(), lower_.data(), upper_.data(), blocks_.data(), place_.data(),
                scale_.data(), node_.data(), source_.data()};
    }

    int size_;
    std::vector<std::int32_t> start_, columns_, lower_, upper_, place_, node_, source_;
    std::vector<Column, Aligned<Column>> blocks_, scale_, work_;
};

}  // namespace factors
