"""A wheel: what is in it, and that it runs where the repository is not."""

import os
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

IMPORT_ALL = """
import importlib, pkgutil, sys
import fsci
for module in pkgutil.walk_packages(fsci.__path__, "fsci."):
    if module.name != "fsci.__main__" and not module.name.endswith(("fem.nanobind", "fem.pybind")):
        importlib.import_module(module.name)
for name, module in list(sys.modules.items()):
    if name.partition(".")[0] in ("fsci", "solvers", "coupling"):
        print(name, module.__file__)
"""

CASE = """\
title: a block on an edge
time: {step: 1, end: 1}
structure:
  bodies:
    block:
      mesh: {shape: rectangle, size: [1, 1], cells: [2, 2]}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1}
      supports: [{on: bottom, displacement: [0, 0]}]
      gravity: [0, -9.81]
"""


#: The repository is installed in place by a finder of its own, which comes before all paths.
WITHOUT_REPOSITORY = """\
import sys
sys.meta_path = [finder for finder in sys.meta_path if not type(finder).__module__.startswith("_editable")]
"""


#: A program `python -c ... COMMAND` for which what DOLFINx brings does not exist.
WITHOUT_DOLFINX = """\
import sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("dolfinx", "basix", "ufl", "ffcx", "petsc4py", "mpi4py"):
            raise ModuleNotFoundError(f"No module named '{name}'", name=name)
sys.meta_path.insert(0, Hidden())
from fsci.cli import main
main()
"""


def modules_of_the_repository() -> set[str]:
    """As they are called in the wheel."""
    found = set()
    for package, place in (("fsci", "fsci"), ("solvers", "fsci/solvers"), ("coupling", "fsci/coupling")):
        paths = (path.relative_to(ROOT / package).as_posix() for path in (ROOT / package).rglob("*.py"))
        found |= {f"{place}/{path}" for path in paths}
    return {name for name in found if not name.startswith("fsci/bench/")}


#: What the program reads besides.
DATA = {"fsci/resolution/table.json", "fsci/stress/scenes.yaml", "fsci/stress/cases.yaml"}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    build = [
        "pip",
        "wheel",
        "--quiet",
        "--no-build-isolation",
        "--no-deps",
        "--config-settings",
        "cmake.build-type=Debug",
    ]
    build += ["--config-settings", f"build-dir={folder / 'build'}", "-w", str(folder), str(ROOT)]
    done = subprocess.run([sys.executable, "-m", *build], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (built,) = folder.glob("*.whl")
    return built


@pytest.mark.slow
def test_wheel(tmp_path, wheel):
    """One top-level package with all modules and the kernels; it imports and computes, and knows its version."""
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert wheel.name.startswith(f"fsci-{version}-cp")

    site = tmp_path / "site"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
        names = {name for name in archive.namelist() if not name.startswith("fsci-")}
    kernels = {name for name in names if name.startswith("fsci/solvers/kernels/_kernels.") and name.endswith(".so")}
    assert len(kernels) == 1
    assert names - kernels == modules_of_the_repository() | DATA

    (tmp_path / "sitecustomize.py").write_text(WITHOUT_REPOSITORY)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(site), str(tmp_path)])}
    done = subprocess.run(
        [sys.executable, "-c", IMPORT_ALL], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    loaded = dict(line.split(" ", 1) for line in done.stdout.splitlines())
    assert loaded.keys() >= {"fsci.builder.build", "fsci.solvers.fluid.solve.system", "fsci.coupling.monolithic"}
    assert [name for name, path in loaded.items() if not path.startswith(str(site))] == []
    assert not {"solvers", "coupling"} & loaded.keys()

    (tmp_path / "case.yaml").write_text(CASE)
    run = [sys.executable, "-m", "fsci", "run", "case.yaml", "-o", "out"]
    done = subprocess.run(run, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    done = subprocess.run([*run[:3], "--version"], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.stdout.split() == ["fsci", version]


@pytest.mark.slow(seconds=150)
def test_installed_program(tmp_path, wheel):
    """In a new virtual environment of the system's Python it writes, computes and draws its demonstration.

    Python packages that it needs are those of the environment of the tests, whose fsci is not seen.
    """
    base = f"{sys.base_prefix}/bin/python3"
    subprocess.run([base, "-m", "venv", "--system-site-packages", tmp_path / "venv"], check=True)
    python = tmp_path / "venv" / "bin" / "python"
    install = [python, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps", wheel]
    done = subprocess.run(install, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (site,) = (tmp_path / "venv").glob("lib/python*/site-packages")
    (site / "packages_of_the_tests.pth").write_text(sysconfig.get_path("purelib") + "\n")

    fsci = [python.parent / "fsci"]
    done = subprocess.run([*fsci, "demo"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    for picture in ("movie", "story_velocity.png", "history_ball.png", "history_contact.png", "history_energy.png"):
        assert f"results/ball/pictures/{picture}" in done.stdout
        assert list((tmp_path / "results/ball/pictures").glob(f"{picture}*"))

    hidden = [python, "-c", WITHOUT_DOLFINX, "run", "ball"]
    done = subprocess.run(hidden, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.startswith(f"fsci: there is no DOLFINx for {python}: the module 'mpi4py' is missing\n")
