"""The system that the terms make, and its solution."""
