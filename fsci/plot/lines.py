"""Lines of several runs over one another."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fsci.plot.curves import COLOURS, CURVE_DOTS, CURVE_SIZE, CURVE_STYLE, PANEL, save_figure
from fsci.plot.units import literal

MARKED = 30  #: points of a line that are marked
DASHES = ("-", "--", ":", "-.")  #: of lines that share a colour

Line = tuple[ArrayLike, ArrayLike]  #: positions and values


def plot_lines(
    path: Path,
    panels: Mapping[str, Mapping[str, Line]],
    below: str,
    *,
    ticks: Mapping[float, str] | None = None,
    logarithmic: bool = False,
) -> Path:
    """Draws panels above each other, label -> name of a line -> line; the same names have the same colours.

    `ticks` are texts at positions; `logarithmic` is the axis of positions.
    """
    import matplotlib
    from matplotlib.figure import Figure

    names = list(dict.fromkeys(name for lines in panels.values() for name in lines))
    with matplotlib.rc_context(CURVE_STYLE):
        height = max(CURVE_SIZE[1], PANEL * len(panels))
        figure = Figure((CURVE_SIZE[0], height), dpi=CURVE_DOTS, layout="constrained")
        rows = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
        for axes, (title, lines) in zip(rows, panels.items(), strict=True):
            for name, (positions, values) in lines.items():
                number = names.index(name)
                style: Any = {"color": COLOURS[number % len(COLOURS)], "label": literal(name)}
                style["linestyle"] = DASHES[number // len(COLOURS) % len(DASHES)]
                # the first lines are wider: those that lie on them are seen to do so
                style["linewidth"] = CURVE_STYLE["lines.linewidth"] * (1 + max(0, min(len(names), 3) - 1 - number))
                axes.plot(positions, values, marker="o" if np.size(positions) < MARKED else "", **style)
            axes.set_title(title, loc="left", fontsize=CURVE_STYLE["font.size"])
        if len(names) > 1:
            drawn = {line.get_label(): line for axes in rows for line in axes.get_lines()}
            figure.legend(list(drawn.values()), list(drawn), loc="outside upper left", ncols=2)
        if logarithmic:
            rows[-1].set_xscale("log")
        if ticks is not None:
            rows[-1].set_xticks(list(ticks), list(ticks.values()))
        rows[-1].set_xlabel(below)
        save_figure(figure, path)
    return path
