"""Other programs on the same problems, on this machine: `python -m fsci.bench.peers FOLDER`."""
