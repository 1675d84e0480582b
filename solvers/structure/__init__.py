"""Finite-deformation solids: bodies of hyperelastic material, static or in motion."""
