"""A periodic flow with a given rate that carries bodies along: the motion is that of the force which drives it."""

import numpy as np
import pytest
from programs import fsci

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, resume_run, run_case

STEP, STEPS = 0.02, 5
RATE = "0.4*t*(1 + t)"
CHANNEL = """\
time: {step: STEP, end: END}
fluid:
  density: 1
  viscosity: 0.02
  FORCE
  element: ELEMENT
  grid: {from: [0, 0], to: [2, 1], cells: [16, 8]}
  patches: {ends: {on: [x-, x+], periodic: trueRATE}, walls: {on: [y-, y+], no_slip: true}}
BODIEScoupling: {scheme: SCHEME}
solver: {newton: {residual: 1.0e-10}, linear: {method: LINEAR}}
output: {fields_every: 0}
probes:
  rate: {quantity: flow_rate, through: ends}
  energy: {quantity: kinetic_energy}
  force: {quantity: force, body: disc}
"""
DRIVING = "  driving: {quantity: driving_force, through: ends}\n"
FREE = """\
  bodies:
    disc: {mesh: {shape: disc, radius: 0.2, cells: [24, 1], translate: [X, 0.47]}, free: {density: 1.5}}
"""
FLAP = """\
structure:
  dynamics: {}
  bodies:
    disc:
      mesh: {shape: rectangle, size: [0.2, 0.4], cells: [3, 6], order: 1, translate: [X, 0]}
      material: {law: neo_hooke, E: 50, nu: 0.4, density: 1.5}
      supports: [{on: bottom, displacement: [0, 0]}]
"""


def case(folder, bodies, *, x, rate=RATE, force="", scheme="monolithic", element="q1q1", linear="direct", end=None):
    given, probe = (f', rate: "{rate}"', DRIVING) if rate else ("", "")
    scheme += ", tolerance: 1.0e-10" if scheme == "partitioned" else ""
    given = {
        "BODIES": bodies, "FORCE": force, "RATE": given, "X": x, "SCHEME": scheme, "ELEMENT": element,
        "LINEAR": linear, "STEP": STEP, "END": end or STEP * STEPS,
    }  # fmt: skip
    text = CHANNEL + probe
    for name, value in given.items():
        text = text.replace(name, str(value))
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text.replace("  \n", ""))
    return folder / "case.yaml"


def run(folder, *args, **choices):
    path = case(folder, *args, **choices)
    assert run_case(load_case(path), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


BODIES = {"free": (FREE, 0.9), "crosses": (FREE, 1.9), "flap": (FLAP, 0.9)}
WAYS = [
    ("q1q1", "monolithic", "direct"), ("q2q1", "monolithic", "direct"), ("q1q1", "partitioned", "direct"),
    ("q1q1", "monolithic", "iterative"),
]  # fmt: skip
#: each body and each way once; all pairs of them are slow
QUICK = dict(zip(WAYS, ("flap", "free", "free", "crosses"), strict=True))
PAIRS = [
    pytest.param(*BODIES[name], *way, id="-".join((*way, name)), marks=() if QUICK[way] == name else pytest.mark.slow)
    for way in WAYS
    for name in BODIES
]


@pytest.mark.parametrize(("bodies", "x", "element", "scheme", "linear"), PAIRS)
def test_the_motion_is_that_of_the_force(tmp_path, bodies, x, element, scheme, linear):
    """Run with a rate, read G, run with the body force G, in as many iterations. It is zero at the start."""
    choices = {"x": x, "element": element, "scheme": scheme, "linear": linear}
    found = run(tmp_path / "rate", bodies, rate="400*t^4", **choices)
    terms = [f"where(abs(t - {STEP * (n + 1)!r}) < 0.1*{STEP}, {G!r}, 0)" for n, G in enumerate(found["driving"])]
    other = run(tmp_path / "force", bodies, rate="", force=f'body_force: ["{" + ".join(terms)}", 0]', **choices)
    assert sum(found["iterations"]) <= 1.1 * sum(other["iterations"])
    assert np.abs(found["interface.momentum"]).max() < 1e-8 * np.abs(found["force.x"]).max()
    for column in ("rate", "energy", "force.x"):
        assert np.abs(np.array(found[column]) - other[column]).max() < 1e-8 * np.abs(other[column]).max(), column


@pytest.mark.parametrize(
    "bodies", [pytest.param(FREE, id="free"), pytest.param(FLAP, id="flap", marks=pytest.mark.slow)]
)
def test_an_impulsive_start(tmp_path, bodies):
    """The rate is there at once: after the impulse the forces are finite, and both schemes have the same."""
    found = [
        run(tmp_path / scheme, bodies, x=0.9, rate="0.3", scheme=scheme) for scheme in ("monolithic", "partitioned")
    ]
    forces = np.array([history["driving"] for history in found])
    assert np.abs(forces[1] - forces[0]).max() < 1e-6 * np.abs(forces).max()
    if bodies is FREE:
        assert np.abs(forces).max() < 0.1 * 0.3 / STEP  # of the impulse, spread over the step


@pytest.mark.slow
@pytest.mark.parametrize("bodies", [FREE, FLAP], ids=["free", "flap"])
def test_it_resumes_and_runs_on_two_processes(tmp_path, bodies):
    """To the last digit; and two processes have the same to 1e-8."""
    whole = run(tmp_path / "whole", bodies, x=1.9 if bodies is FREE else 0.9)
    run(tmp_path / "part", bodies, x=1.9 if bodies is FREE else 0.9, end=2 * STEP)
    assert resume_run(tmp_path / "part" / "out", [("time.end", str(STEPS * STEP))]) == FINISHED
    path = case(tmp_path / "two", bodies, x=1.9 if bodies is FREE else 0.9)
    assert fsci("run", path, "-o", tmp_path / "two" / "out", processes=2).returncode == 0
    part, two = (read_history(tmp_path / name / "out" / "history.csv") for name in ("part", "two"))
    for column in ("driving", "rate", "force.x", "energy"):
        assert np.array_equal(part[column], whole[column])
        assert np.abs(np.array(two[column]) - whole[column]).max() < 1e-8 * np.abs(whole[column]).max()


def test_the_rate_may_change_on_resuming(tmp_path):
    """It is a load: the state stays, and the new rate holds from the next step on."""
    run(tmp_path, FREE, x=0.9, end=2 * STEP)
    overrides = [("time.end", str(3 * STEP)), ("fluid.patches.ends.rate", "0.02")]
    assert resume_run(tmp_path / "out", overrides) == FINISHED
    history = read_history(tmp_path / "out" / "history.csv")
    assert history["driving"][2] < history["driving"][1] - 0.1


@pytest.mark.parametrize("scheme", ["monolithic", "partitioned"])
def test_a_steady_flap(tmp_path, scheme):
    """The state of the rate is that of the force; above, the stress is zero, which sets the level of the pressure."""
    top = "floor: {on: y-, no_slip: true}, top: {on: y+, traction: [0, 0]}"

    def steady(folder, **choices):
        path = case(folder, FLAP, x=0.9, scheme=scheme, **choices)
        text = path.read_text().replace("  dynamics: {}\n", "").replace("walls: {on: [y-, y+], no_slip: true}", top)
        text = text.replace(f"step: {STEP}, end: {STEP * STEPS}", "step: 1, end: 1")
        path.write_text(text.replace("density: 1\n", "density: 1\n  scheme: steady\n  flow: stokes\n"))
        assert run_case(load_case(path), folder / "out") == FINISHED
        return read_history(folder / "out" / "history.csv")

    found = steady(tmp_path / "rate", rate="0.1")
    other = steady(tmp_path / "force", rate="", force=f"body_force: [{found['driving'][0]!r}, 0]")
    for column in ("rate", "force.x", "iterations"):
        assert found[column][0] == pytest.approx(other[column][0], rel=1e-10)
