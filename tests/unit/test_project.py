"""The project as a whole: its tools are content, what its pages say exists, and its files are portable."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BIN = Path(sys.executable).parent
TUTORIALS = sorted(path.stem for path in ROOT.glob("docs/tutorial_*.md"))
PAGES = [ROOT / "README.md", *sorted(ROOT.glob("docs/*.md"))]


@pytest.mark.parametrize("tool", ["ruff check", "ruff format --check", "mypy", "lint-imports"])
def test_tools_run_before_the_tests(tool):
    """Once: `make test` begins with all of them, and ends with the first one that is not content."""
    targets = (ROOT / "Makefile").read_text()
    (needs,) = re.findall(r"^test:(.*)$", targets, re.MULTILINE)
    assert "lint" in needs.split()
    recipe = targets.partition("\nlint:")[2].partition("\n\n")[0]
    assert re.search(rf"(^\t|&& )\$\(BIN\)/{tool}\b", recipe, re.MULTILINE)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_make_targets_of_the_pages_exist(page):
    named = set(re.findall(r"(?:^|`)make ([a-z0-9-]+)", page.read_text(), re.MULTILINE))
    assert named <= make_targets()


def test_readme_begins_with_demo_and_test():
    assert commands(ROOT / "README.md")[:2] == ["make demo", "make test"]


def make_targets() -> set[str]:
    return set(re.findall(r"^([a-z0-9-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))


def commands(page: Path) -> list[str]:
    """Lines of the page's shell blocks, without comments."""
    blocks = re.findall(r"^```sh\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)
    lines = [line.split("  #")[0].strip() for block in blocks for line in block.splitlines()]
    return [line for line in lines if line]


def test_subcommands_of_the_pages_exist():
    lines = [line for page in PAGES for line in commands(page)]
    named = {found[1] for line in lines if (found := re.search(r"\bfsci ([a-z]+)", line))}
    assert {"new", "check", "run", "resume", "plot", "schema"} <= named
    for name in sorted(named):
        program = [sys.executable, "-c", "from fsci.cli import main; main()", name, "--help"]
        done = subprocess.run(program, cwd=ROOT, capture_output=True, text=True)
        assert done.returncode == 0, f"fsci {name}: {done.stderr}"


def test_error_shown_in_the_quickstart(tmp_path):
    folder = shutil.copytree(ROOT / "cases" / "csm3", tmp_path / "cases" / "csm3")
    case = (folder / "case.yaml").read_text()
    (folder / "case.yaml").write_text(case.replace("gravity:", "gravty:"))
    program = [sys.executable, "-c", "from fsci.cli import main; main()", "check", "cases/csm3"]
    done = subprocess.run(
        program, cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True
    )
    assert done.returncode == 2
    assert done.stderr.splitlines()[0] in (ROOT / "docs" / "quickstart.md").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("page", ["quickstart", "running", "flow", "howto", *TUTORIALS])
def test_commands_of_the_docs_run(page, tmp_path):
    shutil.copytree(ROOT / "cases", tmp_path / "cases")
    shutil.copytree(ROOT / "docs" / "tutorials", tmp_path / "docs" / "tutorials")
    lines = [line for line in commands(ROOT / "docs" / f"{page}.md") if not line.startswith("make")]
    assert lines
    environment = {**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}"}
    script = "\n".join(["set -ex", *lines])
    done = subprocess.run(
        ["bash", "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(("minutes", "last"), [(0, "1 skipped"), (9, "1 passed")])
def test_tests_end_in_time(minutes, last):
    """Those that do not begin within the bound are named."""
    name = f"{Path(__file__).name}::{test_readme_begins_with_demo_and_test.__name__}"
    program = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", f"--minutes={minutes}", f"tests/unit/{name}"]
    done = subprocess.run(program, cwd=ROOT, capture_output=True, text=True)
    assert last in done.stdout
    assert (name in done.stdout.partition("left out, no time is left")[2]) == (minutes == 0)


def text_files() -> list[Path]:
    """What is, or would be, under version control, except pictures and other binary files."""
    listing = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    names = subprocess.run(listing, cwd=ROOT, check=True, capture_output=True, text=True).stdout.split("\0")
    paths = [ROOT / name for name in names if name]
    return [path for path in paths if path.is_file() and b"\0" not in path.read_bytes()]


def test_files_are_portable():
    """No paths of one machine, no addresses in a network, nothing but ASCII."""
    path_of_a_machine = rb"(?<![\w.])/(?:work|home|root|Users)/\w"
    host = rb"\b\d{1,3}(?:\.\d{1,3}){3}\b|\blocal(?:host|domain)\b"
    places = re.compile(path_of_a_machine + rb"|" + host)
    found = []
    for path in text_files():
        for number, line in enumerate(path.read_bytes().splitlines(), start=1):
            if places.search(line) or not line.isascii():
                found.append(f"{path.relative_to(ROOT)}:{number}: {line.decode(errors='replace')}")
    assert not found, "\n".join(found)
