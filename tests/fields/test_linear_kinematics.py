"""Small displacements: Hooke's law, exact solutions, one Newton step, and the same with contact, fluid and time."""

import numpy as np
import pytest
from contact_setup import SETTINGS, make_body, make_contact, solve_step
from programs import fsci
from structure_setup import CELL_TYPES, block, constant, distort, held_everywhere, load_step, make_structure, vector
from test_structure_tangent import tangent_error

from fsci import shapes
from fsci.running.history import read_history
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.structure.body import Pressure, Support, Symmetry, Traction
from solvers.structure.dynamics import Dynamics
from solvers.structure.elastic_constants import lame, plane_stress_lambda
from solvers.structure.materials import LinearElastic, PlaneStressLinearElastic

GRADIENT = np.array([[0.4, 0.9, 0.3], [-0.5, -0.7, 0.2], [0.1, -0.6, 0.5]])


@pytest.mark.parametrize("cell_type", [name for name in CELL_TYPES if name != "hexahedron27"])
def test_patch(cell_type):
    """Gradients of any size, with a rotation, in one Newton step; the stress is Hooke's."""
    mesh = distort(block(cell_type, 2), 0.08)
    dim = mesh.points.shape[1]
    gradient = GRADIENT[:dim, :dim]

    def displacement(i):
        return lambda x, t: t * (0.3 + gradient[i] @ x[:dim])

    structure = make_structure(mesh, LinearElastic(80.0, 120.0), supports=held_everywhere(mesh, displacement))
    assert load_step(structure).residuals[1] < 1e-11
    body = structure.bodies[0]
    exact = 0.3 + body.points[:dim].T @ gradient.T
    assert np.abs(body.u.x.array.reshape(-1, dim) - exact).max() < 1e-12
    strain = np.zeros((3, 3))
    strain[:dim, :dim] = (gradient + gradient.T) / 2
    hooke = 160.0 * strain + 120.0 * np.trace(strain) * np.eye(3)
    assert body.stress().reshape(-1, 3, 3) == pytest.approx(np.broadcast_to(hooke, (body.owned, 3, 3)), abs=1e-10)
    assert body.internal_energy() == pytest.approx(np.sum(hooke * strain) / 2, rel=1e-12)


@pytest.mark.parametrize(
    ("order", "element", "nu", "bound"),
    [(2, "displacement", 0.3, 1e-4), (1, "mixed", 0.3, 5e-3), (1, "mixed", 0.4999, 5e-3), (2, "mixed", 0.4999, 1e-4)],
)
def test_tube_under_pressure(order, element, nu, bound):
    """Lame in plane strain, a large load: u_r = (1 + nu) p a^2/(E (b^2 - a^2)) ((1 - 2 nu) r + b^2/r)."""
    a, b, E, p = 1.0, 2.0, 1000.0, 400.0
    structure = make_structure(
        shapes.ring(a, b, [12, 8], 90, order=order),
        LinearElastic(*lame(E, nu)),
        element=element,
        supports=[Symmetry("start"), Symmetry("end")],
        pressures=[Pressure("inner", constant(p))],
    )
    residuals = load_step(structure).residuals
    assert residuals[1] < 1e-10 * residuals[0]
    body = structure.bodies[0]
    r = np.hypot(*body.points[:2])
    exact = (1 + nu) * p * a**2 / (E * (b**2 - a**2)) * ((1 - 2 * nu) * r + b**2 / r)
    u = body.u.x.array.reshape(-1, 2)
    radial = np.sum(u * body.points[:2].T, axis=1) / r
    assert np.abs(radial / exact - 1).max() < bound
    assert exact.max() > 0.5 * a


def test_bar_in_plane_stress():
    """A traction stretches a strip by t/E and thins it by nu t/E, however large."""
    E, nu, t = 100.0, 0.3, 70.0
    mu, lmbda = lame(E, nu)
    structure = make_structure(
        block("quad", 2),
        PlaneStressLinearElastic(mu, plane_stress_lambda(mu, lmbda)),
        supports=[Symmetry("left"), Symmetry("bottom")],
        tractions=[Traction("right", vector(t, 0.0))],
    )
    load_step(structure)
    body = structure.bodies[0]
    assert body.u.x.array.reshape(-1, 2) == pytest.approx((body.points[:2].T) * [t / E, -nu * t / E], abs=1e-12)
    assert body.stress() == pytest.approx(np.tile(np.diag([t, 0, 0]).ravel(), (9, 1)), abs=1e-10)


@pytest.mark.parametrize("element", ["displacement", "mixed"])
def test_tangent(element):
    pressures = [Pressure("top", constant(2.0))]
    structure = make_structure(
        distort(block("quad", 2), 0.05), LinearElastic(3.0, 5.0, 2.0), element=element, pressures=pressures
    )
    assert tangent_error(structure) < 1e-8


def test_energy_is_kept_exactly():
    """Free vibration, rho_inf = 1: for a linear structure the trapezoidal rule keeps the energy to rounding."""
    structure = make_structure(
        shapes.rectangle([4, 1], [8, 2]),
        LinearElastic(*lame(100.0, 0.3), 1.0),
        time=Dynamics(GeneralisedAlpha.from_rho_inf(1.0)),
        supports=[Support("left", vector(0, 0))],
        initial_velocity=(constant(0.0), lambda x, t: 3.0 * x[0]),
    )
    structure.initialise(0.0, 0.05)
    for step in range(20):
        structure.begin_step(0.05 * step, 0.05)
        residuals = structure.solve().residuals
        assert residuals[1] < 1e-10 * residuals[0]
        structure.end_step()
    assert structure.energy.internal > 0.1 * structure.energy.initial
    assert abs(structure.energy.error) < 1e-10 * structure.energy.initial


def test_contact():
    """Contact sees the displaced surfaces: a gap of 0.1 closes, then two equal blocks share the displacement."""
    lower, upper = block("quad", 3), block("quad", 2)
    upper.points[:, 1] += 1.1
    law = LinearElastic(mu=400.0, lmbda=600.0)
    sides = [Support(name, (constant(0.0), None)) for name in ("left", "right")]
    bodies = [
        make_body("lower", lower, law, supports=[Support("bottom", vector(0, 0)), *sides]),
        make_body("upper", upper, law, supports=[Support("top", vector(0, -0.3)), *sides]),
    ]
    structure, _ = make_contact(bodies, [(("lower", "top"), ("upper", "bottom"))], settings=SETTINGS)
    solve_step(structure)
    for body in bodies:
        stress = body.stress().reshape(-1, 3, 3)[:, 1, 1]
        assert stress == pytest.approx(-0.1 * (600.0 + 2 * 400.0), rel=1e-9)


MATERIALS = {
    "neo": "{law: neo_hooke, E: 100, nu: 0.25}",
    "coup": "{law: coup_neo_hooke, lambda: 40, mu: 40}",
    "mooney": "{law: mooney_rivlin, c10: 15, c01: 5, bulk: 66.66666666666667}",
}
BODY = """
    NAME:
      mesh: {shape: box, size: [1, 1, 1], cells: [2, 2, 2]}
      material: MATERIAL
      kinematics: linear
      supports: [{on: left, symmetry: true}, {on: front, symmetry: true}, {on: bottom, symmetry: true}]
      tractions: [{on: right, value: ["20*t", 0, 0]}]
"""


def test_case(tmp_path):
    """Every law with the same constants at small strain, E = 100 and nu = 0.25, gives t/E and -nu t/E."""
    text = "time: {step: 1, end: 2}\nstructure:\n  bodies:"
    text += "".join(BODY.replace("NAME", name).replace("MATERIAL", law) for name, law in MATERIALS.items())
    text += "probes:\n"
    text += "".join(f"  {name}: {{body: {name}, quantity: displacement, at: [1, 1, 1]}}\n" for name in MATERIALS)
    (tmp_path / "case.yaml").write_text(text)
    done = fsci("run", tmp_path, "-o", tmp_path / "out")
    assert done.returncode == 0, done.stdout + done.stderr
    found = read_history(tmp_path / "out" / "history.csv")
    for name in MATERIALS:
        assert found[f"{name}.x"] == pytest.approx([0.2, 0.4], rel=1e-9)
        assert found[f"{name}.z"] == pytest.approx([-0.05, -0.1], rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["monolithic", "partitioned"])
def test_fluid(scheme, tmp_path):
    """The bar that pushes a column of fluid keeps its exact frequency and amplitude, as `verify` of the case asks."""
    changes = (f"coupling.scheme={scheme}", "structure.bodies.bar.kinematics=linear")
    sets = (word for entry in changes for word in ("--set", entry))
    done = fsci("run", "cases/elastic_bar_column", "-o", tmp_path / "out", *sets, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "verify ok" in done.stdout
    assert "MISSED" not in done.stdout
