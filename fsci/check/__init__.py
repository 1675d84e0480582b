"""What `fsci check` says of a case."""
