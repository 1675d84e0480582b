"""Names: a class has one meaning in the whole project."""

import ast
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[2]

#: Two versions of one class, for the bindings of older and of newer DOLFINx.
TWICE = {"Compiled"}


def test_class_names_are_unique():
    files = (path for folder in ("solvers", "coupling", "fsci") for path in (ROOT / folder).rglob("*.py"))
    nodes = (node for path in files for node in ast.walk(ast.parse(path.read_text())))
    names = Counter(node.name for node in nodes if isinstance(node, ast.ClassDef))
    assert {name for name, count in names.items() if count > 1} == TWICE


def test_file_names_of_tests_are_unique():
    """Tests have no packages: of two files of one name in different folders, the second one cannot be imported."""
    names = Counter(path.name for path in (ROOT / "tests").rglob("test_*.py"))
    assert [name for name, count in names.items() if count > 1] == []
