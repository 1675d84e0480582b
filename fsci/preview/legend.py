"""The legend of a preview: what has which colour, and its place beside or below the scene."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from fsci.plot.curves import COLOURS
from fsci.plot.units import literal
from fsci.preview.parts import DistantPair, NamedSurface, Preview

LEGEND = 3.4  #: width of a legend beside the scene [inch]
ROW = 0.21  #: height of a line of the legend [inch]
LEGEND_COLUMNS = 3  #: of a legend below the scene
MANY_ENTRIES = 40  #: of the legend
# Bodies have COLOURS; what is no body has others.
PATCHES = {"no slip": "black", "velocity": "#00207f", "outflow": "#5f7f1f", "periodic": "#7f5f1f"}
MARK_COLOURS = {
    "support": "black",
    "spring": "dimgray",
    "traction": "#8b2500",
    "pressure": "#8b3a8b",
    "force": "#8b2500",
    "motion": "#006400",
    "velocity": PATCHES["velocity"],
}
OTHER_PATCH = "#7f7f7f"
NEAR = "#cc0000"  #: of the line between the surfaces of a pair

Entry = tuple[Any, str, str]  #: colour, words, marker of a point or line; empty: a surface


def colours_of(bodies: list[NamedSurface]) -> list[str]:
    """One for each body; more bodies than colours share them."""
    return [COLOURS[number % len(COLOURS)] for number in range(len(bodies))]


def entries(scene: Preview, unit: str) -> Iterator[Entry]:
    """The legend: what has which colour."""
    for part, colour in zip(scene.bodies, colours_of(scene.bodies), strict=True):
        yield colour, f"{part.name} ({part.kind})", ""
    for part in scene.marks:
        yield MARK_COLOURS[part.kind], f"{part.kind} on {part.name}", ""
    for point in scene.points:
        yield MARK_COLOURS[point.kind], f"{point.kind} at a point of {point.name}", "^"
    for pair in scene.pairs:
        yield NEAR, f"pair {words_of(pair, unit)}", "."
    for part in scene.patches:
        yield PATCHES.get(part.kind, OTHER_PATCH), f"patch {part.name} ({part.kind})", ""
    for kind in sorted({arrow.kind for arrow in scene.arrows} & {"motion"}):
        yield MARK_COLOURS[kind], "begins to move", "$\\rightarrow$"
    for name in scene.probes:
        yield "black", f"probe {name}", "+"


def words_of(pair: DistantPair, unit: str) -> str:
    """Its surfaces and how far they are apart."""
    slave, master = pair.sides
    apart = f"{pair.distance:.4g} {unit} apart" if pair.distance > 0.0 else "touching"
    return f"{pair.name}: {slave.name}, {master.name}, {apart}"


def handles(scene: Preview, unit: str) -> list[Any]:
    """Lines and surfaces of matplotlib, with the words of each entry."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    found = list(entries(scene, unit))
    if len(found) > MANY_ENTRIES:
        found = [*found[: MANY_ENTRIES - 1], ("white", f"and {len(found) - MANY_ENTRIES + 1} more", "")]
    shown: list[Any] = []
    for colour, words, marker in found:
        text = literal(_short(words))
        if marker:
            looks: Any = {"color": colour, "marker": marker, "linestyle": "-" if marker == "." else ""}
            shown.append(Line2D([], [], label=text, **looks))
        else:
            shown.append(Patch(color=colour, label=text))
    return shown


def add_beside(figure: Any, shown: list[Any]) -> None:
    """In the last LEGEND inches of the figure."""
    place = (1.0 - LEGEND / figure.get_figwidth(), 1.0 - 0.5 / figure.get_figheight())
    figure.legend(handles=shown, fontsize=8 if len(shown) <= 25 else 6, loc="upper left", bbox_to_anchor=place)


def add_below(figure: Any, shown: list[Any]) -> None:
    """In the last `height_below` inches of the figure."""
    place = (0.5, (height_below(shown) - 0.1) / figure.get_figheight())
    figure.legend(handles=shown, fontsize=8, ncols=LEGEND_COLUMNS, loc="upper center", bbox_to_anchor=place)


def height_below(shown: list[Any]) -> float:
    """[inch]."""
    return ROW * -(-len(shown) // LEGEND_COLUMNS) + 0.3


def _short(words: str) -> str:
    """At most 54 characters; what is at the end is what matters of a pair: its distance."""
    return words if len(words) <= 54 else f"{words[:31]}...{words[-20:]}"
