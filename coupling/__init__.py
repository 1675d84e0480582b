"""Fluid and structure together: what they exchange, and the schemes that bring them into balance."""
