"""A run: steps through time, results, checkpoints, stop and resume."""
