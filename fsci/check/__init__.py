"""The command `fsci check`: mistakes, warnings and cost of a case."""
