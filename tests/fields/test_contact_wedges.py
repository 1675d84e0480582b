"""The length over which Nitsche's penalty acts in wedges of fluid beside closed contact."""

from types import SimpleNamespace

import numpy as np
import pytest

from solvers.fluid.thin.contact_wedges import beside_contact

H = 0.1  #: edge of the cells [m]


def wedge(normals, areas, fluid, closed):
    """(grid, cut) of three cells, the one in the middle cut by surfaces with these areas [m^2]; fluid: its share."""
    count = len(areas)
    pieces = SimpleNamespace(
        cell=np.zeros(count, dtype=int), area=np.array(areas)[:, None], normal=np.array(normals, dtype=float)
    )
    cut = SimpleNamespace(cut=np.array([1]), fraction=np.array([1.0, fluid, 1.0]), pieces=pieces)
    sheets = SimpleNamespace(closed=np.array(closed, dtype=int))
    return SimpleNamespace(sheets=sheets, dim=3, sizes=np.full((3, 3), H), numbers=np.array([7, 8, 9])), cut


@pytest.mark.parametrize(("height", "factor"), [(0.3, 0.3), (0.01, 0.1), (0.999, 0.999)])
def test_height_of_a_film(height, factor):
    """Two walls across a cell: the factor is the height in cells, at least 0.1; elsewhere it is 1."""
    found = beside_contact(*wedge([[1, 0, 0], [-1, 0, 0]], [H**2, H**2], height, [8]))
    assert found == pytest.approx([1.0, factor, 1.0], rel=1e-12)


def test_mean_height_of_a_wedge():
    """Walls from a line, at a small angle, over the whole cell: the mean height."""
    angle = 1e-3
    normals = [[np.cos(angle), 0, -np.sin(angle)], [-1, 0, 0]]
    found = beside_contact(*wedge(normals, [H**2 / np.cos(angle), H**2], 0.4, [8]))
    assert found[1] == pytest.approx(0.4, rel=1e-3)


def test_where_it_does_not_act():
    """At one wall, in cells in which nothing touches, and without contact."""
    assert (beside_contact(*wedge([[1, 0, 0]], [H**2], 0.01, [8])) == 1.0).all()
    both = [[1, 0, 0], [-1, 0, 0]], [H**2, H**2], 0.2
    assert (beside_contact(*wedge(*both, [9])) == 1.0).all()
    assert beside_contact(*wedge(*both, [])) is None
