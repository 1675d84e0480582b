"""Bodies that overlap at the start, by any depth: the first step closes it with the force of the bodies' strain."""

import json

import numpy as np
import pytest
from contact_cases import run

from fsci.case import CaseError, load_case
from fsci.check.meshes import check_meshes

BLOCKS = """\
time: {{step: {step}, end: 1}}
structure:
  bodies:
    lower:
      mesh: {{shape: rectangle, size: [{size}, {size}], cells: [{lower}, {lower}], cell: {cell}, order: {order}}}
      material: {{law: st_venant_kirchhoff, E: 1000, nu: 0, density: 1}}
      supports: [{{on: bottom, displacement: [null, 0]}}, {{on: left, symmetry: true}}]
    upper:
      mesh:
        shape: rectangle
        size: [{size}, {size}]
        cells: [{upper}, {upper}]
        cell: {cell}
        order: {order}
        origin: [0, {height}]
      material: {{law: st_venant_kirchhoff, E: 1000, nu: 0, density: 1}}
      supports: [{{on: top, displacement: [null, 0]}}, {{on: left, symmetry: true}}]
contact:
  pairs:
    p: {{slave: {{body: {slave}}}, master: {{body: {master}}}{settings}}}
probes:
  gap: {{quantity: gap, pair: p}}
  overlap: {{quantity: overlap, pair: p}}
  force: {{quantity: reaction, body: lower, on: bottom}}
  energy: {{quantity: energy}}
solver: {{newton: {{residual: 1.0e-10, max_iterations: 30}}}}
"""

SIDES = {"upper": ("upper, on: bottom", "lower, on: top"), "lower": ("lower, on: top", "upper, on: bottom")}


def blocks(depth, slave="upper", size=1.0, lower=4, upper=4, cell="quad", order=1, step=1, settings=""):
    """Two squares, the upper one so much too low, relative to their size."""
    of_slave, of_master = SIDES[slave]
    values = {"height": size * (1.0 - depth), "slave": of_slave, "master": of_master, "settings": settings}
    return BLOCKS.format(**values, size=size, lower=lower, upper=upper, cell=cell, order=order, step=step)


def stress(depth):
    """Nominal stress [Pa] of St. Venant-Kirchhoff's law where each of two blocks is compressed by half of the depth."""
    stretch = 1.0 - 0.5 * depth
    return 0.5 * 1000.0 * stretch * (1.0 - stretch**2)


@pytest.mark.parametrize("slave", SIDES)
@pytest.mark.parametrize(
    ("depth", "how"),
    [
        (0.3, {}),
        (0.3, {"size": 1e-3}),
        (0.3, {"upper": 7}),
        (0.3, {"upper": 3, "lower": 8}),
        (0.3, {"cell": "tri", "order": 2}),
        (0.3, {"step": 0.25}),
        (0.1, {}),
        (0.55, {"upper": 8, "lower": 8}),
    ],
)
def test_blocks_part(depth, how, slave, tmp_path):
    history = run(blocks(depth, slave, **how), tmp_path)
    size = how.get("size", 1.0)
    np.testing.assert_allclose(history["force.y"], stress(depth) * size, rtol=1e-6)
    np.testing.assert_allclose(np.abs(history["contact.p.y"]), stress(depth) * size, rtol=1e-6)
    np.testing.assert_allclose(history["overlap"], 0.0, atol=1e-9 * size)
    np.testing.assert_allclose(history["gap"], 0.0, atol=1e-9 * size)


DIES = """\
time: {step: 1, end: 1}
structure:
  bodies:
    block:
      mesh: {shape: box, size: [1, 1, 1], cells: [3, 2, 4]}
      material: {law: st_venant_kirchhoff, E: 1000, nu: 0}
      supports: [{on: bottom, displacement: [0, 0, 0]}]
contact:
  obstacles:
    die: {mesh: {shape: box, size: [3, 3, 2], cells: [1, 1, 1], translate: [-1, -1, 0.6]}, on: [bottom, top]}
  pairs:
    p: {slave: {body: block, on: top}, master: {obstacle: die}}
probes: {foot: {quantity: reaction, on: bottom}, overlap: {quantity: overlap, pair: p}}
"""


def test_an_obstacle_in_space(tmp_path):
    """A die that reaches 0.4 into a block of cells of 0.25, in space. Its far side is no master."""
    history = run(DIES, tmp_path)
    assert history["foot.z"][-1] == pytest.approx(0.5 * 1000 * 0.6 * (1 - 0.6**2), rel=1e-6)
    assert history["overlap"][-1] == pytest.approx(0.0, abs=1e-9)
    with_motion = DIES.replace("translate: [-1, -1, 0.6]}, on", "translate: [-1, -1, 0.9]}, motion: [0, 0, -0.3], on")
    moved = run(with_motion, tmp_path / "moved")
    assert moved["foot.z"][-1] == pytest.approx(history["foot.z"][-1], rel=1e-9)


def test_the_far_side_of_a_thin_body_is_no_master(tmp_path):
    """Closed surfaces on both sides: a plate overlaps a block by less than it is thick, and its back is free."""
    text = DIES.replace("size: [3, 3, 2]", "size: [3, 3, 0.5]").replace("on: [bottom, top]}", "on: [bottom, top]}")
    assert run(text, tmp_path)["foot.z"][-1] == pytest.approx(0.5 * 1000 * 0.6 * (1 - 0.6**2), rel=1e-6)


def test_the_first_step_of_a_motion_closes_it(tmp_path):
    """In dynamics, too, and with friction; then nothing overlaps and no energy comes from nothing."""
    text = blocks(0.3, step=0.05, settings=", friction: {coefficient: 0.2}").replace(
        "structure:\n", "structure:\n  dynamics: {rho_inf: 0.5}\n"
    )
    history = run(text, tmp_path)
    assert np.abs(history["overlap"]).max() < 0.02
    assert history["energy.total"][1:].max() <= history["energy.total"][0] * 1.02


# ------------------------------------------------------------------------------------------------------ interference

HUB = """\
time: {step: 0.5, end: 1}
structure:
  bodies:
    shaft:
      mesh: {shape: ring, inner_radius: 0.4, outer_radius: OUTER, cells: [24, 6], angle: 90, order: 2}
      material: {law: st_venant_kirchhoff, E: 1000, nu: 0}
      kinematics: linear
      supports: [{on: [start, end], symmetry: true}]
    hub:
      mesh: {shape: ring, inner_radius: 1, outer_radius: 2, cells: [20, 8], angle: 90, order: 2}
      material: {law: st_venant_kirchhoff, E: 3000, nu: 0}
      kinematics: linear
      supports: [{on: [start, end], symmetry: true}]
contact:
  pairs:
    fit: {SIDESSETTINGS}
probes:
  least: {quantity: pressure, pair: fit, extreme: least}
  largest: {quantity: pressure, pair: fit}
"""

FITS = {
    "shaft": "slave: {body: shaft, on: outer}, master: {body: hub, on: inner}",
    "hub": "slave: {body: hub, on: inner}, master: {body: shaft, on: outer}",
}


def lame(interference):
    """Pressure [Pa] of a press fit (Lame), radii 0.4, 1 and 2, moduli 1000 and 3000, nu = 0."""
    a, c, b = 0.4, 1.0, 2.0
    compliance = (b**2 + c**2) / (b**2 - c**2) / 3000 + (c**2 + a**2) / (c**2 - a**2) / 1000
    return interference / (c * compliance)


@pytest.mark.parametrize("slave", FITS)
@pytest.mark.parametrize("how", ["setting", "growing", "mesh"])
def test_a_press_fit_by_lame(how, slave, tmp_path):
    """The overlap of a shaft and its hub as a setting, one that grows, and in the meshes."""
    settings = {"setting": ", interference: 1e-4", "growing": ', interference: "1e-4*t"', "mesh": ""}[how]
    text = HUB.replace("SIDES", FITS[slave]).replace("SETTINGS", settings)
    history = run(text.replace("OUTER", "1.0001" if how == "mesh" else "1"), tmp_path)
    expected = lame(1e-4) * (np.array([0.5, 1.0]) if how == "growing" else 1.0)
    np.testing.assert_allclose(np.abs(history["contact.fit.x"]), expected, rtol=2e-3)  # of a quarter, radius 1
    for column in ("least", "largest"):
        np.testing.assert_allclose(history[column], expected, rtol=0.1)


def test_an_interference_of_several_cells(tmp_path):
    """The surfaces of two blocks are held apart by more than a cell."""
    history = run(blocks(0.0, upper=8, lower=8, settings=", interference: 0.3"), tmp_path)
    np.testing.assert_allclose(history["force.y"], stress(0.3), rtol=1e-6)
    np.testing.assert_allclose(history["gap"], 0.3, rtol=1e-9)


def test_the_work_of_a_growing_interference(tmp_path):
    """All that is stored: energy minus work is that of the first overlap, up to second order in the step."""
    text = blocks(0.1, step=0.25, settings=', interference: "0.2*t"')
    history = run(text, tmp_path)
    stored = history["energy.internal"] - history["energy.work"]
    assert history["energy.internal"][-1] > 3.0 * history["energy.internal"][0]
    np.testing.assert_allclose(stored, stored[0], rtol=0.02)
    fine = run(text.replace("step: 0.25", "step: 0.125"), tmp_path / "fine")
    error = [np.ptp(h["energy.internal"] - h["energy.work"]) for h in (history, fine)]
    assert error[1] < 0.4 * error[0]  # of second order
    warnings = json.loads((tmp_path / "out" / "summary.json").read_text())["warnings"]
    assert warnings == []


# ------------------------------------------------------------------------------------------------------------ adjust


@pytest.mark.parametrize("slave", SIDES)
@pytest.mark.parametrize(("order", "cell"), [(1, "quad"), (2, "tri")])
def test_adjusted_nodes_lie_on_the_master(slave, order, cell, tmp_path):
    """Without strain: nothing happens to blocks that overlapped, or, with a length, that were apart."""
    for depth, setting in ((0.1, "true"), (-0.05, "0.06")):
        text = blocks(depth, slave, order=order, cell=cell, settings=f", adjust: {setting}")
        history = run(text, tmp_path / setting)
        for column in ("gap", "overlap", "contact.p.y", "force.y"):
            np.testing.assert_allclose(history[column], 0.0, atol=1e-9)
    apart = run(blocks(-0.05, slave, settings=", adjust: true"), tmp_path / "apart")
    np.testing.assert_allclose(apart["gap"], 0.05, atol=1e-9)


def test_adjusted_blocks_bear_the_load_of_their_new_shape(tmp_path):
    """The upper block is 0.9 high after its lower nodes are moved: its top comes down by 0.19 of 1.9."""
    text = blocks(0.1, settings=", adjust: true").replace(
        "{on: top, displacement: [null, 0]}", '{on: top, displacement: [null, "-0.19*t"]}'
    )
    stretch = 1.0 - 0.19 / 1.9
    history = run(text, tmp_path)
    np.testing.assert_allclose(history["force.y"], 500.0 * stretch * (1.0 - stretch**2), rtol=1e-6)


def test_a_cell_cannot_be_adjusted_away(tmp_path):
    (tmp_path / "case.yaml").write_text(blocks(0.3, settings=", adjust: true"))
    found = check_meshes(load_case(tmp_path / "case.yaml"))
    assert [problem.message for problem in found.problems] == [
        "cell 1 at (0.125, 0.975) (and 3 more) is concave or twisted: its Jacobian determinant changes its sign; the"
        " nodes lie deeper than its cells are high: leave 'adjust' out, so that the first step closes the overlap"
    ]


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (", interference: -0.1", "a clearance is a gap of the meshes: 'interference' must be at least 0"),
        (", interference: 0.1, tied: true", "tied surfaces stay where they are: remove 'interference' or 'tied'"),
        (", adjust: true, tied: true", "tied surfaces are moved onto each other anyway: remove 'adjust'"),
        (", adjust: -1", "'adjust' must be true, false or a number of at least 0, not -1"),
    ],
)
def test_mistakes(settings, message, tmp_path):
    (tmp_path / "case.yaml").write_text(blocks(0.1, settings=settings))
    with pytest.raises(CaseError) as caught:
        load_case(tmp_path / "case.yaml")
    assert message in str(caught.value)
