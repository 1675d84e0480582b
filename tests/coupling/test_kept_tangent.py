"""Tangents that are kept for the last iterate of a step: as many iterates, the same result, fewer tangents."""

import numpy as np
import pytest
from coupled_case import post
from mpi4py import MPI
from small_scenes import BEAM, BLOCK, FLOW

from coupling.monolithic import Monolithic
from fsci.builder.build import build
from fsci.case import load_case
from solvers.fluid.flow.field import Fluid
from solvers.fluid.solve.system import FlowSystem
from solvers.structure.field import Structure
from solvers.structure.tangent import Tangent
from solvers.timing import Timer

TOLERANCE = 1e-6
SOLVER = f"solver: {{newton: {{residual: {TOLERANCE}}}}}\n"
PROBED = {
    "flow": FLOW + "probes:\n  v: {field: fluid, quantity: velocity, at: [0.735, 0.41]}\n",
    "beam": BEAM + "probes:\n  u: {field: structure, quantity: displacement, at: [2, 0.5]}\n",
    "post": post(1.0, rest=SOLVER),
}
STEPS = 8


def run(folder, text, tangents):
    """(iterates of all steps, probes at the end); `tangents` gets those of the steps."""
    (folder / "case.yaml").write_text(text if "title" in text else "title: a scene\n" + SOLVER + text)
    case = load_case(folder)
    simulation, dt = build(case, MPI.COMM_WORLD, Timer()), case.time.step
    simulation.initialise(0.0, dt)
    tangents.clear()
    iterates = [simulation.scheme.step(n * dt, dt).iterations for n in range(STEPS)]
    return iterates, np.array(list(simulation.probes().values()))


@pytest.fixture
def tangents(monkeypatch):
    """A list with one entry for each tangent that a flow or a structure assembles."""
    found: list[str] = []
    for owner, name in ((FlowSystem, "tangent"), (Tangent, "assemble")):

        def counting(*arguments, _original=getattr(owner, name), _owner=owner, **options):
            found.append(_owner.__name__)
            return _original(*arguments, **options)

        monkeypatch.setattr(owner, name, counting)
    return found


@pytest.mark.parametrize(
    ("scene", "owner", "kept"),
    [("flow", Fluid, FlowSystem), ("beam", Structure, Tangent), ("post", Monolithic, FlowSystem)],
)
def test_fewer_tangents_and_the_same_result(scene, owner, kept, tangents, tmp_path, monkeypatch):
    iterates, found = run(tmp_path, PROBED[scene], tangents)
    fewer = tangents.count(kept.__name__)
    assert sum(iterates) - fewer >= 2
    advance = owner.advance
    monkeypatch.setattr(owner, "advance", lambda self, *, keep=False, **more: advance(self))
    expected_iterates, expected = run(tmp_path, PROBED[scene], tangents)
    assert tangents.count(kept.__name__) == sum(expected_iterates)
    assert sum(iterates) <= sum(expected_iterates) + 1
    assert np.abs(found - expected).max() < 10 * TOLERANCE * np.abs(expected).max()


def test_contact_gets_new_tangents(tangents, tmp_path):
    """A block that slides on a floor: the rows of its multipliers change with each iterate."""
    iterates, _ = run(tmp_path, BLOCK.replace("0.001", "-0.0001"), tangents)
    assert tangents.count(Tangent.__name__) >= sum(iterates)
