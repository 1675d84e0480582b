"""The error that the resolution of a flow had in the benchmark."""
