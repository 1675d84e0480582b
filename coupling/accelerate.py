"""Accelerators of fixed-point iterations d -> D(d): constant relaxation, Aitken's, interface quasi-Newton.

r = D(d) - d is the residual of the interface. Arrays are the same on every process.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np

from solvers.api import Array, State


class Accelerator(Protocol):
    """Computes the next iterate from those of this step and of earlier ones."""

    @property
    def finds_levels(self) -> bool:
        """Whether it converges with the pressure levels of closed pockets among the unknowns."""
        ...

    def begin_step(self) -> None: ...

    def next(self, d: Array, found: Array) -> Array:
        """The next iterate from d and D(d)."""
        ...

    def forget(self) -> None:
        """Discard all differences: the map has changed, because contact opened or closed."""
        ...

    def save(self) -> State: ...
    def restore(self, state: State) -> None: ...


class Relaxation:
    """d + omega r with a constant omega; omega = 1 is the plain Dirichlet-Neumann iteration."""

    finds_levels = False

    def __init__(self, omega: float = 1.0):
        self.omega = omega

    def begin_step(self) -> None: ...
    def forget(self) -> None: ...

    def next(self, d: Array, found: Array) -> Array:
        return d + self.omega * (found - d)

    def save(self) -> State:
        return {}

    def restore(self, state: State) -> None: ...


class Aitken:
    """d + omega_k r_k, omega_k = -omega_{k-1} r_{k-1} . (r_k - r_{k-1}) / |r_k - r_{k-1}|^2.

    A step starts with the last omega of the step before, at most `first`.
    Source: Kuttler, Wall, Comput. Mech. 43 (2008) 61-72.
    """

    finds_levels = False

    def __init__(self, first: float = 0.5):
        self.first = first
        self.omega = first
        self._before: Array | None = None

    def begin_step(self) -> None:
        self.omega = np.sign(self.omega) * min(abs(self.omega), self.first)
        self._before = None

    def forget(self) -> None:
        self._before = None

    def next(self, d: Array, found: Array) -> Array:
        residual = found - d
        if self._before is not None:
            change = residual - self._before
            size = float((change * change).sum())
            if size > 0.0:
                self.omega *= -float((self._before * change).sum()) / size
        self._before = residual
        return d + self.omega * residual

    def save(self) -> State:
        return {"omega": float(self.omega)}

    def restore(self, state: State) -> None:
        self.omega, self._before = state["omega"], None


class QuasiNewton:
    """IQN-ILS: the combination of earlier differences that minimises the residual in the least-squares sense.

    Columns of V are differences of r, those of W differences of D(d), newest first, of this step and of `reuse` steps
    before. With V = Q R and R a = -Q^T r the next iterate is D(d) + W a. Columns that depend on newer ones,
    |R_ii| < `filter` |V_i|, are dropped. Sources: Degroote, Bathe, Vierendeels, Comput. Struct. 87 (2009) 793-801;
    Haelterman, Bogaers, Scheufele, Uekermann, Mehl, Comput. Struct. 171 (2016) 9-17 (filter).
    """

    finds_levels = True

    def __init__(self, first: float = 0.1, reuse: int = 8, filter: float = 0.1):
        self.first, self.reuse, self.filter = first, reuse, filter
        self._steps: list[tuple[list[Array], list[Array]]] = []
        self._before: tuple[Array, Array] | None = None

    def begin_step(self) -> None:
        self._before = None
        self._steps = [step for step in self._steps if step[0]][: self.reuse]
        self._steps.insert(0, ([], []))

    def forget(self) -> None:
        self._steps = [([], [])]
        self._before = None

    def next(self, d: Array, found: Array) -> Array:
        residual, mapped = (found - d).ravel(), found.ravel()
        if self._before is not None:
            v, w = self._steps[0]
            v.insert(0, residual - self._before[0])
            w.insert(0, mapped - self._before[1])
        self._before = residual, mapped
        columns = [c for step in self._steps for c in step[0]]
        if not columns:
            return d + self.first * (found - d)
        V, W = np.stack(columns, axis=1), np.stack([c for step in self._steps for c in step[1]], axis=1)
        kept = self.independent(V)
        a = np.linalg.lstsq(V[:, kept], -residual, rcond=None)[0]
        return (mapped + W[:, kept] @ a).reshape(d.shape)

    def independent(self, V: Array) -> list[int]:
        """Indices of the columns that do not depend on newer ones, by modified Gram-Schmidt."""
        basis: list[Array] = []
        kept = []
        for index in range(min(V.shape)):
            column = V[:, index].copy()
            size = np.linalg.norm(column)
            for direction in basis:
                column -= (direction @ column) * direction
            rest = np.linalg.norm(column)
            if rest > self.filter * size and rest > 0.0:
                basis.append(column / rest)
                kept.append(index)
        return kept

    def save(self) -> State:
        steps = [step for step in self._steps if step[0]]
        V, W = (np.array([column for step in steps for column in step[which]]) for which in (0, 1))
        return {"V": V, "W": W, "lengths": np.array([len(step[0]) for step in steps], dtype=np.int64)}

    def restore(self, state: State) -> None:
        ends = np.cumsum(state["lengths"])
        starts = ends - state["lengths"]
        self._steps = [(list(state["V"][a:b]), list(state["W"][a:b])) for a, b in zip(starts, ends, strict=True)]
        self._before = None


#: Name in the case file -> (factor of the first correction, count of reused steps) -> accelerator.
ACCELERATORS: Mapping[str, Callable[[float, int], Accelerator]] = {
    "iqn": QuasiNewton,
    "aitken": lambda first, reuse: Aitken(first),
    "constant": lambda first, reuse: Relaxation(first),
}
