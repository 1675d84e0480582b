"""Families of runs: a scene, its variants, what is measured, and the reference. All of them stand in families.yaml."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from importlib import import_module
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fsci.bench.bands import with_bands
from fsci.bench.program import run_timed
from fsci.bench.table import ERROR, FRONT, LEVEL, TIME, Row
from fsci.template import fill

CASES = Path(__file__).parents[2] / "cases"
FAMILIES = Path(__file__).with_name("families.yaml")

Settings = Mapping[str, Any]  #: dotted name of a setting -> its value; NAME.*.SETTING: a list, one for each entry

#: What a family has, and what its variants may have of their own.
SHARED = ("measure", "case", "set", "exact", "values")
ENTRIES = ("words", *SHARED, "variants")


class FamilyError(ValueError):
    """An entry that is no family."""


@dataclass(frozen=True)
class FamilyRun:
    """A run that came to its end."""

    summary: Mapping[str, Any]
    history: Mapping[str, Any]
    seconds: float  #: of the processor


@dataclass(frozen=True)
class FamilyScene:
    """A case with some settings, as it is given to the function that measures it."""

    folder: Path  #: of the case
    out: Path
    settings: Settings
    exact: Mapping[str, Any]  #: the reference
    values: Sequence[str]  #: which are compared; empty: all
    given: Mapping[str, Any]  #: what the variant says besides
    kept: dict[str, FamilyRun] = field(default_factory=dict)

    def run(self, settings: Settings | None = None) -> FamilyRun:
        """Run it with some settings more; what has been run is not run again. Raises ProgramFailed."""
        from fsci.running.history import read_history

        together = {**self.settings, **(settings or {})}
        key = json.dumps([(self.folder / "case.yaml").read_text(), together], sort_keys=True)
        if key not in self.kept:
            summary, seconds = run_timed(self.folder, self.out, together)
            self.kept[key] = FamilyRun(summary, read_history(self.out / "history.csv"), seconds)
        return self.kept[key]


@dataclass(frozen=True)
class Member:
    """One run of a family."""

    columns: Mapping[str, Any]  #: column of its row -> which variant it is
    measure: str
    case: str | Mapping[str, Any] | None
    settings: Settings
    exact: Mapping[str, Any]
    values: Sequence[str]
    given: Mapping[str, Any]

    def scene(self, folder: Path, kept: dict[str, FamilyRun] | None = None) -> FamilyScene:
        """Its case, written into the folder if it is none of `cases/`."""
        if isinstance(self.case, Mapping):
            (folder / "case.yaml").write_text(json.dumps(self.case))
        place = folder if isinstance(self.case, Mapping) else CASES / str(self.case)
        return FamilyScene(
            place, folder / "out", self.settings, self.exact, self.values, self.given, {} if kept is None else kept
        )


@dataclass(frozen=True)
class Family:
    """An entry of a file of families."""

    name: str
    words: str
    shared: Mapping[str, Any]  #: of all variants: SHARED
    variants: Sequence[Mapping[str, Any]]

    def members(self) -> Iterator[Member]:
        """The variants of each block, whose last axis varies fastest."""
        for block in self.variants:
            shared = {**self.shared, **{name: block[name] for name in SHARED if name in block}}
            axes = [_axis(name, value) for name, value in block.items() if name not in SHARED]
            for choice in product(*axes):
                columns = {name: value for part, _ in choice for name, value in part.items()}
                yield _member(columns, {name: value for _, part in choice for name, value in part.items()}, shared)

    def run(self, **more: Any) -> list[Row]:
        """The rows of all members, with bands of two and three runs; a star is on the front of error and time."""
        rows: list[Row] = []
        kept: dict[str, FamilyRun] = {}
        with TemporaryDirectory() as folder:
            for member in self.members():
                measure = function(member.measure)
                if member.case is None:
                    found = measure(**member.given, **more)
                else:
                    found = measure(member.scene(Path(folder), kept))
                several = [found] if isinstance(found, dict) else found
                rows += [{**member.columns, **row} for row in several]
        rows = with_bands(rows) if all(LEVEL in row for row in rows) else rows
        return starred(rows) if all(TIME in row and ERROR in row for row in rows) else rows


def read_families(path: Path = FAMILIES) -> dict[str, Family]:
    """The families of a file; names that begin with a dot are none. Raises FamilyError, OSError."""
    from ruamel.yaml import YAML, YAMLError

    try:
        entries = YAML(typ="safe", pure=True).load(path.read_text())
    except YAMLError as error:
        raise FamilyError(f"{path}: {error}") from None
    if not isinstance(entries, Mapping):
        raise FamilyError(f"{path} has no families: write NAME: {{words: .., measure: ..}}")
    return {str(name): _family(path, str(name), entry) for name, entry in entries.items() if str(name)[0] != "."}


def _family(path: Path, name: str, entry: Any) -> Family:
    if not isinstance(entry, Mapping) or "words" not in entry:
        raise FamilyError(f"{path}: family '{name}' needs 'words'")
    for key in entry:
        if key not in ENTRIES:
            close = get_close_matches(str(key), ENTRIES, n=1)
            hint = f"; did you mean '{close[0]}'?" if close else f" (known: {', '.join(ENTRIES)})"
            raise FamilyError(f"{path}: family '{name}' has an unknown entry '{key}'{hint}")
    variants = entry.get("variants", {})
    blocks = variants if isinstance(variants, list) else [variants]
    if "measure" not in entry and not all(map(_has_measure, blocks)):
        raise FamilyError(f"{path}: family '{name}' needs 'measure'")
    return Family(name, entry["words"], {key: entry[key] for key in SHARED if key in entry}, blocks)


def _has_measure(block: Mapping[str, Any]) -> bool:
    """Whether it has a function, or each choice of one of its axes has."""
    axes = (_axis(name, value) for name, value in block.items() if name not in SHARED)
    return "measure" in block or any(all("measure" in part for _, part in axis) for axis in axes)


def _axis(name: str, value: Any) -> list[tuple[Mapping[str, Any], Mapping[str, Any]]]:
    """(columns, what is given) of each choice: LABEL: {..} has a column; a list, or one value, has none."""
    if isinstance(value, Mapping):
        return [({name: label}, part) for label, part in value.items()]
    choices = value if isinstance(value, list) else [value]
    return [({}, choice if isinstance(choice, Mapping) else {name: choice}) for choice in choices]


def _member(columns: Mapping[str, Any], given: Mapping[str, Any], shared: Mapping[str, Any]) -> Member:
    from fsci.case.case import Case

    parameters = {name: value for name, value in given.items() if isinstance(value, int | float | str)}
    shared = fill({**shared, **{name: given[name] for name in SHARED if name in given}}, parameters)
    given = fill({name: value for name, value in given.items() if name not in SHARED}, parameters)
    of_case = {name for name in given if name.split(".")[0] in Case.model_fields}
    settings = {**shared.get("set", {}), **{name: given[name] for name in given if name in of_case}}
    return Member(
        fill(columns, parameters),
        shared["measure"],
        shared.get("case"),
        dict(_each(settings)),
        shared.get("exact", {}),
        shared.get("values", ()),
        {name: value for name, value in given.items() if name not in of_case},
    )


def _each(settings: Settings) -> Iterator[tuple[str, Any]]:
    """The settings that `*` stands for."""
    for name, value in settings.items():
        if "*" in name:
            yield from ((name.replace("*", str(number)), one) for number, one in enumerate(value))
        else:
            yield name, value


def function(name: str) -> Callable[..., Any]:
    """FILE.FUNCTION of fsci/bench, or MODULE:FUNCTION of somebody else. Raises FamilyError."""
    module, _, attribute = name.rpartition(":" if ":" in name else ".")
    try:
        return getattr(import_module(module if ":" in name else f"fsci.bench.{module}"), attribute)
    except (ImportError, AttributeError) as error:
        raise FamilyError(f"there is no function '{name}': {error}") from None


def starred(rows: list[Row]) -> list[Row]:
    """Rows with a star on those of the front of time and error."""
    on_front = front([(float(row[TIME]), float(row[ERROR])) for row in rows])
    return [{**row, FRONT: "*" if on else ""} for row, on in zip(rows, on_front, strict=True)]


def front(points: Sequence[tuple[float, float]]) -> list[bool]:
    """Pareto's front: the points (cost, error) for which no other point costs no more and errs no more."""
    return [
        not any(other != point and other[0] <= point[0] and other[1] <= point[1] for other in points)
        for point in points
    ]
