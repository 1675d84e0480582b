"""Free rigid bodies in a case: run on two processes, resumed bit for bit, with located mistakes."""

import numpy as np
import pytest
from programs import fsci

from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

#: A disc sinks in a box, held back by an eccentric spring.
SINKING = """\
title: a disc that sinks
time: {step: 0.02, end: 0.08}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  grid: {from: [0, 0], to: [1, 1], cells: [12, 12]}
  patches:
    walls: {on: [x-, x+, y-, y+], no_slip: true}
  dynamics: {rho_inf: 0.5}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.2, translate: [0.5, 0.5], cells: [24, 2]}
      free:
        density: 2
        gravity: [0, -5]
        springs: [{at: [0.6, 0.55], stiffness: [3, 1], damping: 0.1}]
        held: []
        initial_angular_velocity: [180/pi]
coupling: {scheme: monolithic}
probes:
  centre: {body: disc, quantity: centre}
  rim: {body: disc, quantity: velocity, at: [0.7, 0.5]}
  spin: {body: disc, quantity: angular_momentum}
  mass: {body: disc, quantity: mass}
  force: {body: disc, quantity: force}
  beside: {quantity: velocity, at: [0.1, 0.5]}
solver: {newton: {residual: 1.0e-10}}
"""


def write(folder, text: str = SINKING):
    path = folder / "case.yaml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    "scheme",
    ["{scheme: monolithic}", pytest.param("{scheme: partitioned, tolerance: 1.0e-9}", marks=pytest.mark.slow)],
)
def test_run_and_resume(tmp_path, scheme):
    """It sinks and turns; a run that stopped halfway ends with the same numbers, bit for bit."""
    path = write(tmp_path, SINKING.replace("{scheme: monolithic}", scheme))
    histories = []
    for name, ends in (("once", ["0.08"]), ("twice", ["0.04", "0.08"])):
        out = tmp_path / name
        for number, end in enumerate(ends):
            words = ["run", path, "-o", out, "--set", f"time.end={end}"] if number == 0 else None
            run = fsci(*(words or ["resume", out, "--set", f"time.end={end}"]))
            assert run.returncode == 0, run.stdout + run.stderr
        histories.append(read_history(out / "history.csv"))
    once, twice = histories
    assert once["centre.y"][-1] < 0.5 - 1e-3
    assert once["mass"] == pytest.approx(2 * np.pi * 0.04, rel=0.02)
    assert once["interface.force"].max() < 1e-6
    for name in once.keys() - {"wall"}:
        assert np.array_equal(once[name], twice[name], equal_nan=True), name


@pytest.mark.slow
def test_two_processes(tmp_path):
    path, histories = write(tmp_path), []
    for processes in (1, 2):
        out = tmp_path / str(processes)
        run = fsci("run", path, "-o", out, processes=processes)
        assert run.returncode == 0, run.stdout + run.stderr
        histories.append(read_history(out / "history.csv"))
    for name in ("centre.x", "centre.y", "rim.x", "rim.y", "spin", "force.x", "force.y"):
        one, two = (history[name] for history in histories)
        assert one == pytest.approx(two, rel=1e-8, abs=1e-9), name


MISTAKES = [
    (
        "coupling: {scheme: monolithic}\n",
        "",
        "a free body needs the section 'coupling'; 'coupling: {}' for its defaults",
    ),
    ("grid:", "scheme: steady\n  grid:", "a free body needs a time-dependent flow: choose the scheme bdf2"),
    ("held: []", "held: [z]", "a body in 2D has no degree of freedom 'z'; choose 'x', 'y' or 'rotation'"),
    (
        "initial_angular_velocity: [180/pi]",
        "initial_angular_velocity: [1, 2, 3]",
        "'initial_angular_velocity' must have 1 entry in 2D, not 3",
    ),
    ("stiffness: [3, 1]", "stiffness: [3, 1, 1]", "'stiffness' must have 2 entries in 2D, not 3"),
    ("gravity: [0, -5]", "gravity: [0, -5, 0]", "'gravity' must have 2 entries in 2D, not 3"),
    ("free:", "motion: {displacement: [0, t]}\n      free:", "give either 'motion' or 'free', not both"),
    (
        "probes:\n",
        "rigid: {bodies: {bar: {mesh: {shape: rectangle, size: [1, 1], cells: [1, 1]}, density: 1}}}\nprobes:\n",
        "free bodies of a case with 'fluid' are in the flow: put it into 'fluid.bodies', with 'free'; outside of"
        " the box it is dry",
    ),
    (
        "probes:\n",
        "contact:\n  obstacles:\n    bar: {mesh: {shape: rectangle, size: [1, 1], cells: [1, 1]}, on: top, "
        "free: {density: 1}}\nprobes:\n",
        "free bodies of a case with 'fluid' are in the flow: put it into 'fluid.bodies', with 'free'; outside of"
        " the box it is dry",
    ),
    ("stiffness: [3, 1]", "stiffness: 3, to: {body: disk, at: [0, 0]}", "there is no free or elastic body 'disk'"),
    ("held: []", "pivot: [0.5, 0.5, 0.5]", "'pivot' must have 2 entries in 2D, not 3"),
    (
        "{body: disc, quantity: c",
        "{field: rigid, body: disk, quantity: c",
        "is measured on a free body: name it as 'body'",
    ),
]


@pytest.mark.parametrize(("right", "wrong", "message"), MISTAKES)
def test_mistakes_are_located(tmp_path, right, wrong, message):
    assert right in SINKING
    with pytest.raises(CaseError) as error:
        load_case(write(tmp_path, SINKING.replace(right, wrong)))
    assert message in str(error.value)
    assert "case.yaml:" in str(error.value)


@pytest.mark.parametrize("scheme", ["monolithic", "partitioned"])
def test_a_body_outside_of_the_box_is_dry(tmp_path, scheme):
    """It falls freely beside one in the flow."""
    mesh = "{shape: disc, radius: 0.2, translate: [9, 0.5], cells: [24, 2]}"
    beside = f"    dry: {{mesh: {mesh}, free: {{density: 2, gravity: [0, -5]}}}}\n"
    text = SINKING.replace("{scheme: monolithic}", f"{{scheme: {scheme}}}").replace("coupling:", beside + "coupling:")
    text = text.replace("probes:\n", "probes:\n  dry: {body: dry, quantity: centre}\n")
    assert run_case(load_case(write(tmp_path, text)), tmp_path / "out") == FINISHED
    found = read_history(tmp_path / "out" / "history.csv")
    assert found["dry.y"] == pytest.approx(0.5 - 2.5 * found["time"] ** 2, abs=1e-12)
    assert found["dry.x"] == pytest.approx(9.0, abs=1e-12)
    assert np.abs(found["centre.x"] - 0.5).max() > 1e-6


#: Values of the old setting in rad/s, and the new one, as messages say it.
OLD_SPINS = [
    ("3", "171.887338539"),
    ("[3]", "[171.887338539]"),
    ("2*pi", "360"),
    ("[-0.5*pi, 0, 1e-3]", "[-90, 0, 0.0572957795131]"),
]


@pytest.mark.parametrize(("old", "new"), OLD_SPINS)
def test_the_old_setting_in_radians_is_refused_with_the_new_one(tmp_path, old, new):
    with pytest.raises(CaseError) as error:
        load_case(write(tmp_path, SINKING.replace("initial_angular_velocity: [180/pi]", f"initial_spin: {old}")))
    (problem,) = error.value.problems
    assert problem.message == (
        f"'initial_spin' [rad/s] is now 'initial_angular_velocity' [degrees/s]: write 'initial_angular_velocity: {new}'"
    )
    line = SINKING.splitlines().index("        initial_angular_velocity: [180/pi]") + 1
    assert (problem.place.line, problem.place.column) == (line, 23)


@pytest.mark.parametrize("old", ["fast", "null", "{z: 1}", "[]"])
def test_the_old_setting_without_a_number_is_refused_with_the_name_of_the_new_one(tmp_path, old):
    with pytest.raises(CaseError, match=r"'initial_spin' \[rad/s\] is now 'initial_angular_velocity'"):
        load_case(write(tmp_path, SINKING.replace("initial_angular_velocity: [180/pi]", f"initial_spin: {old}")))


def test_the_initial_angular_velocity_is_in_degrees_per_second(tmp_path):
    """A quarter of a turn in a second, as a number or a list: the angular momentum of the thrown disc is I pi/2."""
    from mpi4py import MPI

    from fsci.builder.rigid import build_free_bodies
    from solvers.timing import Timer

    for given in ("90", "[90]"):
        path = write(tmp_path, SINKING.replace("[180/pi]", given))
        bodies = build_free_bodies(load_case(path), MPI.COMM_SELF, Timer())
        assert bodies.bodies[0].initial_spin == pytest.approx((0.0, 0.0, np.pi / 2))


def test_friction_and_restitution_of_free_bodies(tmp_path):
    """They are those of all pairs; a case without elastic bodies may have the section for them alone."""
    from mpi4py import MPI

    from fsci.builder.rigid import build_free_bodies
    from solvers.timing import Timer

    for given, mu, e in (
        ("{friction: {coefficient: 0.3}, restitution: 0.5}", 0.3, 0.5),
        ("{friction: none}", 0.0, 0.0),
    ):
        path = write(tmp_path, SINKING + f"contact: {given}\n")
        contact = build_free_bodies(load_case(path), MPI.COMM_SELF, Timer()).contact
        assert [pair.friction for pair in contact.pairs] == [mu] * 4
        assert contact.restitution == e


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("{c_n: 2}", "'c_n' needs the section 'structure': it is not for contact of free bodies"),
        ("{friction: {bound: 2}}", "free rigid bodies have Coulomb's friction: give 'coefficient'"),
        ("{restitution: 1.5}", "restitution"),
    ],
)
def test_contact_of_free_bodies_has_no_other_settings(tmp_path, given, message):
    with pytest.raises(CaseError, match=message):
        load_case(write(tmp_path, SINKING + f"contact: {given}\n"))


def test_restitution_is_for_free_bodies(tmp_path):
    text = SINKING.replace("free:", "slip_length: 0\n      unused:").split("      unused:")[0]
    with pytest.raises(CaseError, match="'contact' needs the section 'structure'"):
        load_case(write(tmp_path, text + "contact: {restitution: 0.5}\n"))


def test_a_held_body_does_not_move(tmp_path):
    """All ways held: the flow is that around a body at rest."""
    text = SINKING.replace("held: []", "held: [x, y, rotation]").replace(
        "initial_angular_velocity: [180/pi]", "initial_velocity: [0, 0]"
    )
    assert run_case(load_case(write(tmp_path, text)), tmp_path / "out") == FINISHED
    history = read_history(tmp_path / "out" / "history.csv")
    assert np.array_equal(history["centre.y"], np.full(4, history["centre.y"][0]))
    assert np.abs(history["rim.y"]).max() < 1e-14
