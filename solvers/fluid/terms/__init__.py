"""Weak forms and their derivatives."""
