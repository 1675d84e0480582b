"""Bodies that come close to a wall in creeping flow: drag against the exact one, down to gaps below a cell."""

from __future__ import annotations

import pytest

from tests.lubrication import cylinder_drag, drag_ratio, sphere_drag

H = 0.05


def test_exact_values():
    """The tables of the literature."""
    assert [cylinder_drag(gap) for gap in (1, 0.1, 0.01)] == pytest.approx([27.86752, 465.93083, 13468.65883], rel=1e-7)
    assert [sphere_drag(gap) for gap in (1, 0.1, 0.01)] == pytest.approx([2.125536, 11.459157, 101.896172], rel=1e-6)


@pytest.mark.parametrize("gap", [0.5, 0.2, 0.1, 0.05])
def test_cylinder_second_order(gap):
    """Within 2 % while there is one cell in the gap."""
    assert drag_ratio(2, gap, H, "q2q1") == pytest.approx(1.0, abs=0.02)


def test_cylinder_second_order_below_a_cell():
    """10 % are passed between 0.4 and 0.2 cells: the wall is felt less and less."""
    assert drag_ratio(2, 0.02, H, "q2q1") == pytest.approx(0.919, abs=0.02)
    assert drag_ratio(2, 0.01, H, "q2q1") == pytest.approx(0.635, abs=0.03)


@pytest.mark.parametrize(("gap", "ratio"), [(0.5, 1.003), (0.2, 1.023), (0.1, 1.078), (0.05, 1.372), (0.01, 0.643)])
def test_cylinder_first_order(gap, ratio):
    """Known and documented: 2 % with four cells in the gap, 8 % with two, 10 % are passed at 1.8 cells."""
    assert drag_ratio(2, gap, H, "q1q1") == pytest.approx(ratio, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("gap", "ratio"), [(0.5, 1.032), (0.2, 1.071), (0.1, 1.232)])
def test_sphere_first_order(gap, ratio):
    """As in 2D: 10 % are passed at 1.7 cells."""
    assert drag_ratio(3, gap, 0.1, "q1q1", growth=1.2, fine=0.6, size=10.0) == pytest.approx(ratio, abs=0.01)
