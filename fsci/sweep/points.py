"""The points of a sweep: all combinations of the values that some settings of a case take."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

from fsci.case.errors import CaseError, Place, Problem
from fsci.twin.grids import Settings

OPENING_BRACKETS, CLOSING_BRACKETS = "([{", ")]}"
LONGEST_NAME = 100  #: of a folder; file systems allow 255 bytes
_MANY = "give at least one setting several values: --set fluid.viscosity=1,2,3"


@dataclass(frozen=True)
class Parameter:
    """A setting and the values it takes, as YAML text."""

    setting: str  #: dotted name
    values: tuple[str, ...]


@dataclass(frozen=True)
class Combination:
    """One value for each parameter, and the name of the folder of its run."""

    name: str
    values: tuple[str, ...]


def parameters(given: Sequence[tuple[str, str]]) -> tuple[list[Parameter], Settings]:
    """Settings with several values between commas, and those with one, which all runs have.

    Raises CaseError if no setting has several, or one is given twice.
    """
    several: list[Parameter] = []
    single: list[tuple[str, str]] = []
    seen: set[str] = set()
    for setting, text in given:
        if setting in seen:
            raise CaseError([Problem(Place("--set"), f"'{setting}' is given twice: write --set {setting}=1,2")])
        seen.add(setting)
        values = tuple(dict.fromkeys(between_commas(text)))
        if len(values) > 1:
            several.append(Parameter(setting, values))
        else:
            single.append((setting, text))
    if not several:
        raise CaseError([Problem(Place("--set"), _MANY)])
    return several, tuple(single)


def between_commas(text: str) -> Iterator[str]:
    """The parts of a text between its commas; those within brackets or quotes divide nothing."""
    part, depth, quote = "", 0, ""
    for letter in text:
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'":
            quote = letter
        else:
            depth += (letter in OPENING_BRACKETS) - (letter in CLOSING_BRACKETS)
        if letter == "," and not quote and depth == 0:
            yield part.strip()
            part = ""
        else:
            part += letter
    yield part.strip()


def points(several: Sequence[Parameter]) -> list[Combination]:
    """All combinations, the last parameter changing fastest; folders are called E=1e6,nu=0.3."""
    short = short_names([parameter.setting for parameter in several])
    found: dict[str, Combination] = {}
    for number, values in enumerate(product(*(parameter.values for parameter in several)), 1):
        name = ",".join(f"{one}={_in_file_names(value)}" for one, value in zip(short, values, strict=True))
        if len(name) > LONGEST_NAME or name in found:
            name = f"run_{number}"
        found[name] = Combination(name, values)
    return list(found.values())


def _in_file_names(value: str) -> str:
    return re.sub(r"[^A-Za-z0-9_.+-]+", "_", value).strip("_")


def short_names(settings: Sequence[str]) -> list[str]:
    """The last part of each dotted name, or so many parts that no two are alike."""
    parts = [setting.split(".") for setting in settings]
    for length in range(1, max(map(len, parts)) + 1):
        names = [".".join(one[-length:]) for one in parts]
        if len(set(names)) == len(names):
            return names
    return list(settings)
