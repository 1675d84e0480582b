"""The settings of a case with its cells, facets and steps so many times as large: levels, and one source alone."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from fsci.case import Case
from fsci.case.mesh import FileMesh
from fsci.case.shapes import ShapeSection
from fsci.meshes.curved import is_curved
from fsci.meshes.of_case import read_body, read_obstacle, read_rigid_body
from fsci.twin.grids import Settings, resized, resized_count

#: What a source of errors is in words.
SOURCE_WORDS = {
    "cells": "cells of the grid",
    "bodies": "cells of elastic bodies",
    "files": "cells of mesh files",
    "facets": "facets of rigid surfaces",
    "step": "step",
}


@dataclass(frozen=True)
class Source:
    """A source of errors that has a size."""

    name: str
    settings: Callable[[float], Settings]  #: of a factor of its size
    size: Callable[[Case], float]  #: of a case [any unit]: that of two cases has their real ratio
    largest: float = math.inf  #: factor of its size, beyond which it stays

    def ratio(self, case: Case, other: Case) -> float:
        """The size in another case over that in the case."""
        return self.size(other) / self.size(case)


def sources(case: Case) -> dict[str, Source]:
    """The sources of errors that a case has and that can be made larger and smaller. Reads meshes of scripts."""
    found = (_cells(case), _bodies(case), _files(case), _facets(case), _step(case))
    return {source.name: source for source in found if source is not None}


def fixed(case: Case) -> Iterator[str]:
    """Names of bodies and obstacles with curved surfaces whose facets no level changes, with their files."""
    for name, mesh in _all_meshes(case).items():
        if isinstance(mesh, FileMesh) and not _scripted(mesh) and _has_curves(case, name):
            yield f"{name.rsplit('.', 1)[-1]} ({mesh.file})"


def _has_curves(case: Case, name: str) -> bool:
    """Whether the surfaces that count of a body or obstacle are curved."""
    group, body = name.rsplit(".", 1)
    if group == "contact.obstacles":
        assert case.contact is not None
        return is_curved(read_obstacle(case, body), case.contact.obstacles[body].on)
    if group in ("fluid.bodies", "rigid.bodies"):
        return is_curved(read_rigid_body(case, body)[0], case.rigid_surfaces[body].on)
    return is_curved(read_body(case, body))


def scaled(found: Mapping[str, Source], factors: Mapping[str, float]) -> Settings:
    """Settings with each named source so many times as large."""
    return tuple(
        setting for name, factor in factors.items() if factor != 1.0 for setting in found[name].settings(factor)
    )


def _cells(case: Case) -> Source | None:
    if case.fluid is None:
        return None
    grid = case.fluid.grid
    # a direction with one cell is none
    directions = [axis for axis, count in enumerate(grid.shape) if count > 1]
    if not directions:
        return None

    def size(other: Case) -> float:
        assert other.fluid is not None
        return math.prod(other.fluid.grid.shape[axis] for axis in directions) ** (-1.0 / len(directions))

    return Source("cells", lambda factor: resized(grid, factor), size)


def _bodies(case: Case) -> Source | None:
    meshes = {name: body.mesh for name, body in case.elastic_bodies.items() if scalable(body.mesh)}
    if not meshes:
        return None
    named = {f"structure.bodies.{name}": mesh for name, mesh in meshes.items()}
    return Source("bodies", lambda factor: _meshes(named, factor), lambda other: _size_of(other, meshes))


def _files(case: Case) -> Source | None:
    """Elastic bodies from mesh files: edges are halved, and not larger than in the file."""
    each = {name: body.mesh for name, body in case.elastic_bodies.items()}
    meshes = {name: mesh for name, mesh in each.items() if isinstance(mesh, FileMesh) and not _scripted(mesh)}
    if not meshes:
        return None

    def settings(factor: float) -> Settings:
        wanted = -math.log2(factor)
        halvings = int(math.copysign(math.ceil(abs(wanted) - 0.5 - 1e-9), wanted))  # of two the smaller one
        counts = {name: max(0, mesh.refine + halvings) for name, mesh in meshes.items()}
        return tuple(
            (f"structure.bodies.{name}.mesh.refine", str(count))
            for name, count in counts.items()
            if count != meshes[name].refine
        )

    largest = 2.0 ** max(mesh.refine for mesh in meshes.values())
    return Source("files", settings, lambda other: _size_of(other, meshes), largest)


def _size_of(case: Case, bodies: Iterable[str]) -> float:
    """Of the cells of elastic bodies, by their number."""
    each = [read_body(case, name) for name in bodies]
    return float(sum(len(mesh.cells) for mesh in each) ** (-1.0 / each[0].points.shape[1]))


def _facets(case: Case) -> Source | None:
    """Rigid bodies and obstacles: only their surfaces count, and those of boxes are exact."""
    meshes = {name: mesh for name, mesh in _rigid(case).items() if scalable(mesh) and not _flat(mesh)}
    if not meshes:
        return None

    def size(other: Case) -> float:
        counts, dimensions = 0, 1
        for name in meshes:
            group, body = name.rsplit(".", 1)
            if group == "contact.obstacles":
                mesh = read_obstacle(other, body)
                count = sum(len(facets) for facets in mesh.surfaces.values())
            else:
                mesh, _, facets = read_rigid_body(other, body)
                count = len(facets)
            counts, dimensions = counts + count, mesh.points.shape[1] - 1
        return float(counts) ** (-1.0 / dimensions)

    return Source("facets", lambda factor: _meshes(meshes, factor), size)


def _step(case: Case) -> Source | None:
    """Not of a steady flow; nor of statics in one step, which has no step that could be larger."""
    steady = case.fluid is not None and case.fluid.scheme == "steady" and not case.elastic_bodies
    still = case.structure is not None and case.structure.dynamics is None
    if steady or (case.time.steps == 1 and (still or case.fluid is None)):
        return None
    length = case.time.end - case.time.start

    def settings(factor: float) -> Settings:
        count = resized_count(case.time.steps, factor)
        return (("time.step", repr(length / count)),)

    return Source("step", settings, lambda other: length / other.time.steps)


def _rigid(case: Case) -> dict[str, Any]:
    found: dict[str, Any] = {".".join(surface.keys): surface.mesh for surface in case.rigid_surfaces.values()}
    if case.contact is not None:
        found |= {f"contact.obstacles.{name}": obstacle.mesh for name, obstacle in case.contact.obstacles.items()}
    return found


def _all_meshes(case: Case) -> dict[str, Any]:
    return {f"structure.bodies.{name}": body.mesh for name, body in case.elastic_bodies.items()} | _rigid(case)


def _scripted(mesh: FileMesh) -> bool:
    return mesh.file.endswith(".geo")


def scalable(mesh: Any) -> bool:
    """Whether cells of a mesh can have any size."""
    return not isinstance(mesh, FileMesh) or _scripted(mesh)


def _flat(mesh: Any) -> bool:
    """Whether facets are exact."""
    return isinstance(mesh, ShapeSection) and mesh.plan.flat


def _meshes(meshes: Mapping[str, Any], factor: float) -> Settings:
    return tuple(
        (f"{name}.mesh.{key}", value)
        for name, mesh in meshes.items()
        if scalable(mesh)
        for key, value in (_of_script(mesh, factor) if isinstance(mesh, FileMesh) else _of_shape(mesh, factor))
    )


def _of_script(mesh: FileMesh, factor: float) -> list[tuple[str, str]]:
    return [("size_factor", repr(mesh.size_factor * factor))]


def _of_shape(mesh: ShapeSection, factor: float) -> list[tuple[str, str]]:
    pairs = zip(mesh.cells, mesh.multiples, strict=True)
    counts = [unit * resized_count(count // unit, factor) for count, unit in pairs]
    return [("cells", json.dumps(counts))]
