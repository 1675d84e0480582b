"""The length over which Nitsche's penalty acts in wedges of fluid beside closed contact."""

from types import SimpleNamespace

import numpy as np
import pytest

from solvers.fluid.terms.contact_wedges import beside_contact

H = 0.1  #: edge of the cells [m]


def wedge(normals, areas, fluid, closed, dim=3, cells=(8,)):
    """(grid, cut) of a row of cells, of which some are cut by surfaces with these areas [m^2]; fluid: their share."""
    count = len(areas)
    pieces = SimpleNamespace(
        cell=np.repeat(np.arange(len(cells)), count),
        area=np.tile(areas, len(cells))[:, None],
        normal=np.tile(np.array(normals, dtype=float)[:, :dim], (len(cells), 1)),
    )
    numbers = np.arange(5, 12)
    rows = np.searchsorted(numbers, cells)
    fraction = np.where(np.isin(numbers, cells), fluid, 1.0)
    cut = SimpleNamespace(cut=rows, fraction=fraction, pieces=pieces)
    grid = SimpleNamespace(
        sheets=SimpleNamespace(closed=np.array(closed, dtype=int)),
        dim=dim,
        sizes=np.full((len(numbers), dim), H),
        numbers=numbers,
        grid=SimpleNamespace(shape=(20, *(1,) * (dim - 1)), size=20),
    )
    return grid, cut


@pytest.mark.parametrize(("height", "factor"), [(0.3, 0.3), (0.01, 0.1), (0.999, 0.999)])
def test_height_of_a_film(height, factor):
    """Two walls across a cell: the factor is the height in cells, at least 0.1; elsewhere it is 1."""
    found = beside_contact(*wedge([[1, 0, 0], [-1, 0, 0]], [H**2, H**2], height, [8]))
    assert found == pytest.approx([1, 1, 1, factor, 1, 1, 1], rel=1e-12)


def test_mean_height_of_a_wedge():
    """Walls from a line, at a small angle, over the whole cell: the mean height."""
    angle = 1e-3
    normals = [[np.cos(angle), 0, -np.sin(angle)], [-1, 0, 0]]
    found = beside_contact(*wedge(normals, [H**2 / np.cos(angle), H**2], 0.4, [8]))
    assert found[3] == pytest.approx(0.4, rel=1e-3)


WALLS = [[1, 0, 0], [-1, 0, 0]], [H**2, H**2], 0.2


@pytest.mark.parametrize(("dim", "around"), [(2, 0.2), (3, 1.0)])
def test_the_film_around_contact(dim, around):
    """Cells 6 to 9 are narrow, bodies touch in 7: in 2D it acts in the cells around, too, not farther."""
    areas = [H ** (dim - 1)] * 2
    found = beside_contact(*wedge(WALLS[0], areas, WALLS[2], [7], dim, (6, 7, 8, 9)))
    assert found == pytest.approx([1, around, 0.2, around, 1, 1, 1], rel=1e-12)


def test_a_film_beside_a_closed_cell():
    """A cell in which bodies touch may have no narrow part of its own."""
    assert beside_contact(*wedge(WALLS[0], [H, H], 0.2, [9], 2))[3] == pytest.approx(0.2)


def test_where_it_does_not_act():
    """At one wall, in films elsewhere, and without contact."""
    assert (beside_contact(*wedge([[1, 0, 0]], [H**2], 0.01, [8])) == 1.0).all()
    assert (beside_contact(*wedge(*WALLS, [10])) == 1.0).all()
    assert beside_contact(*wedge(*WALLS, [])) is None
