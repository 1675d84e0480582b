"""Expressions at points of cells, with values of their coefficients that need not be those of functions."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import nullcontext
from functools import cached_property
from math import prod
from typing import Any

import numpy as np
import ufl
from cffi import FFI
from ufl.algorithms.analysis import extract_arguments, extract_coefficients, extract_constants

from solvers.api import Array, Indices32
from solvers.fem.axis_aligned import axis_aligned
from solvers.fem.calls import calls
from solvers.fem.compiling import compiling
from solvers.fem.domain import Domain
from solvers.fem.forms import AXIS_ALIGNED_OPTIONS, COMPILE_OPTIONS
from solvers.fem.spaces import cell_blocks, cell_of

_FFI = FFI()


class Pointwise:
    """A UFL expression at reference points of cells, also one that is linear in a test function.

    It is compiled when it is used first. The compiled function is called directly: DOLFINx 0.5 reserves too little
    memory for test functions with several components.
    """

    def __init__(self, domain: Domain, expression: Any, points: Array, what: str):
        """points: (points, dim); what: it is, for messages."""
        self._domain, self._expression, self._points, self._what = domain, expression, points, what

    @cached_property
    def _compiled(self) -> tuple[Any, list[Any], list[Any], list[int]]:
        """(function, coefficients and constants that it reads, dofs of a cell of each test function)."""
        expression, of_aligned = self._expression, self._domain.axis_aligned
        with compiling(self._what), axis_aligned() if of_aligned else nullcontext():
            options = AXIS_ALIGNED_OPTIONS if of_aligned else COMPILE_OPTIONS
            found = calls.tabulator(self._domain.comm, expression, self._points, options)
        known, used = extract_coefficients(expression), range(found.num_coefficients)
        tests = [argument.ufl_function_space() for argument in extract_arguments(expression)]
        return (
            found.tabulate_tensor_float64,
            [known[found.original_coefficient_positions[k]] for k in used],
            extract_constants(expression),
            [cell_blocks(space).shape[1] * space.dofmap.index_map_bs for space in tests],
        )

    def compile(self) -> None:
        """Compile it if it is not yet (collective)."""
        _ = self._compiled

    def on(self, cells: Indices32, given: Mapping[Any, Array] | None = None) -> Array:
        """Values (cells, points, ...) in local cells, which may recur (collective if it is used first).

        given: of `numbers_of_cells`, (cells, ...), or, instead of the values of a function, those at its dofs. The last
        axis of what is returned has the dofs of a cell of the test function, if there is one.
        """
        mesh, given, (tabulate, used, constants, sizes) = self._domain.mesh, given or {}, self._compiled
        w = [_flat(given[f] if f in given else values_of_cells(f, cells)) for f in used]
        data = np.concatenate([np.empty((len(cells), 0)), *w], axis=1)
        numbers = np.concatenate([np.empty(0), *(np.ravel(constant.value) for constant in constants)])
        corners = calls.geometry_nodes(mesh).reshape(-1, 2**self._domain.dim)[cells]
        values = np.zeros((len(cells), len(self._points), *self._expression.ufl_shape, *sizes))
        tabulate_rows(tabulate, values, data, numbers, np.ascontiguousarray(mesh.geometry.x[corners]))
        return values


def numbers_of_cells(domain: Domain, count: int) -> Any:
    """A vector of numbers for an expression, which have no values but those that `Pointwise.on` is given."""
    element = calls.mixed_element([calls.discontinuous_element(cell_of(domain), 0)] * count)
    return _Numbers(ufl.FunctionSpace(domain.mesh.ufl_domain(), element))


class _Numbers(ufl.Coefficient):
    """Form compilers take its text, which otherwise is w_{10} after nine others, for a name in C."""

    def __str__(self) -> str:
        return "numbers"


def values_of_cells(function: Any, cells: Indices32) -> Array:
    """Values of a function at the dofs of local cells, shape (cells, blocks, components)."""
    space = function.function_space
    return function.x.array.reshape(-1, space.dofmap.index_map_bs)[cell_blocks(space)[cells]]


def _flat(values: Array) -> Array:
    return values.reshape(len(values), prod(values.shape[1:]))


def tabulate_rows(function: Any, found: Array, w: Array, c: Array, x: Array, facets: Indices32 | None = None) -> None:
    """Call a compiled function for each row of `found`; w, x: rows of coefficients and coordinates; c: constants.

    facets: of both cells of a facet, the same for all rows.
    """
    kinds = _FFI.typeof(function).args
    out, w_at, c_at, x_at = (
        _FFI.cast(kind, part.ctypes.data) for kind, part in zip(kinds, (found, w, c, x), strict=False)
    )
    size, stride, nodes = (prod(part.shape[1:]) for part in (found, w, x))
    more = [_FFI.NULL] * (len(kinds) - 4)  # facets, permutations, later more
    turns = np.zeros(2, dtype=np.uint8)
    if facets is not None:
        more[:2] = _FFI.cast(kinds[4], facets.ctypes.data), _FFI.cast(kinds[5], turns.ctypes.data)
    for k in range(len(found)):
        function(out + k * size, w_at + k * stride, c_at, x_at + k * nodes, *more)
