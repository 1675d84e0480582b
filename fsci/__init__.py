"""Fluid-structure-contact interaction from one YAML case file, and from Python: load, build, run, results."""

import os
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fsci.case import CaseError
    from fsci.python import Results, RunFailed, build, load, results, run

__all__ = ["CaseError", "Results", "RunFailed", "build", "load", "results", "run"]

# Read by libraries when they are first imported; variables that the user has set are kept.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Waiting processes yield their core. A single process must not: MUMPS polls MPI for messages all the time.
if int(os.environ.get("OMPI_COMM_WORLD_SIZE", "1")) > 1:
    os.environ.setdefault("OMPI_MCA_mpi_yield_when_idle", "1")
os.environ.setdefault("OMPI_MCA_btl_vader_single_copy_mechanism", "none")


def __getattr__(name: str) -> Any:
    """What Python users have, imported when it is first used: the command line has to start at once."""
    if name not in __all__:
        raise AttributeError(f"module 'fsci' has no attribute '{name}'")
    from importlib import import_module

    return getattr(import_module("fsci.case" if name == "CaseError" else "fsci.python"), name)
