"""Regions into which surfaces divide a cell, its faces and edges."""
