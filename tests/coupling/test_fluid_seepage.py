"""A layer on surfaces in which fluid passes: its volume, the force of films down to contact, what the case says."""

import numpy as np
import pytest
from fluid_setup import BOX, block, body, make_fluid, turned, with_slip
from lubrication import film_force, seepage_ratio
from programs import fsci
from test_coupled_run import MEETING, run
from test_fsci_lubrication import SETTLING

from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from solvers.fluid.grid.box import uniform
from solvers.fluid.terms import seepage
from solvers.fluid.terms.boundary.patches import Patch

KAPPA, MU = 1e-3, 0.7


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_volume_rows_of_a_linear_pressure(element):
    """q^T B p = kappa / mu int grad_t p . grad_t q ds on a wall at any angle."""
    points, facets = block([-2, -3], [3, -0.13])
    wall = body("wall", turned(points + np.array([0, 0.5]), 0.4, [0.5, 0.5]), facets)
    rest = Patch("box", BOX[2], "no_slip")
    fluid = make_fluid(uniform([0, 0], [1, 1], [5, 4]), [rest], [with_slip(wall, 0.0, KAPPA)], element=element, mu=MU)
    nodes = fluid.unknowns.pressure
    p, q = np.zeros((2, len(fluid.flow)))
    p[nodes.dofs[:, 0]], q[nodes.dofs[:, 0]] = nodes.points[:, :2] @ [2.0, 1.0], nodes.points[:, :2] @ [-1.0, 3.0]
    along = np.array([np.cos(0.4), np.sin(0.4)])
    length = fluid.cut.pieces.mass.sum()
    expected = KAPPA / MU * (along @ [2, 1]) * (along @ [-1, 3]) * length
    assert q @ fluid.system.assemble_interface().cell_blocks[0].rows(p) == pytest.approx(expected, rel=1e-10)


def test_films_of_the_references():
    """Forces of lubrication theory with a transmissivity of 1e-6 and, at contact, in closed form."""
    assert [film_force(2, g, transmissivity=1e-6) for g in (0.1, 0.01, 0.001)] == pytest.approx(
        [420.389, 6339.82, 9817.18], rel=1e-5
    )
    assert [film_force(3, g, transmissivity=1e-6) for g in (0.1, 0.01, 0.001)] == pytest.approx(
        [188.270, 1277.238, 1905.741], rel=1e-5
    )
    for kappa in (1e-4, 1e-6):
        at_contact = np.pi / 3 * np.sqrt(96 / kappa), 19.91141 * kappa ** (-1 / 3)
        assert [film_force(dim, 1e-12, transmissivity=kappa) for dim in (2, 3)] == pytest.approx(at_contact, rel=1e-5)


@pytest.mark.parametrize(("h", "kappa"), [(0.1, 1e-4), (0.05, 1e-6)])
def test_force_of_a_film_down_to_contact(h, kappa):
    """Within 2 %, from a gap of 0.4 cells to none; the film's width (96 kappa)^(1/6) is 4.3 cells."""
    ratios = [seepage_ratio(2, gap, h, "q2q1", kappa) for gap in (0.02, 0.001, 1e-5)]
    assert ratios == pytest.approx([1.0] * 3, abs=0.02)


@pytest.mark.parametrize(("h", "ratio"), [(0.1, 1.137), (0.05, 0.904)])
def test_force_at_contact_with_first_order(h, ratio):
    """Known and documented: it has the layer, but not the film around the place of contact."""
    assert seepage_ratio(2, 1e-4, h, "q1q1", {0.1: 1e-4, 0.05: 1e-6}[h]) == pytest.approx(ratio, abs=0.01)


def test_results_do_not_depend_on_the_release(monkeypatch):
    ratios = []
    for factor in (10.0, 100.0, 1000.0):
        monkeypatch.setattr(seepage, "RELEASE", factor)
        ratios.append(seepage_ratio(2, 1e-3, 0.1, "q2q1", 1e-4))
    assert ratios == pytest.approx([1.0] * 3, abs=0.015)


def test_time_until_contact():
    """A unit force closes a gap of 0.1 in 63.5708 s (kappa 1e-4, quasi-static): time = int F dg, within 5 %."""
    places, weights = np.polynomial.legendre.leggauss(3)
    gaps = 0.05 * (places + 1.0)
    ratios = np.array([seepage_ratio(2, gap, 0.1, "q2q1", 1e-4) for gap in gaps])
    films = np.array([film_force(2, gap, transmissivity=1e-4) for gap in gaps])
    assert 0.05 * weights @ films == pytest.approx(63.5708, rel=1e-4)
    assert 0.05 * weights @ (ratios * films) == pytest.approx(63.5708, rel=0.05)


@pytest.mark.slow
def test_sphere_in_contact():
    """Within 5 % where the film's width is 4.6 cells."""
    ratio = seepage_ratio(3, 1e-3, 0.1, "q2q1", 1e-4, growth=1.6, fine=0.6, size=5.0)
    assert ratio == pytest.approx(1.0, abs=0.05)


def test_bodies_that_meet(tmp_path):
    """Both schemes find the same through contact."""
    text = MEETING.replace("contact:\n", "contact:\n  film: {roughness: 0.02}\n", 1)
    found = run(text, tmp_path / "monolithic")
    other = run(text.replace("monolithic", "partitioned, tolerance: 1.0e-8"), tmp_path / "partitioned")
    without = run(MEETING, tmp_path / "smooth")
    for name in ("left.x", "right.y"):
        assert found[name] == pytest.approx(other[name], abs=1e-6)
    assert np.abs(found["force.x"] - without["force.x"]).max() > 1e-3 * np.abs(found["force.x"]).max()
    assert found["iterations"].max() <= without["iterations"].max() + 1


#: The cylinder of `SETTLING` with a rough surface and a wall to touch; the film is 4.6 cells wide, or 2.3.
ROUGH = (
    SETTLING.replace("step: 0.1, end: 3", "step: 0.1, end: 7")
    .replace("[0, 1.6]", "[0, 1.12]")
    .replace("cells: [128, 2]", "cells: [256, 2]")
    .replace(
        "coupling:",
        """contact:
  film: {transmissivity: 1e-4}
  obstacles:
    wall: {mesh: {shape: rectangle, size: [2, 0.1], cells: [1, 1], origin: [-1, -0.1]}, on: top}
  pairs:
    wall: {slave: {body: cylinder, on: outer}, master: {obstacle: wall}}
coupling:""",
    )
)
COARSE = ROUGH.replace("to: 1, cells: 20", "to: 1, cells: 10").replace("{to: 0.9, cells: 9}", "{to: 0.8, cells: 4}")


@pytest.mark.slow
@pytest.mark.parametrize("text", [ROUGH, COARSE], ids=["h 0.1", "h 0.2"])
def test_elastic_cylinder_settles_until_contact(text, tmp_path):
    """The force 4 pi closes the film in the time of the film's theory, int F dg / 4 pi, to 5 %; the wall takes it."""
    history = run(text, tmp_path)
    time, gap, force = history["time"], history["cylinder.y"] - 1.0, history["contact.wall.y"]
    start, end = np.interp([-0.1, -0.002], -gap, time)
    places, weights = np.polynomial.legendre.leggauss(6)
    films = np.array([film_force(2, 0.051 + 0.049 * place, transmissivity=1e-4) for place in places])
    assert end - start == pytest.approx(0.049 * weights @ films / (4.0 * np.pi), rel=0.05)
    assert force[-1] == pytest.approx(4.0 * np.pi, rel=1e-3)
    assert history["iterations"][0] <= 4 * 6  # the first step is divided into four parts
    assert history["iterations"][1:].max() <= 5


@pytest.mark.slow
def test_two_processes(tmp_path):
    """Two steps with slip and seepage, of which one process has no surface at first."""
    text = MEETING.replace("contact:\n", "contact:\n  film: {roughness: 0.02}\n", 1)
    text = text.replace("left:\n", "left:\n      slip_length: 0.05\n", 1)
    one = run(text, tmp_path, ("time.end", "0.04"))
    done = fsci("run", tmp_path, "-o", tmp_path / "two", "--set", "time.end=0.04", processes=2, timeout=100)
    assert done.returncode == 0, done.stdout + done.stderr
    two = read_history(tmp_path / "two" / "history.csv")
    for name in ("left.x", "right.y", "force.x", "force.y"):
        assert two[name] == pytest.approx(one[name], abs=1e-8 * np.abs(one["force.x"]).max())


@pytest.mark.parametrize(
    ("film", "message"),
    [
        ("{roughness: -1}", "'roughness' must be at least 0, not -1"),
        ("{transmissivity: 1e-7, roughness: 0.01}", "give either 'transmissivity' or 'roughness', not both"),
        ("{thickness: 1}", "unknown setting 'thickness' (available: transmissivity, roughness, zone, seal)"),
    ],
)
def test_mistakes(film, message, tmp_path):
    (tmp_path / "case.yaml").write_text(MEETING.replace("contact:\n", f"contact:\n  film: {film}\n", 1))
    with pytest.raises(CaseError) as caught:
        load_case(tmp_path / "case.yaml")
    assert [str(p).split(": ", 1)[1].split("\n")[0] for p in caught.value.problems] == [message]
