"""What two and three runs of a family say about the error of one of them, by the band of `fsci converge`.

Two runs are a run and its twin, which has a better method in cells up to twice as large; three are these and the next
coarser run of the same option. Without a better method both are coarser runs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from fsci.bench.table import LEVEL, TIME, Row
from fsci.converge.estimate import Evidence, LevelValue, estimate

#: Numbers of runs -> the column of the largest band of all values that they give.
BANDS = {2: "band of 2 [%]", 3: "band of 3 [%]"}
#: Elements and time schemes of flows, the better ones last; that of bodies is their order.
ELEMENTS = ("q1q1", "q2q1")
SCHEMES = ("backward_euler", "bdf2", "bdf2_optimized")
#: Sizes of a twin over those of its run: from the same to twice as large, with counts that are rounded.
LEAST, TWICE = 0.9, 2.2


def level(
    values: Mapping[str, float],
    sizes: Mapping[str, float],
    methods: Mapping[str, int],
    first_order: Sequence[str] = (),
) -> dict[str, Any]:
    """What a row has as LEVEL.

    `values` are over the exact ones, `sizes` those of the sources of errors [any unit], `methods` numbers that are
    larger for better ones, `first_order` the reasons for errors of first order.
    """
    return {"values": dict(values), "sizes": dict(sizes), "methods": dict(methods), "first_order": list(first_order)}


@dataclass(frozen=True)
class KnownRun:
    """A run with those that its band can be made of."""

    row: Row
    coarser: Sequence[Row]  #: of its option, the next one first
    twin: Row | None

    def runs(self, count: int) -> list[Row]:
        """The run and so many others that there are `count`; fewer if the family has no more."""
        twins = [] if self.twin is None else [self.twin]
        return [self.row, *twins, *self.coarser][:count]

    def bands(self, count: int) -> dict[str, float]:
        """By value, over the exact one; empty without as many runs."""
        runs = self.runs(count)
        if len(runs) < count:
            return {}
        own = self.row[LEVEL]
        levels = [one[LEVEL] for one in runs if one is not self.twin]
        twins = {"twin": self.twin[LEVEL]["values"]} if self.twin is not None else {}
        found = {}
        for name in own["values"]:
            known = [LevelValue(_size(one["sizes"], own["sizes"]), one["values"][name]) for one in levels]
            others = {twin: values[name] for twin, values in twins.items()}
            band = estimate(Evidence(known, 1.0, twins=others, first_order=own["first_order"])).band
            found[name] = math.inf if band is None else band
        return found

    def seconds(self, count: int) -> float:
        """Of all runs."""
        return math.fsum(float(one[TIME]) for one in self.runs(count))


def known_runs(rows: Sequence[Row]) -> Iterator[KnownRun]:
    """Of each row with a LEVEL; rows of one option go from coarse to fine."""
    for _, group in groupby(rows, key=lambda row: row.get("option", "")):
        of_option = list(group)
        for number, row in enumerate(of_option):
            if LEVEL in row:
                yield KnownRun(row, of_option[:number][::-1], _twin(row, rows))


def with_bands(rows: Sequence[Row]) -> list[Row]:
    """Rows with columns of BANDS, which are empty without as many runs."""
    return [
        {**one.row, **{column: _percent(one.bands(count)) for count, column in BANDS.items()}}
        for one in known_runs(rows)
    ]


def _percent(found: Mapping[str, float]) -> float | str:
    return 100.0 * max(found.values()) if found else ""


def _twin(row: Row, rows: Sequence[Row]) -> Row | None:
    """The best method, in the largest of all cells that are at most twice as large and nowhere smaller."""
    own = row[LEVEL]
    found = []
    for other in rows:
        if LEVEL not in other or other[LEVEL]["sizes"].keys() != own["sizes"].keys():
            continue
        methods, sizes = other[LEVEL]["methods"], other[LEVEL]["sizes"]
        better = [number - own["methods"].get(name, number) for name, number in methods.items()]
        least = min((size / own["sizes"][name] for name, size in sizes.items()), default=1.0)
        size = _size(sizes, own["sizes"])
        if min(better, default=0) >= 0 < max(better, default=0) and least > LEAST and size <= TWICE:
            found.append((sum(better), size, other))
    return max(found, key=lambda one: one[:2])[2] if found else None


def _size(sizes: Mapping[str, float], own: Mapping[str, float]) -> float:
    """The mean ratio of the sources that are not of one size in both."""
    ratios = [size / own[name] for name, size in sizes.items() if not math.isclose(size, own[name], rel_tol=1e-6)]
    return math.prod(ratios) ** (1.0 / len(ratios)) if ratios else 1.0
