"""The scenes whose bands are compared with exact values: they are cases, and have these values."""

import pytest
from ruamel.yaml import YAML

from fsci.bench.converge import SCENES, case_of, markdown, row, summary
from fsci.case import load_case
from fsci.converge.values import wanted

ALL = YAML(typ="safe", pure=True).load(SCENES.read_text())


@pytest.mark.parametrize("name", ALL)
def test_scenes(name, tmp_path):
    scene = ALL[name]
    case = load_case(
        case_of(name, scene, tmp_path), tuple((key, str(value)) for key, value in scene.get("set", {}).items())
    )
    assert scene["exact"]
    wanted(case, [value.split()[0] for value in scene["exact"]])


def found(value, band, verdict="resolved"):
    return {"value": value, "band": band, "order": None, "verdict": verdict}


def test_rows():
    one = row("scene", "drag", 2.0, found(2.1, 0.2), 3.0)
    assert one["error [%]"] == pytest.approx(5.0)
    assert one["band / error"] == pytest.approx(2.0)
    assert one["held"] == "yes"
    assert row("scene", "drag", 2.0, found(2.1, 0.09), 3.0)["held"] == "no"
    assert row("scene", "drag", 2.0, found(2.1, None), 3.0)["held"] == "yes"
    assert row("scene", "drag", 2.0, found(2.0 + 1e-12, 1e-13), 3.0)["held"] == "yes"  # rounding


def test_the_table_of_the_docs():
    rows = [
        row("cylinder", "drag", 2.0, found(2.1, 0.2), 3.0),
        row("cylinder", "lift", 1.0, found(1.5, 2.0, "not resolved"), 3.0),
        row("cube", "low.x", 1.0, found(1.0 + 1e-9, 1e-6), 3.0),
    ]
    assert markdown(rows).splitlines()[2:] == [
        "| cylinder | drag: 5/10, lift: 50/200; lift not resolved |",
        "| cube | low.x: 0/0.0001 |",
    ]


def test_summary():
    rows = [
        row("a", "x", 1.0, found(1.01, 0.02), 3.0),
        row("a", "y", 1.0, found(1.01, 0.03), 3.0),
        row("b", "x", 1.0, found(1.01, 0.001), 4.0),
        row("c", "x", 1.0, found(1.01, 0.001, "indicative"), 4.0),
    ]
    last = summary(rows)
    assert last["held"] == "2 of 4"
    assert last["verdict"] == "3 resolved, 1 of them missed"
    assert last["band / error"] == pytest.approx(1.05)
    assert last["all runs [s]"] == pytest.approx(11.0)
