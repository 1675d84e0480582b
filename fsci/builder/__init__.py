"""Construction of the objects of a run from a case. Only these modules import all classes of the solvers."""
