"""Built-in structured meshes: plain functions from sizes and cell counts to a `Mesh` with named surfaces."""

from fsci.shapes.leaflet import leaflet
from fsci.shapes.plane import disc, rectangle, ring
from fsci.shapes.solid import beam, box, cylinder, hollow_sphere, hollow_torus, solid_torus, sphere, tube

annulus = tube
