"""The distributed mesh of the cells, and the unknowns on it."""
