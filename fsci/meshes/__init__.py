"""Meshes of a case: from files and scripts, placed, their parts found by name."""
