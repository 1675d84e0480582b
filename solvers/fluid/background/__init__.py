"""The background grid: cells, processes, unknowns on it."""
