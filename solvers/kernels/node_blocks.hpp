// Dense blocks of n x n entries of a matrix in compressed rows, one for each pair of nodes with a common entry.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace node_blocks {

struct Rows {
    const std::int32_t *start, *columns;
    const double* values;
};

struct Blocks {
    std::vector<std::int32_t> start, columns;  // increasing in each row, with the diagonal
    std::vector<double> values;                // by columns of each block
};

// The blocks of `nodes` nodes; rows and columns of a node are n consecutive ones.
template <int n>
Blocks collect(std::size_t nodes, const Rows& A) {
    constexpr std::size_t area = n * n;
    Blocks found;
    found.start.assign(nodes + 1, 0);
    std::vector<std::int32_t> place(nodes, -1);
    const auto entries = static_cast<std::size_t>(A.start[nodes * n]);
    found.columns.reserve(entries / area + nodes);
    found.values.reserve(entries + nodes * area);
    for (std::size_t i = 0; i < nodes; ++i) {
        const auto begin = found.columns.size();
        place[i] = 0;
        found.columns.push_back(static_cast<std::int32_t>(i));
        for (int r = 0; r < n; ++r) {
            std::int32_t before = -1;
            for (std::int32_t k = A.start[i * n + r]; k < A.start[i * n + r + 1]; ++k) {
                const std::int32_t node = A.columns[k] / n;
                if (node != before && place[node] < 0) {
                    place[node] = 0;
                    found.columns.push_back(node);
                }
                before = node;
            }
        }
        std::sort(found.columns.begin() + begin, found.columns.end());
        for (auto k = begin; k < found.columns.size(); ++k) place[found.columns[k]] = static_cast<std::int32_t>(k);
        found.values.resize(found.columns.size() * area, 0.0);
        double* row = found.values.data();
        for (int r = 0; r < n; ++r)
            for (std::int32_t k = A.start[i * n + r]; k < A.start[i * n + r + 1]; ++k) {
                const std::int32_t node = A.columns[k] / n, c = A.columns[k] - n * node;
                row[static_cast<std::size_t>(place[node]) * area + c * n + r] += A.values[k];
            }
        for (auto k = begin; k < found.columns.size(); ++k) place[found.columns[k]] = -1;
        found.start[i + 1] = static_cast<std::int32_t>(found.columns.size());
    }
    return found;
}

// The entries of blocks, given by columns of each, in the order of compressed rows: the inverse of `collect` for matrices
// whose blocks are full.
template <int n>
void spread(std::size_t nodes, const std::int32_t* start, const double* blocks, double* entries) {
    for (std::size_t i = 0; i < nodes; ++i)
        for (int r = 0; r < n; ++r)
            for (std::int32_t k = start[i]; k < start[i + 1]; ++k)
                for (int c = 0; c < n; ++c) *entries++ = blocks[static_cast<std::size_t>(k) * n * n + c * n + r];
}

}  // namespace node_blocks
