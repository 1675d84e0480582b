"""The program in a process of its own, as users start it."""

from __future__ import annotations

import os
import sys

#: One thread per process; Open MPI as root, on shared cores.
ON_SHARED_CORES = {
    "OPENBLAS_NUM_THREADS": "1",
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
}


def environment() -> dict[str, str]:
    """Its variables: those of this process, and those of a program on shared cores."""
    return os.environ | ON_SHARED_CORES


def command(*arguments: str, processes: int = 1) -> list[str]:
    """The command that starts the program."""
    launcher = ["mpirun", "-n", str(processes)] if processes > 1 else []
    return [*launcher, sys.executable, "-m", "fsci", *arguments]
