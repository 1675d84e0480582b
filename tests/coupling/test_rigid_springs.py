"""Springs and dampers between elastic and free rigid bodies, dry and in a flow."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI
from programs import fsci

from fsci.builder.build import build
from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case
from solvers.march import march
from solvers.rigid import motion
from solvers.timing import Timer

#: A square of 2 kg hangs on two springs from the lower face of an elastic beam.
HANGING = """\
time: {step: 1, end: 1}
structure:
  bodies:
    beam:
      mesh: {shape: rectangle, size: [2, 0.4], origin: [-0.5, 1.5], cells: [8, 2]}
      material: {law: neo_hooke, E: 2e4, nu: 0.3}
      supports: [{on: left, displacement: [0, 0]}]
      point_springs: [{at: [0.3, 1.5], stiffness: 50, to: {body: mass, at: [0.3, 0.8]}, length: 0.6}]
rigid:
  gravity: [0, -10]
  bodies:
    mass:
      mesh: {shape: rectangle, size: [1, 1], cells: [1, 1]}
      density: 2
      springs: [{at: [0.7, 0.8], stiffness: 50, to: {body: beam, at: [0.71, 1.55]}, length: 0.6}]
probes: {wall: {body: beam, quantity: reaction, on: left}}
output: {fields_every: 0}
solver: {newton: {residual: 1e-12}}
"""
BEAM = "size: [2, 1, 0.4], origin: [-0.5, 0, 1.5], cells: [4, 1, 1]"
CUBE = (
    HANGING.replace("size: [2, 0.4], origin: [-0.5, 1.5], cells: [8, 2]", BEAM)
    .replace("displacement: [0, 0]", "displacement: [0, 0, 0]")
    .replace("at: [0.3, 1.5]", "at: [0.3, 0.5, 1.5]").replace("at: [0.3, 0.8]", "at: [0.3, 0.5, 0.8]")
    .replace("at: [0.7, 0.8]", "at: [0.7, 0.5, 0.8]").replace("at: [0.71, 1.55]", "at: [0.71, 0.5, 1.55]")
    .replace("gravity: [0, -10]", "gravity: [0, 0, -10]").replace("shape: rectangle", "shape: box")
    .replace("size: [1, 1], cells: [1, 1]", "size: [1, 1, 1], cells: [1, 1, 1]")
    .replace("density: 2\n", "density: 2\n      held: [rotation_x, y]\n")
)  # fmt: skip


def simulation(text, folder):
    (folder / "case.yaml").write_text(text)
    return build(load_case(folder / "case.yaml"), MPI.COMM_SELF, Timer())


def stretches(composite):
    """Lengths of the springs between both, less those without force [m]."""
    structure = composite.elastic.structure
    return [np.linalg.norm(a.x - b.x) - law.length for law, a, b in structure.springs.places(structure)]


def pulls(composite):
    """Forces [N] on the first ends."""
    structure = composite.elastic.structure
    return [law.force(a.x - b.x, a.v - b.v)[0] for law, a, b in structure.springs.places(structure)]


@pytest.mark.parametrize("text", [HANGING, CUBE], ids=["plane", "space"])
def test_springs_carry_the_weight_to_the_support(tmp_path, text):
    """The vertical parts of both forces are the weight m g = 20, and the reaction of the beam as well."""
    composite = simulation(text, tmp_path).scheme
    for _ in march(composite, 1.0, 1):
        pass
    structure, up = composite.elastic.structure, 1 if text is HANGING else 2
    first, second = pulls(composite)
    assert second[up] - first[up] == pytest.approx(20.0, abs=1e-9)  # the mass is the first end of the second one
    assert second - first == pytest.approx(20.0 * np.eye(3)[up], abs=1e-9)
    reaction = structure.residual_force.reshape(-1, structure.dim).sum(axis=0)
    assert reaction == pytest.approx(20.0 * np.eye(structure.dim)[up], abs=1e-8)
    assert min(stretches(composite)) > 0.1


#: A square of 2 kg and a free elastic one of 4 kg swing on a spring between their middles.
SWINGING = """\
time: {step: 0.02, end: 1}
structure:
  dynamics: {rho_inf: 1}
  bodies:
    soft:
      mesh: {shape: rectangle, size: [1, 1], origin: [1.5, 0], cells: [1, 1]}
      material: {law: neo_hooke, E: 1e6, nu: 0.3, density: 4}
rigid:
  bodies:
    mass:
      mesh: {shape: rectangle, size: [1, 1], cells: [1, 1]}
      density: 2
      springs: [{at: [0.5, 0.5], stiffness: 40, dashpot: 0, to: {body: soft, at: [2, 0.5]}, length: 1.3}]
output: {fields_every: 0}
solver: {newton: {residual: 1e-12}}
"""


def swung(folder, steps, text=SWINGING, end=0.7 * np.pi / np.sqrt(30.0)):
    composite = simulation(text, folder).scheme
    for _ in march(composite, end, steps):
        pass
    return composite


def momentum(composite):
    structure, rigid = composite.elastic.structure, composite.rigid
    own = structure.inertia.times(structure.now.v).reshape(-1, structure.dim).sum(axis=0)
    return own + sum(b.inertia.mass * i.v[: structure.dim] for b, i in zip(rigid.bodies, rigid.now, strict=True))


def test_a_rigid_and_an_elastic_mass_swing_with_their_frequency(tmp_path):
    """Stretch 0.2 cos(omega t), omega^2 = k (1 / m_1 + 1 / m_2) = 30, of second order; momentum and energy stay."""
    errors = []
    for steps in (20, 40):
        composite = swung(tmp_path, steps)
        structure, rigid = composite.elastic.structure, composite.rigid
        errors.append(abs(stretches(composite)[0] - 0.2 * np.cos(0.7 * np.pi)))
        assert momentum(composite) == pytest.approx(0.0, abs=1e-9)
        kinetic = motion.kinetic_energy(rigid.bodies[0], rigid.now[0])
        total = kinetic + structure.energy.kinetic + structure.energy.internal + structure.springs.energy(structure)
        assert total == pytest.approx(0.5 * 40.0 * 0.2**2, rel=1e-3)
    assert errors[1] < 1e-3 * 0.2
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_a_damper_takes_the_relative_speed(tmp_path):
    """v exp(-c (1 / m_1 + 1 / m_2) t) with c = 2."""
    text = SWINGING.replace("stiffness: 40, dashpot: 0", "stiffness: 0, dashpot: 2").replace(
        "density: 2\n", "density: 2\n      initial_velocity: [1, 0]\n"
    )
    composite = swung(tmp_path, 50, text, 1.0)
    rigid, structure = composite.rigid, composite.elastic.structure
    speed = rigid.now[0].v[0] - structure.now.v.reshape(-1, 2)[:, 0].mean()
    assert speed == pytest.approx(np.exp(-1.5), rel=1e-3)
    assert momentum(composite) == pytest.approx([2.0, 0.0], abs=1e-8)


@pytest.mark.parametrize("text", [HANGING, CUBE], ids=["plane", "space"])
def test_the_derivative_of_both(tmp_path, text):
    """The tangent of the whole solid against differences of its balance, with dampers, in a turned state."""
    rng = np.random.default_rng(2)
    dynamic = text.replace("nu: 0.3}", "nu: 0.3, density: 3}").replace(
        "structure:\n", "structure:\n  dynamics: {rho_inf: 0.6}\n"
    )
    dynamic = dynamic.replace("stiffness: 50,", "stiffness: 50, dashpot: 4,").replace(
        "      held: [rotation_x, y]\n", ""
    )
    composite = simulation(dynamic, tmp_path).scheme
    composite.initialise(0.0, 0.1)
    composite.begin_step(0.0, 0.1)
    elastic, rigid = composite.elastic.structure, composite.rigid
    u0 = elastic.now.u + 0.02 * rng.standard_normal(elastic.layout.size)
    q0 = np.zeros((1, 6))
    q0[:, rigid.components] = 0.2 * rng.standard_normal(len(rigid.components))

    def balance(du, dq):
        elastic.now.u[:] = u0 + du
        rigid.set_increments(q0)
        rigid.update(dq)
        composite.residual()
        return np.concatenate([elastic.residual_force, rigid.balance])

    way, h = rng.standard_normal(composite.size), 1e-6
    own = elastic.layout.size
    ends = [balance(sign * h * way[:own], sign * h * way[own:]) for sign in (1.0, -1.0)]
    slope = (ends[0] - ends[1]) / (2.0 * h)
    balance(np.zeros(own), np.zeros(len(way) - own))
    matrix = composite.linearise()
    x, y = matrix.createVecs()
    x.array[:] = way
    matrix.mult(x, y)
    for part in (slice(0, own), slice(own, None)):
        assert y.array[part] == pytest.approx(slope[part], rel=1e-6, abs=1e-6 * np.abs(slope[part]).max())


#: A disc sinks in a fluid until the spring to a plate, held above, and the fluid carry it.
SINKING = """\
time: {step: 0.1, end: 3}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  gravity: [0, -10]
  scheme: backward_euler
  grid: {from: [0, 0], to: [1, 1.2], cells: [10, 12]}
  patches: {walls: {on: [x-, x+, y-, y+], no_slip: true}}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.12, cells: [16, 1], translate: [0.5, 0.47]}
      free:
        density: 3
        springs: [{at: [0.5, 0.53], stiffness: 30, dashpot: 2, to: {body: plate, at: [0.5, 0.94]}}]
structure:
  dynamics: {rho_inf: 0}
  bodies:
    plate:
      mesh: {shape: rectangle, size: [0.6, 0.15], origin: [0.2, 0.93], cells: [6, 2]}
      material: {law: neo_hooke, E: 1e5, nu: 0.3, density: 1}
      supports: [{on: left, displacement: [0, 0]}]
coupling: {scheme: monolithic}
probes: {disc: {body: disc, quantity: centre}}
output: {fields_every: 0}
"""
IN_WATER = 2.0 * 10.0 * 16 * 0.5 * 0.12**2 * np.sin(2.0 * np.pi / 16)  # (3 - 1) g V


@pytest.mark.parametrize("scheme", ["monolithic", pytest.param("partitioned", marks=pytest.mark.slow)])
def test_a_disc_in_a_fluid_hangs_on_a_plate(tmp_path, scheme):
    """The spring carries its weight less the buoyancy; on the way the interface keeps its momentum."""
    found = simulation(SINKING.replace("scheme: monolithic", f"scheme: {scheme}"), tmp_path)
    solid = found.scheme.coupled.solid
    for _, info in march(found.scheme, 3.0, 30):
        assert info.numbers["interface.force"] < 1e-5
    assert stretches(solid)[0] * 30.0 == pytest.approx(IN_WATER, rel=1e-6)
    assert pulls(solid)[0][1] == pytest.approx(IN_WATER, rel=1e-6)


MOVING = SINKING.replace("step: 0.1, end: 3", "step: 0.02, end: 0.12")


def histories(folder, *, processes=1, cut=None):
    folder.mkdir()
    (folder / "case.yaml").write_text(MOVING)
    ends = [[]] if cut is None else [["--set", f"time.end={cut}"], ["--set", "time.end=0.12"]]
    for number, end in enumerate(ends):
        words = ["run", folder / "case.yaml", "-o", folder / "out"] if number == 0 else ["resume", folder / "out"]
        run = fsci(*words, *end, processes=processes)
        assert run.returncode == 0, run.stdout + run.stderr
    return read_history(folder / "out" / "history.csv")


@pytest.fixture(scope="module")
def moving(tmp_path_factory):
    return histories(tmp_path_factory.mktemp("moving") / "one")


def test_resumed_bit_for_bit(tmp_path, moving):
    assert moving["disc.y"][-1] < 0.47 - 1e-3
    resumed = histories(tmp_path / "resumed", cut=0.06)
    for name in ("disc.x", "disc.y", "interface.force", "structure.energy"):
        assert np.array_equal(moving[name], resumed[name]), name


@pytest.mark.slow
def test_two_processes(tmp_path, moving):
    two = histories(tmp_path / "two", processes=2)
    assert two["disc.y"] == pytest.approx(moving["disc.y"], rel=1e-10)


MISTAKES = [
    (", to: {body: mass, at: [0.3, 0.8]}, length: 0.6", "", "needs 'to', the other point"),
    ("body: mass, at: [0.3, 0.8]", "body: mas, at: [0.3, 0.8]", "no free or elastic body 'mas'; did you mean 'mass'?"),
    ("at: [0.71, 1.55]", "at: [0.71, 2]", r"the point (0.71, 2.0) is not in body 'beam'"),
    ("at: [0.3, 1.5]", "at: [0.3, 1.4]", r"the point (0.3, 1.4) is not in body 'beam'"),
    ("at: [0.3, 1.5]", "at: [0.3, 1.5, 1]", "'at' must have 2 entries in 2D, not 3"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "message"), MISTAKES)
def test_mistakes_have_a_place(tmp_path, old, new, message):
    assert old in HANGING
    text = HANGING.replace(old, new)
    with pytest.raises(CaseError) as raised:
        simulation(text, tmp_path)
    line = next(i for i, (a, b) in enumerate(zip(HANGING.splitlines(), text.splitlines(), strict=True), 1) if a != b)
    assert message in str(raised.value)
    assert f":{line}:" in str(raised.value)


def test_static_bodies_on_springs_are_held(tmp_path):
    """No warning of motions that a spring to another body may hold."""
    text = HANGING.replace("      supports: [{on: left, displacement: [0, 0]}]\n", "")
    (tmp_path / "case.yaml").write_text(text)
    run = fsci("check", tmp_path / "case.yaml")
    assert "static equilibrium does not determine" not in run.stdout + run.stderr


def test_a_case_with_springs_runs(tmp_path):
    (tmp_path / "case.yaml").write_text(HANGING)
    assert run_case(load_case(tmp_path / "case.yaml"), tmp_path / "out") == FINISHED
    assert read_history(tmp_path / "out" / "history.csv")["wall.y"][-1] == pytest.approx(20.0, rel=1e-8)


#: A stamp lies on an elastic plate, and a spring from an elastic beam above takes a part of its weight.
PRESSED = """\
time: {step: 1, end: 1}
structure:
  bodies:
    plate:
      mesh: {shape: rectangle, size: [2, 0.4], origin: [-1, -0.4], cells: [12, 3]}
      material: {law: neo_hooke, E: 2e4, nu: 0.3}
      supports: [{on: bottom, displacement: [0, 0]}]
    beam:
      mesh: {shape: rectangle, size: [2, 0.4], origin: [-1, 2], cells: [8, 2]}
      material: {law: neo_hooke, E: 2e4, nu: 0.3}
      supports: [{on: left, displacement: [0, 0]}]
      point_springs: [{at: [0.03, 2], stiffness: 30, to: {body: stamp, at: [0.03, 1]}, length: 0.7}]
rigid:
  gravity: [0, -10]
  bodies:
    stamp: {mesh: {shape: rectangle, size: [1, 1], origin: [-0.5, 0], cells: [1, 1]}, density: 2, held: [x]}
contact: {pairs: {press: {slave: {body: plate, on: top}, master: {obstacle: stamp}}}}
output: {fields_every: 0}
solver: {newton: {residual: 1e-11}}
"""


def test_contact_carries_what_the_spring_does_not(tmp_path):
    """Weight 20 less the pull of the spring, whose ends both give way."""
    composite = simulation(PRESSED, tmp_path).scheme
    ((_, info),) = march(composite, 1.0, 1)
    pull = -pulls(composite)[0][1]
    assert 7.0 < pull < 30.0 * 0.3  # the beam comes down
    pressed = composite.rigid.pressed[1]
    assert pressed + pull == pytest.approx(20.0, abs=1e-8)
    assert abs(info.numbers["contact.press.y"]) == pytest.approx(pressed, rel=1e-9)
