// What all bindings share: arrays of numpy, errors in arguments, and results that numpy gets without a copy.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace nb = nanobind;
using namespace nb::literals;

template <class T, int dims>
using Values = nb::ndarray<T, nb::ndim<dims>, nb::c_contig, nb::device::cpu>;

// Throws ValueError in Python unless a condition holds.
template <class Message>
void require(bool condition, const Message& message) {
    if (!condition) throw std::invalid_argument(message);
}

template <class T>
nb::object to_numpy(std::vector<T> values, std::initializer_list<std::size_t> shape) {
    auto* owned = new std::vector<T>(std::move(values));
    nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
    return nb::cast(nb::ndarray<nb::numpy, T>(owned->data(), shape.size(), shape.begin(), owner));
}
