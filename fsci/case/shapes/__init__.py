"""Built-in meshes in the case file, by shape."""

from fsci.case.shapes.built_in import PlacedMesh
from fsci.case.shapes.plane import PlaneShape
from fsci.case.shapes.solid import SolidShape

Shape = PlaneShape | SolidShape
