"""Numbers in messages that are told apart."""

from __future__ import annotations


def distinct(a: float, b: float) -> tuple[str, str]:
    """Two numbers in as few digits as tell them apart, six at least."""
    pairs = ((f"{a:.{digits}g}", f"{b:.{digits}g}") for digits in range(6, 18))
    return next((pair for pair in pairs if pair[0] != pair[1] or a == b), (repr(a), repr(b)))
