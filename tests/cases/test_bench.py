"""Benchmarks: their tables and command line; the small ones run."""

import json
import time
from dataclasses import replace

import numpy as np
import pytest
from programs import fsci

from fsci.bench import hertz, idle, linear, measures, processes, profile, studies
from fsci.bench.compare import compare
from fsci.bench.family import FamilyError, front, function, read_families, starred
from fsci.bench.front_plot import plot_front
from fsci.bench.table import show, text
from fsci.case import load_case

FAMILIES = read_families()


def only(family, **axes):
    """The family with one of its blocks, where axes have these choices only."""
    return replace(family, variants=[{**family.variants[0], **axes}])


def first(family, name):
    """The first choice of an axis."""
    return dict([*family.variants[0][name].items()][:1])


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


@pytest.mark.slow
def test_a_family_measures_each_option_and_resolution(tmp_path):
    csm1 = FAMILIES["csm1"]
    rows = only(csm1, resolution=first(csm1, "resolution")).run()
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
    (row,) = only(bar, option=first(bar, "option"), resolution=first(bar, "resolution")).run()
    assert row["error [%]"] == max(row["momentum.x final [%]"], row["centre.x min [%]"]) < 12.0


def test_a_study_has_its_front(tmp_path):
    """Runs without a memory of their own have no panel for it."""
    rows = [{"option": "a", "resolution": str(n), "unknowns": n, "time [s]": n, "error [%]": 1 / n} for n in (1.0, 2.0)]
    found = starred(rows)
    assert [row["front"] for row in found] == ["*", "*"]
    plot_front(found, "two runs", tmp_path / "front.png")
    assert (tmp_path / "front.png").stat().st_size > 0


def test_second_order_ball():
    """Nodes of a coarse mesh of second order lie on the ball as those of a finer one of first order do."""
    coarse, fine = hertz.quarter_ball(2, 6, order=2), hertz.quarter_ball(2, 6)
    assert len(coarse.points) > 6 * len(fine.points)
    corners = coarse.points[np.unique(coarse.cells[:, :8])]
    assert np.abs(np.sort(corners, axis=0) - np.sort(fine.points, axis=0)).max() < 1e-12


@pytest.mark.slow
def test_studies_measure_what_they_say():
    """Few cells: the drag in a film of 0.2 cells, and the flow around a sphere."""
    assert studies.film("q2q1", 0.1)["error [%]"] < 3.0 < studies.film("q1q1", 0.1)["error [%]"]
    assert studies.decay("q1q1", "bdf2", 6)["error [%]"] < 5.0


@pytest.mark.slow
def test_the_drag_of_a_sphere_near_a_wall():
    """Brenner (1961), table 1: 9.2518 at cosh(0.5) - 1; on cells of four gaps it is within a tenth."""
    assert studies.brenner(np.cosh(0.5) - 1.0) == pytest.approx(9.2518, abs=1e-4)
    assert studies.sphere("q2q1", 0.4)["error [%]"] < 10.0


@pytest.mark.parametrize("name", FAMILIES)
def test_each_member_of_a_family_could_begin(name, tmp_path):
    """Its settings are those of its case, and there is a function that measures it."""
    members = list(FAMILIES[name].members())
    assert members
    for member in members:
        assert callable(function(member.measure))
        if member.case is not None:
            scene = member.scene(tmp_path)
            exact = measures.checks(scene) if member.measure == "measures.errors" else {}
            load_case(scene.folder, [(key, json.dumps(value)) for key, value in {**scene.settings, **exact}.items()])


@pytest.mark.slow
def test_cells_halved_around_the_cylinder_cost_less():
    """2D-1: a tenth of the error with twice the unknowns."""
    nested = FAMILIES["nested"]
    options = {name: nested.variants[0]["option"][name] for name in ("q1q1, equal", "q1q1, halved twice")}
    equal, halved = only(nested, option=options, resolution=first(nested, "resolution")).run()
    assert halved["error [%]"] < 0.1 * equal["error [%]"]
    assert halved["unknowns"] < 2 * equal["unknowns"]


def test_ratios_to_earlier_results():
    now = {"a": [{"option": "x", "time [s]": 1.0, "error [%]": 3.0, "dofs": 5, "front": "*"}], "b": [{"time [s]": 1.0}]}
    before = {"a": [{"option": "y", "time [s]": 9.0}, {"option": "x", "time [s]": 2.0, "error [%]": 1.5, "dofs": 5}]}
    assert [(row["column"], row["now/before"]) for row in compare(now, before)] == [
        ("time [s]", 0.5),
        ("error [%]", 2.0),
    ]


def member_of(name, number=0):
    return list(FAMILIES[name].members())[number]


def test_small_row(tmp_path):
    row = measures.small_step(member_of("small").scene(tmp_path), steps=2)
    assert row["unknowns"] == 138
    assert row["newton per step"] >= 1


def test_idle_row(tmp_path):
    """A pair that never meets changes no Newton step."""
    row = idle.measure(member_of("idle").scene(tmp_path), steps=10)
    assert row["newton with"] == row["newton without"]
    assert row["ratio"] == pytest.approx(row["with [ms]"] / row["without [ms]"])


def test_idle_row_of_sentinels(tmp_path):
    """They change no Newton step."""
    row = idle.measure(member_of("idle", 6).scene(tmp_path), steps=10)
    assert row["newton with"] == row["newton without"]


@pytest.mark.slow
def test_schemes_of_coupling_find_the_same_flag():
    """FSI1 on half the cells: Aitken's, the quasi-Newton and the monolithic scheme have one error."""
    fsi1 = FAMILIES["fsi1"]
    rows = only(fsi1, resolution=first(fsi1, "resolution")).run()
    errors = {row["option"]: row["error [%]"] for row in rows}
    assert errors["q2q1, Aitken"] == pytest.approx(errors["q2q1, IQN-ILS"], abs=1e-3)
    assert errors["q2q1, Aitken"] == pytest.approx(errors["q2q1, monolithic"], abs=0.01)


def test_linear_row():
    row = linear.measure((1, 1, 1), (3, 3, 3))
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


OWN = """\
.case: &block
  time: {step: 1, end: 1}
  structure:
    bodies:
      block:
        mesh: {shape: rectangle, size: [1, 1], cells: ["{n}", "{2*n}"]}
        material: {law: st_venant_kirchhoff, E: 100, nu: 0}
        supports: [{on: bottom, displacement: [0, 0]}]
        tractions: [{on: top, value: [0, 1.01505]}]  # 1.01 times S = E (1.01^2 - 1) / 2
  probes: {top: {quantity: displacement, on: top}}

own:
  words: a block that is pulled, by an entry of somebody else
  measure: measures.errors
  case: *block
  exact: {top.y final: 0.01}
  variants:
    option: {quad4: {structure.bodies.block.mesh.order: 1}, quad9: {structure.bodies.block.mesh.order: 2}}
    n: [1, 2]
    resolution: {"{n} x {2*n}": {}}

own function:
  words: what a function of somebody else measures
  measure: own_measures:twice
  variants: {number: [1, 2]}
"""


def test_a_family_from_outside(tmp_path):
    """One entry of a file: a case with formulas of its own, exact values, and a function beside the file."""
    (tmp_path / "own.yaml").write_text(OWN)
    (tmp_path / "own_measures.py").write_text(
        "def twice(number):\n    return {'number': number, 'twice': 2 * number}\n"
    )
    done = fsci("bench", tmp_path / "own.yaml", "-o", tmp_path / "out.json", "--plot", tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "out.json").read_text())["results"]
    assert [(row["option"], row["resolution"], row["unknowns"]) for row in found["own"]] == [
        ("quad4", "1 x 2", 12),
        ("quad4", "2 x 4", 30),
        ("quad9", "1 x 2", 30),
        ("quad9", "2 x 4", 90),
    ]
    assert max(row["error [%]"] for row in found["own"]) < 1e-6
    assert found["own function"] == [{"number": 1, "twice": 2}, {"number": 2, "twice": 4}]
    assert (tmp_path / "own.png").exists()
    assert not (tmp_path / "own function.png").exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: {words: b}", "family 'a' needs 'measure'"),
        ("a: {measure: b}", "family 'a' needs 'words'"),
        ("a: {words: b, measure: c, varants: {}}", "has an unknown entry 'varants'; did you mean 'variants'?"),
        ("a: {words: b, measure: c, tolerance: {}}", "(known: words, measure, case, set, exact, values, variants)"),
        ("a: [", "own.yaml: while parsing"),
        ("1", "has no families"),
    ],
)
def test_mistakes_of_families(text, message, tmp_path):
    (tmp_path / "own.yaml").write_text(text)
    with pytest.raises(FamilyError) as caught:
        read_families(tmp_path / "own.yaml")
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("measure: measures.eror", "there is no function 'measures.eror'"),
        ("measure: nobody:measure", "there is no function 'nobody:measure'"),
        ("measure: measures.errors, case: {time: {step: 1, ends: 1}}", "unknown setting 'ends'"),
        ('measure: search.measure, variants: {facets: ["{3*m}"]}', "unknown name 'm'"),
    ],
)
def test_what_a_family_names_has_to_be_there(entry, message, tmp_path):
    (tmp_path / "own.yaml").write_text(f"own: {{words: w, {entry}}}")
    done = fsci("bench", tmp_path / "own.yaml")
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr
