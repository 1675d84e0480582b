"""Built-in meshes in the case file: every shape there is."""

from fsci.case.shapes.built_in import Placed
from fsci.case.shapes.plane import Disc, Rectangle, Ring
from fsci.case.shapes.solid import Beam, Box, Cylinder, HollowSphere, HollowTorus, SolidTorus, Sphere, Tube

Shape = Rectangle | Disc | Ring | Box | Beam | Cylinder | Tube | SolidTorus | HollowTorus | HollowSphere | Sphere

__all__ = ["Placed", "Shape"]
