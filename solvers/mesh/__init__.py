"""Meshes as plain arrays: cells, facets, surfaces, distances."""
