"""The command `fsci preview`: draws a case that has not been computed, and says how far its pairs are apart."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fsci.case import load_case
from fsci.preview.draw import draw
from fsci.preview.legend import words_of
from fsci.preview.page import write_page
from fsci.preview.parts import preview_of


def preview(path: Path, overrides: Sequence[tuple[str, str]], out: Path) -> list[str]:
    """Write the picture or page `out`; lines on pairs of contact, then the file. Raises CaseError, or OSError."""
    case = load_case(path, overrides)
    scene = preview_of(case)
    out.parent.mkdir(parents=True, exist_ok=True)
    units = case.units.model_dump()
    if out.suffix == ".html":
        write_page(out, scene, units)
    else:
        draw(out, scene, units)
    return [*(f"pair {words_of(pair, case.units.length)}" for pair in scene.pairs), str(out)]
