"""Thin bodies: each side of the fluid has cells and unknowns of its own."""
