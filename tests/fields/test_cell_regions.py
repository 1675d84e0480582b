"""Parts of the fluid in cells that a surface cuts, in 3D."""

import numpy as np
import pytest
from fluid_setup import block, sphere
from thin_space import turn

from solvers import kernels
from solvers.fluid.geometry.bodies import closed_surfaces
from solvers.fluid.geometry.thin.fluid_parts import parts_of_fluid
from solvers.fluid.grid.box import Grid, uniform
from solvers.mesh.gauss import gauss

POINTS, WEIGHTS = gauss(3)
GRID = uniform([0, 0, 0], [1, 1, 1], [8, 8, 8])
UNEVEN = Grid((np.array([0.0, 0.1, 0.3, 0.45, 0.7, 1.0]), np.linspace(0.0, 1.0, 5), np.linspace(0.0, 1.0, 7) ** 1.3))


def found_in(grid, points, facets):
    """(parts of the fluid that the surface bounds, moments of the kernel)."""
    wanted = np.ones(grid.size, dtype=bool)
    moments = kernels.moments(grid.edges, POINTS, np.ascontiguousarray(points), facets, wanted)
    return parts_of_fluid(grid, moments, closed_surfaces(facets, points), points), moments


def bodies(kind, thickness):
    """A plate through the box, one within it, a rod, a hollow ball, and a small box, of this thickness [m]."""
    half = thickness / 2
    if kind == "ball":
        (outer, facets), (inner, _) = (sphere((0, 0, 0), radius, 2) for radius in (0.3, 0.3 - thickness))
        return np.concatenate([outer, inner]), np.concatenate([facets, facets[:, ::-1] + len(outer)])
    size = {"plate": (half, 1.0, 1.0), "leaf": (half, 0.3, 0.25), "rod": (half, half, 0.3), "box": (half,) * 3}[kind]
    return block([-a for a in size], size)


@pytest.mark.parametrize("thickness", [1e-7, 1e-3, 0.03, 0.12])
@pytest.mark.parametrize("kind", ["plate", "leaf", "rod", "ball", "box"])
def test_regions_make_up_the_fluid(kind, thickness):
    """Their integrals add up to those of the moments kernel; each is positive, and every cell has its own."""
    rng = np.random.default_rng(3)
    points, facets = bodies(kind, thickness)
    for grid in (GRID, UNEVEN):
        x = points @ turn(*rng.uniform(-2.0, 2.0, 2)).T + 0.5 + rng.uniform(-0.05, 0.05, 3)
        parts, moments = found_in(grid, x, facets)
        assert (parts.region[np.isin(parts.cell, moments.cells)] >= 0).all()
        assert (parts.share > 0.0).all()
        total = np.bincount(parts.cell, parts.share, grid.size)[moments.cells]
        assert np.abs(total - 1.0 + moments.fraction[moments.cells]).max() < 1e-13
        weights = np.multiply.outer(WEIGHTS, np.multiply.outer(WEIGHTS, WEIGHTS)).ravel()
        for row in range(0, len(moments.cells), 7):
            here = np.flatnonzero(parts.cell == moments.cells[row])
            off = sum(parts.integrals(part, POINTS) for part in here) - weights + moments.solid[row]
            assert np.abs(off).max() < 1e-13


@pytest.mark.parametrize(("kind", "most"), [("plate", 2), ("leaf", 2), ("rod", 1), ("box", 1), ("ball", 2)])
def test_how_many(kind, most):
    """A thin plate or shell divides most cells into two, its edges do not, a rod or a body within a cell does not."""
    points, facets = bodies(kind, 0.004)
    parts, _ = found_in(GRID, points @ turn(0.3, 0.4).T + [0.47, 0.53, 0.56], facets)
    count = np.bincount(parts.cell[parts.region >= 0])
    count = count[count > 0]
    assert count.max() == most
    assert (np.mean(count == most) > 0.8) == (kind != "leaf")


def test_points_in_regions():
    """A point on either side of a plate has the region of its side, one in the plate none; corners, too."""
    points, facets = bodies("plate", 0.004)
    matrix, middle = turn(0.5, -0.4), np.array([0.47, 0.53, 0.56])
    parts, _ = found_in(GRID, points @ matrix.T + middle, facets)
    rng = np.random.default_rng(0)
    for cell in np.unique(parts.cell[parts.region >= 0])[::9]:
        facing = {}
        for k in np.flatnonzero(parts.cell == cell):
            of = points[facets[min(parts.facets(k))]]
            facing[bool(np.cross(of[1] - of[0], of[2] - of[0])[0] > 0)] = parts.region[k]
        low = np.stack(np.unravel_index(cell, GRID.shape, order="F")) / 8
        for s in [*rng.uniform(size=(5, 3)), *rng.integers(0, 2, (3, 3)).astype(float)]:
            side = (low + s / 8 - middle) @ matrix[:, 0]
            if abs(side) > 0.0025 and len(facing) == 2:
                assert parts.region_at(int(cell), s) == facing[bool(side > 0)]
            elif abs(side) < 0.0015:
                assert parts.region_at(int(cell), s) == -1


def test_a_hollow_within_a_face():
    """A tube through a face of a cell: the fluid in it is a region of its own, around a hole in the other one."""
    a, b = 0.06, 0.04
    ring = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    corners = np.array([[r * x, r * y, z] for r in (a, b) for z in (-0.4, 0.4) for x, y in ring])
    facets = []
    for first, turned in ((0, False), (8, True)):
        for k in range(4):
            n = (k + 1) % 4
            pair = [[first + k, first + n, first + 4 + n], [first + k, first + 4 + n, first + 4 + k]]
            facets += [f[::-1] if turned else f for f in pair]
    for k in range(4):
        n = (k + 1) % 4
        facets += [[k, n + 8, n], [k, k + 8, n + 8], [4 + k, 4 + n, 12 + n], [4 + k, 12 + n, 12 + k]]
    parts, _ = found_in(GRID, corners + np.array([0.5625, 0.5625, 0.5]), np.array(facets))
    count = np.bincount(parts.cell[parts.region >= 0], minlength=GRID.size)
    inside = [4 + 8 * (4 + 8 * k) for k in range(1, 7)]
    assert count[inside].tolist() == [2] * 6
    shares = sorted(parts.share[parts.cell == inside[2]])
    assert shares == pytest.approx([1 - (2 * a * 8) ** 2, (2 * b * 8) ** 2], abs=1e-13)
