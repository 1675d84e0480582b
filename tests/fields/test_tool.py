"""A given force presses a curved tool on a block, from above it: as the moved tool that needs this force."""

import numpy as np
import pytest

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

CASE = """\
time: {{step: 0.25, end: 1}}
structure:
  bodies:
    block:
      mesh: {{shape: {block}}}
      material: {{law: neo_hooke, E: 1000, nu: 0.3}}
      supports: [{{on: bottom, displacement: {zero}}}]
contact:
  friction: {{coefficient: {friction}}}
  obstacles: {{tool: {{mesh: {{shape: {tool}}}, {way}}}}}
  pairs: {{press: {{slave: {{body: block, on: top}}, master: {{obstacle: tool}}}}}}
probes: {{clamp: {{field: structure, body: block, quantity: reaction, on: bottom}}{more}}}
solver: {{newton: {{residual: 1.0e-12}}}}
output: {{fields_every: 0}}
"""
PLANE = {
    "block": "rectangle, size: [1, 0.5], cells: [10, 5], origin: [-0.5, 0]",
    "tool": "disc, radius: 0.3, cells: [48, 1], translate: [0.013, {height}]",
    "zero": "[0, 0]",
}
SPACE = {
    "block": "box, size: [1, 1, 0.5], cells: [5, 5, 3], origin: [-0.5, -0.5, 0]",
    "tool": "sphere, radius: 0.3, cells: [4, 1], translate: [0.013, 0.02, {height}]",
    "zero": "[0, 0, 0]",
}
CENTRE = ", centre: {field: rigid, body: tool, quantity: centre}"


def run(folder, scene, height, friction, way, more=""):
    """(forces on the block, heights of the tool) after each load step; way: of the tool along the last axis."""
    text = CASE.format(**(scene | {"tool": scene["tool"].format(height=height)}), friction=friction, way=way, more=more)
    path = folder / "case.yaml"
    path.write_text(text)
    assert run_case(load_case(path), folder / "out") == FINISHED
    history, axes = read_history(folder / "out" / "history.csv"), "xyz"[: 2 if scene is PLANE else 3]
    force = np.array([history[f"contact.press.{axis}"] for axis in axes])
    assert np.abs(force + [history[f"clamp.{axis}"] for axis in axes]).max() < 1e-8 * np.abs(force).max()
    return force, history[f"centre.{axes[-1]}"] if more else None


def along(formula, scene):
    return f'[0, "{formula}"]' if scene is PLANE else f'[0, 0, "{formula}"]'


def through(values):
    """A formula that has these values at the ends of the four load steps, zero at the start."""
    times = [0.25 * n for n in range(len(values) + 1)]
    rises = np.diff([0.0, *values]).tolist()
    return " + ".join(f"{rise!r}*ramp(t, {a}, {b})" for rise, a, b in zip(rises, times, times[1:], strict=False))


@pytest.mark.parametrize("friction", [0, 0.3])
@pytest.mark.parametrize("scene", [PLANE, SPACE], ids=["plane", "space"])
def test_a_force_presses_as_the_moved_tool_that_needs_it(tmp_path, scene, friction):
    """The same steps one way and the other: force and way, to 1e-8; and from a gap of ten facets, without friction."""
    held = "[x, rotation]" if scene is PLANE else "[x, y, rotation]"
    force, _ = run(tmp_path, scene, 0.8, friction, f"motion: {along('-0.04*t', scene)}")
    free = f"free: {{density: 1, held: {held}, loads: [{{force: {along(through(force[-1]), scene)}}}]}}"
    pressed, heights = run(tmp_path, scene, 0.8, friction, free, CENTRE)
    assert np.abs(pressed - force).max() < 1e-8 * np.abs(force).max()
    assert heights == pytest.approx(0.8 - 0.04 * np.array([0.25, 0.5, 0.75, 1.0]), rel=1e-8)
    if not friction:
        pressed, below = run(tmp_path, scene, 1.8, friction, free, CENTRE)
        # the step that closes the gap integrates over facets that are farther apart, too
        assert np.abs(pressed - force)[:, 1:].max() < 1e-8 * np.abs(force).max()
        assert pressed[-1] == pytest.approx(force[-1], rel=1e-8)
        assert below[1:] == pytest.approx(heights[1:], rel=1e-8)
