"""Kinds of failures: each has advice that a test of a real failure reaches, and no code reads messages."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from fsci.case.solver import Newton
from fsci.explain.advice import OF_KIND, of_failure
from solvers.api import FailureKind

ROOT = Path(__file__).parents[2]
SEARCHES = {"startswith", "endswith", "find", "rfind", "index", "count", "search", "match", "fullmatch", "findall"}
DIVERGES = (1.0, 2.0, 40.0)


@pytest.mark.parametrize("kind", FailureKind)
def test_each_kind_has_advice(kind):
    """By its residuals alone only where Newton's method does not converge for no cause that is known."""
    assert list(of_failure(kind, DIVERGES, Newton()))
    assert bool(OF_KIND[kind]) == (kind is not FailureKind.NEWTON)


def test_a_real_failure_of_each_kind_is_tested():
    calls = [
        node
        for path in (ROOT / "tests").rglob("test_*.py")
        if "require_" in path.read_text()
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ("require_advice", "require_explained")
    ]
    assert {ast.unparse(call.args[1]).rpartition(".")[2] for call in calls} >= {kind.name for kind in FailureKind}


def messages_searched(text: str) -> Iterator[str]:
    """Expressions that look for words in the message of an exception or in the reason of a failure."""
    tree = ast.parse(text)
    caught = {node.name for node in ast.walk(tree) if isinstance(node, ast.ExceptHandler)}
    caught |= {
        node.arg
        for node in ast.walk(tree)
        if isinstance(node, ast.arg) and node.annotation is not None and "StepFailed" in ast.unparse(node.annotation)
    }

    def is_message(node: ast.AST) -> bool:
        match node:
            case (
                ast.Name(id="reason") | ast.Attribute(attr="reason") | ast.Subscript(slice=ast.Constant(value="reason"))
            ):
                return True
            case ast.Call(func=ast.Name(id="str"), args=[ast.Name(id=name)]):
                return name in caught
        return False

    for node in ast.walk(tree):
        match node:
            case ast.Compare(ops=[ast.In() | ast.NotIn()], comparators=[searched]) if is_message(searched):
                yield ast.unparse(node)
            case ast.Call(func=ast.Attribute(value=owner, attr=name)) if name in SEARCHES:
                if any(map(is_message, (owner, *node.args))):
                    yield ast.unparse(node)


@pytest.mark.parametrize(
    "text",
    [
        "if 'not a number' in failure.reason: pass",
        "found = what['reason'].startswith('Newton')",
        "for part in REASONS:\n    if part in reason: pass",
        "try: step()\nexcept StepFailed as failed:\n    if 'singular' in str(failed): pass",
        "def cause(failure: StepFailed): return re.search('cells', str(failure))",
    ],
)
def test_a_search_is_found(text):
    assert list(messages_searched(text))


def test_no_code_searches_messages():
    """They are for users: what depends on the cause of a failure takes its kind."""
    found = {
        f"{path.relative_to(ROOT)}: {expression}"
        for folder in ("fsci", "coupling", "solvers")
        for path in (ROOT / folder).rglob("*.py")
        for expression in messages_searched(path.read_text())
    }
    assert found == set()
