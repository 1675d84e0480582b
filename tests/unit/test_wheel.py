"""A wheel: what is in it, and that it runs where the repository is not."""

import os
import subprocess
import sys
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


def modules_of_the_repository() -> set[str]:
    """As they are called in the wheel."""
    found = set()
    for package, place in (("fsci", "fsci"), ("solvers", "fsci/solvers"), ("coupling", "fsci/coupling")):
        paths = (path.relative_to(ROOT / package).as_posix() for path in (ROOT / package).rglob("*.py"))
        found |= {f"{place}/{path}" for path in paths}
    return {name for name in found if not name.startswith("fsci/bench/")}


#: What the program reads besides.
DATA = {"fsci/resolution/table.json", "fsci/stress/scenes.yaml", "fsci/stress/cases.yaml"}


@pytest.mark.slow
def test_wheel(tmp_path):
    """One top-level package with all modules and the kernels; it imports and computes, and knows its version."""
    build = [
        "pip",
        "wheel",
        "--quiet",
        "--no-build-isolation",
        "--no-deps",
        "--config-settings",
        "cmake.build-type=Debug",
    ]
    build += ["--config-settings", f"build-dir={tmp_path / 'build'}", "-w", str(tmp_path), str(ROOT)]
    done = subprocess.run([sys.executable, "-m", *build], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (wheel,) = tmp_path.glob("*.whl")
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
