"""How many cells the grid has across bodies, gaps and boundary layers."""
