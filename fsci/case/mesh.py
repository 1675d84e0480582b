"""Section `mesh` of a body: a file or a built-in shape."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Tag

from fsci.case.section import fault, setting
from fsci.case.shapes import (
    Beam,
    Box,
    Cylinder,
    Disc,
    HollowSphere,
    HollowTorus,
    Placed,
    Rectangle,
    Ring,
    SolidTorus,
    Tube,
)
from fsci.case.values import Name, Number, Text, chosen, spoken


class FileMesh(Placed):
    """A mesh from a file: gmsh's .geo or .msh with physical names, or any format that meshio reads."""

    file: Text = setting(..., "path of the file, relative to the case file")
    order: Literal[1, 2] = setting(1, "polynomial order of the cells (.geo only; other files have theirs)")
    parameters: dict[Name, Number] = setting(dict, "values for the script's DefineConstant names (.geo only)")


#: shapes by their names in case files
SHAPES = {
    name: shape
    for shape in (Rectangle, Disc, Ring, Box, Beam, Cylinder, Tube, SolidTorus, HollowTorus, HollowSphere)
    for name in get_args(shape.model_fields["shape"].annotation)
}


def _file_or_shape(value: Any) -> Any:
    if not isinstance(value, dict):
        raise fault(f"must be a section with 'file' or 'shape', not {spoken(value)}")
    if "file" in value and "shape" in value:
        raise fault("give either 'file' or 'shape', not both", "shape")
    if "file" not in value and "shape" not in value:
        raise fault("needs the setting 'file' or 'shape'")
    return value


def _kind(value: Any) -> str:
    """Which of the alternatives a mesh is, from data that has passed `_file_or_shape`."""
    ...
