"""Shallow ironing without friction (after Fischer & Wriggers 2006): a stiff indenter is pressed into a slab and slid.

Plane strain: slab 12 x 4, E = 68.96; indenter 1.2 wide with a lower arc of radius 0.75, its apex 0.2 above the slab at
the start, E = 689.6; both nu = 0.32. The top of the indenter goes down by 1 until t = 1, then along with speed 10.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from contact_setup import make_body, make_contact, solve_step
from structure_setup import constant

from fsci import shapes
from solvers.structure.body import Support
from solvers.structure.materials import NeoHooke, lame

ZERO = constant(0)
DOWN, ALONG, PER_UNIT = 10, 28, 50  #: steps down and along, steps per unit of time then


def slab(cells):
    """Finer towards its top."""
    mesh = shapes.rectangle([12, 4], cells)
    x, y = mesh.points.T
    return replace(mesh, points=np.column_stack([x, 4.0 * (1.0 - (1.0 - y / 4.0) ** 1.5)]))


def indenter(cells):
    mesh = shapes.rectangle([1.2, 1.0], [cells, cells], [-0.6, 0.0])
    x, y = mesh.points.T
    low = 0.75 - np.sqrt(0.75**2 - x**2)
    return replace(mesh, points=np.column_stack([0.8 + x, 4.2 + low + (1.2 - low) * y]))


def path(x, t):
    return np.full(x.shape[1], 10.0 * max(0.0, t - 1.0))


def depth(x, t):
    return np.full(x.shape[1], -min(t, 1.0))


@pytest.fixture(scope="module")
def ironing():
    """Columns: forces (x, y) on the indenter's top, those on the slab's bottom, Newton steps; one row for each step."""
    bodies = [
        make_body("slab", slab([48, 8]), NeoHooke(*lame(68.96, 0.32)), supports=[Support("bottom", (ZERO, ZERO))]),
        make_body("indenter", indenter(6), NeoHooke(*lame(689.6, 0.32)), supports=[Support("top", (path, depth))]),
    ]
    structure, _ = make_contact(bodies, [(("slab", "top"), ("indenter", "bottom"))])
    heights = [body.points[1, : body.owned] for body in bodies]
    top, bottom = heights[1] > heights[1].max() - 1e-9, heights[0] < 1e-9
    structure.initialise(0.0, 0.1)
    times = [*np.linspace(0.0, 1.0, DOWN + 1), *(1.0 + np.arange(1, ALONG + 1) / PER_UNIT)]
    rows = []
    for t, after in pairwise(times):
        info = solve_step(structure, t, after - t, first=False)
        on_slab, on_indenter = (part.reshape(-1, 2) for part in structure.split(structure.residual_force))
        rows.append([*on_indenter[top].sum(axis=0), *on_slab[bottom].sum(axis=0), info.iterations])
    return np.array(rows)


def test_forces_balance(ironing):
    assert np.abs(ironing[:, :2] + ironing[:, 2:4]).max() < 1e-8 * np.abs(ironing[:, 1]).max()


def test_down(ironing):
    """Meshes of 96 and 160 cells along give 31.0, too."""
    assert -ironing[DOWN - 1, 1] == pytest.approx(31.0, rel=0.005)
    assert (np.diff(-ironing[:DOWN, 1]) >= 0).all()


def test_along(ironing):
    """Far from the slab's end nothing changes any more, and without friction no force is needed to go on."""
    along, down = ironing[-8:, 0], -ironing[-8:, 1]
    assert down == pytest.approx(down.mean(), rel=0.005)
    assert np.abs(along).max() < 0.005 * down.mean()


def test_newton(ironing):
    """Every step moves the indenter by nearly a facet."""
    assert ironing[:, 4].max() <= 7
    assert ironing[:, 4].mean() <= 5.5
