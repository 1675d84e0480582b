"""Whether a way through the fluid leads from period to period."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence

import numpy as np

from solvers.fluid.cut.cut import Cut
from solvers.fluid.cut.pockets import regions
from solvers.fluid.geometry.pieces import NOTHING
from solvers.fluid.mesh.distributed_grid import DistributedGrid


def leads_through(grid: DistributedGrid, cut: Cut, axis: int, periodic: Sequence[int]) -> bool:
    """Whether the fluid is connected along a periodic axis from one period to the next (collective).

    Cells with fluid that share a vertex are connected; periodic: all axes along which the flow repeats.
    """
    uncut, partly = (some[some < grid.owned] for some in (cut.uncut, cut.cut))
    own = np.sort(np.concatenate([uncut, partly[cut.fraction[partly] > NOTHING]])).astype(np.int32)
    labels, _ = regions(grid, own, [other for other in periodic if other != axis])
    index = np.stack(np.unravel_index(grid.numbers[own], grid.grid.shape, order="F"))
    ends = []
    for place in (0, grid.grid.shape[axis] - 1):
        there = index[axis] == place
        rows = map(tuple, np.delete(index[:, there], axis, axis=0).T.tolist())
        parts = grid.comm.allgather(list(zip(rows, labels[own[there]].tolist(), strict=True)))
        ends.append(dict(pair for part in parts for pair in part))
    return winds({(ends[1][row], ends[0][row]) for row in ends[0].keys() & ends[1].keys()})


def winds(crossings: Iterable[tuple[int, int]]) -> bool:
    """Whether some parts are joined to a way that ends in another period than it began.

    crossings: (part at the end of a period, part at the beginning of the next one).
    """
    steps: dict[int, list[tuple[int, int]]] = {}
    for before, after in crossings:
        steps.setdefault(before, []).append((after, 1))
        steps.setdefault(after, []).append((before, -1))
    period: dict[int, int] = {}
    for start in steps:
        if start in period:
            continue
        period[start], queue = 0, deque([start])
        while queue:
            part = queue.popleft()
            for other, step in steps[part]:
                if other not in period:
                    period[other] = period[part] + step
                    queue.append(other)
                elif period[other] != period[part] + step:
                    return True
    return False
