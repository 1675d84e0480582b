"""What to say where DOLFINx is missing or too old: which one is needed, and the one command that installs it."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

VERSIONS = "DOLFINx 0.5 (Debian 12), or 0.9 and later, with real numbers and PETSc"

#: Packages that come with DOLFINx; what of them is missing tells that DOLFINx is.
WITH_DOLFINX = ("dolfinx", "basix", "ufl", "ffcx", "petsc4py", "mpi4py", "h5py")

APT = (
    "sudo apt-get install --no-install-recommends build-essential python3-dev python3-dolfinx python3-petsc4py "
    "python3-mpi4py python3-h5py python3-h5py-mpi python3-scipy"
)
CONDA = 'conda install -c conda-forge fenics-dolfinx "petsc=*=real*" h5py cxx-compiler'
PIP = f"{Path(sys.executable).name} -m pip install dolfinx-solver-real h5py"


def is_dolfinx(error: ImportError) -> bool:
    """Whether an import failed since DOLFINx, or what comes with it, is missing or has an unsupported version."""
    return (error.name or "").partition(".")[0] in WITH_DOLFINX


def words(error: ImportError, system: Mapping[str, str] | None = None) -> str:
    """What is missing, the versions that will do, and the command for this system.

    system: settings of os-release; by default those of this machine.
    """
    if isinstance(error, ModuleNotFoundError):
        found = f"there is no DOLFINx for {sys.executable}: the module '{error.name}' is missing"
    else:
        found = str(error)
    return f"{found}\nfsci needs {VERSIONS}. This installs it:\n\n    {command(system or os_release())}\n"


def command(system: Mapping[str, str]) -> str:
    """The command that installs DOLFINx for this Python, in the packages of its conda environment, system or PyPI."""
    if (Path(sys.prefix) / "conda-meta").is_dir():
        return CONDA
    if not has_package(system):
        return PIP
    return APT if sees_packages_of_the_system() else f"{APT}\n\n{USE_THEM}"


USE_THEM = """\
and its packages are seen by a virtual environment that is made with

    /usr/bin/python3 -m venv --system-site-packages FOLDER

in which fsci is installed by FOLDER/bin/pip"""


def has_package(system: Mapping[str, str]) -> bool:
    """Whether the system has a package of a DOLFINx that will do: Debian from 12, Ubuntu from 26.04, and theirs."""
    names = {system.get("ID", ""), *system.get("ID_LIKE", "").split()}
    version = system.get("VERSION_ID", "")
    number = float(version) if version.replace(".", "", 1).isdigit() else float("inf")  # testing has none
    if "ubuntu" in names:
        return number >= 26.04
    return "debian" in names and number >= 12


def sees_packages_of_the_system() -> bool:
    """Whether this Python is that of the system, or a virtual environment of it that has its packages."""
    of_system = sys.base_prefix == "/usr"
    return of_system and any(path.endswith("dist-packages") for path in sys.path if path.startswith("/usr/lib"))


def os_release(path: Path = Path("/etc/os-release")) -> dict[str, str]:
    """The settings of os-release: ID, VERSION_ID, ...; none where there is no such file."""
    if not path.is_file():
        return {}
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    pairs = (line.partition("=") for line in lines)
    return {name.strip(): value.strip().strip("\"'") for name, _, value in pairs}
