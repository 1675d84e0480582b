"""Bodies that stick through a face of the box with a traction or a pressure: it acts on what is left of the face."""

import numpy as np
import pytest
from fluid_setup import block, body, field, make_fluid, nodal_errors, solve_steady, turned
from programs import fsci

from fsci.running.history import read_history
from solvers.fluid.flow.balances import Balances
from solvers.fluid.flow.conservation.regions import RegionsOfCut
from solvers.fluid.flow.conservation.volume_balance import VolumeBalance
from solvers.fluid.flow.probes import flow_rate
from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.boundary.covered_faces import CoveredFaces
from solvers.fluid.terms.boundary.patches import Patch
from solvers.fluid.terms.boundary.wet_faces import wet_face
from solvers.mesh.gauss import gauss

MU = 0.7


def bar(low, high, turn, velocity):
    """A bar whose surface moves with the flow."""
    points, facets = block(low, high)
    points = turned(points, turn)
    return body("bar", points, facets, velocity=np.stack(np.broadcast_arrays(*velocity(points.T)), axis=1))


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize("turn", [0.0, 0.2])
def test_shear_under_a_traction(element, turn):
    """u = (y, 0), p = 3 - 2 x - y, and the traction (mu, -p) that it has at y = 1."""
    u, p = field(lambda x, y, t: y, 0.0), field(lambda x, y, t: 3.0 - 2.0 * x - y, 0.0)
    fluid = make_fluid(
        uniform([0, 0], [1, 1], [8, 8]),
        [
            Patch("rest", ("x-", "x+", "y-"), "velocity", u),
            Patch("top", ("y+",), "traction", field(MU, lambda x, y, t: 2.0 * x + y - 3.0)),
        ],
        [bar([0.31, 0.7], [0.55, 1.3], turn, lambda x: (x[1], 0.0 * x[0]))],
        mu=MU, element=element, scheme="steady", body_force=field(-2.0, -1.0),
    )  # fmt: skip
    solve_steady(fluid)
    assert nodal_errors(fluid, u, p[0], 0.0) == pytest.approx((0.0, 0.0), abs=1e-11)
    on_bodies, *_ = Balances(fluid.system)(fluid.iterate.held)
    assert np.abs(on_bodies - fluid.force()["bar"].sum(axis=0)).max() < 1e-11


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize("back", [False, True])
def test_shear_that_leaves(element, back):
    """u = (y, 0) and p = 0 through x+; the same backwards, as Stokes flow, on which the way back costs nothing."""
    sign = -1.0 if back else 1.0
    u = field(lambda x, y, t: sign * y, 0.0)
    fluid = make_fluid(
        uniform([0, 0], [1, 1], [8, 8]),
        [Patch("rest", ("x-", "y+", "y-"), "velocity", u), Patch("out", ("x+",), "outflow")],
        [bar([0.7, 0.31], [1.3, 0.55], 0.1, lambda x: (sign * x[1], 0.0 * x[0]))],
        mu=MU, element=element, scheme="steady", convection=not back,
    )  # fmt: skip
    info = solve_steady(fluid)
    assert info.iterations <= 4
    assert nodal_errors(fluid, u, field(0.0, 0.0)[0], 0.0) == pytest.approx((0.0, 0.0), abs=1e-11)
    on_bodies, *_ = Balances(fluid.system)(fluid.iterate.held)
    assert np.abs(on_bodies - fluid.force()["bar"].sum(axis=0)).max() < 1e-11


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_flow_rate_beside_a_corner_that_has_left(element):
    """u = (1, 0): a film of 0.1 cells between body and outlet parts a cell; each part has its own share of the face.

    Parts of the cell that have no fluid do not count.
    """
    u = field(1.0, 0.0)
    points, facets = block([1.485, 0.306], [1.995, 0.736])
    middle = points.mean(axis=0)
    x = turned(points, -0.0283, middle)
    fluid = make_fluid(
        uniform([0, 0], [2, 1], [40, 5]),
        [Patch("rest", ("x-", "y+", "y-"), "velocity", u), Patch("out", ("x+",), "outflow")],
        [body("block", x, facets, velocity=np.broadcast_to([1.0, 0.0], x.shape).copy())],
        mu=MU, element=element, scheme="steady",
    )  # fmt: skip
    solve_steady(fluid)
    front = x[points[:, 0] > 1.99]
    front = front[np.argsort(front[:, 1])]
    assert front[-1, 0] > 2.0 > front[-2, 0]  # the corner has left
    assert fluid.grid.sheets is not None
    covered = wet_face(fluid.grid.grid, "x+", gauss(3)[0], fluid.cut.facets, fluid.cut.motion).weights
    assert flow_rate(fluid)(["out"]) == pytest.approx(1.0 - 0.2 * (1.0 - covered.sum()), abs=1e-11)
    assert VolumeBalance(fluid, RegionsOfCut(fluid)).numbers()["fluid.mass"] == pytest.approx(0.0, abs=1e-11)


@pytest.mark.parametrize("side", [0, 1])
def test_outflow_of_a_face_without_cover_is_that_of_the_form(side):
    """Blocks with the weights of whole faces against the compiled form, with flow that comes back."""
    face = "y-" if side == 0 else "y+"
    others = tuple(name for name in ("x-", "x+", "y-", "y+") if name != face)
    u = field(lambda x, y, t: 0.3 + x * y, lambda x, y, t: 2.0 * x * y - 0.7 * x + 0.1)
    fluid = make_fluid(
        uniform([0, 0], [1, 1], [3, 4]), [Patch("rest", others, "velocity", u), Patch("out", (face,), "outflow")],
        mu=MU, rho=1.3, element="q2q1", initial_velocity=u,
    )  # fmt: skip
    system, unknowns = fluid.system, fluid.unknowns
    system.set_scales(fluid.velocity())
    expected = system.outer_rows()
    cells = fluid.parts.boundary.cells[1]
    points, rule = gauss(8)
    reference = np.stack([points, np.full(8, float(side))], axis=1)
    whole = CoveredFaces(fluid.grid, unknowns, cells, 1, side, reference, np.tile(rule / 3.0, (len(cells), 1)))
    mass_flux = 1.3 * whole.velocity(fluid.velocity())
    blocks, dofs = whole.outflow(MU, mass_flux), unknowns.cell_velocity[cells]
    found = np.zeros_like(expected)
    np.add.at(found, dofs, np.einsum("caibk,cbk->cai", blocks, fluid.flow[dofs]))
    assert np.abs(expected).max() > 0.1
    assert found == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())  # the form has fewer points at the kink


@pytest.mark.parametrize("dim", [2, 3])
def test_rest_under_a_pressure(dim):
    """p = 5 - g (z - 1): nothing moves, however the bar covers the surface."""
    up, zero = dim - 1, np.zeros(dim)
    gravity, low, high = zero.copy(), np.full(dim, 0.31), np.full(dim, 0.55)
    gravity[up], low[up], high[up] = -2.0, 0.7, 1.3
    faces = ["x-", "x+", "y-", "y+", "z-", "z+"][: 2 * dim]
    fluid = make_fluid(
        uniform(zero, zero + 1, [5] * dim),
        [
            Patch("rest", tuple(faces[:-1]), "no_slip"),
            Patch("top", (faces[-1],), "pressure", field(5.0, *zero[1:])[:1]),
        ],
        [bar(low, high, 0.1 * (dim == 2), lambda x: tuple(0.0 * x))],
        mu=MU, scheme="steady", body_force=field(*gravity),
    )  # fmt: skip
    solve_steady(fluid)
    exact = field(lambda *x: 5.0 - 2.0 * (x[up] - 1.0), *zero[1:])[0]
    assert nodal_errors(fluid, field(*zero), exact, 0.0) == pytest.approx((0.0, 0.0), abs=1e-11)


CASE = """\
time: {step: 0.1, end: 0.2}
fluid:
  density: 1
  viscosity: 0.3
  element: q1q1
  grid: {from: [0, 0], to: [2, 1], cells: [14, 8]}
  patches:
    walls: {on: [y-, y+], no_slip: true}
    in: {on: x-, pressure: 2}
    out: {on: x+, outflow: true}
  bodies:
    bar: {mesh: {shape: rectangle, size: [2.6, 0.21], cells: [3, 1], origin: [-0.3, 0.43]}}
probes: {force: {quantity: force, body: bar}}
"""


def test_two_processes(tmp_path):
    (tmp_path / "case.yaml").write_text(CASE)
    found = []
    for processes in (1, 2):
        done = fsci("run", tmp_path, "-o", tmp_path / str(processes), processes=processes)
        assert done.returncode == 0, done.stdout + done.stderr
        found.append(read_history(tmp_path / str(processes) / "history.csv")["force.x"])
    assert found[1] == pytest.approx(found[0], rel=1e-9)
