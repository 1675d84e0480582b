"""Closed contact: fluid pressure and seepage where surfaces touch."""
