"""The command `fsci converge`: runs levels of a case, estimates the errors of its values, and writes converge.json."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path
from typing import Any

from fsci.case import Case, load_case
from fsci.converge.cheapest import Option, cheapest
from fsci.converge.estimate import BAND
from fsci.converge.page import write_page
from fsci.converge.plan import SECONDS_TO_START, Plan, PlannedRun, Refused
from fsci.converge.results import BandedValue, Done, as_json, done, findings
from fsci.converge.values import wanted
from fsci.converge.words import helps, percent, run_row, seconds_in_words, sentences, settings, without_results
from fsci.running.files import write_text
from fsci.running.kept_case import keep_case
from fsci.running.summary import plain
from fsci.running.warm import WarmProcess
from fsci.twin.changes import Twin
from fsci.twin.grids import NO_FIELDS, Settings
from fsci.twin.runs import TwinEnded, has_run, known_runs, run_all

CONVERGE_RESULTS = "converge.json"
CHEAPEST = "cheapest"  #: folder of the case that reaches the tolerance
BETTER = {"element": "cells", "order": "bodies"}  #: twins with less error of a source


def converge(
    path: Path,
    overrides: Settings,
    out: Path,
    *,
    only: Sequence[str] = (),
    tolerance: float | None = None,
    budget: float | None = None,
    say: Any = print,
) -> bool:
    """Run all levels that the budget [s] allows; returns whether the case itself has values. Raises CaseError.

    Runs that are in `out` from before, of the same case, are not run again. converge.json is written anew as each run
    ends.
    """
    case = load_case(path, overrides)
    wanted(case, only)
    with WarmProcess() as warm:
        return _study(LevelStudy(case, overrides, out, only, tolerance, budget, say, warm))


def _study(study: LevelStudy) -> bool:
    levels = [study.plan.base(), *study.plan.coarser(), *study.plan.in_place_of_coarser()]
    others = [*study.plan.alone(), *study.plan.twins(), *study.plan.shifts()]
    study.announce([*levels, *others])
    study.run(levels)
    if any(one.run.name == "case" and one.ended.message for one in study.runs):
        return False
    study.run(others)
    study.run(_in_place_of_the_element(study))
    if study.tolerance is not None:
        _go_upwards(study, study.tolerance)
    study.tell()
    return True


class LevelStudy:
    """The runs of a case and what they say so far."""

    def __init__(
        self,
        case: Case,
        overrides: Settings,
        out: Path,
        only: Sequence[str],
        tolerance: float | None,
        budget: float | None,
        say: Any,
        warm: WarmProcess,
    ):
        self.case, self.overrides, self.out, self.only, self.say = case, overrides, out, only, say
        self.tolerance, self.budget, self.warm = tolerance, budget, warm
        self.plan = Plan(case, lambda changes: load_case(case.path, (*overrides, *changes)))
        self.runs: list[Done] = []
        self.found: dict[str, BandedValue] = {}
        self.known = known_runs(out / CONVERGE_RESULTS)
        self.reach: dict[str, Any] | None = None
        self._begin = time.monotonic()
        self._cores = len(os.sched_getaffinity(0))

    def announce(self, made: Sequence[PlannedRun | Refused]) -> None:
        """Say what all runs cost, the first of which is the case itself, before any of them starts."""
        runs = [one for one in made if isinstance(one, PlannedRun)]
        new = [run for run in runs if not self._has_run(run)]
        together = max(sum(run.seconds for run in new) / self._cores, *(run.seconds for run in new), 0.0)
        together += SECONDS_TO_START if new else 0.0
        there = f" ({len(runs) - len(new)} of them are there)" if len(new) < len(runs) else ""
        own = f", the case itself {seconds_in_words(runs[0].seconds)} of it" if runs[0] in new else ""
        self.say(
            f"{self.case.path}: {len(runs)} runs in {self.out}{there}: about {seconds_in_words(together)} on "
            f"{self._cores} core{'s' * (self._cores > 1)}{own} (accurate to a factor of about three)"
        )
        self.out.mkdir(parents=True, exist_ok=True)

    def run(self, made: Iterable[PlannedRun | Refused]) -> bool:
        """Run what the budget allows, the cheapest first; returns whether all runs were allowed."""
        runs: list[PlannedRun] = []
        for one in made:
            if isinstance(one, Refused):
                self._add(Done(one.run, TwinEnded(one.run.twin, message=one.message)))
            else:
                runs.append(one)
        runs.sort(key=lambda run: run.seconds)
        new = [] if self.budget is None else [run for run in runs if not self._has_run(run)]
        allowed = [run for run in runs if run not in new or self._fits(run, new)]
        by_name = {run.name: run for run in allowed}
        twins = [_without_fields(run.twin) for run in allowed]
        count = len(self.runs) + len(twins)
        for ended in run_all(self.case, self.overrides, twins, self.out, self.known, self.warm):
            self.known[ended.twin.name] = ended.checksum
            self._add(done(self.case, by_name.pop(ended.twin.name), ended), count, by_name.values())
        return len(allowed) == len(runs)

    def _fits(self, run: PlannedRun, together: Sequence[PlannedRun]) -> bool:
        """Whether a run, with those before it, ends within the budget. The case itself always runs."""
        if self.budget is None or run.name == "case":
            return True
        left = self.budget - (time.monotonic() - self._begin)
        before = [one.seconds for one in together[: together.index(run) + 1]]
        needed = self._measured() * max(sum(before) / self._cores, run.seconds)
        if needed > left:
            words = f"{seconds_in_words(needed)} needed, {seconds_in_words(max(left, 0.0))} left of the budget"
            self.say(f"{run.name:12} left out: {words}")
        return needed <= left

    def _has_run(self, run: PlannedRun) -> bool:
        """Whether its results are in the folder; those of a case that has changed since are not."""
        return has_run(self.case, self.overrides, _without_fields(run.twin), self.out, self.known)

    def _measured(self) -> float:
        """Seconds of the runs that have ended over those estimated."""
        ended = [one for one in self.runs if one.seconds]
        estimated = sum(one.run.seconds for one in ended)
        return sum(one.seconds for one in ended) / estimated if estimated else 1.0

    def _add(self, one: Done, of: int = 0, left: Collection[PlannedRun] = ()) -> None:
        self.runs = [*(other for other in self.runs if other.run.name != one.run.name), one]
        rest = self._measured() * sum(run.seconds for run in left) / self._cores
        more = f"; {len(left)} more: about {seconds_in_words(rest)}" if left else ""
        self.say(f"{f'{len(self.runs)}/{of}' if of else '':>6} {run_row(one)}{more}")
        self.found = findings(self.plan, self.runs, self.only, self.tolerance or BAND)
        self.write()

    def write(self) -> None:
        """converge.json with what is known."""
        content = {**as_json(self.found, self.runs, self.known), "cheapest": self.reach}
        write_text(self.out / CONVERGE_RESULTS, json.dumps(plain(content), indent=1) + "\n")

    def tell(self) -> None:
        """The values with their bands; the settings that reach the tolerance; the page."""
        lines = [line for name, one in self.found.items() for line in sentences(name, one, self.runs)]
        self.say("\n" + "\n".join([*lines, *without_results(self.runs), *helps(self.runs, self.found)]))
        if self.tolerance is not None:
            self.say(self._reach(self.tolerance))
        self.write()
        self.say(str(write_page(self.case.title, self.out, self.found, self.runs)))

    def _reach(self, tolerance: float) -> str:
        """Writes the cheapest case within the tolerance, and says what it is."""
        ended = {one.run.name: one for one in self.runs if not one.ended.message}
        options = [Option(ended["case"].seconds)]
        options += [Option(ended[name].seconds, name, source) for name, source in BETTER.items() if name in ended]
        sources = {name: source.largest for name, source in self.plan.sources.items()}
        choice = cheapest(list(self.found.values()), options, sources, self.plan.dimension, tolerance)
        if choice is None:
            return f"{percent(tolerance)}: no cells up to 8 times as fine reach it"
        changes = ended[choice.option.twin].run.twin.settings if choice.option.twin else ()
        changes = (*changes, *self.plan.settings(choice.factors, changes))
        folder = self.out / CHEAPEST
        keep_case(load_case(self.case.path, (*self.overrides, *changes)), folder)
        words = settings(changes) or "the case as it is"
        self.reach = {"tolerance": tolerance, "settings": dict(changes), "seconds": choice.seconds}
        return f"{percent(tolerance)}: {folder / 'case.yaml'}, about {seconds_in_words(choice.seconds)}: {words}"


def _in_place_of_the_element(study: LevelStudy) -> list[PlannedRun | Refused]:
    """The other element in the same cells, where it refuses those twice as large."""
    failed = any(one.run.name == "element" and one.ended.message for one in study.runs)
    other = study.plan.element_in_the_same_cells() if failed else None
    return [] if other is None else [other]


def _go_upwards(study: LevelStudy, tolerance: float) -> None:
    """Finer levels, one by one, until all bands are within the tolerance or the budget is spent."""
    for level in study.plan.finer():
        if all(one.relative is not None and one.relative <= tolerance for one in study.found.values()):
            return
        if not study.run([level]):
            return


def _without_fields(twin: Twin) -> Twin:
    return Twin(twin.name, twin.words, twin.meaning, (*twin.settings, *NO_FIELDS), twin.processes, twin.opposite)
