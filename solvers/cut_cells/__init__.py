"""The fluid in the cells that closed surfaces of bodies cut: one table, in 2D and 3D, without finite elements or MPI.

The solid is the union of the bodies. `cut_cells` rounds grid lines and vertices once to multiples of 2^-48 of the
smallest cell, and everything reads these. Two kernels in C++ fill the table: one in double for cells whose surfaces
are apart and where rounding decides nothing (`cut_fast.hpp`), and an exact one for all others (`cut_exact.hpp`), a BSP
of the cell by the planes of the facets (Thibault & Naylor, SIGGRAPH 1987). Its decisions are signs of determinants, in
double with a bound of their rounding error, or else in integers. Zeros are decided by rule: facets that coincide, or
lie in one plane or in a plane of the grid, cover one portal together, that of the first body counts; facets in a plane
of the grid divide that face of both cells along their edges. No tolerance and no perturbation.

A body is one or several closed surfaces that may touch, but not cross each other: a cell inside of two layers of one
body is not seen to be solid.

Surfaces that touch after a rotation touch to rounding only, and the rounded vertices would decide whether fluid passes
between them. The closing length decides instead. Fluid between two facets A, B of any bodies, whose normals are at more
than 120 degrees, is taken for solid where n_A.(x - a) + n_B.(x - b) is at most this length, over both facets. Each pair
has such a zone, a convex body of half-spaces with integer coefficients, found before the cells: both cells at a face
see the same one, and no body is closed by its own thickness. Where neighbours bend the zones overlap by up to the gap.
The ends of zones bound regions, but have no facet and are in no column; their area is of the order of the length.
"""

from solvers.cut_cells.components import Components, components_of
from solvers.cut_cells.make import CellCutter, CrossingSurfaces, cut_cells
from solvers.cut_cells.surfaces import ClosedSurfaces
from solvers.cut_cells.table import CellState, CutTable
