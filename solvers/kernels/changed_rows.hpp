// A matrix in compressed rows of which some are replaced, and others are added to, in one pass.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "node_blocks.hpp"

namespace changed_rows {

using node_blocks::Rows;

struct Matrix {
    std::vector<std::int32_t> start, columns;
    std::unique_ptr<double[]> values;
};

// Changes the matrix `before` of `count` rows with increasing columns. `after` has a row for each of `changed`; the first
// `replaced` of them replace rows, the others are added to rows. Entries at the same place are summed.
inline Matrix change(std::size_t count, const Rows& before, const std::int32_t* changed, std::size_t n_changed,
                     std::size_t replaced, const Rows& after) {
    std::vector<std::int32_t> by_row(count, -1);
    std::size_t most = static_cast<std::size_t>(before.start[count]);
    for (std::size_t k = 0; k < n_changed; ++k) {
        by_row[changed[k]] = static_cast<std::int32_t>(k);
        most += static_cast<std::size_t>(after.start[k + 1] - after.start[k]);
    }
    Matrix found{std::vector<std::int32_t>(count + 1), std::vector<std::int32_t>(most),
                 std::make_unique_for_overwrite<double[]>(most)};
    std::int32_t* columns = found.columns.data();
    double* values = found.values.get();
    std::vector<std::pair<std::int32_t, double>> row;
    std::size_t end = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const std::int32_t begin = before.start[i], k = by_row[i];
        if (k < 0) {
            const auto size = static_cast<std::size_t>(before.start[i + 1] - begin);
            std::copy_n(before.columns + begin, size, columns + end);
            std::copy_n(before.values + begin, size, values + end);
            end += size;
        } else {
            row.clear();
            const auto add = [&row](const Rows& from, std::int32_t first, std::int32_t last) {
                for (std::int32_t e = first; e < last; ++e) row.emplace_back(from.columns[e], from.values[e]);
            };
            add(after, after.start[k], after.start[k + 1]);
            if (static_cast<std::size_t>(k) >= replaced) add(before, begin, before.start[i + 1]);
            // stable: the sum of two entries does not depend on the library
            std::stable_sort(row.begin(), row.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
            const std::size_t first = end;
            for (const auto& [column, value] : row) {
                if (end > first && columns[end - 1] == column) {
                    values[end - 1] += value;
                } else {
                    columns[end] = column;
                    values[end++] = value;
                }
            }
        }
        found.start[i + 1] = static_cast<std::int32_t>(end);
    }
    found.columns.resize(end);
    return found;
}

}  // namespace changed_rows
