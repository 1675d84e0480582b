// P^T A P of a sparse matrix A of dense blocks, one per pair of nodes. P interpolates all components of a node alike,
// but for marks of single unknowns: row (i, a) of P has mark (i, a) times weight (i, I) in column (I, a).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <vector>

namespace coarse {

// Which blocks there are, by compressed rows.
struct Pattern {
    std::vector<std::int32_t> start, columns;
};

struct Rows {
    const std::int32_t *start, *columns;
};

// The blocks of P^T A P, columns in each row increasing. A has `rows` rows, P as many as A has columns or more.
inline Pattern pattern(std::size_t rows, Rows A, Rows P, std::size_t coarse) {
    std::vector<std::int32_t> first(coarse + 1, 0), children(P.start[rows]);  // rows of P by their columns
    for (std::int32_t k = 0; k < P.start[rows]; ++k) ++first[P.columns[k] + 1];
    for (std::size_t I = 0; I < coarse; ++I) first[I + 1] += first[I];
    std::vector<std::int32_t> next(first.begin(), first.end() - 1);
    for (std::size_t i = 0; i < rows; ++i)
        for (std::int32_t k = P.start[i]; k < P.start[i + 1]; ++k)
            children[next[P.columns[k]]++] = static_cast<std::int32_t>(i);

    Pattern found{{0}, {}};
    std::vector<std::int32_t> seen(coarse, -1);
    for (std::size_t I = 0; I < coarse; ++I) {
        for (std::int32_t c = first[I]; c < first[I + 1]; ++c)
            for (std::int32_t k = A.start[children[c]]; k < A.start[children[c] + 1]; ++k)
                for (std::int32_t l = P.start[A.columns[k]]; l < P.start[A.columns[k] + 1]; ++l)
                    if (std::int32_t& mark = seen[P.columns[l]]; mark != static_cast<std::int32_t>(I)) {
                        mark = static_cast<std::int32_t>(I);
                        found.columns.push_back(P.columns[l]);
                    }
        std::sort(found.columns.begin() + found.start.back(), found.columns.end());
        if (found.columns.size() > std::numeric_limits<std::int32_t>::max())
            throw std::length_error("more than 2^31 blocks in a coarse matrix");
        found.start.push_back(static_cast<std::int32_t>(found.columns.size()));
    }
    return found;
}

// Their values, each block by columns, as in A; `result` has zeros before.
template <int size>
void product(std::size_t rows, Rows A, const double* values, Rows P, const double* weights, const double* marks,
             std::size_t coarse, Rows C, double* result) {
    constexpr int area = size * size;
    std::vector<std::int32_t> place(coarse, -1), present;
    std::vector<double> row;  // of A P, its blocks in the order of `present`
    for (std::size_t i = 0; i < rows; ++i) {
        present.clear();
        row.clear();
        if (P.start[i] == P.start[i + 1]) continue;
        for (std::int32_t k = A.start[i]; k < A.start[i + 1]; ++k) {
            const std::int32_t j = A.columns[k];
            double block[area];
            for (int b = 0; b < size; ++b)
                for (int a = 0; a < size; ++a)
                    block[b * size + a] =
                        values[static_cast<std::size_t>(k) * area + b * size + a] * marks[j * size + b] * marks[i * size + a];
            for (std::int32_t l = P.start[j]; l < P.start[j + 1]; ++l) {
                std::int32_t& at = place[P.columns[l]];
                if (at < 0) {
                    at = static_cast<std::int32_t>(present.size());
                    present.push_back(P.columns[l]);
                    row.resize(row.size() + area, 0.0);
                }
                double* sum = row.data() + static_cast<std::size_t>(at) * area;
                for (int e = 0; e < area; ++e) sum[e] += weights[l] * block[e];
            }
        }
        for (std::int32_t l = P.start[i]; l < P.start[i + 1]; ++l) {
            const std::int32_t *begin = C.columns + C.start[P.columns[l]], *end = C.columns + C.start[P.columns[l] + 1];
            for (std::size_t p = 0; p < present.size(); ++p) {
                double* sum = result + (std::lower_bound(begin, end, present[p]) - C.columns) * area;
                const double* some = row.data() + p * area;
                for (int e = 0; e < area; ++e) sum[e] += weights[l] * some[e];
            }
        }
        for (const std::int32_t column : present) place[column] = -1;
    }
}

}  // namespace coarse
