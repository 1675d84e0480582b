"""Pictures have the units that people use for values of their size, and texts that can be read."""

from itertools import pairwise

import numpy as np
import pytest

from fsci.plot.curves import scaled
from fsci.plot.tidy import tidy
from fsci.plot.units import unit_of

SI_UNITS = {"length": "m", "mass": "kg", "time": "s"}
TONNES = {"length": "mm", "mass": "t", "time": "s"}


@pytest.mark.parametrize(
    ("quantity", "units", "flat", "largest", "shown", "text"),
    [
        ("pressure", SI_UNITS, False, 12_500.0, 12.5, "kPa"),
        ("pressure", SI_UNITS, True, 2.1e11, 210.0, "GPa"),
        ("stress", SI_UNITS, True, 3.0e6, 3.0, "MPa"),
        ("von_mises", TONNES, False, 0.05, 50.0, "kPa"),
        ("von_mises", TONNES, False, 50.0, 50.0, "MPa"),
        ("displacement", SI_UNITS, True, 0.012, 12.0, "mm"),
        ("displacement", TONNES, True, 150.0, 0.15, "m"),
        ("velocity", SI_UNITS, True, 0.2, 0.2, "m/s"),
        ("pressure", SI_UNITS, False, 0.02, 0.02, "Pa"),
        ("displacement", SI_UNITS, True, 1.0, 1.0, "m"),
        ("force", SI_UNITS, False, 2500.0, 2.5, "kN"),
        ("force", SI_UNITS, True, 2500.0, 2.5, "N/mm"),
        ("force", SI_UNITS, True, 0.2, 200.0, "mN/m"),
        ("force", TONNES, True, 2.5, 2.5, "N/mm"),
        ("reaction", TONNES, False, 2500.0, 2.5, "kN"),
        ("energy", SI_UNITS, True, 0.02, 20.0, "mJ/m"),
        ("energy", TONNES, False, 0.02, 20.0, "\u00b5J"),
        ("moment", SI_UNITS, False, 2000.0, 2.0, "kN m"),
        ("power", SI_UNITS, True, 5.0, 5.0, "W/m"),
        ("contact_area", SI_UNITS, True, 0.003, 3.0, "mm"),
        ("volume", SI_UNITS, True, 0.3, 0.3, "m$^2$"),
        ("flow_rate", SI_UNITS, True, 0.3, 0.3, "m$^2$/s"),
        ("vorticity", SI_UNITS, True, 7.0, 7.0, "1/s"),
        ("drag_coefficient", SI_UNITS, True, 5.58, 5.58, ""),
        ("force", SI_UNITS, True, 0.0, 0.0, "N/m"),
        ("pressure", {**SI_UNITS, "length": "ell"}, False, 2e6, 2e6, "kg/ell s$^2$"),
    ],
)
def test_unit_by_the_largest_value(quantity, units, flat, largest, shown, text):
    unit = unit_of(quantity, units, largest, flat=flat)
    assert unit.text == text
    assert largest * unit.factor == pytest.approx(shown, rel=1e-12)


def test_every_size_has_a_readable_number():
    for quantity in ("pressure", "force", "energy", "power"):
        for largest in np.logspace(0, 8, 33):
            assert 1.0 <= largest * unit_of(quantity, SI_UNITS, largest).factor * (1.0 + 1e-9) < 1000.0 * (1.0 + 1e-9)


def test_curves_of_one_picture_share_their_unit():
    unit, curves = scaled({"x": np.array([1.0, np.nan]), "y": np.array([0.0, -2e4])}, "force", SI_UNITS, flat=False)
    assert unit.text == "kN"
    assert curves["x"][0] == 1e-3
    assert curves["y"][1] == -20.0


def figure_of(title, width):
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure((4.0, 3.0))
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.3, 0.2, width, 0.6))
    axes.set_xlim(123.4561, 123.4567)
    axes.set_title(title)
    return figure, axes, canvas.get_renderer()


def test_a_long_title_is_within_the_figure():
    """And one that fits keeps its size, also beside the upper edge."""
    figure, axes, renderer = figure_of("An elastic leaflet in a pulsating channel with a very long title", 0.4)
    box = axes.title.get_window_extent(renderer)
    assert box.x0 < 0.0 or box.x1 > 400.0
    tidy(figure)
    box = axes.title.get_window_extent(renderer)
    assert box.x0 >= 0.0
    assert box.x1 <= 400.0
    short = figure_of("short", 0.4)
    short[1].set_position((0.3, 0.2, 0.4, 0.74))
    size = short[1].title.get_fontsize()
    tidy(short[0])
    assert short[1].title.get_fontsize() == size


def test_numbers_at_a_narrow_axis_do_not_overlap():
    figure, axes, renderer = figure_of("", 0.25)
    axes.ticklabel_format(useOffset=False)

    def overlap():
        figure.draw_without_rendering()
        low, high = axes.get_xlim()
        labels = zip(axes.get_xticks(), axes.get_xticklabels(), strict=True)
        boxes = [label.get_window_extent(renderer) for at, label in labels if low <= at <= high]
        return any(a.x1 > b.x0 for a, b in pairwise(boxes))

    assert overlap()
    tidy(figure)
    assert not overlap()
    assert len(axes.get_xticks()) >= 1
