"""The advice on a step that really failed: that of its kind, whatever its message says."""

from __future__ import annotations

from pathlib import Path

from fsci.case.solver import Newton
from fsci.explain.advice import OF_KIND, of_failure
from fsci.explain.explain import explain
from solvers.api import FailureKind, StepFailed


def require_advice(failure: StepFailed, kind: FailureKind) -> None:
    """The failure is of this kind, and there is advice on it."""
    assert failure.kind is kind
    words = list(of_failure(failure.kind, failure.history, Newton()))
    assert words
    assert set(OF_KIND[kind]) <= set(words)


def require_explained(out: Path, kind: FailureKind) -> None:
    """`fsci explain` gives the advice on this kind for a run that failed."""
    assert OF_KIND[kind]
    text = explain(out)
    assert [words for words in OF_KIND[kind] if f"try            {words}" not in text] == []
