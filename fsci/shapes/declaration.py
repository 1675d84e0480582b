"""What a shape declares: settings with meaning, unit and limits, and the plan of its mesh, before a node is made.

The settings of a case file, their documentation and the function in Python follow from the signature of one function.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import wraps
from inspect import get_annotations, signature
from typing import Annotated, Literal, ParamSpec, TypeAlias, get_args, get_origin

from fsci.distinct import distinct
from fsci.shapes import lattice
from solvers.mesh.mesh import Mesh

P = ParamSpec("P")

#: The table of a file: name in case files -> function of a shape, and an example of its settings.
Shapes: TypeAlias = dict[str, tuple[Callable[..., Mesh], str]]

#: Kind of a setting -> what must hold, and how messages say it.
LIMITS: dict[str, tuple[Callable[[float], bool], str]] = {
    "number": (lambda value: True, ""),
    "positive": (lambda value: value > 0, "greater than 0"),
    "not negative": (lambda value: value >= 0, "at least 0"),
    "count": (lambda value: value >= 1, "at least 1"),
}
#: Simplices that a cell of the lattice is divided into.
SIMPLICES = {"tri": 2, "tet": 6}


class ShapeError(ValueError):
    """Settings that no shape has: the message, and the keys that lead to the setting."""

    def __init__(self, message: str, *keys: str | int):
        super().__init__(f"{keys[0]}: {message}")
        self.message, self.keys = message, keys


@dataclass(frozen=True)
class Takes:
    """What a setting of a shape takes."""

    kind: Literal["number", "positive", "not negative", "count"]
    meaning: str
    unit: str = ""
    entries: int = 0  #: of a list; 0: a single value
    #: position in `cells` -> (what the count must be a multiple of, where these cells are)
    multiples: Mapping[int, tuple[int, str]] = field(default_factory=dict)

    def check(self, name: str, value: float | Sequence[float]) -> None:
        """Raises ShapeError."""
        values = list(value) if isinstance(value, Iterable) else [value]  # arrays, too
        if len(values) != (self.entries or 1):
            raise ShapeError(f"must have {self.entries or 1} entries, not {len(values)}", name)
        allowed, words = LIMITS[self.kind]
        for number in values:
            if not allowed(number):
                raise ShapeError(f"must be {words}, not {number:g}", name)


def number(meaning: str, unit: str = "m", entries: int = 0) -> Takes:
    return Takes("number", meaning, unit, entries)


def positive(meaning: str, unit: str = "m", entries: int = 0) -> Takes:
    return Takes("positive", meaning, unit, entries)


def not_negative(meaning: str, unit: str = "m") -> Takes:
    return Takes("not negative", meaning, unit)


def counts(entries: int, meaning: str, multiples: Mapping[int, tuple[int, str]] | None = None) -> Takes:
    """Of cells; see `Takes`."""
    return Takes("count", meaning, "", entries, multiples or {})


#: Degrees of a ring or a torus: the part that there is, and where it begins.
Part = Annotated[float, positive("angle of the part, at most 360", "degrees")]
Start = Annotated[float, number("angle between the x axis and the start of the part", "degrees")]


@dataclass(frozen=True)
class MeshPlan:
    """A mesh that is not made yet."""

    nodes: lattice.Lattice
    cells: Sequence[int]  #: as the case counts them
    cell: str  #: quad, tri, hex or tet
    extents: Sequence[float]  #: lengths [m] along the numbers in `cells`
    thickness: float  #: the shortest extent of the body [m]
    edges: Sequence[float] = ()  #: of a typical cell, if not the extents divided by the numbers
    flat: bool = False  #: whether its facets are exact

    def mesh(self) -> Mesh:
        return lattice.mesh(self.nodes.make(), self.cell)

    @property
    def dimension(self) -> int:
        return self.nodes.directions

    @property
    def hollow(self) -> bool:
        """Whether its wall encloses a space."""
        return set(self.surfaces) == {"inner", "outer"}

    @property
    def counts(self) -> tuple[int, int]:
        """(cells, nodes) of the mesh."""
        return self.nodes.cells * SIMPLICES.get(self.cell, 1), self.nodes.nodes

    @property
    def surfaces(self) -> tuple[str, ...]:
        """Names that supports, loads and probes can use; the ends of a part come last."""
        return tuple(sorted(self.nodes.sides, key=lambda name: name in ("start", "end")))

    @property
    def aspect(self) -> float:
        """Longest over shortest edge of a typical cell."""
        edges = self.edges or [extent / count for extent, count in zip(self.extents, self.cells, strict=True)]
        return max(edges) / min(edges)


def settings(plan: Callable[..., MeshPlan]) -> dict[str, Takes]:
    """What the settings of a shape take, by name."""
    found = get_annotations(plan, eval_str=True)
    return {name: get_args(takes)[1] for name, takes in found.items() if get_origin(takes) is Annotated}


def meshed(plan: Callable[P, MeshPlan]) -> Callable[P, Mesh]:
    """The function of a shape for Python: it checks the settings as a case file does, and makes the mesh.

    Its plan is `inspect.unwrap` of it. Raises ShapeError.
    """
    takes, parameters = settings(plan), signature(plan)

    @wraps(plan)
    def mesh(*args: P.args, **kwargs: P.kwargs) -> Mesh:
        given = parameters.bind(*args, **kwargs)
        for name, value in given.arguments.items():
            if name in takes:
                takes[name].check(name, value)
        made = plan(*args, **kwargs)
        require_multiples(made.cells, takes["cells"])
        return made.mesh()

    mesh.__signature__ = parameters.replace(return_annotation="Mesh")  # type: ignore[attr-defined]
    return mesh


def require_multiples(cells: Sequence[int], takes: Takes) -> None:
    """Raises ShapeError for a count of cells that is not a multiple of what it has to be."""
    for at, (unit, where) in takes.multiples.items():
        if cells[at] % unit:
            wanted = "even" if unit == 2 else f"a multiple of {unit}"
            raise ShapeError(f"the number of cells {where} must be {wanted}, not {cells[at]}", "cells", at)


def require_around(cells: Sequence[int], at: int) -> None:
    """A closed circle needs three cells."""
    if cells[at] < 3:
        raise ShapeError(f"at least 3 cells are needed all the way around, not {cells[at]}", "cells", at)


def require_part(angle: float, cells: Sequence[int]) -> None:
    """A ring or a part of it, with the number of cells around first."""
    if angle > 360:
        raise ShapeError(f"must be at most 360 degrees, not {angle:g}", "angle")
    if angle == 360:
        require_around(cells, 0)


def require_less(name: str, value: float, *, than: str, limit: float) -> None:
    """One setting must be less than another one."""
    if value >= limit:
        raise ShapeError("must be less than '{}', {}, not {}".format(than, *distinct(limit, value)), name)


def require_wall(inner_radius: float, outer_radius: float) -> None:
    if outer_radius <= inner_radius:
        inner, outer = distinct(inner_radius, outer_radius)
        raise ShapeError(f"must be greater than 'inner_radius', {inner}, not {outer}", "outer_radius")
