"""Contact: search, and two tori from beginning to end. The mortar kernel's numbers belong here too."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from fsci.bench.program import run_case
from fsci.bench.table import Row
from solvers.contact.search import measure_search

TORI = Path(__file__).parents[2] / "cases" / "two_tori"


def run_search() -> list[Row]:
    """Microseconds per facet to build, refit and query the trees and to compare the boxes of the surfaces."""
    rows: list[Row] = []
    for facets in (1_000, 10_000, 100_000):
        found = measure_search(facets)
        count = int(found["facets"])
        times = {f"{part} [us]": 1e6 * found[part] / count for part in ("build", "refit", "query", "box")}
        rows.append({"facets": count, **times, "pairs": int(found["pairs"]), "tests": int(found["tests"])})
    return rows


def run_tori() -> list[Row]:
    """Seconds by part of all steps of `two_tori`; `contact` is everything but assembly and solution of the system."""
    with TemporaryDirectory() as folder:
        summary = run_case(TORI, Path(folder), {"output.fields_every": 0})
    steps, newton, wall = summary["steps"], summary["newton"], summary["wall"]
    parts = {name: wall[name] for name in ("assembly", "contact", "solve")}
    return [
        {
            "dofs": summary["dofs"]["structure"],
            "steps": steps["accepted"],
            "retried": steps["retried"],
            "newton": newton["total"],
            "most": newton["max"],
            "wall [s]": wall["total"],
            **{f"{name} [s]": seconds for name, seconds in parts.items()},
            "rest [s]": wall["total"] - sum(parts.values()),
        }
    ]
