"""A case in one picture before it is computed: the command `fsci preview`."""
