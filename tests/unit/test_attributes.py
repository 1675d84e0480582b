"""Objects of the fields and of their coupling are complete when they are made."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2]
FILES = sorted(path for folder in ("solvers", "coupling") for path in (ROOT / folder).rglob("*.py"))


def late_attributes(tree: ast.Module) -> list[str]:
    """Attributes that a method other than __init__ is the first to set."""
    found = []
    for owner in (node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)):
        born, set_later = set(), set()
        for node in owner.body:
            if isinstance(node, ast.AnnAssign | ast.Assign):
                targets = [node.target] if isinstance(node, ast.AnnAssign) else node.targets
                born |= {target.id for target in targets if isinstance(target, ast.Name)}
            if isinstance(node, ast.FunctionDef):
                (born if node.name == "__init__" else set_later).update(_set_by(node))
        found += [f"{owner.name}.{name}" for name in sorted(set_later - born)]
    return found


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
    def go(self):
        self.b = self.c = self.d = 2
"""
    assert late_attributes(ast.parse(text)) == ["A.d"]


def test_attributes_are_set_first_by_init():
    late = {str(path.relative_to(ROOT)): late_attributes(ast.parse(path.read_text())) for path in FILES}
    assert {path: names for path, names in late.items() if names} == {}
