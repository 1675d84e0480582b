"""Mutated case files: settings of small valid cases enlarged, replaced, deleted, copied elsewhere."""

from __future__ import annotations

import contextlib
import copy
import io
import random
from functools import cache
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from fsci.stress.program import Ended, run_text

#: Those that are mutated.
KINDS = ("beam", "press", "flow", "post")


@cache
def cases() -> dict[str, Any]:
    """The cases of cases.yaml."""
    return YAML(typ="safe", pure=True).load(Path(__file__).with_name("cases.yaml").read_text())


#: other values, most of which a case may have
VALUES: list[Any] = [
    0, 1, -1, 2, 3, 0.5, -0.3, 1e-3, 1e3, 1e-12, 1e9, 1e-300, 1e300, None, True, False, "t", "x", "1/t", "sqrt(-1)",
    "where(x > 0.5, 1, 0)", "log(x)", [0, 0], [1, 0, 0], [0.5, 0.5], ["t", "-t"], [1], [], {}, "left", "right", "top",
    "x-", "y+", "beam", "post", "disc", "tri", "quad", "iterative", "direct", "bdf2", "backward_euler", "steady",
    "stokes", "q2q1", "partitioned", "monolithic", "mooney_rivlin", "neo_hooke", "coup_neo_hooke", "mixed", "stress",
]  # fmt: skip
#: of numbers
FACTORS = (-1, 0, 2, 3, 5, 0.5, 0.3, 0.1, 0.01, 10, 100, 1e4, 1e-6)
#: Cells in one direction above which a case takes too long.
MOST_CELLS = 40


def settings_of(data, found=None):
    """All settings in the data, as pairs (container, key)."""
    found = [] if found is None else found
    for key, value in data.items() if isinstance(data, dict) else enumerate(data):
        found.append((data, key))
        if isinstance(value, dict | list):
            settings_of(value, found)
    return found


def mutate(data, chance: random.Random) -> None:
    """Change one setting: mostly the size of a number, else replace, delete or copy it."""
    kind, everything = chance.random(), settings_of(data)
    numbers = [(where, key) for where, key in everything if type(where[key]) in (int, float)]
    container, key = chance.choice(numbers if kind < 0.7 and numbers else everything)
    if kind < 0.7 and numbers:
        value = container[key]
        container[key] = type(value)(value * chance.choice(FACTORS)) + chance.choice([0, 0, 0, type(value)(1)])
    elif kind < 0.8:
        container[key] = chance.choice(VALUES)
    elif kind < 0.9:
        del container[key]
    else:
        other, name = chance.choice(settings_of(data))
        container[key] = copy.deepcopy(other[name])


def mutant(seed: int) -> str | None:
    """The text of a case, or None if it is too large to be computed for this."""
    chance = random.Random(seed)
    data = copy.deepcopy(cases()[chance.choice(KINDS)])
    for _ in range(chance.choice([1, 1, 1, 2, 3])):
        mutate(data, chance)
    for container, key in settings_of(data):
        cells = container[key] if key == "cells" else ()
        if any(isinstance(n, int | float) and n > MOST_CELLS for n in (cells if isinstance(cells, list) else [cells])):
            return None
    stream = io.StringIO()
    try:
        YAML(typ="safe", pure=True).dump(data, stream)
    except ValueError:
        return None
    return stream.getvalue()


def run_mutant(seed: int, folder: Path) -> Ended:
    """Compute the first mutant from this number on that is small enough, for one step."""
    from fsci.case import CaseError, load_case

    chance = random.Random(seed)
    text = None
    while text is None:
        text = mutant(chance.randrange(10**9))
    settings: list[str] = []
    (folder / "case.yaml").write_text(text)
    with contextlib.suppress(CaseError):  # the run says it too
        case = load_case(folder)
        if (case.time.end - case.time.start) / case.time.step > 2:
            settings = ["--set", f"time.end={case.time.start + case.time.step!r}"]
    return run_text(folder, text, *settings)
