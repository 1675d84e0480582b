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
