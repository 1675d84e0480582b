"""Cells of the box as plain numbers: uniform, graded and nested ones."""
