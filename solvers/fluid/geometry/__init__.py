"""Surfaces in the cells of a grid: pieces, regions, overlaps. Without finite elements, PETSc and MPI."""
