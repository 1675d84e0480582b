"""What free bodies and the fluid press on floors and obstacles: the weight less the fluid's force, and rho g h."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from fsci.builder.build import build
from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, resume_run, run_case
from solvers.timing import Timer

#: Two discs, one of which lies on a table in the flow, the other on the floor.
DISCS = """\
time: {step: 0.02, end: 0.8}
fluid:
  density: 1
  viscosity: 0.5
  element: q1q1
  gravity: [0, -10]
  scheme: RULE
  grid: {from: [0, 0], to: [1.2, 0.8], cells: [16, 10]}
  patches: {top: {on: y+, outflow: true}, sides: {on: [x-, x+], no_slip: true}, floor: {on: y-, no_slip: true}}
  bodies:
    table: {mesh: {shape: rectangle, size: [0.33, 0.15], cells: [1, 1], origin: [0.7, 0.13]}}
    heavy: {mesh: {shape: disc, radius: 0.15, cells: [24, 1], translate: [0.308, 0.16], rotate: {angle: 7.5}},
            free: {density: 8}}
    light: {mesh: {shape: disc, radius: 0.12, cells: [24, 1], translate: [0.87, 0.399], rotate: {angle: 7.5}},
            free: {density: 3}}
coupling: {scheme: SCHEME}
probes:
  heavy_mass: {body: heavy, quantity: mass}
  light_mass: {body: light, quantity: mass}
  on_heavy: {field: fluid, body: heavy, quantity: force}
  on_light: {field: fluid, body: light, quantity: force}
  floor: {quantity: contact_force, on: floor}
  table: {quantity: contact_force, on: table}
  sides: {quantity: contact_force, on: sides}
  by_heavy: {quantity: contact_force, on: floor, body: heavy}
  by_light: {quantity: contact_force, on: floor, body: light}
  wet_floor: {quantity: force, on: floor}
  wet_left: {quantity: force, on: sides}
output: {fields_every: 0}
"""
BALL = """\
time: {step: 0.02, end: 0.3}
fluid:
  density: 1
  viscosity: 0.5
  element: q1q1
  gravity: [0, 0, -10]
  scheme: backward_euler
  grid: {from: [0, 0, 0], to: [0.6, 0.6, 0.5], cells: [6, 6, 5]}
  patches: {top: {on: z+, outflow: true}, sides: {on: [x-, x+, y-, y+], no_slip: true}, floor: {on: z-, no_slip: true}}
  bodies:
    ball: {mesh: {shape: sphere, radius: 0.15, cells: [3, 1], translate: [0.31, 0.28, 0.1501]}, free: {density: 8, held: [rotation]}}
coupling: {scheme: monolithic}
probes:
  mass: {body: ball, quantity: mass}
  on_ball: {field: fluid, body: ball, quantity: force}
  floor: {quantity: contact_force, on: floor}
  wet_floor: {quantity: force, on: floor}
output: {fields_every: 0}
"""  # noqa: E501


def run(folder, text: str) -> dict[str, np.ndarray]:
    folder.mkdir(exist_ok=True)
    path, out = folder / "case.yaml", folder / "out"
    path.write_text(text)
    assert run_case(load_case(path), out) == FINISHED
    return read_history(out / "history.csv")


@pytest.mark.parametrize(
    ("rule", "scheme"), [("backward_euler", "monolithic"), ("bdf2", "monolithic"), ("backward_euler", "partitioned")]
)
def test_floor_and_table_carry_what_the_fluid_does_not(tmp_path, rule, scheme):
    found = run(tmp_path, DISCS.replace("RULE", rule).replace("SCHEME", scheme))
    for probe, body in (("floor", "heavy"), ("table", "light")):
        load = found[f"on_{body}.y"][-1] - 10.0 * found[f"{body}_mass"][-1]
        assert found[f"{probe}.y"][-1] == pytest.approx(load, rel=1e-6)
        assert found[f"{probe}.y"] == pytest.approx(-found[f"contact.on_{body}.y"], rel=1e-12, abs=1e-12)
        assert found[f"{probe}.x"][-1] == pytest.approx(0.0, abs=1e-6 * abs(load))
    assert not found["sides.x"].any()
    assert not found["by_light.y"].any()
    assert np.array_equal(found["by_heavy.y"], found["floor.y"])
    assert found["wet_floor.y"][-1] == pytest.approx(-10.0 * 0.8 * 1.2, rel=1e-5)


def test_a_floor_in_space(tmp_path):
    found = run(tmp_path, BALL)
    load = found["on_ball.z"][-1] - 10.0 * found["mass"][-1]
    assert found["floor.z"][-1] == pytest.approx(load, rel=1e-6)
    assert found["wet_floor.z"][-1] == pytest.approx(-10.0 * 0.5 * 0.36, rel=1e-3)


def test_a_resumed_run_has_the_same_forces(tmp_path):
    text = (
        DISCS.replace("RULE", "bdf2")
        .replace("SCHEME", "monolithic")
        .replace("end: 0.8", "end: END")
        .replace("0.16]", "0.149]")
    )
    whole = run(tmp_path / "whole", text.replace("END", "0.12"))
    run(tmp_path / "parts", text.replace("END", "0.06"))
    assert resume_run(tmp_path / "parts" / "out", [("time.end", "0.12")]) == FINISHED
    found = read_history(tmp_path / "parts" / "out" / "history.csv")
    for column in ("floor.y", "table.y", "wet_floor.x", "wet_floor.y"):
        assert whole[column].any()
        assert np.array_equal(found[column], whole[column])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("on: floor", "on: flor", "22:40: there is no obstacle, given body or patch 'flor'; did you mean 'floor'?"),
        ("on: floor", "on: light", "22:40: there is no obstacle, given body or patch 'light' (available: table, top, "),
        ("on: floor", "on: top", "22:40: free bodies do not touch 'top' (available: table, sides, floor)"),
        ("body: heavy", "body: heavi", "25:56: unknown free body 'heavi'; did you mean 'heavy'?"),
        ("force, on: floor}", "force, on: floor, body: heavy}", "27:49: quantity 'force' of the fluid is not measured"),
    ],
)
def test_mistakes_are_located(tmp_path, old, new, words):
    text = DISCS.replace("RULE", "bdf2").replace("SCHEME", "monolithic")
    start = text.index("wet_floor" if old.startswith("force") else "  by_heavy" if "body" in old else "  floor:")
    (tmp_path / "case.yaml").write_text(text[:start] + text[start:].replace(old, new, 1))
    with pytest.raises(CaseError) as raised:
        build(load_case(tmp_path / "case.yaml"), MPI.COMM_SELF, Timer())
    assert words in str(raised.value)


def test_without_contact_there_is_no_force(tmp_path):
    text = DISCS.replace("RULE", "bdf2").replace("SCHEME", "monolithic") + "contact: none\n"
    (tmp_path / "case.yaml").write_text(text)
    with pytest.raises(CaseError, match="free bodies do not touch 'floor'"):
        build(load_case(tmp_path / "case.yaml"), MPI.COMM_SELF, Timer())
