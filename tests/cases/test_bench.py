"""Benchmarks: their tables and command line; the small ones run."""

import json
import time
from collections.abc import Mapping
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from programs import fsci

from fsci.bench import hertz, idle, linear, processes, profile, small, studies
from fsci.bench.compare import compare
from fsci.bench.families import FAMILIES
from fsci.bench.family import CASES, Family, Study, front
from fsci.bench.front_plot import plot_front
from fsci.bench.table import show, text
from fsci.case import load_case
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
    done = fsci("bench", "search", "-o", out)
    assert done.returncode == 0, done.stderr
    data = json.loads(out.read_text())
    assert data.keys() == {"machine", "versions", "commit", "results"}
    assert [row["facets"] for row in data["results"]["search"]] == [1024, 10000, 99856]
    assert done.stdout.splitlines()[1].startswith("search: ")


def test_mistakes(tmp_path):
    done = fsci("bench", "sercah")
    assert done.returncode == 2
    assert done.stderr == "fsci bench: there is no benchmark 'sercah'; did you mean 'search'?\n"
    (tmp_path / "old.json").write_text("{}")
    done = fsci("bench", "search", "--against", tmp_path / "old.json")
    assert done.returncode == 2
    assert done.stderr == f"fsci bench: {tmp_path}/old.json has no results of benchmarks (KeyError)\n"


def test_list():
    done = fsci("bench")
    assert done.returncode == 0
    assert done.stdout.startswith("small           one time step of small problems")


def test_front():
    """Cost and error: (3, 2) costs more and errs more than (2, 1); two that are the same are both on the front."""
    assert front([(1.0, 5.0), (2.0, 1.0), (3.0, 2.0), (2.0, 1.0), (4.0, 0.5)]) == [True, True, False, True, True]


def test_a_family_measures_each_option_and_resolution(tmp_path):
    csm1 = FAMILIES["csm1"]
    rows = replace(csm1, resolutions=dict([*csm1.resolutions.items()][:1])).run()
    assert [(row["option"], row["resolution"], row["unknowns"]) for row in rows] == [
        ("quad9", "35 x 2", 710),
        ("quad4", "35 x 2", 216),
    ]
    errors = [row["error [%]"] for row in rows]
    assert errors[0] < 1.0 < 30.0 < errors[1]
    assert all(row["error [%]"] == max(row["A.x final [%]"], row["A.y final [%]"]) for row in rows)
    assert rows[0]["front"] == "*"
    plot_front(rows, "two runs", tmp_path / "front.png")
    assert (tmp_path / "front.png").read_bytes()[:4] == b"\x89PNG"


def test_a_family_of_a_case_of_its_own():
    """A bar hits a wall; the errors are those of momentum and depth (10.1 % for ten cells, exact in time)."""
    bar = FAMILIES["bar_impact"]
    (row,) = replace(bar, options={"": {}}, resolutions=dict([*bar.resolutions.items()][:1])).run()
    assert row["error [%]"] == max(row["momentum.x final [%]"], row["centre.x min [%]"]) < 12.0


def test_a_study_has_its_front(tmp_path):
    """Runs without a memory of their own have no panel for it."""
    rows = [{"option": "a", "resolution": str(n), "unknowns": n, "time [s]": n, "error [%]": 1 / n} for n in (1.0, 2.0)]
    found = Study("words", lambda: rows).run()
    assert [row["front"] for row in found] == ["*", "*"]
    plot_front(found, "two runs", tmp_path / "front.png")
    assert (tmp_path / "front.png").stat().st_size > 0


def test_second_order_ball():
    """Nodes of a coarse mesh of second order lie on the ball as those of a finer one of first order do."""
    coarse, fine = hertz.quarter_ball(2, 6, order=2), hertz.quarter_ball(2, 6)
    assert len(coarse.points) > 6 * len(fine.points)
    corners = coarse.points[np.unique(coarse.cells[:, :8])]
    assert np.abs(np.sort(corners, axis=0) - np.sort(fine.points, axis=0)).max() < 1e-12


def test_studies_measure_what_they_say(monkeypatch):
    """Few cells: the drag in a film of 0.2 cells, and the flow around a sphere."""
    monkeypatch.setattr(studies, "FILM_CELLS", (0.1,))
    rows = studies.film()
    assert [row["option"] for row in rows] == ["q1q1", "q2q1"]
    assert rows[1]["error [%]"] < 3.0 < rows[0]["error [%]"]
    assert studies.decay("q1q1", "bdf2", 6)["error [%]"] < 5.0


def test_the_drag_of_a_sphere_near_a_wall(monkeypatch):
    """Brenner (1961), table 1: 9.2518 at cosh(0.5) - 1; on cells of four gaps it is within a tenth."""
    assert studies.brenner(np.cosh(0.5) - 1.0) == pytest.approx(9.2518, abs=1e-4)
    monkeypatch.setattr(studies, "SPHERE_RUNS", (("q2q1", 0.4),))
    (row,) = studies.sphere()
    assert row["error [%]"] < 10.0


@pytest.mark.parametrize("name", [name for name, family in FAMILIES.items() if isinstance(family, Family)])
def test_all_settings_of_a_family_are_those_of_its_case(name, tmp_path):
    """Each run of it could begin."""
    family = FAMILIES[name]
    case = tmp_path if isinstance(family.case, Mapping) else CASES / family.case
    (tmp_path / "case.yaml").write_text(json.dumps(family.case))
    for option, resolution in product(family.options.values(), family.resolutions.values()):
        settings = {**(family.all or {}), **option, **resolution}
        load_case(case, [(key, json.dumps(value)) for key, value in settings.items()])


def test_cells_halved_around_the_cylinder_cost_less():
    """2D-1: a tenth of the error with twice the unknowns."""
    nested = FAMILIES["nested"]
    options = {name: nested.options[name] for name in ("q1q1, equal", "q1q1, halved twice")}
    equal, halved = replace(nested, options=options, resolutions=dict([*nested.resolutions.items()][:1])).run()
    assert halved["error [%]"] < 0.1 * equal["error [%]"]
    assert halved["unknowns"] < 2 * equal["unknowns"]


def test_ratios_to_earlier_results():
    now = {"a": [{"option": "x", "time [s]": 1.0, "error [%]": 3.0, "dofs": 5, "front": "*"}], "b": [{"time [s]": 1.0}]}
    before = {"a": [{"option": "y", "time [s]": 9.0}, {"option": "x", "time [s]": 2.0, "error [%]": 1.5, "dofs": 5}]}
    assert [(row["column"], row["now/before"]) for row in compare(now, before)] == [
        ("time [s]", 0.5),
        ("error [%]", 2.0),
    ]


def test_small_row():
    row = small.measure("beam", *small.CASES["beam"], steps=2)
    assert row["unknowns"] == 138
    assert row["newton per step"] >= 1


def test_idle_row():
    """A pair that never meets changes no Newton step."""
    (name, (text, part)), *_ = idle.SCENES.items()
    row = idle.measure(name, text, part, steps=10)
    assert row["newton with"] == row["newton without"]
    assert row["ratio"] == pytest.approx(row["with [ms]"] / row["without [ms]"])


def test_idle_row_of_sentinels():
    """They change no Newton step."""
    row = idle.measure_sentinels("flow", idle.WATCHED["flow with a moved disc, sentinels"], steps=10)
    assert row["newton with"] == row["newton without"]


@pytest.mark.slow
def test_schemes_of_coupling_find_the_same_flag():
    """FSI1 on half the cells: Aitken's, the quasi-Newton and the monolithic scheme have one error."""
    fsi1 = FAMILIES["fsi1"]
    rows = replace(fsi1, resolutions=dict([*fsi1.resolutions.items()][:1])).run()
    errors = {row["option"]: row["error [%]"] for row in rows}
    assert errors["q2q1, Aitken"] == pytest.approx(errors["q2q1, IQN-ILS"], abs=1e-3)
    assert errors["q2q1, Aitken"] == pytest.approx(errors["q2q1, monolithic"], abs=0.01)


def test_linear_row():
    row = linear.measure("small", box((1, 1, 1), (3, 3, 3)))
    assert row["dofs"] == 192
    assert 0 < row["iterations"] < 60
    assert min(seconds for name, seconds in row.items() if name.endswith("[s]")) > 0


def test_profile():
    """The parts of a Newton step add up to all that it takes, and each part is found."""
    begin = time.process_time()
    found, least = profile.channel(8, 2)
    seconds = time.process_time() - begin
    parts = [*profile.PARTS, "Krylov", "rest"]
    assert found["total"] == pytest.approx(sum(found[part] for part in parts))
    assert all(found[part] > 0.0 for part in parts)
    assert found["total"] * 1e-6 * found["unknowns"] * found["newton"] * 2 < seconds
    assert 0.0 < least["Krylov"] < found["Krylov"]
    assert found["krylov"] >= 1


def test_counts_by_process():
    """Two processes share the cells of one, with each other as neighbours."""
    one, two = (processes.row(count, 8) for count in (1, 2))
    assert one["unknowns"] == two["unknowns"] == 4 * 9**3
    assert (one["neighbours"], two["neighbours"]) == ("0-0", "1-1")
    assert (one["halo [kB]"], one["work"]) == ("0-0", 1.0)
    least, most = map(int, two["halo [kB]"].split("-"))
    assert 8 * 4 * 9**2 // 1000 <= least <= most < 8 * one["unknowns"] / 1000  # a layer of nodes, but not all
    for cells in ("uncut cells", "cut cells"):
        whole = int(one[cells].split("-")[0])
        least, most = map(int, two[cells].split("-"))
        assert 2 * least <= whole <= 2 * most
    assert 1.0 <= two["work"] < 1.5
