"""Other programs beside ours: what they are given, what is read from them, what is said if they are missing."""

import fsi1_files
import hertz_files
import install
import numpy as np
import others
import ours
import pytest
from pressure import pressure_errors
from run_peers import PEERS, main

from fsci.bench import hertz
from fsci.bench.family import function, read_families


@pytest.mark.slow
def test_our_stokes_flow_has_the_exact_solution():
    coarse, fine = (ours.stokes("q1q1", cells) for cells in (10, 20))
    assert fine["velocity [%]"] < 0.3 * coarse["velocity [%]"] < 0.3
    assert fine["pressure [%]"] < 0.5 * coarse["pressure [%]"]


def test_the_pressure_of_hertz_has_no_error():
    radius, force = 1.0, 4.0 * hertz.E / (3.0 * (1.0 - hertz.NU**2) * hertz.RADIUS)
    distance = np.linspace(0.0, 3.0, 50)
    pressure = 1.5 * force / np.pi * np.sqrt(np.maximum(0.0, 1.0 - (distance / radius) ** 2))
    found = {"dofs": 1, "newton": 1, "time [s]": 1.0, "force": force, "distance": distance, "pressure": pressure}
    assert pressure_errors(found)["peak [%]"] == pytest.approx(0.0, abs=1e-10)
    assert pressure_errors(found)["pressure [%]"] == pytest.approx(0.0, abs=1e-10)
    assert pressure_errors({**found, "pressure": 1.1 * pressure})["pressure [%]"] == pytest.approx(10.0)


def test_files_of_the_ball(tmp_path):
    """Faces of the slave surface have their nodes on it; both files have all nodes and cells."""
    ball, below, points, cells, sets = hertz_files.both(2, 3)
    hertz_files.write_calculix(tmp_path / "ball.inp", 2, 3)
    text = (tmp_path / "ball.inp").read_text()
    slave = text.split("NAME=SLAVE\n")[1].split("*")[0].split()
    corners = {number: corners for corners, number in hertz_files.FACES.items()}
    for cell, face in zip(slave[::2], slave[1::2], strict=True):
        assert set(cells[int(cell.rstrip(",")) - 1][list(corners[int(face[1])])]) <= set(sets["bottom"])
    assert len(slave) // 2 == len(ball.surfaces["bottom"])
    hertz_files.write_kratos(tmp_path / "ball.mdpa", 2, 3)
    text = (tmp_path / "ball.mdpa").read_text()
    assert len(text.split("Begin Nodes\n")[1].split("End")[0].splitlines()) == len(points)
    assert text.split("Begin SubModelPart bottom")[1].count("\n") > len(sets["bottom"]) + len(ball.surfaces["bottom"])
    assert below.points[:, 2].max() == 0.0


def test_files_of_the_flag(tmp_path):
    """Triangles fill the channel without cylinder and flag; edges on the flag are those of the flag's own mesh."""
    pytest.importorskip("gmsh")
    mesh = fsi1_files.flag(10)
    outline = fsi1_files.along(mesh)
    assert np.abs(np.diff(mesh.points[outline], axis=0)).sum(axis=1).max() < 0.0176
    fsi1_files.write_flag(tmp_path / "flag.mdpa", mesh)
    assert (tmp_path / "flag.mdpa").read_text().count("\n") > len(mesh.points) + 2 * len(outline)
    count = fsi1_files.write_fluid(tmp_path / "fluid.mdpa", mesh.points[outline], 0.05)
    text = (tmp_path / "fluid.mdpa").read_text()

    def numbers(block, columns):
        lines = text.split(f"Begin {block}\n")[1].split("End")[0].splitlines()
        return np.array([[float(word) for word in line.split()] for line in lines])[:, columns]

    points, cells = numbers("Nodes", [1, 2]), numbers("Elements Element2D3N", [2, 3, 4]).astype(int) - 1
    assert len(points) == count
    (ax, ay), (bx, by) = (points[cells[:, i]].T - points[cells[:, 0]].T for i in (1, 2))
    left = 0.05**2 * (np.pi - np.arcsin(0.2)) + 0.01 * (fsi1_files.ROOT - 0.2)  # of the disc without the flag's sector
    flag = 0.02 * (0.6 - fsi1_files.ROOT)
    assert 0.5 * np.abs(ax * by - ay * bx).sum() == pytest.approx(2.5 * 0.41 - left - flag, rel=2e-4)
    wet = text.split("Begin SubModelPart wet\nBegin SubModelPartNodes\n")[1].split("End")[0].split()
    found = points[np.array(wet, dtype=int) - 1]
    assert np.abs(found[:, None] - mesh.points[outline][None]).sum(axis=2).min(axis=1).max() < 1e-9


@pytest.mark.slow
def test_our_flag_has_the_published_displacement(tmp_path):
    (_, member, _) = [one for one in read_families(PEERS)["fsi1"].members() if one.measure == "ours:flag"]
    found = ours.flag(member.scene(tmp_path))
    assert abs(found["u_x error [%]"]) < 1.5
    assert abs(found["drag error [%]"]) < 0.5


def test_pressure_in_a_result_of_calculix(tmp_path):
    (tmp_path / "a.frd").write_text(
        " -1         1 1.00000E+00 2.00000E+00 3.00000E+00\n"
        " -4  CONTACT     6    1\n -5  COPEN       1    4    1    1\n"
        " -1         7 0.00000E+00 0.00000E+00 0.00000E+00 6.50000E+00 0.00000E+00 0.00000E+00\n -3\n"
        " -4  OTHER       6    1\n -1         7 1.00000E+00 1.00000E+00 1.00000E+00 1.00000E+00\n -3\n"
    )
    assert others.contact_pressure(tmp_path / "a.frd") == {7: 6.5}


def test_what_is_missing(tmp_path, monkeypatch, capsys):
    assert main([]) == main([str(tmp_path), "sotkes"]) == 2
    assert capsys.readouterr().err.startswith("usage: python tests/peers FOLDER [stokes|cylinder|hertz|fsi1 ..]")
    monkeypatch.setattr(install.shutil, "which", lambda name: None)
    assert main([str(tmp_path), "hertz"]) == 1
    assert capsys.readouterr().out.splitlines()[-1] == "there is no ccx: apt-get install calculix-ccx"


def test_a_program_that_fails_is_shown(tmp_path, monkeypatch):
    with pytest.raises(others.PeerFailed, match="No such file"):
        others.run_program(tmp_path, "ls", "nothing")
    monkeypatch.setattr(others, "PATIENCE", 0.1)
    with pytest.raises(others.PeerFailed, match=r"sleep took more than 0\.1 s"):
        others.run_program(tmp_path, "sleep", "5")


def test_each_peer_has_a_function():
    families = read_families(PEERS)
    assert [*families] == ["stokes", "cylinder", "hertz", "fsi1"]
    for family in families.values():
        assert {callable(function(member.measure)) for member in family.members()} == {True}
