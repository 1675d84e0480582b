"""One name, one thing: no two classes of the packages share theirs."""

import ast
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[1]

#: One class for each generation of DOLFINx; only one of the two is ever imported.
VERSIONS = {"Compiled"}


def test_class_names_are_unique():
    files = defaultdict(list)
    for package in ("solvers", "coupling", "fsci"):
        for path in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.ClassDef):
                    files[node.name].append(str(path.relative_to(ROOT)))
    assert len(files) > 200, "the classes are found"
    assert {name: where for name, where in files.items() if len(where) > 1 and name not in VERSIONS} == {}
