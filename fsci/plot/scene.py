"""Bodies with title, axes and colour bar: one figure per state, the same frame and colours for all of a movie."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np

from fsci.plot.curves import CURVE_SIZE, CURVE_STYLE
from fsci.plot.derived import names_of_derived
from fsci.plot.render import ISOMETRIC, Array, DrawnBody, Pixels, View, axes_of_view, frame, render
from fsci.plot.tidy import tidy
from fsci.plot.units import Unit, literal, unit_of

Rectangle = tuple[float, float, float, float]  #: left, bottom, width, height in parts of the figure

#: Rectangles of the picture and of its colour bar in the figure.
UPRIGHT = ((0.125, 0.12, 0.70, 0.785), (0.85, 0.16, 0.018, 0.70))
SPATIAL = ((0.02, 0.05, 0.80, 0.855), (0.85, 0.16, 0.018, 0.70))
TALL = ((0.02, 0.04, 0.76, 0.87), (0.82, 0.16, 0.024, 0.66))
TALL_SIZE = (6.2, 7.0)  #: inches
TALL_FROM = 1.2  #: height over width from which a picture in space is upright
LONG_FROM = 2.2  #: width over height from which the colour bar is below the picture, and the figure as low as it can be
AROUND = 0.25  #: part of the extent of all bodies, beside which obstacles are shown
LOPSIDED = 0.2  #: values on one side of zero, in parts of those on the other, below which zero is no middle


@dataclass(frozen=True)
class Scene:
    """The common view, colours and layout of the pictures of a run."""

    view: View
    flat: bool  #: 2D bodies, viewed from the front, with coordinates at the axes
    limits: tuple[float, float]  #: values at the ends of the colour bar
    colours: str  #: name of the colour map
    title: str
    unit: Unit  #: of the values
    label: str  #: label of the colour bar; empty without colours
    units: Mapping[str, str]  #: of length, mass and time
    extend: str  #: ends of the colour bar that values exceed: neither, max or both
    layout: tuple[Rectangle, Rectangle]  #: of the picture and of the colour bar
    size: tuple[float, float]  #: of the figure, in inches


def compose(
    states: Iterable[list[DrawnBody]],
    field: str | None,
    title: str,
    units: Mapping[str, str],
    *,
    away: Array = ISOMETRIC,
    colours: str | None = None,
    crop: float = 0.0,
) -> Scene:
    """The scene whose size and colours fit all the given states, of which there must be one.

    Bodies in space are seen from the direction `away`. Without a field nothing has colours. `crop`: percent of the
    points whose values may lie above the colour bar, and of those with negative ones below it. Raises ValueError if no
    body has the field, unless all are rigid: then nothing has colours.
    """
    states = iter(states)
    first = next(states)
    field = None if all(body.rigid for body in first) else field
    alone = all(body.aside for body in first)
    spans = np.max([np.ptp(body.surface.points, axis=0) for body in first], axis=0)
    flat = bool(spans[2] <= 1e-9 * spans.max())
    axes = axes_of_view(flat, away)
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    beside = low.copy(), high.copy()
    lowest, least, most = np.inf, np.inf, -np.inf
    for body in chain(first, chain.from_iterable(states)):
        seen = np.asarray(body.surface.points, dtype=np.float64) @ axes
        if body.aside and not alone:
            beside = np.minimum(beside[0], seen.min(axis=0)), np.maximum(beside[1], seen.max(axis=0))
            continue
        low, high = np.minimum(low, seen.min(axis=0)), np.maximum(high, seen.max(axis=0))
        if body.values is not None:
            lowest = min(lowest, float(body.values.min()))
            least = min(least, float(np.percentile(body.values, crop)) if lowest < 0 else lowest)
            most = max(most, float(np.percentile(body.values, 100 - crop)))
    room = AROUND * (high - low)[:2].max()
    low, high = np.minimum(low, np.maximum(beside[0], low - room)), np.maximum(high, np.minimum(beside[1], high + room))
    if field is None:
        least, most = 0.0, 1.0
    if least > most:
        data = [body.surface.point_data for body in first]
        known = sorted({name for part in data for name in part if not name.startswith("vtk")})
        known += sorted({name for part in data for name in names_of_derived(part)})
        raise ValueError(f"no body has a field '{field}'; there are {', '.join(known)}")
    signed = least < 0 < most and min(-least, most) > LOPSIDED * max(-least, most)
    if signed:
        least, most = -max(-least, most), max(-least, most)
    elif least == most:
        most = least + (abs(least) or 1.0)
    width, height = (high - low)[:2]
    size, layout = CURVE_SIZE, UPRIGHT if flat else SPATIAL
    if flat and width > LONG_FROM * height:
        size, layout = long_layout(height / width, below=1.4 if field else 0.75)
    if not flat and height > TALL_FROM * width:
        size, layout = TALL_SIZE, TALL
    if field is None and layout in (UPRIGHT, SPATIAL, TALL):
        _, bottom, across, up = layout[0]
        layout = ((0.5 - across / 2, bottom, across, up), layout[1])
    return Scene(
        view=frame(axes, low, high, aspect=size[0] * layout[0][2] / (size[1] * layout[0][3])),
        flat=flat,
        limits=(least, most),
        colours=colours or ("coolwarm" if signed else "viridis"),
        title=title,
        unit=(unit := field_unit(field or "", (least, most), units)),
        label=field_label(field, first, unit) if field else "",
        units=units,
        extend="neither" if crop == 0 else "both" if lowest < least else "max",
        layout=layout,
        size=size,
    )


def long_layout(slope: float, below: float) -> tuple[tuple[float, float], tuple[Rectangle, Rectangle]]:
    """(size of the figure in inches, picture and colour bar in parts of it) for a scene of this height over width.

    `below`: inches below the picture.
    """
    picture = max(0.845 * CURVE_SIZE[0] * slope, 0.8)
    height = picture + below + 0.45
    return (CURVE_SIZE[0], height), (
        (0.125, below / height, 0.845, picture / height),
        (0.25, 0.6 / height, 0.5, 0.125 / height),
    )


def draw(scene: Scene, bodies: list[DrawnBody], time: float, *, dots: int) -> Any:
    """The figure of one state, at `dots` pixels per inch."""
    figure, image, title = lay_out(scene, dots)
    image.set_data(render_into(scene, bodies, dots))
    title.set_text(literal(headline(scene, time)))
    return figure  # `save_figure` makes the texts fit


def animate(scene: Scene, states: Iterable[tuple[float, list[DrawnBody]]], *, dots: int) -> Iterator[Pixels]:
    """Pictures of many states (time, bodies), shape (height, width, 3); fixed parts are drawn once."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure, image, title = lay_out(scene, dots)
    canvas = FigureCanvasAgg(figure)
    title.set_text(literal(headline(scene, -1.2345e-5)))  # as long as the title can be
    tidy(figure)
    moving = [image, *image.axes.spines.values(), title] if scene.flat else [image, title]
    for artist in moving:
        artist.set_animated(True)
    canvas.draw()
    still = canvas.copy_from_bbox(figure.bbox)
    for time, bodies in states:
        canvas.restore_region(still)
        image.set_data(render_into(scene, bodies, dots))
        title.set_text(literal(headline(scene, time)))
        for artist in moving:
            image.axes.draw_artist(artist)
        yield np.array(canvas.buffer_rgba())[..., :3]


def lay_out(scene: Scene, dots: int) -> tuple[Any, Any, Any]:
    """(figure, its picture, its title): everything around the picture, which is still white."""
    import matplotlib
    from matplotlib.figure import Figure

    view = scene.view
    x, y = float(view.centre @ view.right), float(view.centre @ view.up)
    ends = np.array([x - view.half_width, x + view.half_width, y - view.half_height, y + view.half_height])
    length = unit_of("displacement", scene.units, float(np.abs(ends).max()))
    with matplotlib.rc_context({**CURVE_STYLE, "axes.grid": False}):
        figure = Figure(scene.size, dpi=dots)
        axes = figure.add_axes(scene.layout[0])
        image = axes.imshow(
            np.full((1, 1, 3), 255), extent=tuple(length.factor * ends), interpolation="none", aspect="auto"
        )
        if scene.flat:
            axes.spines[:].set_visible(True)
            axes.set_xlabel(length.beside("x"))
            axes.set_ylabel(length.beside("y"))
            axes.locator_params(nbins=6)
        else:
            axes.set_axis_off()
            draw_triad(figure, view)
        title = axes.set_title("", pad=10)
        if scene.label:
            limits = (scene.limits[0] * scene.unit.factor, scene.limits[1] * scene.unit.factor)
            draw_colour_bar(figure, scene.layout[1], limits, scene.colours, scene.label, extend=scene.extend)
    return figure, image, title


def draw_colour_bar(
    figure: Any, place: Rectangle, limits: tuple[float, float], colours: str, label: str, *, extend: str = "neither"
) -> None:
    """Draw the colour bar in a rectangle of the figure; extend: ends with arrows."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    upright = place[3] * figure.get_figheight() > place[2] * figure.get_figwidth()
    colour_bar = figure.colorbar(
        ScalarMappable(Normalize(*limits), colours),
        cax=figure.add_axes(place),
        orientation="vertical" if upright else "horizontal",
        label=label,
        extend=extend,
        extendfrac=0.03,
    )
    colour_bar.outline.set_linewidth(0.6)
    if upright:  # the power of ten belongs above the numbers, not over the picture
        colour_bar.ax.yaxis.set_offset_position("right")
        colour_bar.ax.yaxis.get_offset_text().set_horizontalalignment("left")


def render_into(scene: Scene, bodies: list[DrawnBody], dots: int) -> Pixels:
    """The bodies at the size of the picture."""
    _, _, width, height = scene.layout[0]
    size = (round(scene.size[0] * width * dots), round(scene.size[1] * height * dots))
    return render(bodies, scene.view, size=size, limits=scene.limits, colours=scene.colours)


def headline(scene: Scene, time: float) -> str:
    """The title with the time."""
    return f"{scene.title}, t = {time:.5g} {scene.units['time']}"


def field_unit(field: str, limits: tuple[float, float], units: Mapping[str, str]) -> Unit:
    """The unit of a field, or of its component, with values in these limits."""
    return unit_of(field.partition(".")[0], units, max(abs(limits[0]), abs(limits[1])))


def field_label(field: str, bodies: list[DrawnBody], unit: Unit) -> str:
    """Label of the colours: |displacement| [m], displacement x [m], stress xx [kPa]."""
    for body in bodies:
        data = body.surface.point_data
        if field in data:
            return unit.beside(f"|{field}|" if data[field].ndim > 1 and field != "principal_stress" else field)
    return unit.beside(field.replace(".", " "))


def draw_triad(figure: Any, view: View) -> None:
    """The directions of x, y and z in the lower left corner."""
    axes = figure.add_axes(
        (
            0.3 / figure.get_figwidth(),
            0.3 / figure.get_figheight(),
            0.6 / figure.get_figwidth(),
            0.6 / figure.get_figheight(),
        )
    )
    axes.set_axis_off()
    axes.set_xlim(-1, 1)
    axes.set_ylim(-1, 1)
    for name, direction in zip("xyz", np.eye(3), strict=True):
        tip = np.array([direction @ view.right, direction @ view.up])
        axes.annotate("", tip, (0, 0), arrowprops={"arrowstyle": "->", "shrinkA": 0, "shrinkB": 0})
        axes.text(*(tip + 0.35 * tip / max(float(np.hypot(*tip)), 0.1)), name, ha="center", va="center", fontsize=11)
