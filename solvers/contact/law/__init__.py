"""What surfaces in contact obey: one law a file."""
