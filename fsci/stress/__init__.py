"""Randomised tests, `fsci stress`: random cases, each compared with an equivalent twin."""
