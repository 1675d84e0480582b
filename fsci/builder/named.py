"""Laws by their names in the case file: a law NAME_OF_LAW is the class NameOfLaw of a module with its name."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Any


def named(package: ModuleType, name: str) -> Any:
    """The class of a law in a package; only its module is loaded."""
    return getattr(import_module(f"{package.__name__}.{name}"), name.title().replace("_", ""))
