"""The errors of a case on one page: OUT/report.html."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from fsci.converge.picture import draw
from fsci.converge.results import BandedValue, Done
from fsci.converge.words import percent, sentences
from fsci.report.html import REPORT_FILE, heading, page, paragraph, pictures, preformatted, section, table
from fsci.running.files import write_text

PICTURE = "error_against_time.png"
STYLE_OF_VERDICT = {"resolved": "ok", "indicative": "", "not resolved": "bad"}


def write_page(title: str, out: Path, found: Mapping[str, BandedValue], runs: Sequence[Done]) -> Path:
    """Writes the page with its picture, and returns it."""
    drawn = [out / PICTURE] if draw(out / PICTURE, found, runs) else []
    said = "\n".join(line for name, one in found.items() for line in sentences(name, one, runs))
    text = page(
        f"Errors of {title}",
        [
            heading(f"Errors of {title}"),
            section("Values", _values(found), preformatted(said)),
            section("Shares of the error", _shares(found)),
            section("Error against time", pictures(drawn)),
            section("Runs", _runs(runs)),
            paragraph("Bands and verdicts: docs/converge.md."),
        ],
    )
    write_text(out / REPORT_FILE, text)
    return out / REPORT_FILE


def _values(found: Mapping[str, BandedValue]) -> str:
    rows = [
        (
            (one.estimate.verdict, STYLE_OF_VERDICT[one.estimate.verdict]),
            name,
            "no value" if one.estimate.value is None else one.estimate.value,
            "none" if one.estimate.band is None else one.estimate.band,
            "" if one.relative is None else percent(one.relative),
            "" if one.estimate.order is None else f"{one.estimate.order:.2g}",
        )
        for name, one in found.items()
    ]
    return table(("", "value", "found", "band", "relative", "order"), rows)


def _shares(found: Mapping[str, BandedValue]) -> str:
    names = list(dict.fromkeys(name for one in found.values() for name in one.estimate.shares))
    rows = [
        (value, *(percent(one.estimate.shares[name]) if name in one.estimate.shares else "" for name in names))
        for value, one in found.items()
        if names
    ]
    return table(("value", *names), rows)


def _runs(runs: Sequence[Done]) -> str:
    rows = [
        (
            one.run.name,
            one.ended.message or one.run.twin.words,
            f"{one.run.size:.3g}" if one.run.role in ("level", "source") else "",
            one.unknowns or "",
            "" if one.ended.seconds is None else float(one.ended.seconds),
        )
        for one in runs
    ]
    return table(("run", "what is other", "size", "unknowns", "time [s]"), rows)
