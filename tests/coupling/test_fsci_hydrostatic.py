"""Contact under pressure: closed contact is dry, it carries the load and the pressure of the fluid around it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from fluid_setup import block, body, field, make_fluid, solve_steady
from programs import fsci

from fsci.running.history import read_history
from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.boundary.patches import Patch

PRESSURE = 7.0


@pytest.mark.parametrize("gap", [1e-1, 1e-3, 1e-6, 1e-9, 1e-12, 1e-17, 0.0, -1e-17, -1e-9, -1e-3])
def test_a_facet_on_the_wall_is_dry(gap):
    """A block above the bottom of a basin: under it is fluid, or nothing; what decides is not rounding."""
    h, left, right = 0.1, 0.33, 0.61
    sides = [Patch("top", ("y+",), "traction", field(0, -PRESSURE)), Patch("sides", ("x-", "x+"), "slip")]
    bottom = Patch("bottom", ("y-",), "no_slip")
    rigid = body("block", *block([left, gap], [right, 0.47]))
    fluid = make_fluid(uniform([0, 0], [1, 1], [10, 10]), [*sides, bottom], [rigid], scheme="steady")
    solve_steady(fluid)
    force = fluid.force()["block"].sum(axis=0)
    dry = gap <= 1e-6 * h
    assert force == pytest.approx([0.0, -PRESSURE * (right - left) if dry else 0.0], abs=1e-7 if gap > 0 else 1e-12)


def test_block_pressed_and_lifted(tmp_path):
    """Closed: F + p A to 1e-9, A of the deformed block. It lets go between the steps around F = -p A."""
    run = fsci("run", "cases/hydrostatic_contact", "-o", tmp_path, "--set", "output.fields_every=0")
    assert run.returncode == 0, run.stdout[-2000:]
    history = read_history(tmp_path / "history.csv")
    t, area, contact = history["time"], 0.33 + history["corner.x"], history["contact.bottom.y"]
    pressed = int(np.argmin(np.abs(t - 1.0)))
    assert contact[pressed] == pytest.approx(2.0 * 0.33 + PRESSURE * area[pressed], rel=1e-9)
    closed = history["contact.active"] > 0
    opened = int(np.flatnonzero(~closed)[0])
    lift = 1.0 + (2.0 + PRESSURE * area[opened - 1] / 0.33) / 9.7
    assert t[opened - 1] < lift + 0.01
    assert t[opened] > lift
    assert not closed[opened:].any()
    assert history["block.y"][-1] > history["block.y"][pressed] + 5e-4
    assert np.abs(history["fluid.mass"]).max() < 1e-9  # what comes under it


@pytest.mark.slow
def test_a_resolved_film_does_not_let_a_smooth_block_go(tmp_path):
    """Stefan: a step of backward Euler leads to g = 2 L (mu / (p dt))^(1/2), 5 m. The fluid in a layer lets it go.

    Then contact carries F alone.
    """
    settings = ("--set", "fluid.element=q2q1", "--set", "output.fields_every=0")
    smooth = fsci("run", "cases/hydrostatic_contact", "-o", tmp_path / "smooth", *settings)
    assert smooth.returncode != 0
    assert "'contact.film.roughness' lets fluid between flat surfaces that part" in smooth.stdout + smooth.stderr
    fsci(
        "run", "cases/hydrostatic_contact", "-o", tmp_path / "layer", *settings,
        "--set", "contact.film.transmissivity=1e-6",
    )  # fmt: skip
    history = read_history(tmp_path / "layer" / "history.csv")
    t, contact = history["time"], history["contact.bottom.y"]
    assert t[-1] == pytest.approx(2.05)
    assert np.diff(t)[1:] == pytest.approx(0.05)
    assert contact[np.argmin(np.abs(t - 1.0))] == pytest.approx(2.0 * 0.33, rel=1e-6)
    assert history["contact.active"][-1] == 0


#: (until [s], pressure on the block [Pa]) above that at which it lets go; each is reached within 0.2 s.
LOADS = ((1.0, 2.0), (2.0, 0.5))


@pytest.mark.parametrize("zone", ["dry", "wetted"])
@pytest.mark.parametrize("processes", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_load_at_which_it_lets_go(zone, processes, tmp_path):
    """At rest contact carries F + p A (dry) or F (wetted) to 1e-8 p A, down to F near -p A and near 0.

    Then it is pulled up, and lets go in the step after its load has become zero.
    """
    base = 0.0 if zone == "wetted" else -PRESSURE
    steps = [f"{a - b!r}*min(max(t - {end}, 0)/0.2, 1)" for (end, a), (_, b) in pairwise(LOADS)]
    value = " + ".join([f"{-2.0 - base!r}*min(t/0.1, 1)", *steps, "max(t - 2, 0)"])
    settings = {
        "contact.film.zone": zone,
        "output.fields_every": 0,
        "verify": "[]",
        "time.end": 2.7,
        "structure.bodies.block.tractions": f'[{{on: top, value: [0, "{value}"]}}]',
    }
    options = [part for name, new in settings.items() for part in ("--set", f"{name}={new}")]
    done = fsci("run", "cases/hydrostatic_contact", "-o", tmp_path, *options, processes=processes, timeout=500)
    assert done.returncode == 0, done.stdout[-2000:]
    assert "repeated" not in done.stdout
    history = read_history(tmp_path / "history.csv")
    t, area, contact = history["time"], 0.33 + history["corner.x"], history["contact.bottom.y"]
    scale = PRESSURE * 0.33
    for end, load in LOADS:
        at = int(np.argmin(np.abs(t - end)))
        expected = 0.33 * (load + base) + (0.0 if zone == "wetted" else PRESSURE * area[at])
        assert contact[at] == pytest.approx(expected, abs=1e-8 * scale)
    if zone == "wetted":
        opened = t[np.flatnonzero(history["contact.active"] == 0)[0]]
        assert 2.5 < opened < 2.5 + 1.01 * 0.05
