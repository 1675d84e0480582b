"""The contact examples of Popp & Wall (COMPDYN 2011) from start to end."""

import json

import numpy as np
import pytest
from mpi4py import MPI
from programs import run_whole

from fsci.builder.build import build
from fsci.case import load_case
from fsci.running.history import read_history
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.timing import Timer


def results(out):
    return json.loads((out / "summary.json").read_text()), read_history(out / "history.csv")


def assert_quadratic(residuals):
    """The last drop is at least 1.5 times the one before in orders of magnitude, unless it ends in rounding error.

    Where the program stops because the residual is only rounding error, the drops before that one count.
    """
    drops = -np.diff(np.log10(residuals))
    rounding = residuals[-1] < 1e-11 * residuals[0] and len(drops) > 2
    if rounding and drops[-1] <= 1.5 * drops[-2]:
        drops = drops[:-1]
    assert drops[-1] > 1.5 * drops[-2] or residuals[-1] < 1e-12 * residuals[0], residuals


def stopping_force(out, step):
    """|M v| (1 - alpha_m) / (beta dt) [N] after a step of two_tori, M with the mass of surfaces as in the paper.

    The program's own first residuals are 1.4 times as large: half of the nodes of these thin walls have all the mass.
    """
    import meshio

    case = load_case("cases/two_tori/case.yaml")
    squares = 0.0
    for body in build(case, MPI.COMM_SELF, Timer()).scheme.bodies:
        velocity = meshio.read(out / "fields" / f"{body.name}_{step:06d}.vtu").point_data["velocity"]
        matrix = body.mass()
        v, force = matrix.createVecs()
        v.array[:] = velocity[body.nodes[: body.owned]].ravel()
        matrix.mult(v, force)
        squares += force.norm() ** 2
    scheme = GeneralisedAlpha.from_rho_inf(case.structure.dynamics.rho_inf)
    return (1.0 - scheme.alpha_m) / (scheme.beta * case.time.step) * np.sqrt(squares)


@pytest.mark.slow
def test_two_tori(tmp_path):
    """200 steps, none retried, at most 6 Newton steps in each; momentum to 1e-9, energy to 1 %."""
    run_whole("two_tori", tmp_path, "output.residuals=[91, 111, 151]", "output.fields_every=10")
    summary, history = results(tmp_path)
    assert summary["steps"] == {"accepted": 200, "retried": 0}
    assert summary["newton"]["max"] <= 6
    for residuals in summary["newton"]["residuals"].values():
        assert_quadratic(residuals)
    # the paper's Table 1, first residuals: the inertia of a predictor that stops at once
    assert stopping_force(tmp_path, 90) == pytest.approx(1.09e6, rel=0.01)
    assert stopping_force(tmp_path, 110) == pytest.approx(1.04e6, rel=0.01)
    momentum = np.stack([history[f"momentum.{axis}"] for axis in "xyz"], axis=1)
    assert np.abs(momentum - momentum[0]).max() < 1e-9 * np.abs(momentum[0]).max()
    energy = history["energy.total"]
    assert energy == pytest.approx(2.0554e7, rel=0.01)
    touching = history["time"][history["contact.active"] > 0]
    assert touching[0] == pytest.approx(2.6, abs=0.1)
    deepest = history["time"][np.argmax(history["energy.internal"])]
    assert deepest == pytest.approx(7.5, abs=0.5)


@pytest.mark.slow
def test_sphere_tube(tmp_path):
    """40 steps, none retried, at most 5 Newton steps in each; the sphere moves as if it were free."""
    run_whole("sphere_tube", tmp_path)
    summary, _ = results(tmp_path)
    assert summary["steps"] == {"accepted": 40, "retried": 0}
    assert summary["newton"]["max"] <= 5
    for residuals in summary["newton"]["residuals"].values():
        assert_quadratic(residuals)
