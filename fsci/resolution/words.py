"""What the resolution of a flow means, body by body and gap by gap."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from fsci.resolution.table import Kind, cells_for, error, error_of_ends, least_error

if TYPE_CHECKING:
    from solvers.fluid.flow.resolution.cells import BodyCells, GapCells

#: Error [%] from which on a message is a warning. What is above 5 % is to warn, and what is below 1 % is not: the
#: geometric mean, since the table is known to a factor. With 2, a sphere of six cells with `q2q1` warns at 0.14 %.
WARNED = math.sqrt(5.0)
#: The same before the flow is known: what acts on the body may be another force.
SURE = 5.0
#: Error [%] that the remedy aims at.
GOOD_ERROR = 1.0

Errors = Callable[[str, float], float]  #: (element, cells) -> error [%]


@dataclass(frozen=True)
class Resolved:
    """A body or a gap, and the error of the force on the body that comes from it."""

    body: str
    to: str  #: what is opposite; empty: the body itself, apart from its narrow gaps
    cells: float  #: in the boundary layer or the gap; along it for films without ends with q2q1
    least: float  #: across the body, or at the narrowest place of the gap
    facets: float  #: facets per cell
    share: float  #: of the force on the body
    error: float  #: [%]
    message: str

    @property
    def warns(self) -> bool:
        return self.error >= WARNED

    def plain(self) -> dict[str, Any]:
        """All of it in the types of JSON."""
        return {**asdict(self), "warns": self.warns}


def resolved(bodies: Sequence[BodyCells], element: str) -> list[Resolved]:
    """One for each body and each of its narrow gaps."""
    return [found for body in bodies for found in (_of_body(body, element), *_of_gaps(body, element))]


def worst_by_body(found: Iterable[Mapping[str, Any]]) -> list[str]:
    """For each body the message of the largest error, if it warns."""
    worst: dict[str, Mapping[str, Any]] = {}
    for one in found:
        if one["warns"] and one["error"] > worst.get(one["body"], {"error": 0.0})["error"]:
            worst[one["body"]] = one
    return [one["message"] for one in worst.values()]


def before_the_run(body: BodyCells, element: str, *, films: bool) -> Iterator[tuple[tuple[str, str], str]]:
    """(body and what a gap is to, warning) about a rigid body, when nothing but the shape is known.

    Across the body it is the least error of the scenes. films: the body moves in its narrow gaps.
    """

    def errors(element: str, cells: float) -> float:
        return least_error(_kind(body), element, cells)

    off = errors(element, body.across)
    if off >= SURE:
        more = f"{_number(cells_for(partial(errors, element), GOOD_ERROR, body.across))} cells"
        words = f"forces were {_number(off)} % off in the benchmark, or more"
        text = f"{_number(body.across)} cells across the body: {words}{_remedy(errors, element, body.across, more)}"
        yield (body.body, ""), text
    if films:
        yield from (((found.body, found.to), found.message) for found in _of_gaps(body, element) if found.error >= SURE)


def _kind(body: BodyCells) -> Kind:
    if not body.sharp:
        return "smooth"
    return "sharp in space" if body.dim == 3 else "sharp"


def _of_body(body: BodyCells, element: str) -> Resolved:
    def errors(element: str, cells: float) -> float:
        return body.share * error(_kind(body), element, cells)

    off = errors(element, body.layer)
    text = (
        f"body '{body.body}': {_cells(body.layer)} in its boundary layer, {_number(body.across)} across it, {_off(off)}"
    )
    if off >= WARNED:
        finer = cells_for(partial(errors, element), GOOD_ERROR, body.layer) / body.layer
        text += _remedy(errors, element, body.layer, f"{_number(finer * body.across)} cells across it")
    return Resolved(body.body, "", body.layer, body.across, body.facets, body.share, off, text)


def _of_gaps(body: BodyCells, element: str) -> Iterator[Resolved]:
    for gap in body.gaps:

        def errors(element: str, finer: float, gap: GapCells = gap) -> float:
            return gap.share * _of_film(gap, element, finer)

        off, along = errors(element, 1.0), _along(gap, element)
        cells = gap.along if along else gap.cells
        text = (
            f"body '{gap.body}': {_number(gap.least)} cells in the gap to {_other(gap)} at its narrowest, "
            f"{_number(cells)} {'along it ' if along else ''}where the force acts, {_off(off)}"
        )
        if off >= WARNED:
            finer = cells_for(partial(errors, element), GOOD_ERROR, 1.0)
            text += _remedy(errors, element, 1.0, f"{_number(finer)} times as many cells there")
        yield Resolved(body.body, gap.to, cells, gap.least, body.facets, gap.share, off, text)


def _along(gap: GapCells, element: str) -> bool:
    """Whether the cells along a film decide: across, parabolas of q2q1 are exact."""
    return element == "q2q1" and not gap.ends


def _of_film(gap: GapCells, element: str, finer: float) -> float:
    """Error [%] of the force in a film with so many times finer cells."""
    if _along(gap, element):
        return error("film", element, finer * gap.along)
    if gap.ends:
        return error_of_ends(element, finer * gap.cells, finer * gap.along)
    return error("film", element, finer * gap.cells)


def _other(gap: GapCells) -> str:
    if gap.to == gap.body:
        return "itself"
    return f"face {gap.to}" if len(gap.to) == 2 and gap.to[1] in "+-" else f"'{gap.to}'"


def _off(off: float) -> str:
    words = f"{_number(off)} %" if off >= 0.1 else "less than 0.1 %"
    return f"with which forces were {words} off in the benchmark"


def _remedy(errors: Errors, element: str, cells: float, more: str) -> str:
    """The other element, where that is enough, and how many cells are."""
    other = element == "q1q1" and errors("q2q1", cells) < GOOD_ERROR
    return f"; take {'element: q2q1, or ' if other else ''}{more}"


def _cells(value: float) -> str:
    return f"{_number(value)} cells" if math.isfinite(value) else "no shear"


def _number(value: float) -> str:
    return f"{value:.2g}" if value < 99.5 else f"{value:.0f}"
