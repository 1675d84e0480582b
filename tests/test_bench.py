"""Benchmarks: their tables and command line; the small ones run."""

import json
import subprocess
import sys

from fsci.bench import linear, small
from fsci.bench.table import show, text
from fsci.shapes import box


def test_table():
    rows = [{"name": "a", "count": 12, "time [s]": 0.123456}, {"name": "longer", "count": 3456, "time [s]": 1234.5}]
    assert show(rows).split("\n") == [
        "    name  count  time [s]",
        "       a     12     0.123",
        "  longer   3456  1.23e+03",
    ]


def test_numbers():
    assert [text(value) for value in (0.0, 1.0, 12.0, 123.4, 1e-5, 7, "word")] == [
        "0.00",
        "1.00",
        "12.0",
        "123",
        "1e-05",
        "7",
        "word",
    ]


def test_command_line(tmp_path):
    out = tmp_path / "bench.json"
    done = subprocess.run(
        [sys.executable, "-m", "fsci.bench", "search", "-o", out], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    data = json.loads(out.read_text())
    assert data.keys() == {"machine", "versions", "results"}
    assert [row["facets"] for row in data["results"]["search"]] == [1024, 10000, 99856]
    assert done.stdout.splitlines()[1].startswith("search: ")


def test_unknown_name():
    done = subprocess.run([sys.executable, "-m", "fsci.bench", "sercah"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert "unknown benchmark 'sercah' (available: small, static, linear," in done.stderr


def test_small_row():
    row = small.measure("beam", *small.CASES["beam"], steps=2)
    assert row["unknowns"] == 138
    assert row["newton per step"] >= 1


def test_linear_row():
    row = linear.measure("small", box((1, 1, 1), (3, 3, 3)))
    assert row["dofs"] == 192
    assert 0 < row["iterations"] < 60
    assert min(seconds for name, seconds in row.items() if name.endswith("[s]")) > 0
