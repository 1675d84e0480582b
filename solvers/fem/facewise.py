"""Element tensors of a form over interior facets, for any two cells: also for such as do not meet in the mesh."""

from __future__ import annotations

from itertools import pairwise
from math import prod
from typing import Any

import numpy as np

from solvers.api import Array, Indices32
from solvers.fem.calls import calls
from solvers.fem.domain import Domain
from solvers.fem.forms import Integral
from solvers.fem.pointwise import tabulate_rows, values_of_cells
from solvers.fem.spaces import cell_blocks, node_steps


class Facewise:
    """The tensors of one integral, by the function that the form compiler makes of it."""

    def __init__(self, domain: Domain, integral: Integral):
        """integral: of type dS alone, which is compiled if it is not yet (collective)."""
        integral.compile()
        self._domain = domain
        #: function, coefficients and constants that it reads, spaces of its arguments
        self._compiled: tuple[Any, list[Any], list[Any], list[Any]] = integral.compiled.of_facets()

    def data(self, cells: Indices32) -> Array:
        """What the tensors of local cells depend on, (cells, numbers): the corners [m], then coefficients."""
        mesh, coefficients = self._domain.mesh, self._compiled[1]
        corners = mesh.geometry.x[calls.geometry_nodes(mesh).reshape(-1, 2**self._domain.dim)[cells]]
        return np.concatenate([_rows(corners), *(_rows(values_of_cells(f, cells)) for f in coefficients)], axis=1)

    def between(self, one: Array, other: Array, axis: int, shift: float) -> Array:
        """Tensors (faces, 2 dofs, ...) of cells with these data, in which the dofs of `one` come first.

        The lower face of `one` along an axis is the upper face of `other`, once that is moved by a shift [m].
        """
        tabulate, coefficients, constants, spaces = self._compiled
        other = other.copy()
        start = 3 * 2**self._domain.dim
        other[:, axis:start:3] += shift
        sizes = [cell_blocks(f.function_space).shape[1] * f.function_space.dofmap.index_map_bs for f in coefficients]
        ends = start + np.cumsum([0, *sizes])
        w = [np.empty((len(one), 0))]
        for first, last in pairwise(ends):
            w += [one[:, first:last], other[:, first:last]]
        x, packed = np.concatenate([one[:, :start], other[:, :start]], axis=1), np.concatenate(w, axis=1)
        c = np.concatenate([np.empty(0), *(np.ravel(constant.value) for constant in constants)])
        dofs = [2 * cell_blocks(space).shape[1] * space.dofmap.index_map_bs for space in spaces]
        found = np.zeros((len(one), *dofs))
        along = [int(np.argmax(step)) for step in node_steps(self._domain, 1)[2 ** np.arange(self._domain.dim)]]
        at = along.index(axis)
        facets = np.array([self._domain.dim - 1 - at, self._domain.dim + at], dtype=np.int32)
        tabulate_rows(tabulate, found, packed, c, x, facets)
        return found


def _rows(values: Array) -> Array:
    return values.reshape(len(values), prod(values.shape[1:]))
