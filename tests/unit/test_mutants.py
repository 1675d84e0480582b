"""The groups of tests/mutate.py name what is there, and a mutant is a program."""

import ast

import pytest
from mutate import GROUPS, ROOT, files, mutants


@pytest.mark.parametrize("group", GROUPS)
def test_sources_and_tests_exist(group):
    sources, tests = GROUPS[group]
    assert [pattern for pattern in sources if not files((pattern,))] == []
    assert [name for name in tests if not list(ROOT.glob(f"tests/*/test_{name}.py"))] == []


def test_a_mutant_differs_by_one_operator():
    path = ROOT / "solvers" / "generalised_alpha.py"
    original = path.read_text()
    for mutant in mutants(path):
        ast.parse(mutant.text)
        assert sum(a != b for a, b in zip(original, mutant.text, strict=True)) == 1
