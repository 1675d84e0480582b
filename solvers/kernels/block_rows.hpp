// Sparse matrices from small dense blocks over nodes: add blocks in any order, then sum them into CSR.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>
#include <vector>

namespace mortar {

struct Csr {
    std::vector<double> data;
    std::vector<std::int32_t> indices, indptr;
};

// row_width x column_width entries for each pair of nodes.
template <int row_width, int column_width>
class BlockRows {
  public:
    // A new block, row-major, to be filled by the caller.
    double* add(std::span<const int> rows, std::span<const int> columns) {
        double* values = allocate(rows.size() * row_width * columns.size() * column_width);
        blocks_.push_back({columns_.size(), columns.size(), values});
        for (std::size_t r = 0; r < rows.size(); ++r) row_nodes_.push_back({rows[r], blocks_.size() - 1, r});
        columns_.insert(columns_.end(), columns.begin(), columns.end());
        return values;
    }

    Csr sum(int n_rows, int n_columns) const {
        std::vector<std::size_t> start(n_rows + 1, 0);  // contributions sorted by row node
        for (const RowNode& r : row_nodes_) ++start[r.node + 1];
        for (int i = 0; i < n_rows; ++i) start[i + 1] += start[i];
        std::vector<const RowNode*> sorted(row_nodes_.size());
        std::vector<std::size_t> next(start.begin(), start.end() - 1);
        for (const RowNode& r : row_nodes_) sorted[next[r.node]++] = &r;

        Csr csr;
        csr.indptr.reserve(static_cast<std::size_t>(n_rows) * row_width + 1);
        csr.indptr.push_back(0);
        std::vector<int> place(n_columns, -1), present;
        for (int node = 0; node < n_rows; ++node) {
            present.clear();
            auto visit = [&](auto&& use) {
                for (std::size_t k = start[node]; k < start[node + 1]; ++k) {
                    const Block& block = blocks_[sorted[k]->block];
                    use(block, columns_.data() + block.column, sorted[k]->position);
                }
            };
            visit([&](const Block& block, const int* columns, std::size_t) {
                for (std::size_t c = 0; c < block.n_columns; ++c)
                    if (place[columns[c]] < 0) {
                        place[columns[c]] = 0;
                        present.push_back(columns[c]);
                    }
            });
            std::sort(present.begin(), present.end());
            for (std::size_t c = 0; c < present.size(); ++c) place[present[c]] = static_cast<int>(c);
            const std::size_t width = present.size() * column_width, base = csr.data.size();
            csr.data.resize(base + row_width * width, 0.0);
            csr.indices.resize(csr.data.size());
            visit([&](const Block& block, const int* columns, std::size_t position) {
                const double* value = block.values + position * row_width * block.n_columns * column_width;
                for (int r = 0; r < row_width; ++r)
                    for (std::size_t c = 0; c < block.n_columns; ++c) {
                        double* sum = csr.data.data() + base + r * width + place[columns[c]] * column_width;
                        for (int b = 0; b < column_width; ++b) sum[b] += *value++;
                    }
            });
            for (int r = 0; r < row_width; ++r) {
                std::int32_t* index = csr.indices.data() + base + r * width;
                for (int column : present)
                    for (int b = 0; b < column_width; ++b) *index++ = column * column_width + b;
                if (csr.data.size() > std::numeric_limits<std::int32_t>::max())
                    throw std::length_error("more than 2^31 entries in a contact matrix");
                csr.indptr.push_back(static_cast<std::int32_t>(base + (r + 1) * width));
            }
            for (int column : present) place[column] = -1;
        }
        return csr;
    }

  private:
    // Values are never moved: they fill one chunk of memory after the other.
    double* allocate(std::size_t size) {
        if (chunks_.empty() || used_ + size > chunk_size_) {
            chunk_size_ = std::max<std::size_t>(size, 1 << 16);
            chunks_.push_back(std::make_unique_for_overwrite<double[]>(chunk_size_));
            used_ = 0;
        }
        used_ += size;
        return chunks_.back().get() + used_ - size;
    }

    struct Block {
        std::size_t column, n_columns;  // first column node, and how many
        const double* values;
    };
    struct RowNode {
        int node;
        std::size_t block, position;  // of the row in the block
    };
    std::vector<Block> blocks_;
    std::vector<RowNode> row_nodes_;
    std::vector<int> columns_;
    std::vector<std::unique_ptr<double[]>> chunks_;
    std::size_t chunk_size_ = 0, used_ = 0;
};

}  // namespace mortar
