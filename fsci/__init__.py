"""Fluid-structure-contact interaction from one YAML case file."""

import os

# Read by libraries when they are first imported; variables that the user has set are kept.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Waiting processes yield their core. A single process must not: MUMPS polls MPI for messages all the time.
if int(os.environ.get("OMPI_COMM_WORLD_SIZE", "1")) > 1:
    os.environ.setdefault("OMPI_MCA_mpi_yield_when_idle", "1")
os.environ.setdefault("OMPI_MCA_btl_vader_single_copy_mechanism", "none")
