"""Arguments of commands: text that a user typed, as values. All raise ArgumentTypeError with what is allowed."""

from __future__ import annotations

import argparse


def override(text: str) -> tuple[str, str]:
    """A setting and its value as YAML text, from NAME=VALUE."""
    name, equals, value = text.partition("=")
    if not name or not equals:
        raise argparse.ArgumentTypeError(f"write NAME=VALUE, not '{text}'")
    return name, value


def count(text: str) -> int:
    """A whole number that is not negative."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"write a whole number, not '{text}'")
    return int(text)


def share(text: str) -> float:
    """A share between 0 and 1, from 0.02 or 2%."""
    number, percent, _ = text.partition("%")
    try:
        found = float(number) / (100.0 if percent else 1.0)
    except ValueError:
        found = 0.0
    if not 0.0 < found < 1.0:
        raise argparse.ArgumentTypeError(f"write a share between 0 and 1 such as 0.02 or 2%, not '{text}'")
    return found


def duration(text: str) -> float:
    """A time [s], from 30s, 20min or 2h."""
    units = {"min": 60.0, "h": 3600.0, "s": 1.0}
    unit = next((name for name in units if text.endswith(name)), "")
    try:
        seconds = float(text.removesuffix(unit)) * units.get(unit, 1.0)
    except ValueError:
        seconds = 0.0
    if not 0.0 < seconds < float("inf"):
        raise argparse.ArgumentTypeError(f"write a time such as 30s, 20min or 2h, not '{text}'")
    return seconds
