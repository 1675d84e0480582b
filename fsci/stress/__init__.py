"""Draws of hard cases, each against its twin: `fsci stress`."""
