"""Closed parts of the fluid, on any number of processes, against a flood fill cell by cell."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from mpi4py import MPI
from programs import on_processes

from solvers.fluid.cut.cut import cells_between
from solvers.fluid.cut.pockets import find_pockets
from solvers.fluid.grid.box import Grid, uniform
from solvers.fluid.mesh.distributed_grid import DistributedGrid

SHAPES = [((9, 8), ()), ((9, 8), (0,)), ((6, 5, 4), ()), ((6, 5, 4), (1, 2))]


def flood(active, periodic):
    """The connected parts of a box of cells, as sets of their indices."""
    left, parts = set(map(tuple, np.argwhere(active).tolist())), []
    while left:
        front, part = [left.pop()], set()
        while front:
            cell = front.pop()
            part.add(cell)
            for step in itertools.product((-1, 0, 1), repeat=active.ndim):
                near = [c + s for c, s in zip(cell, step, strict=True)]
                near = tuple(
                    c % n if a in periodic else c for a, (c, n) in enumerate(zip(near, active.shape, strict=True))
                )
                if near in left:
                    left.remove(near)
                    front.append(near)
        parts.append(part)
    return parts


def check(comm):
    """Pockets of random patterns on a distributed grid are the closed parts, once each, on all processes."""
    rng = np.random.default_rng(3)
    for shape, periodic in SHAPES:
        grid = DistributedGrid(comm, uniform([0.0] * len(shape), [1.0] * len(shape), shape))
        index = np.stack(np.unravel_index(grid.numbers, shape, order="F"), axis=1)
        for share in (0.0, 0.15, 0.3, 0.45):
            active, is_open = (rng.random(shape) < chance for chance in (share, 0.04))
            if share == 0.3:  # bodies cover the cells of some processes
                active[: shape[0] // 2] = False
            is_open &= active
            here = active[tuple(index.T)]
            cut = SimpleNamespace(
                facets=np.empty((0, 2), dtype=np.int64),
                pieces=SimpleNamespace(facet=np.empty(0, dtype=np.int64), cell=np.empty(0, dtype=np.int64)),
                cut=np.empty(0, dtype=np.int32),
            )
            opening = np.flatnonzero(is_open[tuple(index.T)]).astype(np.int32)
            cells = np.flatnonzero(here).astype(np.int32)
            found = find_pockets(grid, cut, cells, opening, np.empty(0, dtype=bool), periodic)
            owned = [index[: grid.owned][pocket.cells[: grid.owned]].tolist() for pocket in found]
            gathered = [set(map(tuple, itertools.chain(*parts))) for parts in zip(*comm.allgather(owned), strict=True)]
            closed = [part for part in flood(active, periodic) if not any(is_open[cell] for cell in part)]
            assert sorted(map(sorted, gathered)) == sorted(map(sorted, closed))
            assert [len(part) for part, pocket in zip(gathered, found, strict=True) if pocket.largest] == (
                [max(map(len, closed))] if closed else []
            )


def test_pockets_are_the_closed_parts():
    check(MPI.COMM_SELF)


@pytest.mark.parametrize("processes", [2, *(pytest.param(count, marks=pytest.mark.slow) for count in (3, 4))])
def test_pockets_on_several_processes(processes):
    on_processes(processes, __file__)


@pytest.mark.parametrize("dim", [2, 3])
def test_cells_between_corners(dim):
    rng = np.random.default_rng(dim)
    box = Grid(tuple(np.sort(np.r_[0.0, 1.0, rng.uniform(size=6)]) for _ in range(dim)))
    low = rng.uniform(-0.1, 0.9, (30, dim))
    low[:10] = np.stack([rng.choice(edge, 10) for edge in box.edges], axis=1)  # on the planes of the grid
    high = low + rng.uniform(0.0, 0.5, (30, dim))
    expected = set()
    for a, b in zip(low, high, strict=True):
        rows = [
            [i for i in range(len(e) - 1) if (e[i] <= y or i == 0) and (e[i + 1] > x or i == len(e) - 2)]
            for e, x, y in zip(box.edges, a, b, strict=True)
        ]
        expected |= {int(np.ravel_multi_index(cell, box.shape, order="F")) for cell in itertools.product(*rows)}
    assert set(cells_between(box, low, high).tolist()) == expected


if __name__ == "__main__":
    check(MPI.COMM_WORLD)
