"""Films between walls that are closer than a cell."""
