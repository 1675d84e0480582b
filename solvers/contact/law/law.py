"""The interface of contact laws: their arguments, the status of multipliers, and the rows that these fulfil."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.sparse import Sparse

#: Status of a multiplier: no contact; contact, free to slide; contact, no sliding
OPEN, SLIP, STICK = 0, 1, 2

Statuses = NDArray[np.int8]

#: Directions of a multiplier: along the normal, also along the surface, or any without regard to the surface
Span = Literal["normal", "surface", "space"]


@dataclass(frozen=True)
class Point:
    """Multipliers of one law at an iterate, m of them. Everything a law may depend on."""

    z: Array  #: multipliers [Pa], the negative traction on the slave, shape (m, dim)
    normals: Array  #: outward unit normals of the slave, shape (m, dim)
    D: Array  #: covered area [m^(dim-1)], shape (m,)
    gap: Array  #: weighted gap [m^dim] that must not be negative, shape (m,)
    covered: NDArray[np.bool_]  #: there is enough of a master for a constraint, shape (m,)
    stiffness: Array  #: of the bodies, per area [Pa/m], shape (m,)
    slip: Array  #: [m], shape (m, dim); with friction that of the step, of which the part along the surface counts
    slip_defined: NDArray[np.bool_]  #: the multiplier saw a master at the beginning of the step, shape (m,)
    c_n: Array  #: complementarity parameter of the gap [Pa/m]: any positive one has the same solution, shape (m,)
    c_t: Array  #: the same of the slip
    touching: float  #: gap [m] that is rounding

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
    """How normal and tangential traction follow from gap and slip."""

    @property
    def span(self) -> Span:
        """Directions that its multipliers may have."""
        ...

    @property
    def slips(self) -> bool:
        """It asks for the slip."""
        ...

    def status(self, at: Point) -> Statuses:
        """OPEN, SLIP or STICK, shape (m,)."""
        ...

    def residual(self, at: Point, status: Statuses, weight: float) -> Array:
        """Residual of multipliers in contact [N], shape (m, dim); weight: of their forces in the balance."""
        ...

    def rows(self, at: Point, slopes: Slopes, status: Statuses, weight: float) -> Rows:
        """The residual and its derivatives; all multipliers given are in contact."""
        ...


def along(normals: Array) -> Array:
    """Projectors I - n n^T onto the tangent planes, shape (m, dim, dim)."""
    return np.eye(normals.shape[1]) - normals[:, :, None] * normals[:, None, :]
