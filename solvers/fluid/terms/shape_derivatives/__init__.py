"""Derivatives of the terms by the motion of surfaces."""
