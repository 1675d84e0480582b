"""The cache of compiled forms: what a killed process leaves is compiled anew, what others compile is waited for."""

import fcntl
import os
import subprocess
import sys
import time

import pytest
import ufl
from dolfinx.fem import form as dolfinx_form
from mpi4py import MPI
from programs import ENVIRONMENT

from fsci import shapes
from solvers import fem

PROGRAM = """\
import sys
import ufl
from mpi4py import MPI
from fsci import shapes
from solvers import fem
domain = fem.distribute(MPI.COMM_SELF, shapes.rectangle([1, 1], [1, 1]))
dx = fem.volume_measure(domain, 1)
with fem.listening(lambda text: print(text, flush=True)):
    forms = fem.compile_forms([fem.constant(domain, 2.0) * dx, fem.constant(domain, 3.0) ** 2 * dx], "the test")
    print([fem.assemble_scalar(form, MPI.COMM_SELF) for form in forms])
"""


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    """A cache of its own, with the forms of the program, and what compiling them said."""
    folder = tmp_path_factory.mktemp("cache")
    return folder, compile_in(folder).stdout


def start(folder):
    environment = ENVIRONMENT | {"XDG_CACHE_HOME": str(folder)}
    return subprocess.Popen([sys.executable, "-c", PROGRAM], env=environment, text=True, stdout=subprocess.PIPE)


def compile_in(folder):
    process = start(folder)
    output, _ = process.communicate(timeout=100)
    return subprocess.CompletedProcess(process.args, process.returncode, output)


def a_form(folder):
    """The .c file of one of the two forms."""
    return sorted((folder / "fenics").glob("libffcx_forms_*.c"))[0]


def test_compilation_is_reported(cache):
    folder, said = cache
    assert said.splitlines() == ["compiling form 1 of 2 of the test", "compiling form 2 of 2 of the test", "[2.0, 9.0]"]
    assert compile_in(folder).stdout == "[2.0, 9.0]\n"
    assert not list((folder / "fenics").glob("*.lock"))


@pytest.mark.parametrize(
    "lock", [pytest.param(True, id="by this program"), pytest.param(False, id="by another one", marks=pytest.mark.slow)]
)
def test_form_of_a_killed_process_is_compiled_anew(cache, lock):
    """Its source is there, half written, and no mark that it is complete."""
    folder, _ = cache
    source = a_form(folder)
    source.with_suffix(".c.cached").unlink()
    source.write_text("half of a line of C")
    if lock:
        source.with_suffix(".lock").touch()
    else:
        os.utime(source, (time.time() - 60, time.time() - 60))
    begin = time.monotonic()
    done = compile_in(folder)
    assert time.monotonic() - begin < 60
    assert "the process that was compiling it has been killed; compiling it again\ncompiling form" in done.stdout
    assert done.stdout.endswith("[2.0, 9.0]\n")
    assert compile_in(folder).stdout == "[2.0, 9.0]\n"


def test_form_that_another_process_compiles_is_waited_for(cache):
    folder, _ = cache
    source = a_form(folder)
    ready = source.with_suffix(".c.cached")
    kept = ready.rename(ready.with_suffix(".kept"))
    with source.with_suffix(".lock").open("wb") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        process = start(folder)
        assert process.stdout.readline().startswith("waiting for another process that compiles form")
        time.sleep(0.5)
        assert process.poll() is None
        kept.rename(ready)
    output, _ = process.communicate(timeout=20)
    assert output == "[2.0, 9.0]\n"


def test_process_killed_while_it_compiles(tmp_path):
    process = start(tmp_path)
    assert process.stdout.readline() == "compiling form 1 of 2 of the test\n"
    while not list((tmp_path / "fenics").glob("libffcx_forms_*.c")):
        assert process.poll() is None
        time.sleep(0.001)
    process.kill()
    process.communicate()
    done = compile_in(tmp_path)
    assert "the process that was compiling it has been killed; compiling it again" in done.stdout
    assert done.stdout.endswith("[2.0, 9.0]\n")


def test_forms_are_plain_libraries(cache):
    """They have their functions alone: a module's description of the same structures takes longer to compile."""
    folder, _ = cache
    sources = [path.read_text() for path in (folder / "fenics").glob("libffcx_*.c")]
    assert len(sources) >= 2
    assert not [text for text in sources if "Python.h" in text]


def test_numbers_of_a_library_are_those_of_a_module():
    """DOLFINx compiles the same form as a Python module where it is called without `compiling`."""
    domain = fem.distribute(MPI.COMM_SELF, shapes.rectangle([2, 1], [2, 1]))
    form = ufl.SpatialCoordinate(domain.mesh)[0] ** 2 * fem.volume_measure(domain, 2)
    values = [fem.assemble_scalar(compiled, MPI.COMM_SELF) for compiled in (fem.compile_form(form), dolfinx_form(form))]
    assert values == pytest.approx([8 / 3, 8 / 3], rel=1e-14)
