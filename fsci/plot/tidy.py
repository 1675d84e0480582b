"""Texts that fit: titles within the figure, numbers at axes that do not overlap."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

MARGIN = 0.01  #: of the figure, on either side of a title
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
    """Scale a text by the room that there is on the side where it has the least of it."""
    box = text.get_window_extent(renderer)
    for low, high, size in ((box.x0, box.x1, figure.bbox.width), (box.y0, box.y1, figure.bbox.height)):
        first, last = MARGIN * size, (1.0 - MARGIN) * size
        middle = 0.5 * (low + high)
        anchored = {"left": low, "right": high}.get(text.get_horizontalalignment(), middle) if low == box.x0 else middle
        parts = [(anchored - first) / (anchored - low) if low < first and low < anchored else 1.0,
                 (last - anchored) / (high - anchored) if high > last and high > anchored else 1.0]  # fmt: skip
        if 0.0 < min(parts) < 1.0:
            text.set_fontsize(text.get_fontsize() * min(parts))
            return


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
