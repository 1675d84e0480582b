"""What `fsci check` says a case will cost."""

import itertools
import json
import re

import pytest
from coupled_case import POST as CHANNEL_AND_POST
from programs import fsci
from small_cases import PLATE
from small_scenes import BLOCK

from fsci.case import load_case
from fsci.check import cost
from fsci.check.cost import MEASURED, Cost, describe_cost, estimate, too_much_memory

#: kind -> two sizes; every factor ten in unknowns takes ten times as long, and contact twice, coupling three times
TABLE = {
    **{kind: [(100.0, 0.01, 100.0), (1000.0, 0.1, 200.0)] for kind in MEASURED},
    "contact": [(100.0, 0.02, 100.0), (1000.0, 0.2, 200.0)],
    "coupled": [(100.0, 0.03, 100.0), (1000.0, 0.3, 200.0)],
}


def case_of(tmp_path, text):
    (tmp_path / "case.yaml").write_text(text)
    return load_case(tmp_path)


def test_between_and_beyond_what_was_measured(tmp_path):
    case = case_of(tmp_path, PLATE)
    for dofs, step, memory in ((10, 0.01, 100.0), (100, 0.01, 100.0), (1000, 0.1, 200.0), (10_000, 1.0, 400.0)):
        found = estimate(case, dofs, TABLE)
        assert found is not None
        assert (found.unknowns, found.step, found.memory) == (dofs, pytest.approx(step), pytest.approx(memory))
    assert estimate(case, None, TABLE) is None


def test_contact_and_coupling_are_factors(tmp_path):
    """Of the structure's time, and of all."""
    alone = estimate(case_of(tmp_path, BLOCK), 100, TABLE)
    coupled = estimate(case_of(tmp_path, CHANNEL_AND_POST), 100, TABLE)
    assert alone is not None
    assert coupled is not None
    assert alone.step == pytest.approx(0.02)
    assert coupled.step == pytest.approx(3 * (0.01 + 0.0693))  # 693 unknowns of the fluid
    assert coupled.unknowns == 793


def test_words():
    assert describe_cost(Cost(12_345, 0.0042, 218.0), 1) == (
        "about 12,345 unknowns, 4.2 ms per step, 220 MB, on one process (accurate to a factor of about three)"
    )
    assert "12 s per step, 33 h for all, 2.4 GB" in describe_cost(Cost(1, 12.0, 2400.0), 10_000)
    assert "0.5 s per step, 4 min for all" in describe_cost(Cost(1, 0.5, 100.0), 500)


def test_more_memory_than_the_machine_has(tmp_path):
    """With what the other element needs."""
    box = "{from: [0, 0, 0], to: [3, 1, 1], cells: [144, 48, 48]}"
    faces = "{walls: {on: [x-, x+, y-, y+, z-, z+], no_slip: true}}"
    fluid = f"fluid: {{density: 1, viscosity: 1, grid: {box}, patches: {faces}}}"
    case = case_of(tmp_path, f"title: Box\ntime: {{step: 1, end: 1}}\n{fluid}\n")
    (told,) = too_much_memory(case, {}, 24_000.0)
    words = (
        r"the run needs about \d{3} GB, and this machine has 24 GB: take fewer cells, or 'element: q1q1', which needs"
    )
    assert re.match(words, told)
    assert too_much_memory(case, {}, 1e6) == []


def test_check_says_it(tmp_path):
    (tmp_path / "case.yaml").write_text(PLATE)
    done = fsci("check", tmp_path)
    assert "  estimate: about 18 unknowns, " in done.stdout
    assert done.stdout.endswith("ok\n")


def test_numbers_of_this_machine(tmp_path, monkeypatch):
    """Those of `fsci bench cost` if they are there and complete, else those that come with the program."""
    path = tmp_path / "cost.json"
    monkeypatch.setattr(cost, "OWN_COSTS", path)
    assert cost.costs() is MEASURED
    rows = [{"kind": kind, "dofs": 10, "step [s]": 1.0, "memory [MB]": 100.0} for kind in MEASURED]
    path.write_text(json.dumps({"results": {"cost": rows}}))
    assert cost.costs() == {kind: [(10, 1.0, 100.0)] for kind in MEASURED}
    path.write_text(json.dumps({"results": {"cost": rows[1:]}}))
    assert cost.costs() is MEASURED
    path.write_text("no JSON")
    assert cost.costs() is MEASURED


def test_every_kind_is_measured():
    assert MEASURED.keys() == {
        "structure 2D", "structure 3D", "coupled", "contact",
        *(f"fluid {dim}D {element}" for dim in (2, 3) for element in ("q1q1", "q2q1")),
    }  # fmt: skip
    for points in MEASURED.values():
        assert all(a[0] < b[0] for a, b in itertools.pairwise(points))
