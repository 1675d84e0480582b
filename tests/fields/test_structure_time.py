"""Generalised-alpha: order, conservation, and numerical damping against formulas derived by hand."""

import numpy as np
import pytest
from advised import require_advice
from structure_setup import block, constant, make_structure, vector

from fsci import shapes
from solvers.api import FailureKind, StepFailed
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure import probes
from solvers.structure.body import Support
from solvers.structure.dynamics import Dynamics
from solvers.structure.materials import NeoHooke, StVenantKirchhoff
from solvers.structure.rayleigh import Damping

TIGHT = SolverSettings(Tolerance(residual=1e-12), linear="direct")


def advance(structure, dt, steps, observe=lambda: None):
    structure.initialise(0.0, dt)
    seen = [observe()]
    for n in range(steps):
        structure.begin_step(n * dt, dt)
        structure.solve()
        structure.end_step()
        seen.append(observe())
    return seen


def swing(rho_inf, dt):
    """End position of a short rubber beam that is thrown to a rotation of about 40 degrees."""
    beam = shapes.rectangle([2, 0.5], [4, 1], order=2)
    structure = make_structure(
        beam,
        NeoHooke(40.0, 60.0, 1.0),
        time=Dynamics(GeneralisedAlpha.from_rho_inf(rho_inf)),
        settings=TIGHT,
        supports=[Support("left", vector(0, 0))],
        initial_velocity=(constant(0.0), lambda x, t: 1.5 * x[0] ** 2),
    )
    advance(structure, dt, round(0.4 / dt))
    return structure.now.u.copy()


@pytest.mark.parametrize(
    ("rho_inf", "dt"),
    [
        pytest.param(1.0, 0.0025, marks=pytest.mark.slow),
        (0.8, 0.0025),
        pytest.param(0.0, 0.00125, marks=pytest.mark.slow),
    ],
)
def test_second_order(rho_inf, dt):
    coarse, middle, fine = (swing(rho_inf, dt / 2**k) for k in range(3))
    ratio = np.linalg.norm(coarse - middle) / np.linalg.norm(middle - fine)
    assert np.abs(coarse).max() > 0.8
    assert np.log2(ratio) == pytest.approx(2.0, abs=0.1)


def test_free_flight():
    """A thrown, spinning, oscillating body: linear momentum is exact and its centre moves on a straight line."""
    structure = make_structure(
        block("hexahedron", 2),
        NeoHooke(30.0, 50.0, 2.0),
        time=Dynamics(GeneralisedAlpha.from_rho_inf(0.9)),
        settings=TIGHT,
        initial_velocity=(
            lambda x, t: 3.0 - 2.0 * (x[1] - 0.5),
            lambda x, t: 1.0 + 2.0 * (x[0] - 0.5) + x[2] ** 2,
            constant(-2.0),
        ),
    )
    momentum = probes.of_bodies(structure, structure.bodies, "momentum")
    centre = probes.of_bodies(structure, structure.bodies, "centre")
    seen = advance(structure, 0.05, 60, lambda: [*momentum().values(), *centre().values()])
    momenta, centres = np.array(seen)[:, :3], np.array(seen)[:, 3:]
    assert momenta[0] == pytest.approx([6.0, 2.0 * (1.0 + 0.25 + 1 / 8), -4.0])  # nodal interpolant of x^2
    assert np.abs(momenta - momenta[0]).max() < 1e-10 * np.abs(momenta[0]).max()
    time = 0.05 * np.arange(61)[:, None]
    assert np.abs(centres - centres[0] - time * momenta[0] / 2.0).max() < 1e-10 * 9.0


def test_energy_without_damping():
    """rho_inf = 1 keeps the energy of a large free vibration to 0.1 % over 1000 steps."""
    structure = make_structure(
        shapes.rectangle([2, 0.5], [4, 1], order=2),
        StVenantKirchhoff(40.0, 60.0, 1.0),
        time=Dynamics(GeneralisedAlpha.from_rho_inf(1.0)),
        settings=TIGHT,
        supports=[Support("left", vector(0, 0))],
        initial_velocity=(constant(0.0), lambda x, t: 0.4 * x[0] ** 2),
    )
    energy = probes.of_bodies(structure, structure.bodies, "energy")
    total = np.array([values["total"] for values in advance(structure, 0.01, 1000, energy)])
    assert np.abs(total - total[0]).max() < 1e-3 * total[0]
    assert abs(structure.energy.error) < 1e-3 * total[0]


# ------------------------------------------------------------------------------------------------ one oscillator

STIFFNESS = 3.0 * (5.0 + 2.0 * 3.0) / 2.0  #: omega^2 of the layer below: K = lambda + 2 mu, M = rho / 3, rho = 2


def oscillator(rho_inf, dt, steps, damping=Damping()):
    """Height of a layer of one cell that moves vertically: one linear degree of freedom at small amplitude."""
    structure = make_structure(
        block("quad", 1),
        StVenantKirchhoff(3.0, 5.0, 2.0),
        time=Dynamics(GeneralisedAlpha.from_rho_inf(rho_inf), damping=damping),
        settings=TIGHT,
        supports=[Support("bottom", vector(0, 0)), Support("top", (constant(0.0), None))],
        initial_velocity=(constant(0.0), lambda x, t: 1e-7 * x[1]),
    )
    return 1e7 * np.array(advance(structure, dt, steps, lambda: structure.now.u.max() + structure.now.u.min()))


def amplification(rho_inf, omega_dt):
    """One step of (u, dt v, dt^2 a): A x_{n+1} = B x_n, written out from Chung & Hulbert's equations (2) to (7)."""
    alpha_m, alpha_f = (2 * rho_inf - 1) / (1 + rho_inf), rho_inf / (1 + rho_inf)
    gamma = 0.5 - alpha_m + alpha_f
    beta = 0.25 * (1 - alpha_m + alpha_f) ** 2
    A = np.array([[1, 0, -beta], [0, 1, -gamma], [(1 - alpha_f) * omega_dt**2, 0, 1 - alpha_m]])
    B = np.array([[1, 1, 0.5 - beta], [0, 1, 1 - gamma], [-alpha_f * omega_dt**2, 0, -alpha_m]])
    return np.linalg.solve(A, B)


@pytest.mark.parametrize("omega_dt", [0.3, 2.0, 100.0])
def test_numerical_damping(omega_dt):
    rho_inf = 0.8
    dt = omega_dt / np.sqrt(STIFFNESS)
    matrix = amplification(rho_inf, omega_dt)
    x = np.array([0.0, dt, 0.0])
    expected = [0.0]
    for _ in range(50):
        x = matrix @ x
        expected.append(x[0])
    heights = oscillator(rho_inf, dt, 50)
    assert heights == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())


def test_spectral_radius_at_infinity():
    """The formula the test above trusts has the property that gives rho_inf its name."""
    radius = np.abs(np.linalg.eigvals(amplification(0.8, 1e6))).max()
    assert radius == pytest.approx(0.8, abs=1e-3)


def test_rayleigh_damping():
    """C = m M + k K: the exact damped oscillation u = v_0 / w exp(-d t) sin(w t), d = (m + k omega^2) / 2."""
    mass, stiffness, dt = 0.4, 0.01, 0.002
    decay = (mass + stiffness * STIFFNESS) / 2
    frequency = np.sqrt(STIFFNESS - decay**2)
    time = dt * np.arange(1001)
    exact = np.exp(-decay * time) * np.sin(frequency * time) / frequency
    heights = oscillator(1.0, dt, 1000, Damping(mass, stiffness))
    assert np.abs(heights - exact).max() < 1e-4 * exact.max()


def test_moving_support_does_not_ring():
    """A body that its support moves at constant velocity: velocity and acceleration are exact from the first step."""
    structure = make_structure(
        block("quad", 1),
        NeoHooke(30.0, 50.0, 2.0),
        time=Dynamics(GeneralisedAlpha.from_rho_inf(1.0)),
        settings=TIGHT,
        supports=[Support(name, (lambda x, t: 2.0 * t, constant(0.0))) for name in ("bottom", "top")],
        initial_velocity=vector(2.0, 0.0),
    )
    seen = advance(structure, 0.1, 5, lambda: (structure.now.v.copy(), structure.now.a.copy()))
    for velocity, acceleration in seen:
        assert velocity.reshape(-1, 2) == pytest.approx(np.tile([2.0, 0.0], (4, 1)), abs=1e-7)
        assert np.abs(acceleration).max() < 1e-4


def test_accelerated_support_at_the_start():
    """Velocity and acceleration of a support that moves by 0.3 t + 0.7 t^2 + 0.2 t^3."""
    cubic = Support("left", (lambda x, t: 0.0 * x[0] + 0.3 * t + 0.7 * t**2 + 0.2 * t**3, constant(0.0)))
    time = Dynamics(GeneralisedAlpha.from_rho_inf(1.0))
    structure = make_structure(block("quad", 2), NeoHooke(30.0, 50.0, 2.0), time=time, supports=[cubic])
    structure.initialise(0.0, 0.1)
    held = structure.held.dofs
    assert structure.now.v[held].reshape(-1, 2) == pytest.approx(np.tile([0.3, 0.0], (3, 1)), abs=1e-7)
    assert structure.now.a[held].reshape(-1, 2) == pytest.approx(np.tile([1.4, 0.0], (3, 1)), abs=1e-6)


def test_acceleration_at_the_start():
    """M a = f_ext - f_int(u) - C v of a body that starts stretched and moving, under gravity, with damping."""
    structure = make_structure(
        block("quad", 2),
        NeoHooke(30.0, 50.0, 2.0),
        time=Dynamics(GeneralisedAlpha.from_rho_inf(1.0), Damping(mass=0.7, stiffness=0.02)),
        gravity=vector(0.0, -10.0),
        initial_displacement=(lambda x, t: 0.1 * x[0] + 0.05 * x[1], lambda x, t: -0.02 * x[1]),
        initial_velocity=(lambda x, t: 0.3 * x[1], lambda x, t: 0.2 * x[0] * x[1]),
    )
    structure.initialise(0.0, 0.1)
    (body,), now = structure.bodies, structure.now
    mass = structure.inertia.assemble_mass().convert("dense").getDenseArray()
    weight = mass @ np.tile([0.0, -10.0], len(now.u) // 2)
    parts = weight, -body.internal_force(), -now.damping
    assert min(np.abs(part).max() for part in parts) > 0.1
    assert mass @ now.a == pytest.approx(sum(parts), abs=1e-10)


def test_no_acceleration_at_the_start():
    """A load that is not a number must not start a run with an acceleration of zero."""
    time = Dynamics(GeneralisedAlpha.from_rho_inf(1.0))
    structure = make_structure(block("quad", 2), NeoHooke(30.0, 50.0, 2.0), time=time, gravity=vector(0.0, np.nan))
    with pytest.raises(
        StepFailed, match=r"the acceleration at the start cannot be computed \(a force is not a number\)"
    ) as failed:
        structure.initialise(0.0, 0.1)
    require_advice(failed.value, FailureKind.NOT_FINITE)


def test_the_average_over_a_step_balances_the_average_of_the_loads_of_another_field():
    """Inertia, stress and damping of a step against (1 - alpha_f) f(t + dt) + alpha_f f(t), at free nodes."""
    scheme = GeneralisedAlpha.from_rho_inf(0.5)  # alpha_f = 1/3
    structure = make_structure(
        block("quad", 2),
        NeoHooke(40.0, 60.0, 1.0),
        time=Dynamics(scheme, Damping(mass=2.0, stiffness=1e-3)),
        settings=TIGHT,
        supports=[Support("left", vector(0, 0))],
    )
    structure.initialise(0.0, 0.01)
    loads = [np.random.default_rng(seed).normal(size=len(structure.now.u)) for seed in range(3)]
    for n, load in enumerate(loads):
        structure.begin_step(0.01 * n, 0.01)
        structure.load(load)
        structure.solve()
        found = structure.held.free_part(structure.time.averaged_load(structure))
        structure.end_step()
    wanted = structure.held.free_part(2 / 3 * loads[2] + 1 / 3 * loads[1])
    assert np.linalg.norm(wanted) > 1.0
    assert found == pytest.approx(wanted, abs=1e-9)
