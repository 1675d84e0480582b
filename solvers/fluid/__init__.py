"""Incompressible flow on a fixed grid that moving surfaces cut (CutFEM)."""
