"""Areas of contact and of stick, and the mean pressure: a pressed block with known width, and one that half slides."""

import numpy as np
import pytest

import fsci

#: A block of 1 m is pressed by 2 Pa onto a wider one; without lateral contraction all is even.
PRESSED = """
time: {step: 0.25, end: 1}
structure:
  bodies:
    low:
      mesh: {shape: rectangle, size: [2, 1], cells: [7, 2], order: 1, origin: [-0.57, 0]}
      material: {law: st_venant_kirchhoff, E: 1e6, nu: 0}
      supports: [{on: bottom, displacement: [0, 0]}]
    high:
      mesh: {shape: rectangle, size: [1, 1], cells: [5, 2], order: 1, origin: [0, 1.0015]}
      material: {law: st_venant_kirchhoff, E: 1e6, nu: 0}
      supports: [{on: top, displacement: [0, "-0.004*t"]}]
contact:
  pairs: {blocks: {slave: {body: high, on: bottom}, master: {body: low, on: top}}}
probes:
  area: {pair: blocks, quantity: contact_area}
  stick: {pair: blocks, quantity: stick_area}
  mean: {pair: blocks, quantity: mean_pressure}
"""

#: A wide block whose right half is pressed down and pulled to the right, beyond friction there alone.
SHEARED = """
time: {step: 0.25, end: 1}
structure:
  bodies:
    block:
      mesh: {shape: rectangle, size: [4, 0.1], cells: [32, 1]}
      material: {law: st_venant_kirchhoff, E: 1e4, nu: 0}
      supports: [{on: left, displacement: [0, null]}]
      pressures: [{on: top, value: 10}]
      tractions: [{on: right, value: ["20*t", 0]}]
contact:
  obstacles:
    floor: {mesh: {shape: rectangle, size: [8, 1], cells: [4, 1], origin: [-2, -1]}, on: top}
  pairs: {base: {slave: {body: block, on: bottom}, master: {obstacle: floor}, friction: {coefficient: 0.1}}}
probes:
  area: {pair: base, quantity: contact_area}
  stick: {pair: base, quantity: stick_area}
  mean: {pair: base, quantity: mean_pressure}
"""


def computed(folder, text, **settings):
    (folder / "case.yaml").write_text(text)
    return fsci.run(fsci.load(folder, settings), folder / "out")


@pytest.mark.parametrize("exchanged", [False, True])
def test_a_pressed_block(tmp_path, exchanged):
    """All zero before contact; then 1 m wide, and the force over it, also where the slave is the wider one."""
    low, high = "{body: low, on: [top]}", "{body: high, on: [bottom]}"
    roles = {"slave": low, "master": high} if exchanged else {"slave": high, "master": low}
    text = PRESSED.replace(
        "{slave: {body: high, on: bottom}, master: {body: low, on: top}}", str(roles).replace("'", "")
    )
    found = computed(tmp_path, text)
    touching = np.array([False, True, True, True])
    assert found["stick"] == pytest.approx(0.0, abs=0.0)  # there is no friction
    assert not found["area"][~touching].any()
    assert not found["mean"][~touching].any()
    force = np.abs(found["contact.blocks.y"])
    assert force[1:] == pytest.approx(found["area"][1:] * found["mean"][1:], rel=2e-5)
    if not exchanged:
        assert found["area"][touching] == pytest.approx(1.0, rel=1e-3)  # strains are 0.15 %
        assert found["mean"][touching] == pytest.approx(force[touching], rel=1e-3)
    else:
        assert found["area"][-1] == pytest.approx(1.0, abs=2 / 7)  # within a facet of the slave


def test_a_block_that_slides_in_part(tmp_path):
    """10 Pa everywhere, pulled by 2 N of at most 4 N of friction: 2 m slide, to a facet of 0.125 m."""
    found = computed(tmp_path, SHEARED)
    assert found["area"] == pytest.approx(4.0, rel=2e-3)
    assert found["mean"] == pytest.approx(10.0, rel=2e-3)
    assert found["stick"] == pytest.approx([3.5, 3.0, 2.5, 2.0], abs=0.13)
    assert np.all(np.diff(found["stick"]) < 0.0)


def test_places_are_refused(tmp_path):
    (tmp_path / "case.yaml").write_text(
        PRESSED.replace("quantity: contact_area}", "quantity: contact_area, at: [0, 1]}")
    )
    with pytest.raises(fsci.CaseError, match="'contact_area' is measured on the whole pair: remove 'at'"):
        fsci.load(tmp_path)
