"""A case beside twins of it, whose answers must be the same: the command `fsci twin`."""
