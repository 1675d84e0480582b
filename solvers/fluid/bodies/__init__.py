"""Bodies in the flow: their surfaces and motion."""
