"""Contact under pressure: closed contact is dry, it carries the load and the pressure of the fluid around it."""

from __future__ import annotations

import numpy as np
import pytest
from fluid_setup import block, body, field, make_fluid, solve_steady
from programs import fsci

from fsci.run.history import read_history
from solvers.fluid.grid import uniform
from solvers.fluid.patches import Patch

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
