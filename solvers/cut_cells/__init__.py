"""The fluid in the cells that closed surfaces of bodies cut: one table, in 2D and 3D, without finite elements or MPI.

The solid is the union of the bodies. `cut_cells` rounds grid lines and vertices once to multiples of 2^-48 of the
smallest cell, and everything reads these. Two kernels in C++ fill the table: one in double for cells whose surfaces
are apart and where rounding decides nothing (`cut_fast.hpp`), and an exact one for all others (`cut_exact.hpp`), a BSP
of the cell by the planes of the facets (Thibault & Naylor, SIGGRAPH 1987). Its decisions are signs of determinants, in
double with a bound of their rounding error, or else in integers. Zeros are decided by rule: facets that coincide, or
lie in one plane or in a plane of the grid, cover one portal together, that of the first body counts; facets in a plane
of the grid divide that face of both cells along their edges. No tolerance and no perturbation.

A body is one or several closed surfaces that may touch, but not cross each other: a cell inside of two layers of one
body is not seen to be solid. Surfaces that touch after a rotation touch to rounding only: whether fluid passes between
them is then decided by the rounded vertices.
"""

from solvers.cut_cells.components import Components, components_of
from solvers.cut_cells.make import cut_cells
from solvers.cut_cells.surfaces import ClosedSurfaces
from solvers.cut_cells.table import CellState, CutTable
