"""Counts in messages: "1 iteration", "2 iterations"."""

from __future__ import annotations


def counted(number: int, noun: str) -> str:
    """The number and the noun, with an s unless the number is one."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
