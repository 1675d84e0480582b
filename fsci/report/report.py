"""The HTML report of a run: settings, checks and balances, pictures, and time by part."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fsci.report.html import REPORT_FILE, bars, folded, heading, page, paragraph, pictures, preformatted, section, table
from fsci.running.files import require_own, write_text

LOG_LINES = 40  #: of the log that are shown


def write_report(out: Path) -> Path:
    """Draws the run in folder `out` and writes out/report.html, which needs no other file; returns it.

    Raises FileNotFoundError if no run has ended there, ValueError or RuntimeError if it cannot be drawn.
    """
    from fsci.plot.picture import plot_run

    require_own(out)
    summary = read_summary(out)
    drawn = plot_run(out)
    write_text(out / REPORT_FILE, report(out, summary, drawn))
    return out / REPORT_FILE


def read_summary(out: Path) -> dict[str, Any]:
    """The summary of a run that has ended. Raises FileNotFoundError."""
    path = out / "summary.json"
    if not path.is_file():
        raise FileNotFoundError(f"'{out}' has no summary.json: no run has ended there")
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def report(out: Path, summary: Mapping[str, Any], drawn: Sequence[Path]) -> str:
    """The text of the page."""
    status = str(summary["status"])
    curves = [file for file in drawn if file.name.startswith(("history_", "convergence"))]
    return page(
        str(summary["title"]),
        [
            heading(str(summary["title"])),
            paragraph(status, "status ok" if status == "finished" else "status bad"),
            paragraph(str(summary["message"])),
            section("Why it failed", _failure(out, summary)),
            section("Warnings", _warnings(summary)),
            section("Resolution", _resolution(summary)),
            section("Run", _run(summary)),
            section("Verification", _verification(summary)),
            section("Pictures", pictures(file for file in drawn if file not in curves)),
            section("Curves", pictures(curves)),
            section("Balances", _balances(summary)),
            section("Probes", _probes(summary)),
            section("Time", _time(summary)),
            section("Files", folded("case.yaml", _text(out / "case.yaml")), folded("log.txt", _tail(out / "log.txt"))),
        ],
    )


def _run(summary: Mapping[str, Any]) -> str:
    steps, newton, wall = summary["steps"], summary["newton"], summary["wall"]["total"]
    mean = newton["total"] / max(steps["accepted"], 1)
    rows: list[tuple[str, object]] = [
        ("unknowns", ", ".join(f"{name} {count:,}" for name, count in summary["dofs"].items())),
        ("time steps", f"{steps['accepted']}, {steps['retried']} repeated"),
        ("Newton iterations", f"{newton['total']}, {mean:.1f} per step, {newton['max']} at most"),
        ("wall time", f"{wall:.3g} s on {summary['processes']} process{'es' * (summary['processes'] > 1)}"),
        ("memory of the largest process", f"{summary['memory_mb']:.0f} MB"),
        ("versions", ", ".join(f"{name} {version}" for name, version in summary["versions"].items())),
    ]
    return table(("", ""), rows)


def _warnings(summary: Mapping[str, Any]) -> str:
    rows = [
        (found["kind"], found["body"], _number(found["time"]), _number(found["value"]), found["message"])
        for found in summary["warnings"]
    ]
    return table(("kind", "body", "first at", "largest", "message"), rows)


def _resolution(summary: Mapping[str, Any]) -> str:
    rows = [
        (
            ("coarse", "bad") if found["warns"] else ("ok", "ok"),
            found["body"],
            found["to"] or "",
            f"{found['cells']:.3g}" if found["cells"] is not None else "no shear",
            f"{found['least']:.3g}",
            f"{found['error']:.2g}",
            found["message"],
        )
        for found in summary.get("resolution", ())
    ]
    words = ("", "body", "gap to", "cells", "across, or at least", "error in the benchmark [%]", "message")
    return table(words, rows)


def _failure(out: Path, summary: Mapping[str, Any]) -> str:
    """The text of `fsci explain` for a failed run."""
    if summary["status"] != "failed":
        return ""
    from fsci.explain.explain import explain

    return preformatted(explain(out))


def _verification(summary: Mapping[str, Any]) -> str:
    rows = [
        (
            ("ok", "ok") if result["ok"] else ("missed", "bad"),
            result["name"],
            result["message"] if result["value"] is None else result["value"],
            result["reference"],
            result["tolerance"],
            "result of an earlier version" if result["regression"] else "",
        )
        for result in summary["verify"]
    ]
    return table(("", "value", "found", "reference", "allowed difference", ""), rows)


def _balances(summary: Mapping[str, Any]) -> str:
    rows = [(name, _number(v["final"]), _number(v["max_abs"])) for name, v in summary["balances"].items()]
    return table(("error of a balance", "at the end", "largest"), rows)


def _probes(summary: Mapping[str, Any]) -> str:
    rows = [(name, *(_number(v[key]) for key in ("final", "min", "max"))) for name, v in summary["probes"].items()]
    return table(("column", "at the end", "least", "largest"), rows)


def _number(value: float | None) -> object:
    return "not finite" if value is None else float(value)


def _time(summary: Mapping[str, Any]) -> str:
    parts = dict(summary["wall"])
    rest = parts.pop("total") - sum(parts.values())
    return bars({**parts, "other": max(rest, 0.0)}, "s")


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8") if path.exists() else ""


def _tail(path: Path) -> str:
    return "\n".join(_text(path).splitlines()[-LOG_LINES:])
