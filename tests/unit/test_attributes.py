"""Objects of the fields and of their coupling are complete when they are made."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2]
FILES = sorted(path for folder in ("solvers", "coupling") for path in (ROOT / folder).rglob("*.py"))


def late_attributes(tree: ast.Module) -> list[str]:
    """Attributes that a method is the first to set which is neither __init__ nor called by it."""
    found = []
    for owner in (node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)):
        born, set_later = set(), set()
        first = _called_by_init(owner)
        for node in owner.body:
            if isinstance(node, ast.AnnAssign | ast.Assign):
                targets = [node.target] if isinstance(node, ast.AnnAssign) else node.targets
                born |= {target.id for target in targets if isinstance(target, ast.Name)}
            if isinstance(node, ast.FunctionDef):
                (born if node.name in first else set_later).update(_set_by(node))
        found += [f"{owner.name}.{name}" for name in sorted(set_later - born)]
    return found


def _called_by_init(owner: ast.ClassDef) -> set[str]:
    init = [node for node in owner.body if isinstance(node, ast.FunctionDef) and node.name == "__init__"]
    calls = [node.func for method in init for node in ast.walk(method) if isinstance(node, ast.Call)]
    own = [call for call in calls if isinstance(call, ast.Attribute) and isinstance(call.value, ast.Name)]
    return {"__init__"} | {call.attr for call in own if call.value.id == "self"}


def _set_by(function: ast.FunctionDef) -> set[str]:
    return {
        node.attr
        for node in ast.walk(function)
        if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)
        if isinstance(node.value, ast.Name) and node.value.id == "self"
    }


def test_what_counts_as_late():
    text = """
class A:
    b = 0
    def __init__(self):
        self.c = 1
        self.make()
    def make(self):
        self.e = 3
    def go(self):
        self.b = self.c = self.d = self.e = 2
"""
    assert late_attributes(ast.parse(text)) == ["A.d"]


def test_attributes_are_set_first_by_init():
    late = {str(path.relative_to(ROOT)): late_attributes(ast.parse(path.read_text())) for path in FILES}
    assert {path: names for path, names in late.items() if names} == {}
