"""The interface of bodies for supports and springs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from numpy.typing import NDArray
from petsc4py import PETSc

from solvers import fem
from solvers.api import Array


class MeshedBody(Protocol):
    """A body with nodes and named surfaces."""

    name: str
    domain: fem.Domain
    space: Any
    points: Array  #: of all local nodes [m], shape (3, n)
    nodes: NDArray[Any]  #: their numbers in the mesh
    owned: int  #: how many of them this process owns

    @property
    def supports(self) -> Sequence[Any]: ...

    @property
    def springs(self) -> Sequence[Any]: ...

    @property
    def dim(self) -> int: ...

    def create_tangent(self) -> PETSc.Mat:
        """An empty matrix of its dofs."""
        ...
