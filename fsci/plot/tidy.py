"""Texts that fit: titles within the figure, numbers at axes that do not overlap."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

SIDE_MARGIN = 0.01  #: of the figure, on either side of a title
FEWEST_TICKS = 1  #: intervals along an axis


def tidy(figure: Any) -> None:
    """Make titles and labels smaller until they are within the figure, and leave out numbers that would overlap."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    known = isinstance(figure.canvas, FigureCanvasAgg)
    renderer = (figure.canvas if known else FigureCanvasAgg(figure)).get_renderer()
    figure.draw_without_rendering()
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            _thin(axis, figure, renderer)
    figure.draw_without_rendering()
    texts = [getattr(figure, name, None) for name in ("_suptitle", "_supylabel", "_supxlabel")]
    for axes in figure.axes:
        texts += [axes.title, axes._left_title, axes._right_title, axes.xaxis.label, axes.yaxis.label]
    for text in texts:
        if text is not None and text.get_text():
            _shrink(text, figure, renderer)


def _shrink(text: Any, figure: Any, renderer: Any) -> None:
    """Scale a text by the room that it has along its line, on the side where there is less of it."""
    box, upright = text.get_window_extent(renderer), text.get_rotation() in (90.0, 270.0)
    low, high, size = (box.y0, box.y1, figure.bbox.height) if upright else (box.x0, box.x1, figure.bbox.width)
    anchor = {"left": low, "right": high}.get(text.get_horizontalalignment(), 0.5 * (low + high))
    room, wanted = (anchor - SIDE_MARGIN * size, (1.0 - SIDE_MARGIN) * size - anchor), (anchor - low, high - anchor)
    parts = [has / needs for has, needs in zip(room, wanted, strict=True) if 0.0 < has < needs]
    text.set_fontsize(text.get_fontsize() * min(parts, default=1.0))


def _thin(axis: Any, figure: Any, renderer: Any) -> None:
    """Fewer numbers along an axis while any two of them overlap."""
    from matplotlib.ticker import MaxNLocator

    if not isinstance(axis.get_major_locator(), MaxNLocator):
        return
    intervals = len(axis.get_majorticklocs())
    while intervals > FEWEST_TICKS and _overlap(axis, renderer):
        intervals -= 1
        axis.set_major_locator(MaxNLocator(intervals, steps=[1, 2, 2.5, 5, 10], min_n_ticks=1))
        figure.draw_without_rendering()


def _overlap(axis: Any, renderer: Any) -> bool:
    shown = sorted(axis.get_view_interval())
    ticks = zip(axis.get_majorticklocs(), axis.get_majorticklabels(), strict=False)
    boxes = [text.get_window_extent(renderer) for at, text in ticks if text.get_text() and shown[0] <= at <= shown[1]]
    return any(a.overlaps(b) for a, b in pairwise(boxes))
