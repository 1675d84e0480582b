// Python names of block_factors.hpp, block_product.hpp, changed_rows.hpp, node_blocks.hpp and row_squares.hpp:
// BlockFactors, BlockProduct, changed_rows, node_blocks, row_squares, spread_blocks.
#include <nanobind/stl/optional.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <optional>

#include "bindings.hpp"
#include "block_factors.hpp"
#include "block_product.hpp"
#include "changed_rows.hpp"
#include "node_blocks.hpp"
#include "row_squares.hpp"

namespace {

using Numbers = Values<const std::int32_t, 1>;
using Vector = Values<const double, 1>;
using Result = Values<double, 1>;
using Blocks = Values<const double, 3>;

// Throws unless these are compressed rows of a matrix with so many columns.
void require_rows(const Numbers& start, const Numbers& columns, std::size_t width, const char* otherwise) {
    require(start.size() > 0 && start.data()[0] == 0, "no compressed rows");
    require(static_cast<std::size_t>(start.data()[start.size() - 1]) == columns.size(), "no compressed rows");
    for (std::size_t i = 1; i < start.size(); ++i) require(start.data()[i - 1] <= start.data()[i], "no compressed rows");
    for (std::size_t k = 0; k < columns.size(); ++k)
        require(columns.data()[k] >= 0 && static_cast<std::size_t>(columns.data()[k]) < width, otherwise);
}

void require_square(const Numbers& start, const Numbers& columns) {
    require_rows(start, columns, start.size() > 0 ? start.size() - 1 : 0, "no square matrix");
}

void create_product(block_product::Product* self, const Numbers& start, const Numbers& columns, std::size_t width) {
    require_rows(start, columns, width, "no such column");
    new (self) block_product::Product(start.size() - 1, width, start.data(), columns.data());
}

void update_product(block_product::Product& self, const Blocks& values, const Vector& left, const Vector& right) {
    require(values.shape(0) == self.blocks() && values.shape(1) == 4 && values.shape(2) == 4, "each column needs a block");
    require(left.size() == self.rows() && right.size() == self.width(), "each row and column needs a scale");
    nb::gil_scoped_release release;
    self.update(values.data(), left.data(), right.data());
}

void add_product(block_product::Product& self, const Vector& x, const Result& y) {
    require(x.size() == self.width() && y.size() == self.rows(), "vectors need a number for each row and column");
    nb::gil_scoped_release release;
    self.add(x.data(), y.data());
}

void create(factors::Factors* self, const Numbers& start, const Numbers& columns, int size,
            const std::optional<Numbers>& order) {
    require_square(start, columns);
    const std::size_t rows = start.size() - 1;
    std::vector<std::int32_t> nodes(rows);
    std::iota(nodes.begin(), nodes.end(), 0);
    if (order) {
        std::vector<std::int32_t> given(order->data(), order->data() + order->size()), sorted = given;
        std::sort(sorted.begin(), sorted.end());
        require(sorted == nodes, "the order must have each row once");
        nodes = std::move(given);
    }
    new (self) factors::Factors(rows, start.data(), columns.data(), size, nodes.data());
}

using ::to_numpy;

nb::object to_numpy(std::unique_ptr<double[]> values, std::initializer_list<std::size_t> shape) {
    double* owned = values.release();
    nb::capsule owner(owned, [](void* p) noexcept { delete[] static_cast<double*>(p); });
    return nb::cast(nb::ndarray<nb::numpy, double>(owned, shape.size(), shape.begin(), owner));
}

nb::object collect(const Numbers& start, const Numbers& columns, const Vector& values, std::size_t size) {
    require_square(start, columns);
    require(values.size() == columns.size(), "each column needs a value");
    require(size == 3 || size == 4, "blocks must have 3 or 4 rows");
    require((start.size() - 1) % size == 0, "the rows are not those of whole nodes");
    node_blocks::Blocks found;
    {
        nb::gil_scoped_release release;
        const node_blocks::Rows A{start.data(), columns.data(), values.data()};
        const std::size_t nodes = (start.size() - 1) / size;
        found = size == 3 ? node_blocks::collect<3>(nodes, A) : node_blocks::collect<4>(nodes, A);
    }
    const std::size_t rows = found.start.size(), blocks = found.columns.size();
    return nb::make_tuple(to_numpy(std::move(found.start), {rows}), to_numpy(std::move(found.columns), {blocks}),
                          to_numpy(std::move(found.values), {blocks, size, size}));
}

void spread(const Numbers& start, const Blocks& blocks, const Result& entries, double factor) {
    require(start.size() > 0 && start.data()[0] == 0, "no compressed rows");
    for (std::size_t i = 1; i < start.size(); ++i) require(start.data()[i - 1] <= start.data()[i], "no compressed rows");
    require(static_cast<std::size_t>(start.data()[start.size() - 1]) == blocks.shape(0), "each column needs a block");
    require(entries.size() == blocks.size(), "each number of a block needs an entry");
    const std::size_t nodes = start.size() - 1, n = blocks.shape(1);
    require(n == blocks.shape(2) && (n == 2 || n == 3), "blocks must have 2 or 3 rows");
    nb::gil_scoped_release release;
    if (n == 2) node_blocks::spread<2>(nodes, start.data(), blocks.data(), factor, entries.data());
    else node_blocks::spread<3>(nodes, start.data(), blocks.data(), factor, entries.data());
}

nb::object change(const Numbers& start, const Numbers& columns, const Vector& values, const Numbers& rows,
                  std::size_t replaced, const Numbers& new_start, const Numbers& new_columns, const Vector& new_values) {
    const std::size_t count = start.size() - 1;
    require(start.size() > 0 && start.data()[0] == 0, "no compressed rows");
    require(static_cast<std::size_t>(start.data()[count]) <= std::min(columns.size(), values.size()),
            "no compressed rows");
    require(new_start.size() == rows.size() + 1 && new_start.data()[0] == 0, "each row needs its entries");
    require(static_cast<std::size_t>(new_start.data()[rows.size()]) <= std::min(new_columns.size(), new_values.size()),
            "each row needs its entries");
    require(replaced <= rows.size(), "more rows to replace than there are");
    for (std::size_t i = 0; i < rows.size(); ++i)
        require(rows.data()[i] >= 0 && static_cast<std::size_t>(rows.data()[i]) < count, "no such row");
    changed_rows::Matrix found;
    {
        nb::gil_scoped_release release;
        const changed_rows::Rows before{start.data(), columns.data(), values.data()};
        const changed_rows::Rows after{new_start.data(), new_columns.data(), new_values.data()};
        found = changed_rows::change(count, before, rows.data(), rows.size(), replaced, after);
    }
    const std::size_t entries = found.columns.size();
    return nb::make_tuple(to_numpy(std::move(found.values), {entries}), to_numpy(std::move(found.columns), {entries}),
                          to_numpy(std::move(found.start), {count + 1}));
}

void add_squares(const Numbers& start, const Numbers& columns, const Blocks& blocks, const Vector& x, const Result& y) {
    const std::size_t rows = start.size() - 1, n = blocks.shape(1);
    require(blocks.shape(0) == columns.size() && n == blocks.shape(2), "each column needs a square block");
    require(n >= 1 && n <= 4, "blocks must have 1 to 4 rows");
    require(x.size() % n == 0 && y.size() == n * rows, "vectors need a number for each row and column");
    require_rows(start, columns, x.size() / n, "no such column");
    nb::gil_scoped_release release;
    constexpr decltype(&row_squares::add<1>) add[] = {row_squares::add<1>, row_squares::add<2>, row_squares::add<3>,
                                                      row_squares::add<4>};
    add[n - 1](rows, start.data(), columns.data(), blocks.data(), x.data(), y.data());
}

bool update(factors::Factors& self, const Blocks& values) {
    require(values.size() == self.values(), "each column needs a square block");
    nb::gil_scoped_release release;
    return self.update(values.data());
}

void solve(factors::Factors& self, const Vector& b, const Result& x) {
    require(b.size() == self.unknowns() && x.size() == self.unknowns(), "vectors need a number for each unknown");
    nb::gil_scoped_release release;
    self.solve(b.data(), x.data());
}

}  // namespace

void bind_factors(nb::module_& module) {
    nb::class_<factors::Factors>(module, "BlockFactors",
        "Incomplete factors, in single precision, of square matrices of n x n blocks with one pattern, n = 3 or 4.\n\n"
        "The pattern is given by compressed rows, with increasing columns and the diagonal in each; order: that of\n"
        "elimination, of rows.")
        .def("__init__", &create, "start"_a, "columns"_a, "size"_a, "order"_a = nb::none())
        .def("update", &update, "values"_a,
             "Factors of a matrix; values: shape (blocks, n, n), each transposed. False if they do not exist.")
        .def("solve", &solve, "b"_a, "x"_a, "x = (L U)^-1 b.");
    nb::class_<block_product::Product>(module, "BlockProduct",
        "A matrix of 4 x 4 blocks, stored in single precision, that multiplies vectors; sums are in double precision.\n\n"
        "The pattern is given by compressed rows; width: count of columns.")
        .def("__init__", &create_product, "start"_a, "columns"_a, "width"_a)
        .def("update", &update_product, "values"_a, "left"_a, "right"_a,
             "Store L A R; values: of A, shape (blocks, 4, 4), each transposed; diagonals of L and R: powers of two.")
        .def("add", &add_product, "x"_a, "y"_a, "y += A x.");
    module.def("node_blocks", &collect, "start"_a, "columns"_a, "values"_a, "size"_a,
               "(start, columns, blocks (m, n, n), each transposed) of a matrix in compressed rows, n of which are a node's.");
    module.def("changed_rows", &change, "start"_a, "columns"_a, "values"_a, "rows"_a, "replaced"_a, "new_start"_a,
               "new_columns"_a, "new_values"_a,
               "(values, columns, start) of a matrix in compressed rows, with increasing columns in each, after a change\n"
               "of `rows`, each once. New rows, whose columns need no order, replace the first `replaced` of them and are\n"
               "added to the others.");
    module.def("row_squares", &add_squares, "start"_a, "columns"_a, "blocks"_a, "x"_a, "y"_a,
               "y_i += sum_j (a_ij x_j)^2 for a matrix of blocks in compressed rows, each transposed.");
    module.def("spread_blocks", &spread, "start"_a, "blocks"_a, "entries"_a, "factor"_a = 1.0,
               "Write the entries of blocks, each transposed, times a factor in the order of compressed rows.");
}
