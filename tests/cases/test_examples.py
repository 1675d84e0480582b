"""The examples of the library page run as they stand and print what they should."""

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from programs import on_processes

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"


def numbers(name: str, *arguments: Path) -> list[list[float]]:
    """The numbers of each line that an example prints."""
    done = on_processes(1, EXAMPLES / f"{name}.py", *arguments)
    return [
        [float(text) for text in re.findall(r"-?\d+\.?\d*(?:e[+-]?\d+)?", line)] for line in done.stdout.splitlines()
    ]


def test_all_are_tested_and_shown():
    names = {path.stem for path in EXAMPLES.glob("*.py")}
    library = {
        "cylinder", "flap", "hertz", "own_material", "own_probe", "torus_and_wall", "two_blocks",
    }  # fmt: skip
    assert names == {*library, "case_file"}
    page = (EXAMPLES.parent / "library.md").read_text()
    assert all(f"examples/{name}.py" in page for name in names)
    assert all(f"pictures/{name}_example.png" in page for name in library)
    drawn = (EXAMPLES.parent / "draw_examples.py").read_text()
    assert set(re.findall(r"^def (\w+)\(found", drawn, re.MULTILINE)) == library


def test_case_file():
    """The tip as the tutorial says; with half of the pressure as in half of the time."""
    lines = numbers("case_file")
    tips = [line for line in lines if len(line) in (2, 3) and 0.0 < line[0] <= 1.0 and line[1] < 1.0]
    halves, whole = tips[-7:-3], tips[-3:]
    assert [line[0] for line in halves] == [0.25, 0.5, 0.75, 1.0]
    assert [line[0] for line in whole] == [0.25, 0.5, 0.75]
    assert whole[0][1] == pytest.approx(halves[1][1], rel=1e-4)
    assert whole[1][1] == pytest.approx(halves[3][1], rel=1e-4)
    assert lines[-1] == [105.0, 3.0, 105.0, 3.0]


def test_two_blocks():
    """In every step all nodes touch, and the force grows a little faster than the displacement."""
    lines = numbers("two_blocks")
    times, steps, active, force = zip(*lines, strict=True)
    assert times == (0.25, 0.5, 0.75, 1.0)
    assert set(active) == {8.0}
    assert max(steps) <= 4
    stiffness = [f / t for f, t in zip(force, times, strict=True)]
    assert all(1.0 < after / before < 1.05 for before, after in pairwise(stiffness))


def run(name: str, *changes: tuple[str, str]) -> dict:
    """What an example has in the end, with some of its words replaced."""
    text = (EXAMPLES / f"{name}.py").read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    found: dict = {}
    exec(compile(text, name, "exec"), found)
    return found


def test_flap():
    """The flap bends with the flow and sinks as it does.

    The force on it is what the momentum of the fluid says.
    """
    lines = numbers("flap")
    assert len(lines) == 20
    assert max(line[1] for line in lines) <= 6
    *_, x, y = lines[-1]
    assert x > 0.05
    assert y < 0.0
    assert all(line[3] <= 1e-12 for line in lines[3:])


@pytest.mark.slow
def test_flap_field_by_field():
    """It bends as far, as the page says."""
    *_, x, y = numbers("flap")[-1]
    tighter = ("Partitioned(coupled)", "Partitioned(coupled, tolerance=FixedPointTolerance(1e-8))")
    other = run(
        "flap",
        (
            "import Monolithic, couple",
            "import Partitioned, couple\nfrom coupling.partitioned import FixedPointTolerance",
        ),
        ("Monolithic(coupled)", "Partitioned(coupled)"),
        tighter,
    )
    tip = other["structure"].now.u.reshape(-1, 2)[other["tip"]]
    assert tip == pytest.approx((x, y), rel=1e-5)
    assert other["coupled"].balance.momentum < 1e-6 * np.abs(other["coupled"].force().sum(axis=0)).max()


def test_own_material():
    """Nearly incompressible: the stress of the incompressible bar within its compressibility."""
    for _, stress, exact in numbers("own_material"):
        assert stress == pytest.approx(exact, rel=5e-4)


def test_own_probe():
    """Small strains: the stress is that of the reference configuration within 1e-4."""
    for _, stress, exact in numbers("own_probe"):
        assert stress == pytest.approx(exact, rel=2e-4)


def test_hertz(tmp_path):
    """The largest pressure is Hertz's for the force there is."""
    picture = tmp_path / "hertz.png"
    lines = numbers("hertz", picture)
    _, pressure, exact = lines[-1]
    assert pressure == pytest.approx(exact, rel=0.03)
    assert picture.stat().st_size > 5_000


@pytest.mark.slow
def test_torus_and_wall(capsys):
    """The flow brings the torus down; no node goes deeper than the weighted gap lets it.

    The force on it is what the momentum of the fluid says, and what inertia and contact of the torus take.
    """
    found = run("torus_and_wall")
    gaps = [float(line.split("gap ")[1].split()[0]) for line in capsys.readouterr().out.splitlines()]
    assert gaps[0] > 0.03
    assert min(gaps) > -0.005
    assert min(gaps) < 0.01
    balance, force = found["coupled"].balance, found["coupled"].force().sum(axis=0)
    assert balance.momentum < 1e-6 * abs(force[2])
    assert balance.force < 1e-6


@pytest.mark.slow
def test_cylinder():
    """Schafer & Turek's 2D-1."""
    _, _, drag, lift = numbers("cylinder")[0]
    assert drag == pytest.approx(5.579535, rel=2e-3)
    assert lift == pytest.approx(0.010619, rel=3e-2)
