// Sums of the squares of the products in each row of a matrix of dense blocks: y_i = sum_j (a_ij x_j)^2.
#pragma once

#include <cstddef>
#include <cstdint>

namespace row_squares {

// n x n blocks in compressed rows, each by columns.
template <int n>
void add(std::size_t rows, const std::int32_t* start, const std::int32_t* columns, const double* blocks,
         const double* x, double* y) {
    for (std::size_t i = 0; i < rows; ++i) {
        double sums[n] = {};
        for (std::int32_t k = start[i]; k < start[i + 1]; ++k) {
            const double *block = blocks + n * n * static_cast<std::size_t>(k),
                         *own = x + n * static_cast<std::size_t>(columns[k]);
            for (int c = 0; c < n; ++c)
                for (int r = 0; r < n; ++r) {
                    const double product = block[n * c + r] * own[c];
                    sums[r] += product * product;
                }
        }
        for (int r = 0; r < n; ++r) y[n * i + r] += sums[r];
    }
}

}  // namespace row_squares
