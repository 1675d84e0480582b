"""Section `mesh` of a body: a file or a built-in shape."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from fsci.case.section import fault, setting
from fsci.case.shapes import AnyShape, PlacedMesh
from fsci.case.values import (
    Count,
    CountOrZero,
    Name,
    Number,
    Order,
    Positive,
    Text,
    chosen,
    describe_value,
)
from fsci.shapes import SHAPES


class FileMesh(PlacedMesh):
    """A mesh from a file: gmsh's .geo or .msh with physical names, .unv, or any format that meshio reads.

    All cells are of one type: triangles or tetrahedra of first or second order, quadrilaterals or hexahedra of first or
    full second order. Cells with 8 and 20 nodes get nodes in the middle, so that they have 9 and 27. Prisms, pyramids
    and mixed meshes are refused, and so are scripts that would run programs or write files.
    """

    file: Text = setting(..., "path of the file, relative to the case file")
    order: Order = setting(
        "auto",
        "polynomial order of the cells (.geo, and with 'thickness'; other files have theirs); auto: 2 for an elastic "
        "body, but 1 for one that is not slender where it may touch with friction, in a flow or in space, or where a "
        "support moves it in a flow",
    )
    parameters: dict[Name, Number] = setting(dict, "values for the script's DefineConstant names (.geo only)")
    size_factor: Positive = setting(
        1.0,
        "edges of cells are so many times as long as the script says, also along transfinite curves; layers of "
        "extrusions stay (.geo only)",
        unit="1",
    )
    scale: Positive = setting(
        1.0, "factor of all coordinates of the file, before anything else: 0.001 for a file in mm", unit="1"
    )
    thickness: Positive | None = setting(
        None,
        "the file is a surface in space (STL, too), in 2D lines: it becomes the middle of a body with this thickness "
        "and the surfaces top, where normals point, bottom and edge; named parts of the edge keep their names",
        unit="m",
    )
    layers: Count = setting(1, "number of cells through the thickness")
    refine: CountOrZero = setting(
        0, "how often edges are halved, so that each cell becomes four, in 3D eight; the surface stays what it is"
    )

    @model_validator(mode="after")
    def _of_layers(self) -> FileMesh:
        if self.thickness is None and "layers" in self.model_fields_set:
            raise fault("'layers' belongs to 'thickness'", "layers")
        return self


def _file_or_shape(value: Any) -> Any:
    if not isinstance(value, dict):
        raise fault(f"must be a section with 'file' or 'shape', not {describe_value(value)}")
    if "file" in value and "shape" in value:
        raise fault("give either 'file' or 'shape', not both", "shape")
    if "file" not in value and "shape" not in value:
        raise fault("needs the setting 'file' or 'shape'")
    return value


# The tags are no names of settings, so that an error's path cannot be misread.
Mesh = Annotated[
    Annotated[FileMesh, Tag("mesh file")]
    | Annotated[AnyShape, Field(discriminator="shape"), chosen("shape", list(SHAPES)), Tag("built-in mesh")],
    Discriminator(lambda value: "mesh file" if "file" in value else "built-in mesh"),
    BeforeValidator(_file_or_shape),
]
