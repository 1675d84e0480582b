"""Coupled cases as a user runs them: both schemes, resumed bit for bit, repeated after failures, on two processes."""

import numpy as np
import pytest
from coupled_case import POST
from programs import ENVIRONMENT, fsci, new_process

from coupling.coupled import Coupled
from fsci.case import load_case
from fsci.plot.picture import plot_run
from fsci.running.history import read_history
from fsci.running.output import read_collection
from fsci.running.run import FINISHED, run_case
from solvers.api import FailureKind, StepFailed

SCHEMES = {
    "monolithic": "coupling: {scheme: monolithic}",
    "iqn": "coupling: {scheme: partitioned, tolerance: 1.0e-8}",
    "aitken": "coupling: {scheme: partitioned, accelerator: aitken, tolerance: 1.0e-8}",
}

#: two elastic balls that meet in a narrow channel: contact inside of a coupled run
MEETING = """\
title: a ball pushed against another
time: {step: 0.02, end: 0.1}
fluid:
  density: 1
  viscosity: 0.1
  element: q1q1
  scheme: backward_euler
  grid: {from: [0, 0], to: [2, 1], cells: [24, 12]}
  patches:
    ends: {on: [x-, x+], outflow: true}
    walls: {on: [y-, y+], no_slip: true}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    left:
      mesh: {shape: disc, radius: 0.2, cells: [16, 2], translate: [0.78, 0.51]}
      material: {law: neo_hooke, E: 500, nu: 0.3, density: 5}
      initial_velocity: [1.5, 0]
    right:
      mesh: {shape: disc, radius: 0.2, cells: [16, 2], translate: [1.25, 0.53]}
      material: {law: neo_hooke, E: 500, nu: 0.3, density: 5}
      initial_velocity: [-1.5, 0]
contact:
  pairs:
    between: {slave: {body: left, on: outer}, master: {body: right, on: outer}}
coupling: {scheme: monolithic}
probes:
  left: {field: structure, body: left, quantity: centre}
  right: {field: structure, body: right, quantity: centre}
  force: {field: fluid, quantity: force, body: left}
"""

#: a block on the floor of a box in 3D
BLOCK = """\
title: a block in a channel
time: {step: 0.02, end: 0.04}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  grid: {from: [0, 0, 0], to: [1.6, 0.8, 0.8], cells: [10, 5, 5]}
  patches:
    inlet: {on: x-, velocity: ["20*z*(0.8 - z)*y*(0.8 - y)*min(t/0.1, 1)", 0, 0]}
    outlet: {on: x+, outflow: true}
    walls: {on: [y-, y+, z-, z+], no_slip: true}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    block:
      mesh: {shape: box, size: [0.23, 0.31, 0.37], cells: [1, 2, 2], translate: [0.5, 0.24, 0]}
      material: {law: st_venant_kirchhoff, E: 300, nu: 0.3, density: 5}
      supports: [{on: bottom, displacement: [0, 0, 0]}]
coupling: {scheme: monolithic}
probes:
  tip: {quantity: displacement, at: [0.5, 0.24, 0.37]}
  force: {quantity: force}
solver: {newton: {residual: 1.0e-11}}
"""


def run(text, folder, *overrides):
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml", overrides), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


def with_scheme(scheme: str) -> str:
    return POST.replace(SCHEMES["monolithic"], SCHEMES[scheme])


@pytest.fixture(scope="module", params=list(SCHEMES))
def whole(request, tmp_path_factory, monolithic):
    """(scheme, results folder, history) of the whole run."""
    if request.param == "monolithic":
        return request.param, *monolithic
    folder = tmp_path_factory.mktemp(request.param)
    return request.param, folder / "out", run(with_scheme(request.param), folder)


@pytest.fixture(scope="module")
def monolithic(tmp_path_factory):
    folder = tmp_path_factory.mktemp("reference")
    return folder / "out", run(POST, folder)


@pytest.mark.parametrize("whole", ["iqn", "aitken"], indirect=True)
def test_all_schemes_agree(whole, monolithic):
    """To 10 times the tolerance of the coupling."""
    _, _, history = whole
    _, expected = monolithic
    moved = np.abs(expected["tip.x"]).max()
    assert moved > 1e-3
    for name in ("tip.x", "tip.y"):
        assert np.abs(history[name] - expected[name]).max() < 1e-7 * moved
    assert np.abs(history["force.x"] - expected["force.x"]).max() < 1e-5 * np.abs(expected["force.x"]).max()


@pytest.mark.parametrize(
    "whole", ["monolithic", *(pytest.param(name, marks=pytest.mark.slow) for name in ("iqn", "aitken"))], indirect=True
)
def test_directions_that_span_the_plane_hold_all(whole, tmp_path):
    """A foot held along two directions that are no axes is the clamped one, whatever couples fluid and structure."""
    scheme, _, expected = whole
    clamp = "{on: bottom, displacement: [0, 0]}"
    pair = "{on: bottom, direction: [1, 1]}, {on: bottom, direction: [1, -2]}"
    text = with_scheme(scheme)
    assert clamp in text
    history = run(text.replace(clamp, pair), tmp_path / "pair", ("time.end", "0.06"), ("verify", "[]"))
    for name in ("tip.x", "tip.y", "force.x", "structure.energy"):
        scale = np.abs(expected[name]).max()
        assert np.abs(history[name] - expected[name][:3]).max() < 1e-6 * scale + 1e-12, name


def test_balances_are_in_the_history(whole):
    _, _, history = whole
    columns = {"interface.force", "interface.momentum", "interface.work", "structure.energy", "fluid.mass"}
    assert columns <= history.keys()
    assert history["interface.force"].max() < 1e-7  # the tolerance of the partitioned schemes
    assert history["interface.momentum"].max() < 1e-9 * np.abs(history["force.x"]).max()
    assert np.abs(history["fluid.mass"]).max() < 1e-9


@pytest.mark.parametrize(
    "whole", ["monolithic", *(pytest.param(name, marks=pytest.mark.slow) for name in ("iqn", "aitken"))], indirect=True
)
def test_resumed_bit_for_bit(whole, tmp_path):
    scheme, _, expected = whole
    (tmp_path / "case.yaml").write_text(with_scheme(scheme))
    half = load_case(tmp_path / "case.yaml", [("time.end", "0.06"), ("verify", "[]")])
    assert run_case(half, tmp_path / "out") == FINISHED
    text = (tmp_path / "out" / "case.yaml").read_text()
    (tmp_path / "out" / "case.yaml").write_text(text.replace("end: 0.06", "end: 0.1"))
    done = fsci("resume", tmp_path / "out")
    assert done.returncode == 0, done.stdout + done.stderr
    resumed = read_history(tmp_path / "out" / "history.csv")
    for name in expected.keys() - {"wall"}:
        assert np.array_equal(expected[name], resumed[name]), name


@pytest.mark.parametrize(
    ("whole", "at"),
    [
        ("monolithic", 1),
        *(
            pytest.param(scheme, at, marks=pytest.mark.slow)
            for scheme, at in (("monolithic", 3), ("iqn", 3), ("aitken", 1))
        ),
    ],
    indirect=["whole"],
)
def test_a_failed_step_does_not_change_the_state(at, whole, tmp_path, monkeypatch):
    """It is repeated as two halves; the same to the last bit whether it fails at its end or before it begins."""
    scheme, _, _ = whole
    histories = []
    for name in ("end_step", "begin_step"):
        calls, method = [], getattr(Coupled, name)

        def fail_once(self, *arguments, calls=calls, method=method):
            calls.append(1)
            if len(calls) == at:
                raise StepFailed("test", FailureKind.NEWTON, "on purpose")
            method(self, *arguments)

        with monkeypatch.context() as patched:
            patched.setattr(Coupled, name, fail_once)
            overrides = ("time.end", "0.06"), ("verify", "[]")
            histories.append(run(with_scheme(scheme), tmp_path, *overrides))
    one, two = histories
    assert np.allclose(one["dt"][: at + 1], [0.02] * (at - 1) + [0.01] * 2, rtol=1e-12)
    for name in one.keys() - {"wall"}:
        assert np.array_equal(one[name], two[name]), name


def test_a_case_that_fails_at_once_says_so_and_keeps_a_checkpoint(tmp_path):
    """Before the first step there is no step size to remember; the state is written all the same."""
    (tmp_path / "case.yaml").write_text(POST)
    overrides = ["--set", "solver.newton.max_iterations=1", "--set", "time.retry.halvings=0"]
    done = fsci("run", tmp_path, "-o", tmp_path / "out", *overrides)
    assert done.returncode == 1
    assert "did not converge" in done.stdout
    assert (tmp_path / "out" / "failure" / "checkpoint_000000.h5").is_file()
    text = (tmp_path / "out" / "case.yaml").read_text()
    (tmp_path / "out" / "case.yaml").write_text(text.replace("max_iterations: 1", "max_iterations: 20"))
    assert fsci("resume", tmp_path / "out").returncode == 0


@pytest.mark.parametrize(
    ("text", "scheme"),
    [
        pytest.param(POST, "monolithic", id="post-monolithic", marks=pytest.mark.slow),
        pytest.param(POST, "iqn", id="post-iqn", marks=pytest.mark.slow),
        pytest.param(BLOCK, "monolithic", id="block-monolithic", marks=pytest.mark.slow),
        pytest.param(BLOCK, "iqn", id="block-iqn", marks=pytest.mark.slow),
        pytest.param(MEETING, "monolithic", id="contact-monolithic", marks=pytest.mark.slow),
        pytest.param(MEETING, "iqn", id="contact-iqn", marks=pytest.mark.slow),
    ],
)
def test_two_processes(text, scheme, tmp_path):
    text = text.replace(SCHEMES["monolithic"], SCHEMES[scheme])
    one = run(text, tmp_path, ("verify", "[]"))
    done = fsci("run", tmp_path, "-o", tmp_path / "two", "--set", "verify=[]", processes=2)
    assert done.returncode == 0, done.stdout + done.stderr
    two = read_history(tmp_path / "two" / "history.csv")
    if "contact.active" in one:
        assert one["contact.active"].max() > 0
    solving = {"residual", "iterations", "coupling.newton", "coupling.linear"}
    solving |= {"interface.force", "interface.momentum", "fluid.mass"}
    for name in one.keys() - solving - {"wall"}:
        size = max(np.abs(one[other]).max() for other in one if other.partition(".")[0] == name.partition(".")[0])
        assert np.abs(one[name] - two[name]).max() <= 1e-8 * size + 1e-12, name


def test_files(monolithic):
    out, history = monolithic
    flow, post = (read_collection(out / "fields" / f"{name}.pvd") for name in ("fluid", "post"))
    assert len(flow) == len(post) == len(history["time"]) + 1
    import pyvista

    mesh = pyvista.read(post[-1][1])
    assert {"displacement", "velocity"} <= set(mesh.point_data)
    tip = np.argmin(np.linalg.norm(mesh.points - mesh.point_data["displacement"] - [0.62, 0.41, 0], axis=1))
    assert mesh.point_data["displacement"][tip, 0] > 1e-3
    area = pyvista.read(flow[-1][1]).cell_data["fluid_fraction"].sum() * 0.01
    assert area == pytest.approx(2.0 - 0.23 * 0.41, rel=0.02)


@pytest.mark.slow
def test_pictures(monolithic):
    from PIL import Image

    out, _ = monolithic
    pictures = plot_run(out)
    assert {"final_velocity.png", "final_pressure.png"} <= {path.name for path in pictures}
    pixels = np.asarray(Image.open(out / "pictures" / "final_velocity.png").convert("RGB")).astype(int)
    assert len(np.unique(np.round(pixels[300:700, 300:1200].reshape(-1, 3) / 8), axis=0)) > 20


@pytest.mark.slow
def test_no_matrix_is_kept_from_step_to_step(tmp_path, monkeypatch):
    """PETSc counts what it creates and destroys; what Python has dropped it frees only if it is asked to."""
    case, log = tmp_path / "case.yaml", tmp_path / "log.txt"
    case.write_text(POST)
    monkeypatch.setitem(ENVIRONMENT, "PETSC_OPTIONS", f"-log_view :{log}")
    kept = []
    for steps in (2, 6):  # both end with an iterate of the same number: what the last one has is there at the end
        run = new_process("run", case, "-o", tmp_path / f"{steps}", "--set", f"time.end={0.02 * steps}")
        assert run.returncode == 0, run.stdout
        line = next(line for line in log.read_text().splitlines() if line.split()[:1] == ["Matrix"])
        created, destroyed = (int(number) for number in line.split()[1:3])
        kept.append(created - destroyed)
    assert kept[0] == kept[1]


def test_post_with_a_slip_length(tmp_path):
    """Both schemes find the same, in as few Newton iterations as with a flow that sticks, and less drag."""
    found = {}
    for length, scheme in ((0, "monolithic"), (0.1, "monolithic"), (0.1, "iqn")):
        folder = tmp_path / f"{scheme}{length}"
        text = with_scheme(scheme).replace("post:\n", f"post:\n      slip_length: {length}\n", 1)
        found[scheme, length] = run(text, folder, ("time.end", "0.06"))
    sticks, slips, partitioned = found.values()
    for name, bound in (("tip.x", 1e-7), ("force.x", 1e-5)):
        assert slips[name] == pytest.approx(partitioned[name], abs=bound * np.abs(slips[name]).max())
    assert slips["force.x"][-1] < 0.99 * sticks["force.x"][-1]
    assert slips["iterations"].max() <= sticks["iterations"].max() + 1
