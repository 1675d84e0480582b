"""The energy balance of short dynamic cases: below 1e-3 of the energy exchanged, or falling with the step.

Other cases: docs/make_energy_table.py.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from fsci.bench.program import run_case
from fsci.running.checkpoint import read_checkpoint
from fsci.running.history import read_history

CASES = Path(__file__).parents[2] / "cases"
_spec = importlib.util.spec_from_file_location("make_energy_table", CASES.parent / "docs" / "make_energy_table.py")
make_energy_table = sys.modules[_spec.name] = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(make_energy_table)


def exchanged(state):
    """Energy that the structure has exchanged [J], anywhere in the state of a run."""
    inner = [value for value in state.values() if isinstance(value, dict)]
    return state["exchanged"] if "exchanged" in state else next(filter(None, map(exchanged, inner)), None)


def balances(case, folder, **settings):
    """Largest errors in the structure and at its surface in a flow, over the energy exchanged."""
    run_case(CASES / case, folder, {"output.fields_every": 0, **settings})
    history, (state, _) = read_history(folder / "history.csv"), read_checkpoint(folder / "checkpoint")
    columns = (history.get(name, np.zeros(1)) for name in ("structure.energy", "interface.work"))
    return [float(np.abs(column).max()) / exchanged(state) for column in columns]


@pytest.mark.slow(seconds=60)
@pytest.mark.parametrize(("case", "end"), [("csm3", 0.5), ("sphere_tube", 0.4), ("ring_added_mass", 6.0)])
def test_energy_is_balanced(case, end, tmp_path):
    assert max(balances(case, tmp_path, **{"time.end": end})) < 1e-3


@pytest.mark.slow(seconds=60)
def test_the_work_at_the_surface_converges_in_first_order(tmp_path):
    """Of an elastic bar below a column of water: time steps of backward Euler."""
    found = [
        balances("elastic_bar_column", tmp_path / str(n), **{"time.step": 0.06 / n, "time.end": 6.0}) for n in (1, 2, 4)
    ]
    structure, interface = np.transpose(found)
    assert structure.max() < 1e-5
    np.testing.assert_array_less(interface[1:], 0.6 * interface[:-1])


@pytest.mark.slow(seconds=60)
def test_the_balance_of_a_falling_sphere_falls_with_step_and_cells(tmp_path):
    """In coarse cells: a step of half the length in 1.4 times as many along each axis."""
    levels = next(row.levels for row in make_energy_table.ROWS if row.case == "falling_sphere")[:2]
    found = [
        balances("falling_sphere", tmp_path / str(n), **{"time.end": 0.4, **level}) for n, level in enumerate(levels)
    ]
    np.testing.assert_array_less(found[1], 0.75 * np.array(found[0]))


@pytest.mark.slow(seconds=60)
def test_energy_that_damping_takes_in_an_impact(tmp_path):
    """A block is stopped by its damping within 2 ms, which steps have to resolve: else nothing takes its energy."""
    (row,) = (row for row in make_energy_table.ROWS if row.case == "piston_impact")
    found = [
        balances("piston_impact", tmp_path / str(n), **{**row.settings, **level})[0]
        for n, level in enumerate(row.levels[:2])
    ]
    assert found[1] < 0.75 * found[0]
