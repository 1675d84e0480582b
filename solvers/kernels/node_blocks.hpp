// Dense blocks of n x n entries of a matrix in compressed rows, one for each pair of nodes with a common entry.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace node_blocks {

struct Rows {
    const std::int32_t *start, *columns;
    const double* values;
};

struct Blocks {
    std::vector<std::int32_t> start, columns;  // increasing in each row, with the diagonal
    std::unique_ptr<double[]> values;          // by columns of each block
};

// Whether the rows of a node consist of full blocks, the diagonal among them: in contact most rows do.
template <int n>
bool is_full(std::size_t node, const Rows& A) {
    const std::int32_t begin = A.start[node * n], size = A.start[node * n + 1] - begin;
    const std::int32_t* columns = A.columns + begin;
    if (size % n != 0) return false;
    for (int r = 1; r < n; ++r) {
        const std::int32_t other = A.start[node * n + r];
        if (A.start[node * n + r + 1] - other != size) return false;
        if (!std::equal(columns, columns + size, A.columns + other)) return false;
    }
    bool diagonal = false, full = true;
    for (std::int32_t k = 0; k < size; k += n) {
        full &= columns[k] % n == 0 && (k == 0 || columns[k - n] < columns[k]);
        for (int c = 1; c < n; ++c) full &= columns[k + c] == columns[k] + c;
        diagonal |= columns[k] == static_cast<std::int32_t>(node) * n;
    }
    return full && diagonal;
}

// The blocks of `nodes` nodes; rows and columns of a node are n consecutive ones.
template <int n>
Blocks collect(std::size_t nodes, const Rows& A) {
    constexpr std::size_t area = n * n;
    Blocks found;
    found.start.assign(nodes + 1, 0);
    std::vector<std::int32_t> place(nodes, -1);
    std::vector<char> full(nodes);
    found.columns.reserve(static_cast<std::size_t>(A.start[nodes * n]) / area + nodes);
    for (std::size_t i = 0; i < nodes; ++i) {
        full[i] = is_full<n>(i, A);
        if (full[i]) {
            for (std::int32_t k = A.start[i * n]; k < A.start[i * n + 1]; k += n)
                found.columns.push_back(A.columns[k] / n);
        } else {
            const auto begin = found.columns.size();
            place[i] = 0;
            found.columns.push_back(static_cast<std::int32_t>(i));
            for (std::int32_t k = A.start[i * n]; k < A.start[(i + 1) * n]; ++k) {
                const std::int32_t node = A.columns[k] / n;
                if (place[node] == 0) continue;
                place[node] = 0;
                found.columns.push_back(node);
            }
            std::sort(found.columns.begin() + begin, found.columns.end());
            for (auto k = begin; k < found.columns.size(); ++k) place[found.columns[k]] = -1;
        }
        found.start[i + 1] = static_cast<std::int32_t>(found.columns.size());
    }
    found.values = std::make_unique_for_overwrite<double[]>(found.columns.size() * area);
    for (std::size_t i = 0; i < nodes; ++i) {
        const std::int32_t first = found.start[i], end = found.start[i + 1];
        double* row = found.values.get() + static_cast<std::size_t>(first) * area;
        if (full[i]) {
            for (std::int32_t k = 0; k < end - first; ++k)
                for (int c = 0; c < n; ++c)
                    for (int r = 0; r < n; ++r) *row++ = A.values[A.start[i * n + r] + k * n + c];
            continue;
        }
        std::fill(row, row + static_cast<std::size_t>(end - first) * area, 0.0);
        for (std::int32_t k = first; k < end; ++k) place[found.columns[k]] = k - first;
        for (int r = 0; r < n; ++r)
            for (std::int32_t k = A.start[i * n + r]; k < A.start[i * n + r + 1]; ++k) {
                const std::int32_t node = A.columns[k] / n, c = A.columns[k] - n * node;
                row[static_cast<std::size_t>(place[node]) * area + c * n + r] += A.values[k];
            }
        for (std::int32_t k = first; k < end; ++k) place[found.columns[k]] = -1;
    }
    return found;
}

// The entries of blocks, given by columns of each, times a factor in the order of compressed rows: the inverse of
// `collect` for matrices whose blocks are full.
template <int n>
void spread(std::size_t nodes, const std::int32_t* start, const double* blocks, double factor, double* entries) {
    for (std::size_t i = 0; i < nodes; ++i)
        for (int r = 0; r < n; ++r)
            for (std::int32_t k = start[i]; k < start[i + 1]; ++k)
                for (int c = 0; c < n; ++c)
                    *entries++ = factor * blocks[static_cast<std::size_t>(k) * n * n + c * n + r];
}

}  // namespace node_blocks
