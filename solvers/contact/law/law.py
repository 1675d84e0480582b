"""The interface `Law` of contact laws: arguments, status of multipliers, and linearised rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse
from solvers.api import Array

#: Status of a multiplier: no contact; contact with slip; contact without slip.
OPEN, SLIP, STICK = 0, 1, 2

Statuses = NDArray[np.int8]

#: Admissible directions of a multiplier: the normal; normal and tangential; all, whatever the normal.
Span = Literal["normal", "surface", "space"]


@dataclass(frozen=True)
class Point:
    """The m multipliers of one law at an iterate: all arguments of the law."""

    z: Array  #: multipliers [Pa], the negative traction on the slave, shape (m, dim)
    normals: Array  #: outward unit normals of the slave, shape (m, dim)
    D: Array  #: covered area [m^(dim-1)], shape (m,)
    gap: Array  #: weighted gap [m^dim] that must not be negative, shape (m,)
    covered: NDArray[np.bool_]  #: mask of the multipliers that may have a constraint, shape (m,)
    stiffness: Array  #: of slave and masters in series, per area [Pa/m], shape (m,)
    slip: Array  #: [m], shape (m, dim); with friction that of the step, of which the tangential part is used
    slip_defined: NDArray[np.bool_]  #: mask of those that a master covered at the beginning of the step, shape (m,)
    shares: Array  #: of each pair in the area that was covered at the beginning of the step, shape (m, pairs)
    stuck: NDArray[np.bool_]  #: mask of those that are not to stick because their slip reverses, shape (m,)
    free: NDArray[np.bool_]  #: mask of those that slip on a body that nothing holds along its contacts, shape (m,)
    c_n: Array  #: complementarity parameter of the gap [Pa/m], (m,); the solution does not depend on it
    c_t: Array  #: complementarity parameter of the slip [Pa/m], (m,)
    touching: Array  #: gap [m] below which it is a rounding error, shape (m,)

    @property
    def pressure(self) -> Array:
        """z_n = n.z [Pa], shape (m,)."""
        return np.einsum("nd,nd->n", self.z, self.normals)

    @property
    def trial_pressure(self) -> Array:
        """z_n - c_n g [Pa] with the mean gap g, shape (m,): positive where in contact."""
        mean_gap = np.divide(self.gap, self.D, out=np.ones_like(self.gap), where=self.covered)
        return self.pressure - self.c_n * (mean_gap - self.touching)


@dataclass(frozen=True)
class Slopes:
    """Derivatives with respect to the displacements of all nodes, dim * N columns."""

    gap: Sparse  #: shape (m, dim * N)
    normals: Sparse  #: shape (dim * m, dim * N)
    slip: Sparse  #: shape (dim * m, dim * N)


@dataclass(frozen=True)
class Rows:
    """residual + by_z dz + by_u du = 0: dim equations [N] for every multiplier in contact."""

    residual: Array  #: shape (m, dim)
    by_z: Array  #: shape (m, dim, dim)
    by_u: Sparse  #: shape (dim * m, dim * N)


class Law(Protocol):
    """A relation between traction, gap and slip."""

    @property
    def span(self) -> Span:
        """Admissible directions of its multipliers."""
        ...

    @property
    def slips(self) -> bool:
        """Whether it depends on the slip."""
        ...

    def status(self, at: Point) -> Statuses:
        """OPEN, SLIP or STICK, shape (m,)."""
        ...

    def residual(self, at: Point, status: Statuses, weight: float) -> Array:
        """Residual of multipliers in contact [N], shape (m, dim); weight: that of their forces in the balance."""
        ...

    def rows(self, at: Point, slopes: Slopes, status: Statuses, weight: float) -> Rows:
        """The residual and its derivatives; all multipliers given are in contact."""
        ...


def along(normals: Array) -> Array:
    """Projectors I - n n^T onto the tangent planes, shape (m, dim, dim)."""
    return np.eye(normals.shape[1]) - normals[:, :, None] * normals[:, None, :]
