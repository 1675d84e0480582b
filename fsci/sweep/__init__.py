"""A case with several values of some settings: the command `fsci sweep`."""
