"""Viscoelastic bodies: relaxation, creep, loss and spin by hand; resumed, repeated and distributed runs."""

import numpy as np
import pytest
from programs import fsci
from scipy.spatial.transform import Rotation
from structure_setup import block, constant, distort, make_structure
from test_structure_tangent import MATERIALS, tangent_error

from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.structure import probes
from solvers.structure.body import Support, Traction
from solvers.structure.dynamics import Dynamics
from solvers.structure.materials import LinearElastic, MooneyRivlin
from solvers.structure.relaxation import Branch

SHARES, TIMES = np.array([0.3, 0.2]), np.array([0.1, 2.0])
BRANCHES = [Branch(share, time) for share, time in zip(SHARES, TIMES, strict=True)]
B = SHARES / (1.0 - SHARES.sum())  #: of the stress after a long time
RUBBER = MooneyRivlin(0.3, 0.2, 100.0)


def held(material, motion, cell_type="hexahedron", element="displacement", branches=BRANCHES, **more):
    """A block whose boundary follows x = motion(t) X, of one cell of first order."""
    mesh = block(cell_type, 1)
    dim = mesh.points.shape[1]

    def component(i):
        return lambda x, t: (motion(t)[i, :dim] - np.eye(dim)[i]) @ x[:dim]

    supports = [Support(name, tuple(component(i) for i in range(dim))) for name in mesh.surfaces]
    structure = make_structure(mesh, material, element=element, relaxing=branches, supports=supports, **more)
    return structure


def advance(structure, steps, dt, look, start=0.0):
    """What `look` returns after each step."""
    found = []
    for n in range(steps):
        structure.step(start + n * dt, dt)
        found.append(look(structure))
    return np.array(found)


def on_top(structure):
    """Force on the upper surface [N]: of the supports, and by the stress there."""
    top = "top"
    found = [probes.on_surface(structure, structure.bodies[0], what, top)() for what in ("reaction", "traction")]
    return [list(force.values()) for force in found]


def sheared(size):
    return lambda t: np.eye(3) + size(t) * np.eye(3)[:, [0]] * np.eye(3)[[2]]


@pytest.mark.parametrize("element", ["displacement", pytest.param("mixed", marks=pytest.mark.slow)])
def test_relaxation(element):
    """After a jump, here within one step about t = h/2: the stress after a long time times 1 + sum b exp(-t/tau)."""
    h = 0.002
    structure = held(RUBBER, sheared(lambda t: 0.5 * min(t / h, 1.0)), element=element)
    structure.initialise(0.0, h)
    force = advance(structure, 60, h, on_top)
    t = h * np.arange(1, 61) - h / 2.0
    expected = 0.5 * (1.0 + np.exp(-t[:, None] / TIMES) @ B)
    assert force[:, 0, 0] == pytest.approx(expected, rel=1e-4)
    assert force[:, 1] == pytest.approx(force[:, 0], abs=1e-10)


def test_a_long_step_has_relaxed_and_a_short_one_has_not():
    for dt, factor in ((1e9, 1.0), (1e-9, 1.0 + B.sum())):
        structure = held(RUBBER, sheared(lambda t, dt=dt: 0.5 * t / dt))
        structure.initialise(0.0, dt)
        assert advance(structure, 1, dt, on_top)[0, 0, 0] == pytest.approx(0.5 * factor, rel=1e-7)


def creep(h, steps):
    """Shear of a block under a small sudden traction, and its difference from the exact curve."""
    mesh = block("quad", 1)
    still = {"left": (None, constant(0.0)), "right": (None, constant(0.0)), "bottom": (constant(0.0),) * 2}
    structure = make_structure(
        mesh,
        LinearElastic(2.0, 3.0),
        relaxing=[Branch(0.4, 0.5)],
        supports=[Support(name, value) for name, value in still.items()],
        tractions=[Traction("top", (constant(0.1), constant(0.0)))],
    )
    structure.initialise(-h, h)
    structure.now.loads[:] = 0.0
    found = advance(structure, steps, h, lambda s: s.bodies[0].u.x.array.max(), -h)
    b = 0.4 / 0.6
    t = h * np.arange(steps) + h / 2.0
    return found - 0.1 / 2.0 * (1.0 - b / (1.0 + b) * np.exp(-t / (0.5 * (1.0 + b))))


def test_creep_of_second_order():
    coarse, fine = creep(0.02, 50), creep(0.01, 100)
    assert abs(coarse).max() < 1e-4 * 0.05
    assert abs(coarse[-1]) > 3.5 * abs(fine[-1])


def test_loss_of_a_standard_linear_solid():
    """tan(delta) = b w tau / (1 + (1 + b) w^2 tau^2); in a cycle the balance gets pi G'' gamma^2, and it holds."""
    omega, b, tau, size, steps = 3.0, 0.25, 0.4, 1e-4, 200
    h = 2.0 * np.pi / omega / steps
    structure = held(RUBBER, sheared(lambda t: size * np.sin(omega * t)), branches=[Branch(b / (1.0 + b), tau)])
    structure.initialise(0.0, h)

    def look(structure):
        return on_top(structure)[0][0], structure.energy.damping

    before = advance(structure, 2 * steps, h, look)[-1, 1]
    stress, lost = advance(structure, steps, h, look, 2 * steps * h).T
    t = h * np.arange(1, steps + 1)
    storage = 1.0 + b * (omega * tau) ** 2 / (1.0 + (omega * tau) ** 2)
    loss = b * omega * tau / (1.0 + (omega * tau) ** 2)
    found = 2.0 / steps / size * np.array([stress @ np.sin(omega * t), stress @ np.cos(omega * t)])
    assert found == pytest.approx([storage, loss], rel=3e-4)
    assert found[1] / found[0] == pytest.approx(b * omega * tau / (1.0 + (1.0 + b) * (omega * tau) ** 2), rel=3e-4)
    assert lost[-1] - before == pytest.approx(np.pi * loss * size**2, rel=1e-3)
    assert abs(structure.energy.error) < 1e-3 * structure.energy.damping


@pytest.mark.parametrize("element", ["displacement", "mixed"])
def test_spin_changes_nothing(element):
    """A stretched block that spins has the stress of one that does not, turned, and no work is done on it."""
    h, stretch = 0.05, np.array([[1.2, 0.3, 0.0], [0.0, 0.9, 0.1], [0.2, 0.0, 1.1]])

    def turned(t):
        return Rotation.from_rotvec([3.0 * max(t - h, 0.0), -2.0 * max(t - h, 0.0), 0.0]).as_matrix()

    spinning = held(
        RUBBER, lambda t: turned(t) @ (np.eye(3) + min(t / h, 1.0) * (stretch - np.eye(3))), element=element
    )
    still = held(RUBBER, lambda t: np.eye(3) + min(t / h, 1.0) * (stretch - np.eye(3)), element=element)
    lost = []
    for n in range(6):
        for structure in (spinning, still):
            if not n:
                structure.initialise(0.0, h)
            structure.step(n * h, h)
        forces = [structure.residual_force.reshape(-1, 3) for structure in (spinning, still)]
        assert forces[0] == pytest.approx(forces[1] @ turned((n + 1) * h).T, abs=1e-10)
        stress = [structure.bodies[0].stress().reshape(-1, 3, 3) for structure in (spinning, still)]
        Q = turned((n + 1) * h)
        assert stress[0] == pytest.approx(Q @ stress[1] @ Q.T, abs=1e-9)
        lost.append(spinning.energy.damping)
    assert lost[-1] == pytest.approx(lost[0], rel=1e-10)
    assert abs(forces[1]).max() > 0.1


@pytest.mark.parametrize("law", ["st_venant_kirchhoff", "holzapfel_gasser_ogden"])
def test_tangent_of_the_displacement_element(law):
    mesh = distort(block("quad", 2), 0.05)
    assert tangent_error(make_structure(mesh, MATERIALS[law], relaxing=BRANCHES)) < 1e-6


@pytest.mark.parametrize("cell_type", ["quad9", pytest.param("hexahedron", marks=pytest.mark.slow)])
def test_tangent_of_the_mixed_element(cell_type):
    mesh = distort(block(cell_type, 1), 0.05)
    structure = make_structure(mesh, MATERIALS["mooney_rivlin"], element="mixed", relaxing=BRANCHES)
    assert tangent_error(structure) < 1e-6


def test_a_repeated_step_is_the_same():
    """A step that is given up leaves nothing behind."""
    structure = held(RUBBER, sheared(lambda t: 0.5 * t), cell_type="hexahedron")
    structure.initialise(0.0, 0.1)
    structure.step(0.0, 0.1)
    state = structure.save()
    structure.begin_step(0.1, 0.1)
    structure.solve()
    structure.restore(state)
    halves = advance(structure, 2, 0.05, on_top, 0.1)
    structure.restore(state)
    assert np.array_equal(advance(structure, 2, 0.05, on_top, 0.1), halves)


def test_free_vibration_loses_what_the_balance_says():
    """A block that is let go after a sudden velocity: damped, and the balance closes with the step squared."""
    errors = []
    for h in (0.02, 0.01):
        structure = make_structure(
            block("quad", 1),
            MooneyRivlin(0.3, 0.2, 3.0, 1.0),
            time=Dynamics(GeneralisedAlpha.from_rho_inf(1.0)),
            relaxing=[Branch(0.3, 0.3)],
            supports=[Support("bottom", (constant(0.0),) * 2)],
            initial_velocity=(lambda x, t: 0.3 * x[1], constant(0.0)),
        )
        structure.initialise(0.0, h)
        advance(structure, round(4.0 / h), h, lambda s: 0.0)
        errors.append(abs(structure.energy.error) / structure.energy.initial)
        assert 0.3 * structure.energy.initial < structure.energy.damping < structure.energy.initial
    assert errors[0] < 3e-3
    assert errors[1] < errors[0] / 3.0


CASE = """
time: {step: 0.1, end: 0.6}
structure:
  bodies:
    beam:
      mesh: {shape: rectangle, size: [4, 1], cells: [4, 1], order: 2}
      element: mixed
      material: {law: yeoh, c10: 50, c20: 3, bulk: 1e5, viscous: [{share: 0.4, time: 0.2}, {share: 0.1, time: 5}]}
      supports: [{on: left, displacement: [0, 0]}]
      tractions: [{on: right, value: [0, "-min(t/0.2, 1)"]}]
probes:
  tip: {body: beam, quantity: displacement, on: right}
  left: {body: beam, quantity: traction, on: left}
  energy: {quantity: energy}
"""


@pytest.mark.slow
def test_resumed_and_distributed_runs(tmp_path):
    """The same bit for bit after half of the run, and to rounding on two processes, which one resumes."""
    (tmp_path / "case.yaml").write_text(CASE)

    def run(name, *words, processes=1):
        ended = fsci(*words, processes=processes)
        assert ended.returncode == 0, ended.stdout + ended.stderr
        return read_history(tmp_path / name / "history.csv")

    whole = run("whole", "run", tmp_path, "-o", tmp_path / "whole")
    assert whole["tip.y"][-1] < 1.1 * whole["tip.y"][1]
    short = ("--set", "time.end=0.3")
    run("half", "run", tmp_path, "-o", tmp_path / "half", *short)
    half = run("half", "resume", tmp_path / "half", "--set", "time.end=0.6")
    run("two", "run", tmp_path, "-o", tmp_path / "two", *short, processes=2)
    two = run("two", "resume", tmp_path / "two", "--set", "time.end=0.6")
    for name in ("tip.x", "tip.y", "left.x", "left.y", "energy.internal"):
        assert np.array_equal(half[name], whole[name]), name
        assert two[name] == pytest.approx(whole[name], rel=1e-8, abs=1e-8), name


def test_stresses_that_begin_to_relax_in_a_resumed_run(tmp_path):
    """Have relaxed: a body in equilibrium stays there, and one whose stresses no longer relax goes there at once."""
    (tmp_path / "case.yaml").write_text(CASE)
    law = "structure.bodies.beam.material.viscous"
    tips = {}
    for name, before, after in (("on", "[]", "[{share: 0.4, time: 0.2}]"), ("off", "[{share: 0.4, time: 9}]", "[]")):
        out = tmp_path / name
        for words in (("run", tmp_path, "-o", out, "--set", "time.end=0.3", "--set", f"{law}={before}"),
                      ("resume", out, "--set", "time.end=0.5", "--set", f"{law}={after}")):  # fmt: skip
            ended = fsci(*words)
            assert ended.returncode == 0, ended.stdout + ended.stderr
        tips[name] = read_history(out / "history.csv")["tip.y"]
    assert tips["on"][2:] == pytest.approx(tips["on"][1], rel=1e-7)
    assert tips["off"][2] > 0.9 * tips["on"][2]
    assert tips["off"][3:] == pytest.approx(tips["on"][1], rel=1e-7)


BALL = """
time: {step: 0.01, end: 1.6}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    ball:
      mesh: {shape: disc, radius: 0.5, cells: [24, 2], translate: [0, 0.7]}
      material: {law: neo_hooke, E: 2000, nu: 0.3, density: 20, viscous: [{share: 0.4, time: 0.05}]}
      gravity: [0, -1]
contact:
  obstacles:
    bottom: {mesh: {shape: rectangle, size: [3, 0.1], cells: [1, 1], origin: [-1.5, -0.1]}, on: top}
  pairs:
    bottom: {slave: {body: ball, on: outer}, master: {obstacle: bottom}}
probes:
  ball: {body: ball, quantity: centre}
output: {fields_every: 1000}
"""


@pytest.mark.slow
def test_a_ball_rebounds_less(tmp_path):
    """From contact with surfaces without mass; the same with half of the step, and without warnings of energy."""
    (tmp_path / "case.yaml").write_text(BALL)
    heights = {}
    for name, change in (
        ("ball", "time.step=0.01"),
        ("fine", "time.step=0.005"),
        ("elastic", "structure.bodies.ball.material.viscous=[]"),
    ):
        ended = fsci("run", tmp_path, "-o", tmp_path / name, "--set", change)
        assert ended.returncode == 0, ended.stdout + ended.stderr
        assert "warning" not in ended.stdout
        found = read_history(tmp_path / name / "history.csv")
        heights[name] = found["ball.y"][found["time"] > 0.9].max() - 0.5
    assert heights["fine"] == pytest.approx(heights["ball"], rel=0.01)
    assert heights["ball"] < 0.7 * heights["elastic"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("share: 0.1", "share: 0.6"), "the sum of all 'share' in 'viscous' must be less than 1, not 1"),
        (("time: 5", "time: 0"), "'time' must be greater than 0, not 0"),
        (("  bodies:", "  plane: stress\n  bodies:"), "'viscous' is not available in plane stress"),
    ],
)
def test_mistakes_in_viscous(tmp_path, change, message):
    (tmp_path / "case.yaml").write_text(CASE.replace(*change))
    with pytest.raises(CaseError) as error:
        load_case(tmp_path)
    assert message in str(error.value)
