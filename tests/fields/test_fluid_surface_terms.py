"""Terms that the declaration of surfaces alone has: rows, force, and their derivatives."""

import numpy as np
import pytest
from fluid_setup import body, circle, field, loop, make_fluid, sphere
from ufl import div, dot, grad

from solvers.fluid.grid.box import uniform
from solvers.fluid.terms import nitsche, seepage
from solvers.fluid.terms.boundary.patches import Patch
from solvers.fluid.terms.coupling_entries import interface_entries


def with_more(flow, n, P, w, u, p, v, q, own=nitsche.at_surface):
    """What multiplies v, grad v and q, by u, grad u, p and u - g, without symmetry."""
    of_force = dot(0.3 * flow.mu * dot(grad(u), n) + 0.2 * dot(P, w) + 0.6 * p * n, v)
    return own(flow, n, P, w, u, p, v, q) + of_force - 0.4 * flow.mu * dot(w, n) * div(v) + 0.7 * q * dot(w, n)


def released_more(flow, n, P, D, w, u, v, released=nitsche.released):
    return 1.5 * released(flow, n, P, D, w, u, v) + 0.3 * dot(dot(D, dot(P, w)), dot(P, dot(grad(v), n)))


def layer_more(mobility, n, p, q, layer=seepage.layer):
    return layer(mobility, n, p, q) + 2.0 * mobility * dot(grad(p), n) * dot(grad(q), n)


class Body:
    """A body in an open box, which slips and has a layer."""

    def __init__(self, dim, element, resistance=True):
        points, facets = (circle((0.47, 0.52), 0.23, 14), loop(14)) if dim == 2 else sphere((0.47, 0.52, 0.5), 0.27, 1)
        self.g = np.zeros_like(points)
        mover = body("mover", points, facets, motion=lambda x, t: (x, self.g))
        open_box = Patch("open", ("x-", "x+", "y-", "y+", "z-", "z+")[: 2 * dim], "traction", field(*[0.0] * dim))
        self.fluid = make_fluid(
            uniform([0] * dim, [1] * dim, [6, 5] if dim == 2 else [4, 5, 4]), [open_box], [mover],
            element=element, scheme="steady", convection=False, mu=0.7,
        )  # fmt: skip
        if resistance:
            self.fluid.system.slip_length = np.full(len(facets), 0.05)
            self.fluid.system.transmissivity = np.full(len(facets), 1e-3)
        self.fluid.begin_step(0.0, 1.0)

    def rows_and_force(self, flow, g):
        """(momentum rows, continuity rows, force on vertices)."""
        fluid, nodes = self.fluid, self.fluid.unknowns
        self.g[:] = g
        fluid.move({})
        fluid.flow[:] = flow
        rows = fluid.system.residual()
        return rows[nodes.velocity.dofs], rows[nodes.pressure.dofs], fluid.system.surface_force()


@pytest.mark.parametrize("resistance", [False, True])
@pytest.mark.parametrize(("dim", "element"), [(2, "q1q1"), (2, "q2q1"), (3, "q1q1")])
def test_a_term_of_the_declaration_alone(dim, element, resistance, monkeypatch):
    """Virtual work: the rows for a constant test function are the force, whatever the terms are.

    They vanish where the flow is that of the surface.
    """
    some, found = np.random.default_rng(5), []
    for more in (False, True):
        if more:
            monkeypatch.setattr(nitsche, "at_surface", with_more)
            monkeypatch.setattr(nitsche, "released", released_more)
        at = Body(dim, element, resistance)
        if not more:
            flow, g = some.normal(size=len(at.fluid.flow)), some.normal(size=at.g.shape)
            rigid, constant = np.zeros(len(flow)), some.normal(size=dim)
            rigid[at.fluid.unknowns.velocity.dofs] = constant
        found.append([at.rows_and_force(flow, g), at.rows_and_force(rigid, 0.0 * g + constant)])
    (momentum, continuity, force), at_rest = (
        [now - before for now, before in zip(*pairs, strict=True)] for pairs in zip(*found, strict=True)
    )
    size = np.abs(momentum).max()
    assert min(size, np.abs(continuity).max()) > 0.01
    np.testing.assert_allclose(momentum.sum(axis=0), force.sum(axis=0), rtol=1e-9, atol=1e-10 * size)
    assert np.abs(force.sum(axis=0)).min() > 1e-3
    for part in at_rest:
        np.testing.assert_allclose(part, 0.0, atol=1e-11 * size)


@pytest.mark.parametrize(("dim", "element"), [(2, "q1q1"), (2, "q2q1"), (3, "q1q1")])
def test_a_term_of_a_layer_alone(dim, element, monkeypatch):
    """The rows of a linear pressure for a linear test function, by hand."""
    slope, rows = np.array([0.5, -2.0, 1.2])[:dim], []
    for more in (False, True):
        if more:
            monkeypatch.setattr(seepage, "layer", layer_more)
        at = Body(dim, element)
        nodes = at.fluid.unknowns.pressure
        flow = np.zeros(len(at.fluid.flow))
        flow[nodes.dofs[:, 0]] = nodes.points[:, :dim] @ slope
        rows.append(nodes.points[:, :dim].T @ at.rows_and_force(flow, 0.0)[1][:, 0])
    surface = at.fluid.system.assemble_interface()
    area = surface.mass_of_pieces.sum(axis=(1, 2))
    by_hand = 2.0 * 1e-3 / 0.7 * (area * (surface.n @ slope)) @ surface.n
    np.testing.assert_allclose(rows[1] - rows[0], by_hand, rtol=1e-9)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_its_blocks_of_the_monolithic_tangent(element, monkeypatch):
    """By flow and velocity of the surface: rows and force are linear."""
    monkeypatch.setattr(nitsche, "at_surface", with_more)
    monkeypatch.setattr(nitsche, "released", released_more)
    at, some = Body(2, element), np.random.default_rng(6)
    flow, change = some.normal(size=(2, len(at.fluid.flow)))
    g, dg = some.normal(size=(2, *at.g.shape))
    *_, before = at.rows_and_force(flow, g)
    *_, by_flow = at.rows_and_force(flow + change, g)
    momentum, continuity, _ = at.rows_and_force(flow, g)
    by_g = at.rows_and_force(flow, g + dg)
    operator, nodes, alpha = at.fluid.system.assemble_interface(), at.fluid.unknowns, 1e8
    nothing_held = np.zeros(len(flow), dtype=bool)
    one, none = (
        interface_entries(operator, nodes, flow, rate, nothing_held, np.arange(len(g))) for rate in (alpha, 0.0)
    )
    into = (one.into_flow - none.into_flow).T @ dg.ravel() / alpha
    load = (one.force_by_motion - none.force_by_motion) @ dg.ravel() / alpha
    pairs = [
        (one.force_by_flow @ change, (by_flow - before).ravel()),
        (into[nodes.velocity.dofs], by_g[0] - momentum),
        (into[nodes.pressure.dofs], by_g[1] - continuity),
        (load, (by_g[2] - before).ravel()),
    ]
    for found, exact in pairs:
        np.testing.assert_allclose(found, exact, atol=1e-7 * np.abs(exact).max())
