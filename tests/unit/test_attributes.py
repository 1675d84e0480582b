"""Objects are complete when they are made: no method but `__init__` is the first to set an attribute."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
FILES = sorted(path for folder in ("solvers", "coupling", "fsci") for path in (ROOT / folder).rglob("*.py"))

#: Methods that make an object.
FIRST = ("__init__", "__post_init__")

#: What communicates, or makes an object on all processes at once: a property that did so would be read by one alone.
COLLECTIVE = {"allreduce", "allgather", "gather", "bcast", "exscan", "scan", "share", "scatter_forward", "add_ghosts"}
VERBS = ("assemble", "compile", "create", "find_")


def late_attributes(tree: ast.Module) -> list[str]:
    """Attributes that a class neither declares with a value, nor as a field of a dataclass, nor sets at first."""
    found = []
    for owner in (node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)):
        born, set_later = set(_declared(owner)), set()
        for node in owner.body:
            if isinstance(node, ast.FunctionDef):
                (born if node.name in FIRST else set_later).update(_set_by(node))
        found += [f"{owner.name}.{name}" for name in sorted(set_later - born)]
    return found


def _declared(owner: ast.ClassDef) -> Iterator[str]:
    fields = any("dataclass" in ast.unparse(one) for one in owner.decorator_list)
    for node in owner.body:
        if isinstance(node, ast.Assign):
            yield from (target.id for target in node.targets if isinstance(target, ast.Name))
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and (fields or node.value):
            yield node.target.id


def _set_by(function: ast.FunctionDef) -> set[str]:
    return {
        node.attr
        for node in ast.walk(function)
        if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)
        if isinstance(node.value, ast.Name) and node.value.id == "self"
    }


def collective_properties(tree: ast.Module) -> list[str]:
    """Properties that communicate, assemble, or say that they are collective."""
    owners = [node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]
    methods = [(owner, node) for owner in owners for node in owner.body if isinstance(node, ast.FunctionDef)]
    properties = [(o, m) for o, m in methods if any("property" in ast.unparse(one) for one in m.decorator_list)]
    return [f"{owner.name}.{method.name}" for owner, method in properties if _is_collective(method)]


def _is_collective(method: ast.FunctionDef) -> bool:
    functions = [node.func for node in ast.walk(method) if isinstance(node, ast.Call)]
    called = {
        f.attr if isinstance(f, ast.Attribute) else f.id for f in functions if isinstance(f, ast.Attribute | ast.Name)
    }
    verbs = any(name.removeprefix("_").startswith(VERBS) for name in called)
    return bool(called & COLLECTIVE) or verbs or "ollective" in (ast.get_docstring(method) or "")


TEXT = """
class A:
    b = 0
    d: int
    def __init__(self):
        self.c = 1
        self.make()
    def make(self):
        self.e = 3
    def go(self):
        self.b = self.c = self.d = 2
    @property
    def size(self):
        return len(self.c)
    @property
    def total(self):
        return self.comm.allreduce(self.c)
    @cached_property
    def mass(self):
        return fem.assemble_matrix(self.c)
"""


def test_what_counts():
    assert late_attributes(ast.parse(TEXT)) == ["A.d", "A.e"]
    assert late_attributes(ast.parse("@dataclass" + TEXT)) == ["A.e"]
    assert collective_properties(ast.parse(TEXT)) == ["A.total", "A.mass"]


def test_attributes_are_set_first_by_init():
    late = {str(path.relative_to(ROOT)): late_attributes(ast.parse(path.read_text())) for path in FILES}
    assert {path: names for path, names in late.items() if names} == {}


def test_properties_are_local():
    found = {str(path.relative_to(ROOT)): collective_properties(ast.parse(path.read_text())) for path in FILES}
    assert {path: names for path, names in found.items() if names} == {}
