"""The other programs, each in a folder of its own: from PyPI by pip, or from Debian."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

#: Name -> packages of PyPI; the versions that docs/benchmarks.md has numbers of.
PACKAGES = {
    "ngsxfem": ("ngsolve==6.2.2608", "xfem==2.1.2608", "mkl"),
    "kratos": (
        "KratosMultiphysics==10.4.4",
        "KratosStructuralMechanicsApplication==10.4.4",
        "KratosContactStructuralMechanicsApplication==10.4.4",
        "KratosLinearSolversApplication==10.4.4",
        "KratosConstitutiveLawsApplication==10.4.4",
        "KratosFluidDynamicsApplication==10.4.4",
        "KratosMeshMovingApplication==10.4.4",
        "KratosMappingApplication==10.4.4",
        "KratosFSIApplication==10.4.4",
        "numpy",
    ),
}


class PeerMissing(Exception):
    """A program cannot be installed here, and why."""


def python_of(name: str, folder: Path) -> Path:
    """Python of a virtual environment in `folder` that has the program, made if there is none. Raises PeerMissing."""
    python = folder / name / "bin" / "python"
    if not python.exists():
        _call(sys.executable, "-m", "venv", str(folder / name))
        try:
            _call(str(python), "-m", "pip", "install", "-q", *PACKAGES[name])
        except PeerMissing:
            shutil.rmtree(folder / name)
            raise
    return python


def calculix() -> str:
    """The program ccx. Raises PeerMissing."""
    if (path := shutil.which("ccx")) is None:
        raise PeerMissing("there is no ccx: apt-get install calculix-ccx")
    return path


def _call(*command: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise PeerMissing(f"{' '.join(command[:4])}: {done.stderr.strip().splitlines()[-1:]}")
