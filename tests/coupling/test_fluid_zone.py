"""Closed contact that fluid reaches: pressure and force of the zone, their derivatives, what a case says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fluid_setup import BOX, block, body, field, make_fluid, solve_steady
from mpi4py import MPI

from fsci import shapes
from fsci.builder.build import build
from fsci.case import load_case
from solvers.fluid.grid.box import uniform
from solvers.fluid.surfaces.immersed import ImmersedBody
from solvers.fluid.surfaces.surface import ImmersedSurface, Motion
from solvers.fluid.terms.boundary.patches import Patch
from solvers.fluid.terms.closed_contact import zone
from solvers.fluid.terms.closed_contact.zone import stiffness, stiffness_by_motion
from solvers.mesh.tessellation import area_vectors, tessellate
from solvers.timing import Timer

PRESSURE = 7.0


def closing(immersed: ImmersedBody, kind: str, which, transmissivity: float = 0.0) -> ImmersedBody:
    """The body with facets that may be in contact."""
    surface = replace(immersed.surface, in_contact=which, zone=kind, transmissivity=transmissivity)
    return replace(immersed, surface=surface)


def block_on_floor(dim: int, shift=0.0):
    """A block of several facets on the floor of a box of unit length, its floor facets in contact, and the flow."""
    low, size = np.array([0.23, 0.31, 0.0])[3 - dim :], np.array([0.47, 0.36, 0.41])[3 - dim :]
    mesh = shapes.rectangle(size, [3, 2], origin=low) if dim == 2 else shapes.box(size, [3, 2, 2], origin=low)
    facets, nodes = tessellate(mesh)
    points = mesh.points[nodes] + shift
    surface = ImmersedSurface("block", facets, len(points))
    floor = (np.abs(mesh.points[nodes][facets][:, :, -1]) < 1e-12).all(axis=1)
    rest = ImmersedBody(surface, lambda t: Motion(points, np.zeros_like(points)), rests=False)
    fluid = make_fluid(
        uniform([0.0] * dim, [1.0] * dim, [6, 5, 4][:dim]),
        [Patch("box", BOX[dim], "no_slip")],
        [closing(rest, "wetted", floor)],
    )
    return fluid, points, facets, floor


def set_pressure(fluid, function) -> None:
    nodes = fluid.unknowns.pressure
    fluid.flow[nodes.dofs[:, 0]] = function(nodes.points[:, : fluid.dim])


@pytest.mark.parametrize("dim", [2, 3])
def test_stiffness_by_motion(dim):
    """K of a facet against its derivative by central differences; K P of a linear field is its gradient."""
    rng = np.random.default_rng(1)
    x, P, h = rng.standard_normal((4, dim, dim)), rng.standard_normal((4, dim)), 1e-6

    def sizes(x):
        return np.linalg.norm(area_vectors(x), axis=1)

    def value(x):
        return np.einsum("fvw,fw->fv", stiffness(x, sizes(x)), P)

    grown = np.zeros_like(x)
    found = np.zeros((4, dim, dim, dim))
    for w in range(dim):
        for j in range(dim):
            dx = np.zeros_like(x)
            dx[:, w, j] = h
            grown[:, w, j] = (np.log(sizes(x + dx)) - np.log(sizes(x - dx))) / (2.0 * h)
            found[:, :, w, j] = (value(x + dx) - value(x - dx)) / (2.0 * h)
    scale = np.abs(found).max()
    assert stiffness_by_motion(x, sizes(x), grown, P) == pytest.approx(found, abs=1e-7 * scale)


@pytest.mark.parametrize("dim", [2, 3])
def test_pressure_of_the_zone(dim):
    """A linear pressure on the floor's rim is the harmonic one; its force is that of the whole facets."""
    fluid, points, facets, floor = block_on_floor(dim)
    slope = np.array([2.0, -1.0, 0.0])[: dim - 1]
    set_pressure(fluid, lambda x: 3.0 + x[:, :-1] @ slope)
    found = fluid.system.assemble_zone()
    at = found.facets.vertices
    on_floor = np.isin(at, facets[floor])
    assert found.pressure(fluid.flow)[on_floor] == pytest.approx(3.0 + points[at[on_floor], :-1] @ slope, rel=1e-4)
    corners = points[facets[floor]]
    area = area_vectors(corners)
    expected = -((3.0 + corners.mean(axis=1)[:, :-1] @ slope)[:, None] * area).sum(axis=0)
    assert fluid.system.zone_force().sum(axis=0) == pytest.approx(expected, rel=1e-4, abs=1e-9)
    assert expected[-1] > 0.1


@pytest.mark.parametrize(
    ("dim", "turn"),
    [
        pytest.param(2, 0.0, id="2-flat"),
        pytest.param(2, 1e-3, id="2-open on one side"),
        pytest.param(2, -1e-3, id="2-on the other"),
        pytest.param(3, 1e-3, id="3-open on one side"),
        pytest.param(3, 0.0, id="3-flat", marks=pytest.mark.slow),
        pytest.param(3, -1e-3, id="3-on the other", marks=pytest.mark.slow),
    ],
)
def test_forces_do_not_depend_on_the_weight_of_the_rim(dim, turn, monkeypatch):
    """From 1e3 to 1e6 within 3e-4, where a facet of the rim is dry but for 1e-4 of it, too."""
    points, length, found = block_on_floor(dim)[1], 0.47 / 3.0, []
    about = 0.23 + (1.0 + 1e-4) * length
    shift = turn * (points[:, :1] - about) * np.eye(dim)[-1]
    for weight in (1e6, 1e5, 1e4, 1e3):
        monkeypatch.setattr(zone, "RIM", weight)
        fluid = block_on_floor(dim, shift)[0]
        set_pressure(fluid, lambda x: 3.0 + np.sin(3.0 * x[:, 0]) + np.cos(2.0 * x[:, -1]))
        found.append(fluid.system.zone_force())
    size = np.abs(found[0]).max()
    assert size > 0.01
    for force in found[1:]:
        assert force == pytest.approx(found[0], abs=3e-4 * size)


@pytest.mark.parametrize("dim", [2, 3])
def test_derivatives_of_the_force(dim):
    """By the pressure of the flow and by the motion of the surface along the floor, central differences."""
    rng = np.random.default_rng(3)
    slope = np.array([2.0, -1.0, 0.7])[:dim]
    fluid, points, facets, floor = block_on_floor(dim)
    pressure = fluid.unknowns.pressure

    def force(shift, dp=0.0):
        moved = block_on_floor(dim, shift)[0]
        set_pressure(moved, lambda x: 3.0 + x @ slope)
        moved.flow[pressure.dofs[:, 0]] += dp
        return moved.system.zone_force()

    set_pressure(fluid, lambda x: 3.0 + x @ slope)
    closed, h = fluid.system.assemble_zone(), 1e-5
    at, number = closed.facets.vertices, np.full(len(points), -1)
    number[at] = np.arange(len(at))

    dp = rng.standard_normal(len(pressure.dofs))
    dofs, slopes = closed.force_by_flow()
    change = np.zeros(len(fluid.flow))
    change[pressure.dofs[:, 0]] = dp
    assert (force(0.0, dp) - force(0.0))[at] == pytest.approx(slopes @ change[dofs], abs=1e-9)

    direction = rng.standard_normal(points.shape)
    direction[np.unique(facets[floor]), -1] = 0.0
    by_motion = closed.force_by_motion(fluid.flow)
    expected = np.einsum("vikj,kj->vi", by_motion, direction[at])
    found = (force(h * direction) - force(-h * direction))[at] / (2.0 * h)
    assert np.abs(expected).max() > 0.1
    assert found == pytest.approx(expected, abs=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("gap", [1e-1, 1e-3, 1e-6, 1e-9, 1e-12, 1e-17, 0.0, -1e-17, -1e-9, -1e-3])
def test_force_is_continuous_when_contact_closes(gap):
    """A block in fluid at rest under pressure feels none in sum, with fluid under it and closed."""
    h, left, right = 0.1, 0.33, 0.61
    sides = [Patch("top", ("y+",), "traction", field(0, -PRESSURE)), Patch("sides", ("x-", "x+"), "slip")]
    rigid = body("block", *block([left, gap], [right, 0.47]))
    rigid = closing(rigid, "wetted", np.array([True, False, False, False]))
    grid = uniform([0, 0], [1, 1], [10, 10])
    fluid = make_fluid(grid, [*sides, Patch("bottom", ("y-",), "no_slip")], [rigid], scheme="steady")
    solve_steady(fluid)
    assert (fluid.system.assemble_zone() is None) == (gap > 1e-6 * h)
    assert fluid.force()["block"].sum(axis=0) == pytest.approx([0.0, 0.0], abs=1e-7 if gap > 0 else 1e-10)


#: The block of `hydrostatic_contact` is pressed, pulled off, and pressed on the bottom again.
AGAIN = "-2*min(t/0.1, 1) + 6*max(t - 0.3, 0) - 24*max(t - 0.8, 0) + 18*max(t - 1.2, 0)"
LIFTED = {
    "contact.film.zone": "wetted",
    "verify": "[]",
    "solver.newton.residual": "1e-10",
    "structure.bodies.block.tractions": f'[{{on: top, value: [0, "{AGAIN}"]}}]',
}


def started(**more: str):
    """The case at its start."""
    settings = LIFTED | {name.replace("__", "."): value for name, value in more.items()}
    case = load_case("cases/hydrostatic_contact/case.yaml", settings.items())
    simulation = build(case, MPI.COMM_SELF, Timer())
    simulation.initialise(0.0, 0.05)
    return simulation.scheme


@pytest.mark.parametrize("layer", [pytest.param(0.0, marks=pytest.mark.slow), 1e-6])
def test_both_schemes_agree(layer):
    """Each step from the same state: pressed, less pressed, pulled off, closed again.

    In the step before contact closes again there are two solutions without a layer, an open and a closed one: the
    schemes may find different ones.
    """
    film = {"contact__film__transmissivity": str(layer), "contact__film__zone": "seeping"} if layer else {}
    one = started(**film)
    two = started(coupling__scheme="partitioned", coupling__accelerator="iqn", coupling__tolerance="1e-7", **film)
    contact = one.coupled.solid.structure.constraint
    other = two.coupled.solid.structure.constraint
    closed, differ = [], []
    for step in range(24):
        before = one.coupled.save()
        assert one.step(step * 0.05, 0.05).iterations <= 5
        two.coupled.restore(before)
        two.step(step * 0.05, 0.05)
        closed.append(bool(contact.active().any()))
        if other.active().any() != closed[-1]:
            differ.append(step)
            continue
        assert np.abs(one.coupled.interface.now - two.coupled.interface.now).max() < 1e-10
        assert other.resultant(0) == pytest.approx(contact.resultant(0), rel=1e-6, abs=1e-6)
    assert closed == [True] * 12 + [False] * 6 + [True] * 6
    assert differ == [] or (not layer and differ == [17])
