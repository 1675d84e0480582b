"""Surfaces of bodies: their facets, their motion, what is inside of them."""
