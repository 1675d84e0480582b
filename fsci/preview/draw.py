"""The picture of a preview: in the plane as it stands, in space seen from above the front, with names beside it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fsci.plot.curves import CURVE_DOTS, CURVE_STYLE, save_figure
from fsci.plot.render import axes_of_view, frame, import_pyvista, photograph
from fsci.plot.scene import draw_triad
from fsci.plot.units import label, literal
from fsci.preview.layout import FILLED, arrow_ends, closest, extent, loops_of, name_place, opacity
from fsci.preview.legend import (
    LEGEND,
    MARK_COLOURS,
    NEAR,
    OTHER_PATCH,
    PATCHES,
    ROW,
    add_below,
    add_beside,
    colours_of,
    handles,
    height_below,
)
from fsci.preview.parts import Preview
from solvers.api import Array

WIDTH = 11.0  #: of the picture with its legend [inch]
HEIGHT = 8.0  #: of the axes of the highest one [inch]
WIDE = 0.5  #: height of a scene over its width, up to which its legend is below
ROOM_AROUND = 0.03  #: around a scene in the plane, of its size
NAME_BOX = {"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.6}
MANY_LINES = 400  #: of the grid along an axis, from which they are left out: they would cover everything
MANY_NAMES = 15  #: bodies, from which the legend alone has their names


def draw(path: Path, scene: Preview, units: Mapping[str, str]) -> None:
    """Write the picture as PNG."""
    import matplotlib
    from matplotlib.figure import Figure

    low, high = extent(scene)
    shown = handles(scene, units["length"])
    with matplotlib.rc_context({**CURVE_STYLE, "axes.grid": False, "font.size": 10}):
        if len(low) == 2:
            figure = figure_of_plane(high - low + 2.0 * ROOM_AROUND * (high - low).max(), shown)
            _draw_plane(figure.axes[0], scene, low, high, units)
        else:
            figure = Figure((WIDTH, 7.0), dpi=CURVE_DOTS)
            _draw_space(figure, scene, low, high)
            add_beside(figure, shown)
        figure.suptitle(literal(scene.title), x=0.02, ha="left", y=1.0 - 0.1 / figure.get_figheight())
        save_figure(figure, path)


# ------------------------------------------------------------------------------------------------------- the plane


def figure_of_plane(size: Array, shown: list[Any]) -> Any:
    """With axes for a scene of this size, and its legend below a wide scene, beside others."""
    from matplotlib.figure import Figure

    slope = float(size[1] / max(size[0], 1e-300))
    left, under, over = 0.8, 0.6, 0.5  # [inch] beside, below and above the axes
    if slope < WIDE:
        width, below = WIDTH - left - 0.2, under + height_below(shown)
        height = max(width * slope, 0.5)
        figure = Figure((WIDTH, height + below + over), dpi=CURVE_DOTS)
        add_below(figure, shown)
    else:
        width, below = WIDTH - LEGEND - left - 0.2, under
        height = min(width * slope, HEIGHT)
        width = height / slope
        figure = Figure(
            (width + left + 0.2 + LEGEND, max(height + below + over, ROW * len(shown) + 1.0)), dpi=CURVE_DOTS
        )
        add_beside(figure, shown)
    total, high = figure.get_size_inches()
    figure.add_axes((left / total, 1.0 - (height + over) / high, width / total, height / high))
    return figure


def _draw_plane(axes: Any, scene: Preview, low: Array, high: Array, units: Mapping[str, str]) -> None:
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.patches import PathPatch

    for axis, planes in enumerate(scene.planes):
        if len(planes) <= MANY_LINES and not scene.cells:
            ends = scene.planes[1 - axis][[0, -1]]
            lines = [[(p, e) if axis == 0 else (e, p) for e in ends] for p in planes]
            axes.add_collection(LineCollection(lines, colors="0.85", linewidths=0.4, zorder=1))
    if scene.cells:
        boxes = [[(a, b), (c, b), (c, d), (a, d)] for (a, b), (c, d) in scene.cells]
        axes.add_collection(PolyCollection(boxes, facecolors="none", edgecolors="0.8", linewidths=0.3, zorder=1))
    for part, colour in zip(scene.bodies, colours_of(scene.bodies), strict=True):
        path = _filled(part.corners)
        axes.add_patch(PathPatch(path, facecolor=colour, alpha=FILLED[part.kind], edgecolor="none", zorder=2))
        axes.add_patch(PathPatch(path, facecolor="none", edgecolor=colour, linewidth=1.2, zorder=3))
        if len(scene.bodies) < MANY_NAMES:
            x, y = name_place(part, low, high)
            axes.text(x, y, literal(part.name), ha="center", va="center", fontsize=9, zorder=8, bbox=NAME_BOX)
    for part in scene.patches:
        colour = PATCHES.get(part.kind, OTHER_PATCH)
        axes.add_collection(LineCollection(list(part.corners), colors=colour, linewidths=3.0, zorder=4, clip_on=False))
    for part in scene.marks:
        axes.add_collection(
            LineCollection(list(part.corners), colors=MARK_COLOURS[part.kind], linewidths=2.6, zorder=5)
        )
    for pair in closest(scene.pairs):
        axes.add_collection(LineCollection([pair.ends], colors=NEAR, linewidths=1.2, zorder=6))
        axes.plot(*pair.ends.T, ".", color=NEAR, markersize=4, zorder=6)
    for mark in scene.points:
        axes.plot(*mark.at, "^", color=MARK_COLOURS[mark.kind], markersize=8, zorder=7)
    for point in scene.probes.values():
        axes.plot(*point[:2], "+", color="black", markersize=9, zorder=7)
    for ends, kind in arrow_ends(scene, float((high - low).max())):
        looks = {"arrowstyle": "-|>", "color": MARK_COLOURS[kind], "linewidth": 1.8, "mutation_scale": 14}
        axes.annotate("", ends[1], ends[0], arrowprops={**looks, "shrinkA": 0, "shrinkB": 0}, zorder=9)
    margin = ROOM_AROUND * (high - low).max()
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
    axes.set_aspect("equal")
    axes.set_xlabel(label("x", "displacement", units))
    axes.set_ylabel(label("y", "displacement", units))


def _filled(segments: Array) -> Any:
    """The path around a body: closed loops of segments that run with the body on their left."""
    from matplotlib.path import Path as Outline

    points, numbers = np.unique(segments.reshape(-1, 2), axis=0, return_inverse=True)
    vertices, codes = [], []
    for loop in loops_of(numbers.reshape(-1, 2)):
        vertices += [points[number] for number in loop]
        codes += [Outline.MOVETO, *[Outline.LINETO] * (len(loop) - 2), Outline.CLOSEPOLY]
    return Outline(np.array(vertices), codes)


# ----------------------------------------------------------------------------------------------------------- space


def _draw_space(figure: Any, scene: Preview, low: Array, high: Array) -> None:
    pyvista = import_pyvista()
    place = (0.01, 0.03, (WIDTH - LEGEND - 0.1) / WIDTH, 0.90)
    size = tuple(round(figure.get_size_inches()[i] * place[2 + i] * CURVE_DOTS) for i in (0, 1))
    axes = axes_of_view(flat=False)
    seen = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T @ axes
    view = frame(axes, seen.min(axis=0), seen.max(axis=0), aspect=size[0] / size[1])
    plotter = pyvista.Plotter(off_screen=True, window_size=[2 * length for length in size], lighting="light kit")
    plotter.set_background("white")
    for part, colour in zip(scene.bodies, colours_of(scene.bodies), strict=True):
        surface = _triangles(part.corners)
        if scene.box is not None:
            surface = surface.clip_box(np.column_stack([low, high]).ravel(), invert=False).extract_surface(
                algorithm="dataset_surface"
            )
        if surface.n_points:
            plotter.add_mesh(surface, color=colour, opacity=opacity(part, scene.bodies), ambient=0.4)
    for part in scene.marks:
        plotter.add_mesh(_triangles(part.corners), color=MARK_COLOURS[part.kind], opacity=0.5, lighting=False)
    for part in scene.patches:
        plotter.add_mesh(
            _triangles(part.corners), color=PATCHES.get(part.kind, OTHER_PATCH), opacity=0.08, lighting=False
        )
    for pair in closest(scene.pairs):
        plotter.add_mesh(pyvista.Line(*pair.ends), color=NEAR, line_width=5)
    if scene.box is not None:
        plotter.add_mesh(pyvista.Box(np.column_stack(scene.box).ravel()).outline(), color="black", line_width=2)
    for point in scene.points:
        plotter.add_mesh(import_pyvista().PolyData(point.at[None]), color=MARK_COLOURS[point.kind], point_size=14)
    for ends, kind in arrow_ends(scene, float((high - low).max())):
        shaft = pyvista.Arrow(start=ends[0], direction=ends[1] - ends[0], scale="auto")
        plotter.add_mesh(shaft, color=MARK_COLOURS[kind], lighting=False)
    if scene.probes:
        plotter.add_mesh(pyvista.PolyData(np.array(list(scene.probes.values()))), color="black", point_size=14)
    if len(scene.bodies) < MANY_NAMES:
        named = np.array([np.clip(part.middle, low, high) for part in scene.bodies])
        names = [part.name for part in scene.bodies]
        looks = {"font_size": 40, "text_color": "black", "shape_color": "white", "shape_opacity": 0.7}
        plotter.add_point_labels(named, names, always_visible=True, show_points=False, **looks)
    image = photograph(plotter, view, np.cross(view.right, view.up), size)
    panel = figure.add_axes(place)
    panel.imshow(image, aspect="auto")
    panel.set_axis_off()
    draw_triad(figure, view)


def _triangles(corners: Array) -> Any:
    cells = np.arange(3 * len(corners)).reshape(-1, 3)
    return import_pyvista().PolyData(corners.reshape(-1, 3), np.column_stack([np.full(len(cells), 3), cells]).ravel())
