"""What 1 % costs in each family of runs: the cheapest run with this error, and the cheapest runs whose band says so."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from fsci.bench.bands import BANDS, known_runs
from fsci.bench.table import ERROR, LEVEL, TIME, UNKNOWNS, Row, text
from fsci.converge.estimate import SOLVER_DIFFERENCE

LIMIT = 1.0  #: [%]
HEAD = ("family", "values", f"cheapest run within {LIMIT:g} %", UNKNOWNS, TIME)


def table(families: Mapping[str, tuple[str, Sequence[Row]]]) -> str:
    """A line of Markdown for each family with errors and times, by name: (words, rows); empty without any.

    `sure by N` are the seconds of the cheapest N runs whose band is within the limit (fsci/bench/bands.py), with their
    error if it is not. Below the table stands how many bands hold the exact value.
    """
    errors = {name: found for name, found in families.items() if {TIME, ERROR, UNKNOWNS} <= found[1][0].keys()}
    if not errors:
        return ""
    heads = [*HEAD, *(f"sure by {count} [s]" for count in BANDS)]
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    lines += [f"| {' | '.join(_line(name, *found))} |" for name, found in errors.items()]
    return "\n".join([*lines, "", *_held([rows for _, rows in errors.values()])])


def _line(name: str, words: str, rows: Sequence[Row]) -> Iterator[str]:
    within = [row for row in rows if row[ERROR] <= LIMIT]
    best = min(within, key=lambda row: row[TIME]) if within else min(rows, key=lambda row: row[ERROR])
    yield f"`{name}`, {words.split(':')[0].split(',')[0]}"
    yield ", ".join(dict.fromkeys(value.split()[0] for value in best[LEVEL]["values"])) if LEVEL in best else "a norm"
    yield _run(best) if within else f"**not reached**: {text(float(best[ERROR]))} % by {_run(best)}"
    yield f"{best[UNKNOWNS]:,}"
    yield text(float(best[TIME]))
    yield from (_sure(rows, count) for count in BANDS)


def _run(row: Row) -> str:
    return "; ".join(str(row[column]) for column in ("option", "resolution") if column in row)


def _sure(rows: Sequence[Row], count: int) -> str:
    found = [(one, bands) for one in known_runs(rows) if (bands := one.bands(count))]
    sure = [one for one, bands in found if 100.0 * max(bands.values()) <= LIMIT]
    if not sure:
        return "not reached" if found else "no band"
    cheapest = min(sure, key=lambda one: one.seconds(count))
    error = float(cheapest.row[ERROR])
    return text(cheapest.seconds(count)) + (f", but {text(error)} %" if error > LIMIT else "")


def _held(families: Sequence[Sequence[Row]]) -> Iterator[str]:
    for count in BANDS:
        each = [
            (abs(one.row[LEVEL]["values"][name] - 1.0), band, one.twin is not None)
            for rows in families
            if LEVEL in rows[0]
            for one in known_runs(rows)
            for name, band in one.bands(count).items()
        ]
        held = [error <= max(band, SOLVER_DIFFERENCE) for error, band, _ in each]
        better = [holds for holds, (*_, twin) in zip(held, each, strict=True) if twin]
        within = [100.0 * error <= LIMIT for error, band, _ in each if 100.0 * band <= LIMIT]
        yield (
            f"Bands of {count} runs hold {sum(held)} of {len(held)} values, with a better method {sum(better)} of "
            f"{len(better)}. Of {len(within)} that are at most {LIMIT:g} %, {sum(within)} have no larger error."
        )
