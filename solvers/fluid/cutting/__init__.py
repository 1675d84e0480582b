"""The cut of the grid by surfaces, and the integrals over it."""
