"""One name, one thing: no two classes of the packages share theirs."""

import ast
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[2]

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


def test_tests_use_no_private_members():
    """Of what they test: only of their own classes."""
    found = set()
    for path in sorted((ROOT / "tests").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            match node:
                case ast.Attribute(value=value, attr=name) if ast.unparse(value) not in ("self", "cls"):
                    names = [name]
                case ast.ImportFrom(names=imported):
                    names = [one.name for one in imported]
                case ast.Call(func=ast.Attribute(attr="setattr"), args=[_, ast.Constant(value=str(name)), *_]):
                    names = [name.rpartition(".")[2]]
                case _:
                    continue
            found |= {f"{path.name}: {name}" for name in names if name[0] == "_" and not name.startswith("__")}
    assert found == set()
