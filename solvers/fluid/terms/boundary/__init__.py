"""Conditions on the faces of the box."""
