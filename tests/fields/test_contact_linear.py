"""Contact with linear systems solved by incomplete factors: the results of the direct solver, on 1 and 2 processes."""

import numpy as np
import pytest
from pressed_block import assert_same_results, press_block
from programs import fsci

from fsci import shapes
from fsci.running.history import read_history
from solvers import newton
from solvers.algebra import linear
from solvers.algebra.solid_factors import SolidFactors


def pressed(method):
    """A block in the middle of a larger one that is held on its bottom."""
    block, plate = shapes.box((1, 1, 1), (5, 5, 5), (0.5, 0.5, 1.0)), shapes.box((2, 2, 1), (8, 8, 4))
    return press_block(method, block, plate, held="bottom")


def test_static_contact():
    direct, ilu = (pressed(method) for method in ("direct", "ilu"))
    assert_same_results(ilu, direct, displacement=1e-6)
    used = ilu[0].create_solver(contact=True)
    assert isinstance(used.getPC().getPythonContext(), SolidFactors)
    assert 0 < used.getIterationNumber() < 100


def test_early_systems_are_solved_inexactly(monkeypatch):
    """As many Newton steps as with exact solutions, three quarters of the iterations, and the same contact force."""
    counts = []

    def counted(ksp, *arguments, **settings):
        solve(ksp, *arguments, **settings)
        counts.append(ksp.getIterationNumber())

    solve = linear.solve
    monkeypatch.setattr(linear, "solve", counted)
    inexact, iterations = pressed("ilu"), sum(counts)
    counts.clear()
    monkeypatch.setattr(newton, "ENOUGH", 0.0)
    exact = pressed("ilu")
    assert inexact[2].iterations == exact[2].iterations
    assert iterations < 0.75 * sum(counts)
    force = exact[1].resultant(0)
    assert inexact[1].resultant(0) == pytest.approx(force, abs=1e-9 * np.abs(force).max())


COLLISION = """
time: {step: 0.01, end: 0.15}
structure:
  dynamics: {rho_inf: 1.0}
  bodies:
    left:
      mesh: {shape: box, size: [1, 1, 1], cells: [4, 4, 4]}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1}
      initial_velocity: [1, 0.2, 0]
    right:
      mesh: {shape: box, size: [1, 1, 1], cells: [3, 3, 3], translate: [1.05, 0.1, 0.1]}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1}
contact:
  pairs:
    face: {slave: {body: left, on: right}, master: {body: right, on: left}}
probes:
  momentum: {quantity: momentum}
  right: {body: right, quantity: centre}
"""


def collision(folder, method, processes):
    """History of the impact."""
    (folder / "case.yaml").write_text(COLLISION)
    change = [f"solver.linear.method={method}", "solver.linear.tolerance=1e-12", "output.fields_every=0"]
    words = [word for setting in change for word in ("--set", setting)]
    run = fsci("run", folder, "-o", folder / "out", *words, processes=processes)
    assert run.returncode == 0, run.stdout + run.stderr
    return read_history(folder / "out" / "history.csv")


@pytest.fixture(scope="module")
def direct(tmp_path_factory):
    return collision(tmp_path_factory.mktemp("direct"), "direct", 1)


@pytest.mark.parametrize(
    ("method", "processes"),
    [("ilu", 2), *(pytest.param(*other, marks=pytest.mark.slow) for other in (("ilu", 1), ("auto", 2)))],
)
def test_impact(tmp_path, direct, method, processes):
    assert direct["contact.active"].max() > 4
    found = collision(tmp_path, method, processes)
    assert (found["iterations"] == direct["iterations"]).all()
    for column in ("right.x", "right.y", "right.z"):
        assert found[column] == pytest.approx(direct[column], rel=1e-8), column
    for axis in "xyz":
        change = np.abs(found[f"momentum.{axis}"] - found[f"momentum.{axis}"][0]).max()
        assert change < 1e-9 * np.abs(direct["momentum.x"][0])
