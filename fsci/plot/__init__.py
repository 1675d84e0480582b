"""Pictures, curves and movies of a results folder."""
