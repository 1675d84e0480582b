"""From the patches of a case to the faces of the box through which no fluid passes."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from fsci.builder.periods import put_within
from fsci.case import Case
from fsci.case.fluid import PatchSection
from solvers.fluid.terms.boundary.patch_kinds import PATCH_KINDS
from solvers.sentinels.walls import Wall

Array = NDArray[np.float64]


def closed_faces(case: Case) -> Iterator[Wall]:
    """Faces of the box, or parts of them, through which no fluid passes."""
    if case.fluid is None:
        return
    grid = case.fluid.grid
    for name, patch in case.fluid.patches.items():
        for face in patch.on:
            axis = "xyz".index(face[0])
            position = (grid.start if face[1] == "-" else grid.to)[axis]
            if is_closed(patch, axis):
                yield Wall(name, face, float(position), None if patch.where is None else _within(case, patch))


def is_closed(patch: PatchSection, axis: int) -> bool:
    """Whether no fluid passes a patch on a face with this normal."""
    if patch.kind == "velocity":
        assert patch.velocity is not None
        return patch.velocity[axis].constant == 0.0
    return PATCH_KINDS[patch.kind].normal_given


def _within(case: Case, patch: PatchSection) -> Callable[[Array], NDArray[np.bool_]]:
    where = patch.where
    assert where is not None
    return lambda x: np.broadcast_to(where(put_within(case, x), 0.0), x.shape[1]) > 0.0
