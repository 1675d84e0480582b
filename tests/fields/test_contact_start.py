"""The first state of bodies whose contact surfaces have no mass: loads there count from the first step on."""

import numpy as np
import pytest
from contact_setup import make_body, make_contact
from structure_setup import block, constant
from test_contact_friction_run import SLIDING

from fsci import shapes
from fsci.case import CaseError, load_case
from fsci.running.run import run_case
from solvers.algebra.blocks import times
from solvers.contact.law.coulomb import Coulomb
from solvers.contact.law.frictionless import Frictionless
from solvers.contact.surface import Surface
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Support
from solvers.structure.dynamics import Dynamics
from solvers.structure.loads import Pressure, Traction
from solvers.structure.materials import NeoHooke, StVenantKirchhoff
from solvers.structure.probes import of_bodies
from solvers.structure.rayleigh import Damping
from solvers.structure.time_scheme import Statics

TIGHT = SolverSettings(Tolerance(residual=1e-12, residual_absolute=1e-13), linear="direct")
TRAPEZOIDAL = GeneralisedAlpha.from_rho_inf(1.0)
FAR = Surface("wall", np.array([[9.0, 9.0], [9.0, -9.0]]), np.array([[0, 1]]), "line", None)
FAR_AWAY = {
    2: FAR,
    3: Surface("wall", np.array([[9.0, 0, 0], [9.0, 9, 0], [9.0, 0, 9]]), np.array([[0, 2, 1]]), "triangle", None),
}


def momentum(structure):
    return list(of_bodies(structure, structure.bodies, "momentum")().values())


def advance(structure, dt, steps):
    """The times after the start and each of the steps."""
    structure.initialise(0.0, dt)
    yield 0.0
    for n in range(steps):
        structure.begin_step(n * dt, dt)
        structure.solve()
        structure.end_step()
        yield (n + 1) * dt


@pytest.mark.parametrize("rho_inf", [1.0, 0.5, 0.0])
@pytest.mark.parametrize("damping", [Damping(), Damping(0.0, 0.01)], ids=["undamped", "damped"])
def test_impulse_of_a_sudden_load(rho_inf, damping):
    """A load on a surface without mass, there from t = 0 on: momentum F t at the end of every step."""
    force = np.array([-3.0, 1.0])
    load = Traction("right", tuple(constant(f) for f in force))
    body = make_body("block", block("quad", 4), NeoHooke(400.0, 600.0, 2.0), tractions=[load])
    scheme = GeneralisedAlpha.from_rho_inf(rho_inf)
    time = Dynamics(scheme, damping=damping)
    structure, _ = make_contact([body], [(("block", "right"), FAR)], time=time, settings=TIGHT)
    for t in advance(structure, 0.01, 5):
        assert momentum(structure) == pytest.approx(force * t, rel=1e-9, abs=1e-15), t


def end_of_a_pushed_bar(rho_inf, dt):
    """Displacements of a bar that is held at its left end and pressed at the right one from t = 0 on."""
    held = [Support("left", (constant(0), constant(0)))]
    body = make_body(
        "bar",
        shapes.rectangle([1, 0.25], [8, 2]),
        NeoHooke(40.0, 60.0, 1.0),
        supports=held,
        pressures=[Pressure("right", lambda x, t: np.full(x.shape[1], 10.0))],
    )
    time = Dynamics(GeneralisedAlpha.from_rho_inf(rho_inf))
    structure, _ = make_contact([body], [(("bar", "right"), FAR)], time=time, settings=TIGHT)
    *_, _ = advance(structure, dt, round(0.08 / dt))
    return structure.now.u.copy()


DAMPING = [pytest.param(0.001, id="weak", marks=pytest.mark.slow), pytest.param(0.05, id="strong")]


@pytest.mark.parametrize("rho_inf", [pytest.param(1.0, marks=pytest.mark.slow), 0.5])
def test_second_order_with_a_sudden_load(rho_inf):
    dt = 0.00125
    coarse, middle, fine = (end_of_a_pushed_bar(rho_inf, dt / 2**k) for k in range(3))
    ratio = np.linalg.norm(coarse - middle) / np.linalg.norm(middle - fine)
    assert np.abs(coarse).max() > 0.01
    assert np.log2(ratio) == pytest.approx(2.0, abs=0.15)


@pytest.mark.parametrize("damping", DAMPING)
def test_second_order_with_damping(damping):
    """Of a bar that is pushed by its massless end, by a force that grows smoothly."""

    def end(steps):
        push = Pressure("right", lambda x, t: np.full(x.shape[1], 10.0 * np.sin(20.0 * t) ** 2))
        held = [Support("left", (constant(0), constant(0)))]
        mesh = shapes.rectangle([1, 0.25], [8, 2])
        body = make_body("bar", mesh, NeoHooke(40.0, 60.0, 1.0), supports=held, pressures=[push])
        time = Dynamics(GeneralisedAlpha.from_rho_inf(1.0), damping=Damping(0.0, damping))
        structure, _ = make_contact([body], [(("bar", "right"), FAR)], time=time, settings=TIGHT)
        *_, _ = advance(structure, 0.08 / steps, steps)
        return structure.now.u.copy()

    exact, coarse, fine = (end(steps) for steps in (256, 32, 64))
    errors = [np.linalg.norm(u - exact) for u in (coarse, fine)]
    assert np.log2(errors[0] / errors[1]) > 1.8
    assert errors[1] < 2e-3 * np.linalg.norm(exact)


@pytest.mark.parametrize("damping", DAMPING)
def test_second_order_with_damping_from_the_first_step_on(damping):
    """A sudden load: the first step, in which massless nodes have no earlier one, has the order of all others."""

    def end(steps):
        held = [Support("left", (constant(0), constant(0)))]
        press = Pressure("right", lambda x, t: np.full(x.shape[1], 10.0))
        mesh = shapes.rectangle([1, 0.25], [8, 2])
        body = make_body("bar", mesh, NeoHooke(40.0, 60.0, 1.0), supports=held, pressures=[press])
        time = Dynamics(TRAPEZOIDAL, damping=Damping(0.0, damping))
        structure, _ = make_contact([body], [(("bar", "right"), FAR)], time=time, settings=TIGHT)
        *_, _ = advance(structure, 0.08 / steps, steps)
        return structure.now.u.copy()

    exact, coarse, fine = (end(steps) for steps in (256, 16, 32))
    errors = [np.linalg.norm(u - exact) for u in (coarse, fine)]
    assert np.log2(errors[0] / errors[1]) > 1.87
    assert errors[1] < 2e-3 * np.linalg.norm(exact)


@pytest.mark.parametrize(("cell_type", "bound"), [("quad", 4e-8), ("triangle6", 2e-9)])
def test_free_fall(cell_type, bound):
    """The centre falls as that of any body, and nothing turns; the weight of a massless surface strains it a little.

    The centre's error is of second order in the strain: a tenth of the weight gives a hundredth.
    """

    def error(share):
        gravity = (constant(share), constant(-9.0 * share))
        body = make_body("block", block(cell_type, 3), StVenantKirchhoff(400.0, 600.0, 2.0), gravity=gravity)
        structure, _ = make_contact([body], [(("block", "bottom"), FAR)], time=Dynamics(TRAPEZOIDAL), settings=TIGHT)

        def probe(quantity):
            return np.array(list(of_bodies(structure, structure.bodies, quantity)().values()))

        found = 0.0
        for t in advance(structure, 0.02, 4):
            exact = 0.5 + 0.5 * share * np.array([1.0, -9.0]) * t**2
            found = max(found, float(np.abs(probe("centre") - exact).max()))
            assert momentum(structure) == pytest.approx([2.0 * share * t, -18.0 * share * t], abs=1e-10 * share)
            assert probe("angular_momentum") == pytest.approx(-10.0 * share * t, rel=2e-4, abs=1e-12)
            assert abs(structure.energy.error) <= 1e-4 * structure.energy.kinetic
        return found

    whole = error(1.0)
    assert whole < bound
    assert error(0.1) == pytest.approx(whole / 100.0, rel=0.03)


@pytest.mark.parametrize("cell_type", ["quad", "hexahedron", "triangle6"])
def test_a_body_at_rest_is_that_of_statics(cell_type):
    """It hangs by its top, its massless bottom included: the weight of a surface acts where the surface is."""
    dim = 3 if cell_type == "hexahedron" else 2
    gravity = tuple(constant(g) for g in (1.0, 0.5, -9.0)[3 - dim :])
    held = [Support("top", tuple(constant(0.0) for _ in range(dim)))]

    def hanging(time):
        body = make_body("block", block(cell_type, 3), NeoHooke(400.0, 600.0, 2.0), gravity=gravity, supports=held)
        structure, _ = make_contact([body], [(("block", "bottom"), FAR_AWAY[dim])], time=time, settings=TIGHT)
        *_, _ = advance(structure, 1e3, 16)
        return structure.now.u

    at_rest = hanging(Dynamics(GeneralisedAlpha.from_rho_inf(0.0)))
    assert at_rest == pytest.approx(hanging(Statics()), abs=1e-9 * np.abs(at_rest).max())


@pytest.mark.parametrize("law", [Frictionless(), Coulomb(0.4)], ids=["frictionless", "coulomb"])
@pytest.mark.parametrize("rho_inf", [1.0, 0.5])
def test_a_load_on_a_surface_that_touches(law, rho_inf):
    """The wall carries all of it from the first step on, with friction along the wall too: nothing moves."""
    along = 0.3 if law.slips else 0.0
    load = Traction("right", (constant(2.0), constant(2.0 * along)))
    body = make_body("block", block("quad", 3), StVenantKirchhoff(400.0, 600.0, 1.0), tractions=[load])
    wall = Surface("wall", np.array([[1.0, 9.0], [1.0, -9.0]]), np.array([[0, 1]]), "line", None)
    time = Dynamics(GeneralisedAlpha.from_rho_inf(rho_inf))
    structure, contact = make_contact([body], [(("block", "right"), wall)], time=time, settings=TIGHT, law=law)
    for _ in advance(structure, 0.02, 4):
        assert contact.resultant(0) == pytest.approx([-2.0, -2.0 * along], abs=1e-9)
        assert np.abs(structure.now.u).max() < 1e-12
        assert np.abs(structure.now.a).max() < 1e-9
    assert structure.energy.error == pytest.approx(0.0, abs=1e-12)


def test_contact_accelerates_what_has_mass():
    """A sheet of one cell between two blocks, the upper one overlapping it: only its lower, slave side has no mass.

    Contact pushes the lowest layer of the block back, a strip of height h whose upper side cannot move at once, with
    P = E s (s^2 - 1) / 2, s = 1 - overlap / h; it accelerates sheet and block by this force, and by nothing else.
    """
    E, h, overlap = 100.0, 0.25, 0.002
    bodies = []
    stack = (("base", 0.5, 2, -0.5), ("sheet", 0.1, 1, 0.0), ("block", 0.5, 2, 0.1 - overlap))
    for name, height, cells, bottom in stack:
        mesh = shapes.rectangle([1.0, height], [4, cells])
        mesh.points[:, 1] += bottom
        held = [Support("bottom", (constant(0), constant(0)))] if name == "base" else []
        bodies.append(make_body(name, mesh, StVenantKirchhoff(E / 2.0, 0.0, 3.0), supports=held))
    pairs = [(("block", "bottom"), ("sheet", "top")), (("sheet", "bottom"), ("base", "top"))]
    structure, contact = make_contact(bodies, pairs, time=Dynamics(TRAPEZOIDAL), settings=TIGHT)
    structure.initialise(0.0, 1e-3)
    stretch = 1.0 - overlap / h
    force = E * stretch * (1.0 - stretch**2) / 2.0
    forces = structure.split(times(structure.inertia.assemble_mass(), structure.now.a))
    _, sheet, upper = (part.reshape(-1, 2).sum(axis=0) for part in forces)
    assert contact.resultant(0) == pytest.approx([0.0, force], rel=1e-9, abs=1e-12)
    assert sheet == pytest.approx([0.0, -force], rel=1e-9, abs=1e-12)
    assert upper == pytest.approx([0.0, force], rel=1e-9, abs=1e-12)


def test_no_balance_at_the_start(tmp_path):
    (tmp_path / "case.yaml").write_text(SLIDING + "solver: {newton: {max_iterations: 1}}\n")
    with pytest.raises(CaseError) as caught:
        run_case(load_case(tmp_path / "case.yaml"), tmp_path / "out")
    message = str(caught.value).split("\n")[0]
    assert message.startswith(
        f"{tmp_path / 'case.yaml'}:14:1: contact surfaces have no mass in dynamics, and no equilibrium was "
        "found for the loads and the overlap at the start; increase both from zero in time: structure: Newton did not"
    )
