"""An elastic plate on a floor under two free discs, all found by `bodies: all`: statics by hand, in any order."""

import numpy as np
import pytest

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

PLATE = """\
    plate:
      mesh: {shape: rectangle, size: [2, 0.3], cells: [24, 4]}
      material: {law: neo_hooke, E: 2.0e+5, nu: 0.3, density: 50}
      gravity: [0, -10]
      supports: [{on: left, displacement: [0, null]}]
"""
DISC = """\
    {name}:
      mesh: {{shape: disc, radius: 0.2, cells: [24, 1], translate: [{x}, {y}]}}
      density: {density}
      held: [x, rotation]
"""
CASE = """\
time: {{step: 1, end: 1}}
structure:
  bodies:
{plate}rigid:
  gravity: [0, -10]
  bodies:
{discs}contact:
  bodies: all
  obstacles: {{floor: {{mesh: {{shape: rectangle, size: [4, 0.5], origin: [-1, -0.5], cells: [4, 1]}}, on: top}}}}
solver: {{newton: {{residual: 1.0e-11}}}}
output: {{fields_every: 0}}
"""
AREA = 12.0 * 0.2**2 * np.sin(2.0 * np.pi / 24)


def lowest(x):
    """Height of the middle of a disc at x that touches the plate, above this: by the facet over its corner."""
    angles = 2.0 * np.pi * np.arange(-6, 7) / 24
    return float(np.interp(max(0.0, x - 2.0), 0.2 * np.sin(angles), 0.2 * np.cos(angles)))


def settled(folder, x, order=(0, 1), above=0.0005):
    """Contact forces along y by pair at the end."""
    heights = [0.3 + above + lowest(at) for at in x]
    discs = [("one", x[0], heights[0], 100), ("two", x[1], heights[1], 160)]
    text = "".join(
        DISC.format(name=name, x=at, y=y, density=density) for name, at, y, density in (discs[k] for k in order)
    )
    folder.mkdir()
    (folder / "case.yaml").write_text(CASE.format(plate=PLATE, discs=text))
    assert run_case(load_case(folder / "case.yaml"), folder / "out") == FINISHED
    history = read_history(folder / "out" / "history.csv")
    return {name: float(history[name][-1]) for name in history if name.startswith("contact.") and name[-2:] == ".y"}


@pytest.mark.parametrize("x", [(0.6, 1.4), (0.6, 2.0), (0.6, 2.08)], ids=["on it", "on its corner", "beyond it"])
def test_contact_carries_the_weights(tmp_path, x):
    """Of both discs, and theirs with that of the plate on the floor; whichever body is first in the file."""
    weights = {"one": 1000.0 * AREA, "two": 1600.0 * AREA}
    known = settled(tmp_path / "first", x)
    for name, weight in weights.items():
        on_plate = sum(force for pair, force in known.items() if pair.startswith("contact.plate_") and name in pair)
        assert known[f"contact.on_{name}.y"] == pytest.approx(weight, rel=1e-6)
        assert on_plate == pytest.approx(-weight, rel=1e-6)
    assert known["contact.plate_bottom_floor.y"] == pytest.approx(sum(weights.values()) + 300.0, rel=1e-6)
    other = settled(tmp_path / "other", x, (1, 0))
    assert other == pytest.approx(known, abs=1e-9 * 623.0, rel=0.0)


@pytest.mark.parametrize("above", [-0.002, 0.0, 0.02])
def test_where_they_begin_does_not_matter(tmp_path, above):
    """Bodies that nothing holds fall onto the plate, or are pushed out of it."""
    assert settled(tmp_path / "other", (0.6, 1.4), above=above) == pytest.approx(
        settled(tmp_path / "first", (0.6, 1.4)), abs=1e-9 * 623.0, rel=0.0
    )
