"""Section `grid` of the fluid: a box of cells, equal or graded, direction by direction."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from fsci.case.section import Section, fault, setting
from fsci.case.values import Count, EntryCount, Name, Number, NumberVector, Positive
from fsci.distinct import distinct

MOST_CELLS_ALONG = 100_000  #: along one direction
MOST_GROWTH = 1e6  #: of cells within a stretch
MOST_LEVELS = 10  #: of cells in cells
MOST_FINE = 10**8  #: cells of the finest level in the whole box: there are arrays of that size


class Stretch(Section):
    """Part of one direction: cells from the end of the part before to its own."""

    to: Number = setting(..., "where it ends", unit="m")
    cells: Count = setting(..., "number of cells")
    ratio: Positive = setting(1.0, "size of its last cell over that of its first one", unit="1")

    @model_validator(mode="after")
    def _moderate(self) -> Stretch:
        if not 1 / MOST_GROWTH <= self.ratio <= MOST_GROWTH:
            raise fault(f"must be from {1 / MOST_GROWTH:g} to {MOST_GROWTH:g}, not {self.ratio:g}", "ratio")
        return self


Stretches = Annotated[tuple[Stretch, ...], EntryCount(1, None)]


class Refinement(Section):
    """A region in which cells are halved: a box, or cells near the surface of a body, which follow it if it moves."""

    box: Annotated[tuple[NumberVector, ...], EntryCount(2, 2)] | None = setting(
        None, "lowest and highest corner of a box", unit="m"
    )
    around: Name | None = setting(None, "instead of a box: name of a body")
    layers: Count = setting(4, "cells of this level on both sides of the body's surface")
    level: Count = setting(1, "how often the cells are halved: edges are 2^-level times as long")

    @model_validator(mode="after")
    def _one_place(self) -> Refinement:
        if (self.box is None) == (self.around is None):
            raise fault("a refinement needs either 'box' or 'around'")
        if self.level > MOST_LEVELS:
            raise fault(f"must be at most {MOST_LEVELS}, not {self.level}", "level")
        if self.box is not None:
            for axis, (low, high) in enumerate(zip(*self.box, strict=False)):
                if low >= high:
                    raise fault(
                        "must be greater than that of the lowest corner, {}, not {}".format(*distinct(low, high)),
                        "box",
                        1,
                        axis,
                    )
        return self


class GridSection(Section):
    """A box of axis-aligned cells. Each direction has a number of equal `cells`, or a list of stretches `x`, `y`, `z`.

    In a stretch of n cells each is ratio^(1/(n - 1)) times as long as the one before.
    """

    start: NumberVector = setting(..., "lowest corner of the box", unit="m", name="from")
    to: NumberVector = setting(..., "highest corner of the box", unit="m")
    cells: Annotated[tuple[Count | None, ...], EntryCount(2, 3)] | None = setting(
        None, "number of equal cells along x, y (and z); null for a direction with stretches"
    )
    x: Stretches | None = setting(None, "stretches along x")
    y: Stretches | None = setting(None, "stretches along y")
    z: Stretches | None = setting(None, "stretches along z")
    refine: tuple[Refinement, ...] = setting(
        tuple,
        "where cells are halved; those that share a corner differ by one level at most, for which more are halved",
    )

    @property
    def dimension(self) -> int:
        return len(self.start)

    @property
    def graded(self) -> tuple[tuple[Stretch, ...] | None, ...]:
        """The stretches of each direction; None for directions without."""
        return (self.x, self.y, self.z)[: self.dimension]

    @property
    def levels(self) -> int:
        """The level of the finest cells."""
        return max((refinement.level for refinement in self.refine), default=0)

    @property
    def smallest(self) -> NDArray[np.float64]:
        """Edges of the smallest cells [m] by direction."""
        return np.array([float(np.diff(edges).min()) for edges in self.planes]) / 2**self.levels

    def _check_refinements(self) -> None:
        finest = int(np.prod([float(n) * 2**self.levels for n in self.shape]))
        if self.refine and finest > MOST_FINE:
            raise fault(
                f"if all of its cells were of the finest level there would be {finest:.2g}: "
                f"{MOST_FINE:.0e} are the most",
                "refine",
            )
        for number, refinement in enumerate(self.refine):
            for corner, x in enumerate(refinement.box or ()):
                if len(x) != self.dimension:
                    raise fault(
                        f"must have {self.dimension} entries like 'from', not {len(x)}", "refine", number, "box", corner
                    )
            if refinement.box is not None and not all(
                a < high and b > low for a, b, low, high in zip(*refinement.box, self.start, self.to, strict=True)
            ):
                raise fault("is outside of the grid", "refine", number, "box")

    @model_validator(mode="after")
    def _consistent(self) -> GridSection:
        dim = self.dimension
        if len(self.to) != dim:
            raise fault(f"must have {dim} entries like 'from', not {len(self.to)}", "to")
        if self.cells is not None and len(self.cells) != dim:
            raise fault(f"must have {dim} entries like 'from', not {len(self.cells)}", "cells")
        if dim == 2 and self.z is not None:
            raise fault("'from' has 2 entries: a grid in 2D has no 'z'", "z")
        for axis, (low, high) in enumerate(zip(self.start, self.to, strict=True)):
            if low >= high:
                words = "must be greater than that of 'from', {}, not {}".format(*distinct(low, high))
                raise fault(words, "to", axis)
            self._check_direction(axis)
        for axis, (count, name) in enumerate(zip(self.shape, "xyz", strict=False)):
            if count > MOST_CELLS_ALONG:
                raise fault(f"{count} cells along {name} are too many: {MOST_CELLS_ALONG} are the most")
            if not np.all(np.diff(self.edges(axis)) > 0.0):
                raise fault(f"the cells along {name} are smaller than rounding errors of their coordinates")
        self._check_refinements()
        return self

    def _check_direction(self, axis: int) -> None:
        name, stretches = "xyz"[axis], self.graded[axis]
        cells = None if self.cells is None else self.cells[axis]
        if stretches is None and cells is None:
            raise fault(f"the direction {name} needs a number of cells in 'cells', or stretches in '{name}'")
        if stretches is None:
            return
        if cells is not None:
            raise fault(f"'{name}' has stretches: write null here, not {cells}", "cells", axis)
        before = self.start[axis]
        for number, stretch in enumerate(stretches):
            if stretch.to <= before:
                words = "must be greater than {}, where this stretch begins, not {}"
                end = words.format(*distinct(before, stretch.to))
                raise fault(end, name, number, "to")
            before = stretch.to
        if before != self.to[axis]:
            to, ends = distinct(self.to[axis], before)
            end = f"must be {to} like entry {axis + 1} of the grid's 'to', not {ends}"
            raise fault(end, name, len(stretches) - 1, "to")

    @property
    def shape(self) -> tuple[int, ...]:
        """Cells per direction."""
        return tuple(
            (self.cells or ())[axis] or 0 if stretches is None else sum(stretch.cells for stretch in stretches)
            for axis, stretches in enumerate(self.graded)
        )

    @property
    def planes(self) -> tuple[NDArray[np.float64], ...]:
        """The edges of all directions."""
        return tuple(self.edges(axis) for axis in range(self.dimension))

    def edges(self, axis: int) -> NDArray[np.float64]:
        """Coordinates of the grid planes along one direction, increasing."""
        parts = [np.array([self.start[axis]])]
        for stretch in self.graded[axis] or (Stretch(to=self.to[axis], cells=self.shape[axis]),):
            sizes = stretch.ratio ** (np.arange(stretch.cells) / max(stretch.cells - 1, 1))
            inner = np.concatenate([[0.0], np.cumsum(sizes) / sizes.sum()])
            inner[-1] = 1.0
            begin = parts[-1][-1]
            parts.append((begin * (1.0 - inner) + stretch.to * inner)[1:])
        return np.concatenate(parts)
