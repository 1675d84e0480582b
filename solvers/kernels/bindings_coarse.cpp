// Python names of coarse_blocks.hpp: coarse_pattern, coarse_product.
#include <algorithm>

#include "bindings.hpp"
#include "coarse_blocks.hpp"

namespace {

using Numbers = Values<const std::int32_t, 1>;
using Reals = Values<const double, 1>;
using Blocks = Values<const double, 3>;
using Result = Values<double, 3>;

// Rows whose starts increase from 0 and whose columns are below a limit.
coarse::Rows checked(const std::string& name, const Numbers& start, const Numbers& columns, std::size_t limit) {
    require(start.size() > 0 && start.data()[0] == 0 && std::is_sorted(start.data(), start.data() + start.size()) &&
                static_cast<std::size_t>(start.data()[start.size() - 1]) == columns.size(),
            name + ": no compressed rows");
    const bool fit = std::all_of(columns.data(), columns.data() + columns.size(), [&](std::int32_t column) {
        return column >= 0 && static_cast<std::size_t>(column) < limit;
    });
    require(fit, name + ": a column is not below " + std::to_string(limit));
    return {start.data(), columns.data()};
}

nb::object py_pattern(const Numbers& start, const Numbers& columns, const Numbers& p_start, const Numbers& p_columns,
                      std::size_t coarse) {
    const std::size_t rows = start.size() - 1, nodes = p_start.size() - 1;
    const coarse::Rows A = checked("A", start, columns, nodes), P = checked("P", p_start, p_columns, coarse);
    require(rows <= nodes, "P has fewer rows than A");
    coarse::Pattern found;
    {
        nb::gil_scoped_release release;
        found = coarse::pattern(rows, A, P, coarse);
    }
    const std::size_t count = found.start.size(), blocks = found.columns.size();
    return nb::make_tuple(to_numpy(std::move(found.start), {count}), to_numpy(std::move(found.columns), {blocks}));
}

void py_product(const Numbers& start, const Numbers& columns, const Blocks& values, const Numbers& p_start,
                const Numbers& p_columns, const Reals& weights, const Reals& marks, const Numbers& c_start,
                const Numbers& c_columns, const Result& result) {
    const std::size_t rows = start.size() - 1, nodes = p_start.size() - 1, count = c_start.size() - 1, size = values.shape(1);
    const coarse::Rows A = checked("A", start, columns, nodes), P = checked("P", p_start, p_columns, count),
                       C = checked("C", c_start, c_columns, count);
    require(rows <= nodes, "P has fewer rows than A");
    require(values.shape(0) == columns.size() && values.shape(2) == size, "A needs a square block for each column");
    require(weights.size() == p_columns.size(), "P needs a weight for each column");
    require(marks.size() == nodes * size, "each unknown needs a mark");
    require(result.shape(0) == c_columns.size() && result.shape(1) == size && result.shape(2) == size,
            "C needs a block for each column");
    const auto use = [&]<int n>() {
        nb::gil_scoped_release release;
        coarse::product<n>(rows, A, values.data(), P, weights.data(), marks.data(), count, C, result.data());
    };
    if (size == 3) use.template operator()<3>();
    else if (size == 4) use.template operator()<4>();
    else throw std::invalid_argument("blocks must have 3 or 4 rows");
}

}  // namespace

void bind_coarse(nb::module_& module) {
    module.def("coarse_pattern", &py_pattern, "start"_a, "columns"_a, "p_start"_a, "p_columns"_a, "coarse"_a,
               "Which blocks P^T A P has, as compressed rows (start, columns).\n\n"
               "A and P are given so, too; P has a row for each column of A and `coarse` columns.");
    module.def("coarse_product", &py_product, "start"_a, "columns"_a, "values"_a, "p_start"_a, "p_columns"_a, "weights"_a,
               "marks"_a, "c_start"_a, "c_columns"_a, "result"_a,
               "Add the blocks of P^T A P to `result`, shape (blocks, n, n), each transposed like those of `values`.\n\n"
               "Row (i, a) of P has marks[n i + a] times the weights of node i. C: what `coarse_pattern` found, or more.");
}
