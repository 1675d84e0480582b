"""What a flow and the bodies in it exchange at surfaces: motions, and derivatives of rows and forces by them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from solvers.api import Array

if TYPE_CHECKING:  # `fsci check` reads motions, and scipy takes a while to load
    from solvers.algebra.sparse import Sparse


@dataclass(frozen=True)
class Motion:
    """Positions and velocities of the vertices of a surface."""

    x: Array  #: positions [m], shape (n, dim)
    v: Array  #: velocities [m/s], shape (n, dim)


@dataclass(frozen=True)
class Difference:
    """u_t at t_{n+1} = alpha u_{n+1} - sum_k beta[k] u_{n-k}; all in 1/s."""

    alpha: float
    beta: tuple[float, ...] = ()


#: No derivative in time.
STEADY = Difference(0.0)


@dataclass(frozen=True)
class InterfaceEntries:
    """Derivatives by motion and flow. Each process has those of its cells.

    Rows are dofs of the vertices, number * dim + axis. Columns of the flow are its global unknowns.
    """

    into_flow: Sparse  #: dr/dd transposed; held rows of the flow are zero
    force_by_flow: Sparse  #: df/dw
    force_by_motion: Sparse  #: df/dd; columns: dofs of the vertices
