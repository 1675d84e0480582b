"""The cut of the mesh by surfaces: active cells, quadrature weights, pockets, films and gaps."""
