"""Any number of processes computes the same, and a resumed run is the same bit for bit."""

from pathlib import Path

import numpy as np
import pytest
from fluid_parallel import everything, scene
from fluid_setup import step
from mpi4py import MPI
from programs import on_processes

from solvers.fluid.flow.conservation.regions import RegionsOfCut
from solvers.fluid.flow.conservation.volume_balance import VolumeBalance

PROGRAM = Path(__file__).parents[1] / "setups" / "fluid_parallel.py"


@pytest.mark.parametrize(
    ("dim", "element", "boxes", "numbers"),
    [
        (2, "q1q1", ("channel", "closed", "film", "nested"), (1, 2)),
        pytest.param(2, "q1q1", ("channel", "closed", "film", "nested"), (1, 3), marks=pytest.mark.slow),
        pytest.param(2, "q2q1", ("closed", "periodic", "film", "nested"), (1, 2, 3), marks=pytest.mark.slow),
        pytest.param(3, "q1q1", ("channel", "nested"), (1, 2), marks=pytest.mark.slow),
    ],
)
def test_processes_agree(tmp_path, dim, element, boxes, numbers):
    for processes in numbers:
        out = tmp_path / str(processes)
        out.mkdir()
        on_processes(processes, PROGRAM, dim, element, out, *boxes)
    for box in boxes:
        one, *others = (np.load(tmp_path / str(processes) / f"{box}.npz") for processes in numbers)
        for name in ("velocity", "pressure", "extremes", "disc", "brick"):
            for other in others:
                assert np.abs(other[name] - one[name]).max() < 1e-8 * np.abs(one[name]).max(), (box, name)


@pytest.mark.parametrize(
    ("dim", "element", "box"),
    [
        (2, "q1q1", "channel"),
        (2, "q1q1", "film"),
        (2, "q2q1", "channel"),
        (2, "q2q1", "periodic"),
        (2, "q2q1", "film"),
        (3, "q1q1", "channel"),
        (2, "q1q1", "nested"),
        pytest.param(2, "q2q1", "nested", marks=pytest.mark.slow),
        pytest.param(3, "q1q1", "nested", marks=pytest.mark.slow),
    ],
)
def test_resumed_run_is_the_same_bit_for_bit(dim, element, box):
    dt, fluid = 0.03, scene(dim, element, MPI.COMM_SELF, box)
    for number in range(3):
        step(fluid, dt * number, dt)
    state = fluid.save()
    kept = fluid.flow.copy()
    fluid.restore(state)
    assert np.array_equal(fluid.flow, kept)
    other = scene(dim, element, MPI.COMM_SELF, box)
    other.restore(state)
    assert np.array_equal(other.flow, kept)
    for number in range(3, 6):
        for some in (fluid, other):
            step(some, dt * number, dt)
        assert np.array_equal(other.flow, fluid.flow)
        for name, force in fluid.force().items():
            assert np.array_equal(other.force()[name], force)
    found = fluid.cut.film if element == "q2q1" else fluid.cut.gaps
    assert (found is not None) == (box == "film" or dim == 3)


def test_a_restored_state_gives_the_same_step():
    dt, fluid = 0.03, scene(2, "q1q1", MPI.COMM_SELF)
    for number in range(3):
        step(fluid, dt * number, dt)
    state, straight = fluid.save(), []
    for _ in range(2):
        step(fluid, 3 * dt, dt)
        straight.append(fluid.flow.copy())
        fluid.restore(state)
    assert np.array_equal(*straight)
    step(fluid, 3 * dt, dt / 2)


@pytest.mark.parametrize("closed", [False, True])
def test_no_fluid_is_lost(closed):
    """What flows out of the box is what the moving body displaces; in a closed box data decide, to O(h^2)."""
    fluid = scene(2, "q1q1", MPI.COMM_SELF, "closed" if closed else "channel")
    balance = VolumeBalance(fluid, RegionsOfCut(fluid)).numbers
    step(fluid, 0.0, 0.03)
    assert abs(balance()["fluid.mass"]) < (2e-3 if closed else 1e-10)
    assert len(everything(fluid)) == 2
