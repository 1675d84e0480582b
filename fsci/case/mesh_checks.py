"""Checks of meshes against the rest of the case: files, dimensions, names of surfaces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from fsci.case.errors import did_you_mean
from fsci.case.mesh import FileMesh, Mesh
from fsci.case.shapes import ShapeSection
from fsci.case.yaml_text import Keys

Mistake = tuple[Keys, str]  #: path of the setting, message


def mesh_mistakes(
    mesh: Mesh, dimension: int | None, folder: Path, keys: Keys, other: str = "another body"
) -> Iterator[Mistake]:
    """Mistakes in the dimension of the mesh of a body; other: the part of the case that has the right one."""
    if isinstance(mesh, ShapeSection):
        if mesh.plan.dimension != dimension:
            yield (*keys, "shape"), f"this shape is {mesh.plan.dimension}D, but {other} is {dimension}D"
    else:
        yield from _file(mesh, folder, keys)
    if mesh.mirror == "z" and dimension == 2:
        yield (*keys, "mirror"), "'mirror' must be x or y in 2D"
    for i, rotation in enumerate(mesh.rotate):
        yield from axis_mistakes(rotation.axis, dimension, (*keys, "rotate", i))
    if mesh.translate is not None:
        yield from length_mistakes(mesh.translate, dimension, (*keys, "translate"))


def axis_mistakes(axis: tuple[float, ...] | None, dimension: int | None, keys: Keys) -> Iterator[Mistake]:
    """A rotation in 3D has an axis."""
    if axis is None and dimension == 3:
        yield keys, "a rotation in 3D needs the setting 'axis'"
    elif axis is not None and dimension == 2:
        yield keys, "a rotation in 2D has no 'axis'"
    elif axis is not None and not any(axis):
        yield keys, "the axis of a rotation must not be zero"


def surface_mistakes(mesh: Mesh, name: str, keys: Keys) -> Iterator[Mistake]:
    """Mistakes in the names of surfaces of built-in shapes."""
    if isinstance(mesh, ShapeSection) and name not in (surfaces := (*mesh.plan.surfaces, *mesh.surfaces)):
        there = ", ".join(surfaces)
        hint = did_you_mean(name, surfaces)
        hint = f"{hint} (available: {there})" if hint.startswith(";") else hint
        yield keys, f"'{mesh.shape}' has no surface '{name}'{hint}"


def surfaces_mistakes(mesh: Mesh, names: Sequence[str], keys: Keys) -> Iterator[Mistake]:
    """Mistakes in a list of names of surfaces."""
    for i, name in enumerate(names):
        yield from surface_mistakes(mesh, name, (*keys, i))


def length_mistakes(vector: tuple[object, ...] | None, dimension: int | None, keys: Keys) -> Iterator[Mistake]:
    """A vector has as many entries as there are dimensions."""
    if vector is not None and dimension is not None and len(vector) != dimension:
        yield keys, f"'{keys[-1]}' must have {dimension} entries in {dimension}D, not {len(vector)}"


def _file(mesh: FileMesh, folder: Path, keys: Keys) -> Iterator[Mistake]:
    path = folder / mesh.file
    try:
        found, exists = path.is_file(), path.exists()
    except (OSError, ValueError):  # a name too long, or with a zero byte
        found = exists = False
    if exists and not found:
        yield (*keys, "file"), f"mesh file '{mesh.file}' is not a file"
    elif not found:
        yield (*keys, "file"), f"mesh file '{mesh.file}' not found in {folder.absolute()}"
    if path.suffix != ".geo":
        for name in ("order", "parameters"):
            if name in mesh.model_fields_set and not (name == "order" and mesh.thickness is not None):
                yield (*keys, name), f"'{name}' is for .geo files; '{mesh.file}' has its own"
