// Python name of block_factors.hpp: BlockFactors.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>
#include <stdexcept>

#include "block_factors.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Numbers = nb::ndarray<const std::int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Vector = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Result = nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Blocks = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

void require(bool condition, const char* message) {
    if (!condition) throw std::invalid_argument(message);
}

void create(factors::Factors* self, const Numbers& start, const Numbers& columns, int size) {
    require(start.size() > 0 && start.data()[0] == 0, "no compressed rows");
    require(static_cast<std::size_t>(start.data()[start.size() - 1]) == columns.size(), "no compressed rows");
    for (std::size_t i = 1; i < start.size(); ++i) require(start.data()[i - 1] <= start.data()[i], "no compressed rows");
    for (std::size_t k = 0; k < columns.size(); ++k)
        require(columns.data()[k] >= 0 && static_cast<std::size_t>(columns.data()[k]) + 1 < start.size(), "no square matrix");
    new (self) factors::Factors(start.size() - 1, start.data(), columns.data(), size);
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
        "The pattern is given by compressed rows, with increasing columns and the diagonal in each.")
        .def("__init__", &create, "start"_a, "columns"_a, "size"_a)
        .def("update", &update, "values"_a,
             "Factors of a matrix; values: shape (blocks, n, n), each transposed. False if they do not exist.")
        .def("solve", &solve, "b"_a, "x"_a, "x = (L U)^-1 b.");
}
