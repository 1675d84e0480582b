"""A flow at several times side by side: a plane of it with streamlines, and the bodies where the plane cuts them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fsci.plot.curves import CURVE_DOTS, CURVE_STYLE, save_figure
from fsci.plot.render import Array, DrawnBody, Pixels, View, import_pyvista, is_obstacle, render
from fsci.plot.render_flow import (
    NO_LINES,
    fill_lines,
    is_flat,
    load_state,
    plane_flow,
    segments,
    slice_plane,
    surrounds,
)
from fsci.plot.scene import draw_colour_bar, field_label, field_unit
from fsci.plot.units import literal, unit_of

PANELS = 6  #: at most
BOARD_WIDTH = 9.0  #: of the picture, inches
SHAPE = 1.4  #: width over height that the panels together come close to
BESIDE, BELOW, BAR, TITLE, GAP = 0.75, 0.6, 1.2, 0.45, 0.45  #: inches left of, below, right of, above, between panels
HEAD = 0.32  #: inches for the time above each panel
BOARD_CROP = {True: 0.3, False: 1.0}  #: percent of the points in the plane, on a slice, above the colour bar

Axes = tuple[str, str]  #: names of the coordinates to the right and upwards


def plot_story(
    path: Path, moments: Sequence[Sequence[tuple[float, Path]]], title: str, units: Mapping[str, str]
) -> Path:
    """Draws the velocity in the whole plane or in the middle of the box; `moments`: (time, file) of flow and bodies."""
    import matplotlib
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    states = [plane_state([file for _, file in moment]) for moment in moments]
    flows = [bodies[0] for bodies, *_ in states]
    speeds = [flow.values for flow in flows if flow.values is not None]
    surfaces = [[body.surface for body in bodies] for bodies, *_ in states]
    shown = [surface for flow, *others in surfaces for surface in (flow, *others) if not surrounds(surface, flow)]
    bounds = np.array([surface.bounds for surface in shown])
    low, high = bounds[:, :4:2].min(axis=0), bounds[:, 1:4:2].max(axis=0)
    names, plane = states[0][1:]
    crop = BOARD_CROP[not plane]
    limits = (0.0, largest_shown([float(np.percentile(speed, 100 - crop)) for speed in speeds]))
    length = unit_of("displacement", units, float(np.abs([low, high]).max()))
    unit = field_unit("velocity", limits, units)
    columns, rows = arrange(len(states), *(high - low))
    width = (BOARD_WIDTH - BESIDE - BAR - (columns - 1) * GAP) / columns
    height = width * float(np.divide(*(high - low)[::-1]))
    total = BELOW + TITLE + rows * (height + HEAD) + (rows - 1) * GAP
    with matplotlib.rc_context({**CURVE_STYLE, "axes.grid": False}):
        figure = Figure((BOARD_WIDTH, total), dpi=CURVE_DOTS)
        for index, (moment, (bodies, *_)) in enumerate(zip(moments, states, strict=True)):
            row, column = divmod(index, columns)
            left = BESIDE + column * (width + GAP)
            bottom = BELOW + (rows - 1 - row) * (height + HEAD + GAP)
            axes = figure.add_axes((left / BOARD_WIDTH, bottom / total, width / BOARD_WIDTH, height / total))
            extent = tuple(length.factor * np.array([low[0], high[0], low[1], high[1]]))
            axes.imshow(snapshot(bodies, low, high, limits, width), extent=extent, aspect="auto", interpolation="none")
            axes.spines[:].set_visible(True)
            axes.xaxis.set_major_locator(MaxNLocator(max(2, round(width / 0.7)), steps=[1, 2, 5, 10]))
            axes.yaxis.set_major_locator(MaxNLocator(max(2, round(height / 0.5)), steps=[1, 2, 5, 10]))
            axes.set_title(literal(f"t = {moment[0][0]:.3g} {units['time']}"), fontsize=CURVE_STYLE["font.size"], pad=5)
            axes.tick_params(labelleft=column == 0, labelbottom=index + columns >= len(states))
            if column == 0:
                axes.set_ylabel(length.beside(names[1]))
            if index + columns >= len(states):
                axes.set_xlabel(length.beside(names[0]))
        figure.suptitle(literal(f"{title}, {plane} {units['length']}" if plane else title), y=1 - 0.1 / total, va="top")
        tall = min(total - BELOW - TITLE - HEAD, 4.0)
        middle = BELOW + (total - BELOW - TITLE - HEAD) / 2
        place = ((BOARD_WIDTH - BAR + 0.2) / BOARD_WIDTH, (middle - tall / 2) / total, 0.14 / BOARD_WIDTH, tall / total)
        shown_limits = (limits[0] * unit.factor, limits[1] * unit.factor)
        draw_colour_bar(figure, place, shown_limits, "viridis", field_label("velocity", flows, unit), extend="max")
        save_figure(figure, path)
    return path


def largest_shown(speeds: Sequence[float]) -> float:
    """The end of the scale of colours: the largest speed of all panels, or twice that of the panel in the middle.

    One moment that is much faster than the others would make all of them dark.
    """
    return min(max(speeds), 2.0 * float(np.median(speeds)) or np.inf) or 1.0


def choose(count: int, needed: Sequence[int] = ()) -> list[int]:
    """Up to PANELS of the states 0 ... count-1, evenly, the last one and the needed ones among them.

    Of more states the first one, mostly at rest, is not shown.
    """
    chosen = set(range(count))
    if count > PANELS:
        chosen = {round(index) for index in np.linspace(0, count - 1, PANELS + 1)[1:]}
    for state in sorted(set(needed) - chosen):
        others = chosen - {count - 1, *needed}
        chosen -= {min(others, key=lambda other: abs(other - state))}
        chosen.add(state)
    return sorted(chosen)


def arrange(count: int, width: float, height: float) -> tuple[int, int]:
    """(columns, rows) with which panels of this size together come closest to the shape of a page."""

    def shape(columns: int) -> float:
        return columns * width / (-(-count // columns) * height)

    full = [columns for columns in range(1, count + 1) if -count % columns <= count // 5]  # few empty panels
    columns = min(full, key=lambda columns: abs(np.log(shape(columns) / SHAPE)))
    return columns, -(-count // columns)


def plane_state(files: Sequence[Path]) -> tuple[list[DrawnBody], Axes, str]:
    """The flow, coloured by velocity, and grey bodies in the plane (x, y, 0); its coordinates; where it is in space."""
    pyvista = import_pyvista()
    meshes = [pyvista.read(path) for path in files]
    if is_flat(meshes[0]):
        flow, *bodies = (part for part in load_state(files, "velocity") if not part.aside)
        return [flow, *(replace(body, edges=NO_LINES) for body in bodies)], ("x", "y"), ""
    meshes = [mesh for mesh in meshes if not is_obstacle(mesh)]
    normal, origin = slice_plane(meshes[0], meshes[1:])
    axis = "xyz".index(normal)
    digit = 1e-4 * float(np.ptp(meshes[0].bounds[2 * axis : 2 * axis + 2]))
    place = f"{normal} = {digit * round(origin[axis] / digit):.3g}"
    return list(cut(meshes, normal, origin)), ("y" if normal == "x" else "x", "z"), place


def cut(meshes: Sequence[Any], normal: str, origin: Array) -> Iterator[DrawnBody]:
    """The section of a 3D flow and its bodies with a vertical plane, viewed from the front."""
    order = [1, 2, 0] if normal == "x" else [0, 2, 1]
    for mesh in meshes:
        section = mesh.slice(normal=normal, origin=origin)
        section.points = np.asarray(section.points)[:, order] * [1, 1, 0]
        if mesh is meshes[0]:
            section.point_data["velocity"] = np.asarray(section.point_data["velocity"])[:, order]
            yield plane_flow(section, "velocity")
        elif section.n_lines:
            yield fill_lines(section.points, section.lines.reshape(-1, 3)[:, 1:])
        elif section.n_points:
            yield DrawnBody(section, NO_LINES, boundary(section), None)


def boundary(section: Any) -> Array:
    """The outer edges of faces, shape (n, 2, 3)."""
    return segments(
        section.clean().extract_feature_edges(
            boundary_edges=True, feature_edges=False, manifold_edges=False, non_manifold_edges=False
        )
    )


def snapshot(bodies: list[DrawnBody], low: Array, high: Array, limits: tuple[float, float], width: float) -> Pixels:
    """The plane from `low` to `high`, at the given width in inches."""
    half = (high - low) / 2
    view = View(np.array([*(low + half), 0.0]), np.array([1.0, 0, 0]), np.array([0.0, 1, 0]), *half)
    size = (round(width * CURVE_DOTS), round(width * CURVE_DOTS * half[1] / half[0]))
    return render(bodies, view, size=size, limits=limits, colours="viridis")
