"""Sums and copies between processes that share dofs."""

from __future__ import annotations

from typing import Any

from dolfinx import fem, la

from solvers.api import Array
from solvers.fem.calls import calls


def sum_ghosts(space: fem.FunctionSpace, values: Array) -> Array:
    """Values per local block with those of all processes added up, the same wherever a block is known (collective)."""
    total: Any = la.vector(space.dofmap.index_map, 1)
    total.array[:] = values
    calls.add_from_ghosts(total)
    total.scatter_forward()
    return total.array.copy()


def add_ghosts(space: fem.FunctionSpace, local: Array) -> None:
    """Add what processes hold at ghost dofs to the owners' entries of a local array (collective)."""
    vector: Any = la.vector(space.dofmap.index_map, space.dofmap.index_map_bs)
    vector.array[:] = local
    calls.add_from_ghosts(vector)
    local[:] = vector.array


def share_owned(space: fem.FunctionSpace, local: Array) -> Array:
    """A local array with the owners' values at ghost dofs (collective)."""
    vector: Any = la.vector(space.dofmap.index_map, space.dofmap.index_map_bs)
    vector.array[:] = local
    vector.scatter_forward()
    return vector.array.copy()


def accumulate(function: fem.Function) -> None:
    """Send what processes added to ghost dofs to the owners."""
    calls.add_from_ghosts(function.x)
