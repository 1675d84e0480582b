"""Supports of a body: which dofs are prescribed, and to what."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array
from solvers.structure.body import Body, Support, Symmetry
from solvers.structure.materials import Value


class SupportError(ValueError):
    """A support cannot be applied; `surface` names where."""

    def __init__(self, body: str, surface: str, message: str):
        super().__init__(f"body '{body}', surface '{surface}': {message}")
        self.body, self.surface, self.message = body, surface, message


@dataclass(frozen=True)
class Prescribed:
    """Owned dofs of a body with a prescribed displacement."""

    dofs: NDArray[np.int32]  #: local, sorted, shape (n,)
    entries: tuple[tuple[NDArray[np.int32], Value, Array], ...]  #: dofs, displacement [m] and their points (3, m)

    def displacement(self, t: float) -> Array:
        """Values [m] at the dofs, shape (n,). Where supports overlap, the last one counts."""
        values = np.zeros(len(self.dofs))
        for dofs, value, points in self.entries:
            values[np.searchsorted(self.dofs, dofs)] = value(points, t)
        return values


def prescribe(body: Body) -> Prescribed:
    """Collect the supports of a body (collective). Raises SupportError."""
    entries = []
    for support in body.settings.supports:
        blocks = fem.surface_blocks(body.domain, body.space, support.surface)
        blocks = np.unique(blocks[blocks < body.owned])
        for component, value in enumerate(_components(body, support, blocks)):
            if value is not None:
                entries.append((blocks * body.dim + component, value, body.points[:, blocks]))
    dofs = np.unique(np.concatenate([np.empty(0, dtype=np.int32), *(e[0] for e in entries)]))
    return Prescribed(dofs.astype(np.int32), tuple(entries))


def _components(body: Body, support: Support | Symmetry, blocks) -> tuple[Value | None, ...]:
    if isinstance(support, Support):
        return support.displacement
    normal = symmetry_axis(body, support, blocks)
    return tuple(_zero if axis == normal else None for axis in range(body.dim))


def symmetry_axis(body: Body, support: Symmetry, blocks) -> int:
    """The axis that the plane of symmetry is normal to (collective). Raises SupportError if it is not such a plane."""
    points = body.points[: body.dim, blocks]
    low = points.min(axis=1, initial=np.inf)
    high = points.max(axis=1, initial=-np.inf)
    gathered = body.domain.comm.allgather((low, high))
    extent = np.max([h for _, h in gathered], axis=0) - np.min([low for low, _ in gathered], axis=0)
    axis = int(np.argmin(extent))
    if not extent[axis] <= 1e-9 * np.max(extent):
        raise SupportError(
            body.name, support.surface, "symmetry needs a plane normal to x, y or z; this surface is not one"
        )
    return axis


def _zero(x: Array, t: float) -> Array:
    return np.zeros(x.shape[1])
