"""Matrices of the flow and the solution of linear systems with them."""
