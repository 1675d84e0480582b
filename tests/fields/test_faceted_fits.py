"""A press fit without numerical settings has Lame's pressure; straight facets lose what is said beforehand."""

from pathlib import Path

import numpy as np
import pytest
from programs import fsci

from fsci import shapes
from fsci.case import load_case
from fsci.check.meshes import check_meshes
from fsci.meshes.curved import facet_offset
from fsci.meshes.of_case import degree_of_cells
from fsci.running.history import read_history
from solvers.mesh.tessellation import area_vectors, tessellate
from solvers.mesh.topology import signed_volumes

CASE = Path(__file__).parents[2] / "cases" / "press_fit"
#: Lame, plane strain: of an interference of 0.002
PRESSURE = 0.74342
PRESSED = "time.step=0.5", "time.end=1", "verify=[]", "output.fields_every=0"


def pressed(folder, *changes):
    """(mean pressure, warnings of the check)."""
    settings = [*PRESSED, *changes]
    done = fsci("run", CASE, "-o", folder, *(word for setting in settings for word in ("--set", setting)))
    assert done.returncode == 0, done.stdout + done.stderr
    case = load_case(CASE, [tuple(setting.split("=", 1)) for setting in settings])
    return read_history(folder / "history.csv")["pressure"][-1], check_meshes(case).warnings


def orders(shaft, hub):
    return f"structure.bodies.shaft.mesh.order={shaft}", f"structure.bodies.hub.mesh.order={hub}"


def test_by_default(tmp_path):
    found, said = pressed(tmp_path)
    assert found == pytest.approx(PRESSURE, rel=2e-3)
    assert said == []
    assert degree_of_cells(load_case(CASE), "shaft") == 2


def words(share, word):
    return f"straight facets make the interference of 0.002 m about {share} % {word}: take 'order: 2', or smaller cells"


@pytest.mark.parametrize(("hub", "lost"), [(2, 80), (1, 29)])
def test_straight_facets(tmp_path, hub, lost):
    """Facets of the shaft lie within it and lose, those of the hub reach into the hole and add."""
    found, said = pressed(tmp_path, *orders(1, hub))
    assert 100.0 * (1.0 - found / PRESSURE) == pytest.approx(lost, abs=1.5)
    assert [text.split(": ", 1)[1] for text in said] == [words(lost, "smaller")]


def test_straight_facets_of_the_hub_only():
    """They reach into the hole."""
    changes = [setting.split("=", 1) for setting in orders(2, 1)]
    said = check_meshes(load_case(CASE, [tuple(change) for change in changes])).warnings
    assert [text.split(": ", 1)[1] for text in said] == [words(51, "larger")]


def test_facets_that_fit_each_other(tmp_path):
    found, said = pressed(tmp_path, *orders(1, 1), "structure.bodies.hub.mesh.cells=[64, 4]")
    assert found == pytest.approx(PRESSURE, rel=0.01)
    assert said == []


def test_order_where_contact_has_an_end():
    """A quarter of a fit that rubs has ends, where nodes may stick and slip in turn: first order."""
    part = [("structure.bodies.shaft.mesh.angle", "90"), ("structure.bodies.shaft.springs", "[]")]
    assert degree_of_cells(load_case(CASE, [*part, ("verify", "[]"), ("probes", "{}")]), "shaft") == 1


SAGITTA = 2 / 3 * (1 - np.cos(np.pi / 32))  # mean of an arc of the unit circle over one of 32 chords


@pytest.mark.parametrize(
    ("mesh", "surface", "exact"),
    [
        (shapes.disc(radius=1, cells=(32, 4)), "outer", SAGITTA),
        (shapes.disc(radius=1, cells=(32, 4), order=2), "outer", 0.0),
        (shapes.rectangle(size=(2, 1), cells=(4, 4)), None, 0.0),
        (shapes.tube(inner_radius=0.5, outer_radius=1, height=2, cells=(32, 2, 4)), "outer", SAGITTA),
        (shapes.tube(inner_radius=0.5, outer_radius=1, height=2, cells=(32, 2, 4), cell="tet"), "inner", -SAGITTA / 2),
    ],
)
def test_offset_of_facets(mesh, surface, exact):
    assert facet_offset(mesh, surface and [surface]) == pytest.approx(exact, rel=0.05, abs=1e-12)


def test_offset_of_facets_of_a_ball():
    """What the volume lacks, by area."""
    mesh = shapes.sphere(radius=1, cells=(8, 2))
    area = np.linalg.norm(area_vectors(mesh.points[surface_facets_of(mesh)]), axis=1).sum()
    assert facet_offset(mesh) == pytest.approx((4 / 3 * np.pi - signed_volumes(mesh).sum()) / area, rel=0.05)


def surface_facets_of(mesh):
    simplices, nodes = tessellate(mesh)
    return nodes[simplices]
