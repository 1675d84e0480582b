"""Time and memory: `python -m fsci.bench`."""
