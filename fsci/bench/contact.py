"""Contact: search. The mortar kernel's numbers belong here too."""

from __future__ import annotations

from fsci.bench.table import Row
from solvers.contact.search import measure_search


def run_search() -> list[Row]:
    """Microseconds per facet to build, refit and query the trees and to compare the boxes of the surfaces."""
    rows: list[Row] = []
    for facets in (1_000, 10_000, 100_000):
        found = measure_search(facets)
        count = int(found["facets"])
        times = {f"{part} [us]": 1e6 * found[part] / count for part in ("build", "refit", "query", "box")}
        rows.append({"facets": count, **times, "pairs": int(found["pairs"]), "tests": int(found["tests"])})
    return rows
