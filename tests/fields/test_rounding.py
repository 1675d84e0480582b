"""At rest there is no residual left to reduce: a step is solved where only rounding errors are left, in any units."""

import numpy as np
import pytest
from petsc4py import PETSc

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case
from solvers.algebra.rounding import rounding_error


def test_estimate_is_the_size_of_the_error():
    """Sums of 300 products in single precision, whose error can be measured: the estimate is as large, by rows."""
    random = np.random.default_rng(5)
    A = (random.normal(size=(200, 300)) * 10.0 ** random.uniform(-3, 3, (200, 1))).astype(np.float32)
    x = random.normal(size=300).astype(np.float32)
    error = np.abs(np.add.accumulate(A * x, axis=1, dtype=np.float32)[:, -1] - A.astype(float) @ x)
    start, columns = np.arange(201, dtype=np.int32) * 300, np.tile(np.arange(300, dtype=np.int32), 200)
    matrix = PETSc.Mat().createAIJ(A.shape, csr=(start, columns, A.astype(float).ravel()), comm=PETSc.COMM_SELF)
    estimate = rounding_error(matrix, x.astype(float)) * np.finfo(np.float32).eps / np.finfo(float).eps
    ratio = error / estimate
    assert 0.1 < np.median(ratio) < 10.0
    assert ratio.max() < 10.0
    assert 0.1 < np.linalg.norm(error) / np.linalg.norm(estimate) < 10.0


@pytest.mark.parametrize("size", [1, 2, 3, 4])
def test_estimate_of_matrices_of_blocks(size):
    """The same from the entries where they are, from blocks and from a copy of the rows."""
    random = np.random.default_rng(size)
    A, x = random.normal(size=(4 * size, 4 * size)), random.normal(size=4 * size)
    expected = np.finfo(float).eps * np.sqrt(np.square(A * x).sum(axis=1))
    dense = PETSc.Mat().createDense(A.shape, array=A, comm=PETSc.COMM_SELF)
    dense.setBlockSize(size)
    dense.assemble()
    for kind in ("dense", "aij", "baij"):
        matrix = dense.copy() if kind == "dense" else dense.convert("aij", PETSc.Mat()).convert(kind, PETSc.Mat())
        np.testing.assert_allclose(rounding_error(matrix, x), expected, rtol=1e-13)


PLATE = """
time: {step: 0.1, end: 0.5, retry: {halvings: 0}}
fluid:
  density: 1
  viscosity: 0.1
  scheme: backward_euler
  element: q2q1
  grid: {from: [0, 0], to: [3, 1], cells: [30, 10]}
  patches:
    inlet: {on: x-, traction: [1, 0]}
    outlet: {on: x+, traction: [0, 0]}
    walls: {on: [y-, y+], slip: true}
  bodies:
    plate: {mesh: {shape: rectangle, size: [0.4, 1.2], cells: [1, 12], origin: [1.437, -0.1]}}
probes:
  pressure: {quantity: pressure, at: [1.0, 0.5]}
"""


def test_fluid_at_rest_under_pressure(tmp_path):
    """A plate closes the channel: u = 0, and the residual is rounding error of the pressure alone."""
    history = computed(tmp_path, PLATE)
    assert history["iterations"].max() <= 1
    assert history["pressure"] == pytest.approx(np.ones(5), abs=1e-12)


PISTON = """
time: {{step: 0.01, end: 0.4, retry: {{halvings: 0}}}}
fluid:
  density: {density}
  viscosity: {viscosity}
  element: q1q1
  scheme: backward_euler
  grid: {{from: [0, 0], to: [{end}, {height}], cells: [13, 2]}}
  patches:
    inlet: {{on: x-, traction: [{pressure}, 0]}}
    sides: {{on: [y-, y+], slip: true}}
    behind: {{on: x+, no_slip: true}}
structure:
  dynamics: {{rho_inf: 0.5, damping: {{stiffness: 0.01}}}}
  bodies:
    block:
      mesh: {{shape: rectangle, size: [{length}, {height}], cells: [4, 2], origin: [{one}, 0]}}
      material: {{law: st_venant_kirchhoff, E: {E}, nu: 0, density: {heavy}}}
      supports: [{{on: [bottom, top], symmetry: true}}]
contact:
  obstacles:
    stop: {{mesh: {{shape: rectangle, size: [{height}, {one}], cells: [1, 1], origin: [{at}, -{height}]}}, on: left}}
  pairs:
    stop: {{slave: {{body: block, on: right}}, master: {{obstacle: stop}}}}
coupling: {{scheme: monolithic, wetted: {{block: left}}}}
probes:
  force: {{field: fluid, body: block, quantity: force}}
"""


@pytest.mark.parametrize(
    "meter",
    [
        pytest.param(1.0, id="in m", marks=pytest.mark.slow),
        pytest.param(1e6, id="in um"),
        pytest.param(1e-6, id="in Mm", marks=pytest.mark.slow),
    ],
)
def test_coupled_system_comes_to_rest(tmp_path, meter):
    """`piston_impact` with a short way, its lengths in three units: the impact and the rest after it need no retry."""
    text = PISTON.format(
        density=1 / meter**3, heavy=2 / meter**3, viscosity=1e-6 / meter, pressure=1 / meter, E=1e5 / meter,
        one=meter, end=1.3 * meter, length=0.5 * meter, height=0.2 * meter, at=1.5001 * meter,
    )  # fmt: skip
    history = computed(tmp_path, text)
    assert len(history["time"]) == 40
    assert history["contact.stop.x"][-1] == pytest.approx(-0.2, rel=1e-8)
    assert history["force.x"][-1] == pytest.approx(0.2, rel=1e-8)
    assert history["iterations"][-1] <= 1


def computed(folder, text):
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml"), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")
