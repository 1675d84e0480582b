"""What the pages name exists: settings, files, options of commands; their YAML blocks are cases that can be run."""

import json
import os
import re
import subprocess
import sys
from contextlib import redirect_stdout
from functools import cache
from importlib import import_module
from io import StringIO
from pathlib import Path

import pytest
from docs_pages import PAGES, ROOT, SCHEMA, fits_somewhere, has_setting, in_backticks, is_case, parsed, yaml_blocks

from fsci.bench.family import function, read_families
from fsci.bench.measures import checks
from fsci.case import load_case
from fsci.case.verify import (
    BODY_COLUMN,
    CONTACT_COLUMNS,
    COUPLING_COLUMNS,
    FIELD_COLUMNS,
    FRICTION_COLUMNS,
    SEEPAGE_COLUMN,
)
from fsci.check.meshes import check_meshes
from fsci.cli import execute
from fsci.stress.draw import draw

READMES = sorted(ROOT.glob("cases/*/README.md"))
NOTES = sorted(ROOT.glob("docs/notes/*.md"))
SECTIONS = set(SCHEMA["properties"])
FOLDERS = ("cases", "docs", "tests", "solvers", "fsci", "coupling")
MADE = ("docs/_build", "docs/reference", "cases/stage")  #: by make docs
NOT_OF_CASES = ("changelog", "library")  #: pages that name settings that are gone, and attributes in Python
COLUMNS = {BODY_COLUMN, SEEPAGE_COLUMN, *FIELD_COLUMNS.values(), *COUPLING_COLUMNS, *CONTACT_COLUMNS, *FRICTION_COLUMNS}
SUFFIXES = (".py", ".yaml", ".md", ".cpp")


def by_name(pages):
    return [pytest.param(page, id=page.relative_to(ROOT).as_posix()) for page in pages]


@pytest.mark.parametrize("page", by_name(PAGES))
def test_yaml_blocks(page, tmp_path):
    """Whole cases pass `fsci check`; parts of cases have settings that exist."""
    for block in yaml_blocks(page):
        if "\n  words: " in block:
            continue
        if not is_case(block):
            assert fits_somewhere(parsed(block)), block
            continue
        (tmp_path / "case.yaml").write_text(block)
        case = load_case(tmp_path)
        assert not check_meshes(case).problems, block


def test_families_and_scenes_of_the_pages(tmp_path):
    """Each run of the family could begin, and the case that is drawn, too."""
    family, scene = (block for page in PAGES for block in yaml_blocks(page) if "\n  words: " in block)
    for name, block in (("family.yaml", family), ("scene.yaml", scene)):
        (tmp_path / name).write_text(block)
    (flag,) = read_families(tmp_path / "family.yaml").values()
    for member in flag.members():
        assert callable(function(member.measure))
        settings = {**member.settings, **checks(member.scene(tmp_path))}
        load_case(ROOT / "cases" / str(member.case), [(key, json.dumps(value)) for key, value in settings.items()])
    for seed in range(400_000, 400_005):
        one = draw(seed, tmp_path / "scene.yaml")
        (tmp_path / "case.yaml").write_text(json.dumps(one.case(one.frame, twin=True)))
        assert not check_meshes(load_case(tmp_path)).problems


@pytest.mark.parametrize("page", by_name(page for page in PAGES if page.stem not in NOT_OF_CASES))
def test_settings_in_backticks_exist(page):
    """`name: value` and dotted names that begin with a section, unless they are columns of the history."""
    for text in in_backticks(page):
        section, dot, rest = text.partition(".")
        if dot and section in SECTIONS and re.fullmatch(r"[\w.]+", rest) and not rest.endswith(SUFFIXES):
            column = text in COLUMNS or re.fullmatch(r"contact\.\w+\.[xyz]|fluid\.pocket_\d", text)
            assert has_setting(text.split("."), SCHEMA) or column, text
        value = parsed(text) if re.match(r"\w+: ", text) else None
        if isinstance(value, dict):
            assert fits_somewhere(value), text


@pytest.mark.parametrize("page", by_name([*PAGES, *READMES]))
def test_files_exist(page):
    """Paths from the top of the repository; capitals stand for names, stars for many."""
    named = re.findall(rf"(?<![\w./-])(?:{'|'.join(FOLDERS)})/[\w*./-]*[\w*/]", page.read_text())
    for path in sorted(set(named)):
        if not re.search(r"[A-Z]{2}", path.replace("README", "")) and not path.startswith(MADE):
            assert list(ROOT.glob(path)) or path.endswith("_"), path


@pytest.mark.parametrize("page", by_name([*PAGES, *READMES, *NOTES]))
def test_links_lead_to_headings(page):
    """Files that links name exist, and so do the headings after #."""
    for target, _, anchor in re.findall(r"\]\((?!https?:)([^)#]*)(#([\w-]+))?\)", page.read_text()):
        file = page.parent / target if target else page
        assert file.exists(), target
        assert page.parent.name != "docs" or file.resolve().is_relative_to(ROOT / "docs"), f"{target}: not in the site"
        assert not anchor or anchor in anchors(file), f"{target}#{anchor}"


def anchors(page: Path) -> set[str]:
    """What links may name in a page: its headings as slugs."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", by_name([*PAGES, *READMES]))
def test_commands_exist(page):
    """Of each line that calls fsci: the command, its options, and the settings that --set names."""
    for line in command_lines(page):
        command, *words = line.split("fsci ", 1)[1].split()
        options = subcommands().get(command)
        assert options is not None or command == "COMMAND", line
        for word, after in zip(words, [*words, ""][1:], strict=True):
            assert not word.startswith("--") or word in options, line
            name = after.strip("'\"").partition("=")[0]
            assert word != "--set" or name in ("NAME", "a.b") or has_setting(name.split("."), SCHEMA), line


def command_lines(page: Path) -> list[str]:
    """Lines of shell blocks, indented lines and words in backticks that call fsci."""
    text = page.read_text().replace("\\\n", " ")
    blocks = re.findall(r"^```sh\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    indented = re.findall(r"^    (.*)$", text, re.MULTILINE) if page.name == "README.md" else []
    lines = [*"\n".join(blocks).splitlines(), *indented, *in_backticks(page)]
    calls = [one for line in lines for one in re.split(r" && |  #", line)]
    return [call for call in calls if re.match(r"(mpirun -n \d+ )?fsci [a-zA-Z]", call)]


@cache
def subcommands() -> dict[str, set[str]]:
    """Subcommand -> its options, from the help that it prints."""
    return {
        name: set(re.findall(r"--?[a-z]+", help_of(name))) for name in re.findall(r"^    ([a-z]+) ", help_of(), re.M)
    }


def help_of(*command: str) -> str:
    with redirect_stdout(StringIO()) as text, pytest.raises(SystemExit):
        execute([*command, "--help"])
    return text.getvalue()


def test_the_gallery_has_every_case():
    page = (ROOT / "docs" / "gallery.md").read_text()
    named = set(re.findall(r"`([a-z]\w+)`", page)) - {"verify"}
    assert named == {path.parent.name for path in READMES}


def test_the_quickstart_has_every_section():
    table = (ROOT / "docs" / "quickstart.md").read_text().split("| section | describes |")[1].split("\n\n")[0]
    assert set(re.findall(r"^\| `([a-z]+)` \|", table, re.MULTILINE)) == SECTIONS


def test_the_glossary_has_the_terms_of_the_field():
    page = (ROOT / "docs" / "glossary.md").read_text()
    defined = {word.strip() for line in re.findall(r"^(.*)\n: ", page, re.MULTILINE) for word in line.split(",")}
    wanted = {"active set", "extrapolate", "ghost cell", "hydrostatic mode", "increment", "predictor", "rate"}
    wanted |= {"sparsity pattern", "added mass", "CutFEM", "dual basis", "ghost penalty", "leak", "extension", "root"}
    wanted |= {"closed contact", "coverage", "film", "hanging node", "massless surface", "seepage", "sheet", "probe"}
    assert wanted <= defined


def test_the_python_api_has_every_public_name():
    """With a signature and a docstring each."""
    made = [sys.executable, ROOT / "docs" / "make_api.py"]
    page = subprocess.run(made, capture_output=True, text=True, check=True, env={**os.environ, "PYTHONPATH": str(ROOT)})
    entries = re.findall(r"^### (\w+)\n\n```python\n\1(.*?)^```\n(.*?)(?=^##|\Z)", page.stdout, re.M | re.S)
    for package in ("solvers.structure", "solvers.contact", "solvers.fluid", "solvers.rigid", "coupling"):
        assert set(import_module(package).__all__) <= {name for name, _, _ in entries}
    assert [name for name, _, words in entries if len(words.strip()) < 20] == []
    assert " object at 0x" not in page.stdout


def test_notes_are_dated_and_named_by_a_page():
    """They are outside of the site; a page says where its measurements are."""
    pages = "".join(page.read_text() for page in PAGES)
    for note in NOTES:
        assert note.stem == "README" or re.fullmatch(r"\d{4}-\d\d-\d\d-[a-z-]+", note.stem), note.name
        assert note.stem == "README" or f"docs/notes/{note.name}" in pages, note.name
