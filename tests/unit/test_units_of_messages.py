"""Messages have the units of the case: solvers, which know none, mark what a number is."""

import ast
import re
from pathlib import Path

import pytest
from case_mistakes import load

from fsci.case.units import MARKS, Units
from fsci.running.watch import Watched
from solvers.api import FailureKind, Finding, StepFailed, StepInfo
from solvers.timing import Timer

ROOT = Path(__file__).parents[2]
SI, TONNES, GRAMS = {}, {"length": "mm", "mass": "t"}, {"length": "cm", "mass": "g", "time": "ms"}
#: A number with a unit behind it, as in f"{depth} m behind".
WITH_UNIT = re.compile(r"\{\} (m|J|N|Pa|W|kg|m\^.)(?![A-Za-z0-9])")
#: A bracket with a single word, which does not belong to the keys of a dictionary.
MARK = re.compile(r"\{\} \[([a-z]+)\]")


@pytest.mark.parametrize(
    ("units", "dimension", "expected"),
    [
        (SI, 3, "m, m^3, N, kg m/s, J, Pa"),
        (SI, 2, "m, m^2, N/m, kg/s, J/m, Pa"),
        (TONNES, 3, "mm, mm^3, N, t mm/s, mJ, MPa"),
        (TONNES, 2, "mm, mm^2, N/mm, t/s, mJ/mm, MPa"),
        (GRAMS, 3, "cm, cm^3, g cm/ms^2, g cm/ms, g cm^2/ms^2, g/cm ms^2"),
    ],
)
def test_units_of_all_marks(units, dimension, expected):
    text = ", ".join(f"[{mark}]" for mark in MARKS)
    assert Units(**units).worded(text, dimension) == expected


def test_other_brackets_stay():
    assert Units().worded("entry [0] of 'on: [left]', 3 [area]", 2) == "entry [0] of 'on: [left]', 3 [area]"


def texts_of(path):
    """All formatted texts of a file, values as {}."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.JoinedStr):
            yield "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)


def test_solvers_name_no_units():
    texts = [
        text for folder in ("solvers", "coupling") for path in (ROOT / folder).rglob("*.py") for text in texts_of(path)
    ]
    assert [text for text in texts if WITH_UNIT.search(text)] == []
    used = {mark for text in texts for mark in MARK.findall(text)}
    assert used - set(MARKS) == set()
    assert used >= {"length", "volume", "energy", "force", "impulse"}


class Leaking:
    """A scheme and its sentinel; the second step fails."""

    def step(self, t, dt):
        if t > 0.0:
            raise StepFailed("structure", FailureKind.NOT_HELD, "ball has come 0.2 [length] behind y-", iteration=3)
        return StepInfo(1, (0.0,))

    def look(self, t, dt):
        return [Finding("mass", "fluid", 0.2, "0.2 [volume] of fluid were lost")]


CASE = """\
units: {length: mm, mass: t}
time: {step: 1, end: 2}
structure:
  bodies:
    bar:
      mesh: {shape: rectangle, size: [2, 1], cells: [1, 1]}
      material: {law: neo_hooke, E: 1, nu: 0}
      supports: [{on: left, displacement: [0, 0]}]
"""


@pytest.mark.usefixtures("in_new_folder")
def test_findings_and_failures_of_a_run():
    watched = Watched(Leaking(), {"leak": Leaking()}, Timer(), load(CASE).worded)
    (found,) = watched.step(0.0, 1.0).findings
    assert (found.message, found.value) == ("0.2 mm^2 of fluid were lost", 0.2)
    with pytest.raises(StepFailed, match=r"^structure: ball has come 0\.2 mm behind y- at iteration 3$") as failed:
        watched.step(1.0, 1.0)
    assert failed.value.kind is FailureKind.NOT_HELD
