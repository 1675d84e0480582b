// Products of vectors with a matrix of dense blocks that is stored in single precision. Sums are in double precision, so
// that the product is that of a matrix with rounded entries, whose difference to the given one does not depend on x.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "block_factors.hpp"

namespace block_product {

typedef double Wide __attribute__((vector_size(32)));

struct View {
    std::size_t rows;
    const std::int32_t *start, *columns;
    factors::Column* blocks;     // of L A R, each by columns
    const double *left, *right;  // diagonals of L and R
    double* scaled;              // R^-1 x
};

FSCI_CLONES inline void store(View A, const double* values) {
    for (std::size_t i = 0; i < A.rows; ++i)
        for (std::int32_t k = A.start[i]; k < A.start[i + 1]; ++k) {
            const double *value = values + 16 * static_cast<std::size_t>(k), *right = A.right + 4 * A.columns[k];
            for (int c = 0; c < 4; ++c)
                for (int r = 0; r < 4; ++r)
                    A.blocks[4 * static_cast<std::size_t>(k) + c][r] =
                        static_cast<float>(value[4 * c + r] * (A.left[4 * i + r] * right[c]));
        }
}

FSCI_CLONES inline void add(View A, double* y) {
    for (std::size_t i = 0; i < A.rows; ++i) {
        Wide sums[4] = {};
        for (std::int32_t k = A.start[i]; k < A.start[i + 1]; ++k) {
            const factors::Column* block = A.blocks + 4 * static_cast<std::size_t>(k);
            const double* own = A.scaled + 4 * static_cast<std::size_t>(A.columns[k]);
            for (int c = 0; c < 4; ++c) sums[c] += __builtin_convertvector(block[c], Wide) * own[c];
        }
        const Wide total = (sums[0] + sums[1]) + (sums[2] + sums[3]);
        for (int r = 0; r < 4; ++r) y[4 * i + r] += total[r] / A.left[4 * i + r];
    }
}

// A matrix of 4 x 4 blocks in compressed rows, whose values may change.
class Product {
public:
    Product(std::size_t rows, std::size_t width, const std::int32_t* start, const std::int32_t* columns)
        : start_(start, start + rows + 1), columns_(columns, columns + start[rows]), blocks_(4 * columns_.size()),
          left_(4 * rows, 1.0), right_(4 * width, 1.0), scaled_(4 * width) {}

    // Blocks by columns. The scales, which keep the entries in the range of single precision, are powers of two.
    void update(const double* values, const double* left, const double* right) {
        left_.assign(left, left + left_.size());
        right_.assign(right, right + right_.size());
        store(view(), values);
    }

    // y += A x
    void add(const double* x, double* y) {
        for (std::size_t k = 0; k < scaled_.size(); ++k) scaled_[k] = x[k] / right_[k];
        block_product::add(view(), y);
    }

    std::size_t rows() const { return left_.size(); }
    std::size_t width() const { return right_.size(); }
    std::size_t blocks() const { return columns_.size(); }

private:
    View view() {
        return {start_.size() - 1, start_.data(), columns_.data(), blocks_.data(), left_.data(), right_.data(),
                scaled_.data()};
    }

    std::vector<std::int32_t> start_, columns_;
    std::vector<factors::Column, factors::Aligned<factors::Column>> blocks_;
    std::vector<double> left_, right_, scaled_;
};

}  // namespace block_product
