"""What the program says where DOLFINx is missing."""

import sys

import pytest

from fsci import dolfinx_needed
from fsci.cli import execute
from fsci.dolfinx_needed import APT, CONDA, PIP, USE_THEM, command, os_release

DEBIAN = {"ID": "debian", "VERSION_ID": "12"}
UBUNTU = {"ID": "ubuntu", "ID_LIKE": "debian"}
MINT = {"ID": "linuxmint", "ID_LIKE": "ubuntu debian", "VERSION_ID": "22.1"}


@pytest.fixture
def system_python(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    monkeypatch.setattr(sys, "base_prefix", "/usr")
    monkeypatch.setattr(sys, "path", ["/usr/lib/python3/dist-packages"])


@pytest.mark.parametrize(
    ("system", "expected"),
    [
        (DEBIAN, APT),
        ({"ID": "debian"}, APT),  # testing and unstable have no number
        ({"ID": "debian", "VERSION_ID": "11"}, PIP),
        ({**UBUNTU, "VERSION_ID": "26.04"}, APT),
        ({**UBUNTU, "VERSION_ID": "24.04"}, PIP),
        (MINT, PIP),
        ({"ID": "fedora", "VERSION_ID": "43"}, PIP),
        ({}, PIP),
    ],
)
def test_command_for_a_system(system, expected, system_python):
    assert command(system) == expected


@pytest.mark.usefixtures("system_python")
def test_packages_of_debian_need_an_environment_that_sees_them(monkeypatch):
    monkeypatch.setattr(sys, "path", [])
    assert command(DEBIAN) == f"{APT}\n\n{USE_THEM}"
    monkeypatch.setattr(sys, "path", ["/usr/lib/python3/dist-packages"])
    monkeypatch.setattr(sys, "base_prefix", "/opt/python")
    assert command(DEBIAN) == f"{APT}\n\n{USE_THEM}"


@pytest.mark.usefixtures("system_python")
def test_conda_comes_before_the_system(tmp_path):
    (tmp_path / "conda-meta").mkdir()
    assert command(DEBIAN) == CONDA


def test_os_release(tmp_path):
    file = tmp_path / "os-release"
    assert os_release(file) == {}
    file.write_text('PRETTY_NAME="Debian GNU/Linux 12"\nID=debian\nVERSION_ID="12"\n')
    assert os_release(file) == {"PRETTY_NAME": "Debian GNU/Linux 12", **DEBIAN}


@pytest.mark.parametrize(
    ("error", "beginning"),
    [
        (
            ModuleNotFoundError("No module named 'petsc4py'", name="petsc4py"),
            f"fsci: there is no DOLFINx for {sys.executable}: the module 'petsc4py' is missing\n",
        ),
        (ImportError("this version of DOLFINx is not supported", name="dolfinx"), "fsci: this version of DOLFINx is"),
    ],
)
def test_message_of_the_program(error, beginning, monkeypatch, capsys):
    def missing(options):
        raise error

    monkeypatch.setattr("fsci.cli._schema", missing)
    monkeypatch.setattr(dolfinx_needed, "command", lambda system: "COMMAND")
    missing.__name__ = "_schema"
    assert execute(["schema"]) == 2
    text = capsys.readouterr().err
    assert text.startswith(beginning)
    needed = "fsci needs DOLFINx 0.5 (Debian 12), or 0.9 and later, with real numbers and PETSc."
    assert text.endswith(f"\n{needed} This installs it:\n\n    COMMAND\n\n")


def test_other_missing_modules_are_errors_of_the_program(monkeypatch):
    def missing(options):
        raise ModuleNotFoundError("No module named 'rich'", name="rich")

    missing.__name__ = "_schema"
    monkeypatch.setattr("fsci.cli._schema", missing)
    with pytest.raises(ModuleNotFoundError):
        execute(["schema"])
