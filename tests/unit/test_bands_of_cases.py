"""Numbers of our own in cases: each has a band in the README of its case, or the words that it has none, and why."""

import re
from pathlib import Path

import pytest

from fsci.case import load_case
from fsci.case.verify import COUNTERS

ROOT = Path(__file__).parents[2]
BAND = re.compile(r"(-?\d+(?:\.\d+)?) \+- (\d+(?:\.\d+)?)")
NO_BAND = re.compile(r"\bno band: \w")
#: READMEs are in the unit of the case, or in thousandths of it.
UNITS = (1.0, 1e3)


def has_band(reference, text):
    """Whether a value and its band in the text hold a number, whatever its sign."""
    bands = [(abs(float(value)), float(band)) for value, band in BAND.findall(text)]
    return any(abs(value - abs(reference) * unit) <= band for value, band in bands for unit in UNITS)


def own_numbers(folder):
    """References of `verify` that are results of this program, without counts."""
    checks = load_case(folder).verify
    return [check.reference for check in checks if check.regression and check.value not in COUNTERS]


FOLDERS = [path for path in sorted((ROOT / "cases").iterdir()) if own_numbers(path)]


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_each_has_a_band_or_a_reason(folder):
    text = " ".join((folder / "README.md").read_text().split())
    without = [number for number in own_numbers(folder) if not has_band(number, text)]
    assert not without or NO_BAND.search(text), without


def test_what_is_a_band():
    assert has_band(-40.8, "across 40.7 +- 0.8")
    assert has_band(0.0269, "26.9 +- 8.6 mm")
    assert not has_band(41.6, "across 40.7 +- 0.8")
    assert len(FOLDERS) > 10
    assert NO_BAND.search("positions have no band: films are not resolved")
    assert not NO_BAND.search("positions have no band.")
