"""Built-in structured meshes: plain functions from sizes and cell counts to a `Mesh` with named surfaces."""

from fsci.shapes import plane, solid
from fsci.shapes.leaflet import LEAFLET_SHAPES, leaflet
from fsci.shapes.plane import disc, rectangle, ring
from fsci.shapes.solid import beam, box, cylinder, hollow_sphere, hollow_torus, solid_torus, sphere, tube

annulus = tube

SHAPES = plane.PLANE_SHAPES | solid.SOLID_SHAPES | LEAFLET_SHAPES
