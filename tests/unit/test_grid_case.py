"""The section `grid` of a case: each mistake with its message, the text it points at, and the cells that it means."""

import re

import numpy as np
import pytest
from case_mistakes import assert_located, load, refused
from channel_case import CASE, GRID, RESTING

from fsci.case import CaseError
from fsci.case.grid import GridSection
from fsci.check.check import summary
from fsci.check.meshes import check_meshes
from fsci.meshes.nested import read_grid

#: what is replaced, by what, the message with line and column, the text that stands there
MISTAKES = [
    ("to: [4, 1]", "to: [4, 1, 1]", "6:28: 'to' must have 2 entries like 'from', not 3", "[4"),
    ("to: [4, 1]", "to: [-4, 1]", "6:29: entry 1 of 'to' must be greater than that of 'from', 0, not -4", "-4"),
    (GRID, "cells: [40]", "6:43: 'cells' must have 2 or 3 entries, not 1", "[40]"),
    (GRID, "cells: [40, 10, 10]", "6:43: 'cells' must have 2 entries like 'from', not 3", "[40"),
    (GRID, "cells: [40, 0]", "6:48: entry 2 of 'cells' must be at least 1, not 0", "0]"),
    (", " + GRID, "", "6:9: the direction x needs a number of cells in 'cells', or stretches in 'x'", "{from"),
    (GRID, GRID + ", z: [{to: 1, cells: 2}]", "6:56: 'from' has 2 entries: a grid in 2D has no 'z'", "[{to"),
    (
        GRID,
        GRID + ", x: [{to: 4, cells: 2}]",
        "6:44: 'x' has stretches: write null here, not 40",
        "40",
    ),
    (
        GRID,
        "cells: [null, 10], x: [{to: 3, cells: 2}]",
        "6:64: 'to' must be 4 like entry 1 of the grid's 'to', not 3",
        "3",
    ),
    (
        GRID,
        "cells: [null, 10], x: [{to: 3, cells: 2}, {to: 2, cells: 1}]",
        "6:83: 'to' must be greater than 3, where this stretch begins, not 2",
        "2",
    ),
    (GRID, "cells: [40, 2e5]", "6:9: 200000 cells along y are too many: 100000 are the most", "{from"),
    (
        "to: [4, 1]",
        "to: [5e-324, 1]",
        "6:9: the cells along x are smaller than rounding errors of their coordinates",
        "{from",
    ),
    (
        GRID,
        "cells: [null, 10], x: [{to: 4, cells: 2, ratio: 1e9}]",
        "6:84: 'ratio' must be from 1e-06 to 1e+06, not 1e+09",
        "1e9",
    ),
    (
        GRID,
        GRID + ", refine: [{level: 1}]",
        "6:62: a refinement needs either 'box' or 'around'",
        "{level",
    ),
    (
        GRID,
        GRID + ", refine: [{box: [[0, 0], [1, 1]], around: cylinder}]",
        "6:62: a refinement needs either 'box' or 'around'",
        "{box",
    ),
    (
        GRID,
        GRID + ", refine: [{around: cylinder, level: 11}]",
        "6:88: 'level' must be at most 10, not 11",
        "11",
    ),
    (
        GRID,
        GRID + ", refine: [{around: cylinder, level: 10}]",
        "6:61: if all of its cells were of the finest level there would be 4.2e+08: 1e+08 are the most",
        "[{around",
    ),
    (
        GRID,
        GRID + ", refine: [{around: cylindre}]",
        "6:71: there is no body 'cylindre'; did you mean 'cylinder'?",
        "cylindre",
    ),
    (
        GRID,
        GRID + ", refine: [{box: [[1, 0], [1, 1]]}]",
        "6:78: entry 1 of entry 2 of 'box' must be greater than that of the lowest corner, 1, not 1",
        "1, 1",
    ),
    (GRID, GRID + ", refine: [{box: [[0, 0]]}]", "6:68: 'box' must have 2 entries, not 1", "[[0"),
    (
        GRID,
        GRID + ", refine: [{box: [[0, 0, 0], [1, 1, 1]]}]",
        "6:69: entry 1 of 'box' must have 2 entries like 'from', not 3",
        "[0, 0, 0]",
    ),
    (GRID, GRID + ", refine: [{box: [[5, 0], [6, 1]]}]", "6:68: 'box' is outside of the grid", "[[5"),
]


pytestmark = pytest.mark.usefixtures("in_new_folder")


@pytest.mark.parametrize(("old", "new", "message", "at"), MISTAKES, ids=[m[2] for m in MISTAKES])
def test_message(old, new, message, at):
    assert CASE.count(old) >= 1
    text = CASE.replace(old, new, 1)
    assert_located(text, refused(text), message, at)


def test_refined_grids():
    refined = RESTING.replace(GRID, GRID + ", refine: [{around: cylinder, level: 2}]")
    text = summary(load(refined))
    grid = read_grid(load(refined))
    assert set(grid.width) == {1, 2, 4}
    assert f"40 x 10 cells, in parts halved 2 times: {len(grid.first):,} in all" in text
    assert f"{2 * grid.unknowns(2) + grid.unknowns(1):,} with" in text
    coarse = refined.replace("level: 2", "layers: 2")
    message = "body 'cylinder' comes within 3 cells of cells that are not of the finest level, 1: refine around it "
    message += "with 3 layers or more, or in a box over all of its way"
    with pytest.raises(CaseError, match=f"case.yaml:6:61: {message}"):
        read_grid(load(coarse))
    assert [str(p).splitlines()[0] for p in check_meshes(load(coarse)).problems] == [f"case.yaml:6:61: {message}"]
    ends = "ends: {on: [x-, x+], periodic: true}"
    periodic = re.sub(r"inlet: .*\n    outlet: .*", ends, refined)
    message = "6:61: a grid with periodic patches cannot be refined: use stretches"
    assert_located(periodic, refused(periodic), message, "[{around")


def test_edges_of_a_graded_grid():
    """Equal cells, and cells that grow by the same factor from the first to the last."""
    stretches = [{"to": 1, "cells": 2}, {"to": 3, "cells": 3, "ratio": 4}, {"to": 4, "cells": 1, "ratio": 7}]
    grid = GridSection.model_validate({"from": [0, -1], "to": [4, 1], "cells": [None, 4], "x": stretches})
    x, y = grid.planes
    assert grid.shape == (6, 4)
    assert np.allclose(y, [-1, -0.5, 0, 0.5, 1], atol=0)
    assert np.allclose(np.diff(x), [0.5, 0.5, 2 / 7, 4 / 7, 8 / 7, 1])
    assert (x[2], x[5], x[6]) == (1.0, 3.0, 4.0)
