"""Sparse matrices, blocks and linear solvers."""
