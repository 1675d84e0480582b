"""A press fit has Lame's pressure by default, and with straight facets: gaps that these leave are none."""

from pathlib import Path

import numpy as np
import pytest
from programs import fsci

from fsci import shapes
from fsci.case import load_case
from fsci.check.meshes import check_meshes
from fsci.meshes.curved import facet_height
from fsci.meshes.of_case import degree_of_cells
from fsci.running.history import read_history

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


EXCHANGED = (
    "contact.pairs.fit.slave={body: hub, on: inner}",
    "contact.pairs.fit.master={body: shaft, on: outer}",
)


@pytest.mark.parametrize("roles", [(), EXCHANGED], ids=["shaft", "hub"])
@pytest.mark.parametrize(("shaft", "hub"), [(1, 1), (1, 2), (2, 1)])
def test_straight_facets(tmp_path, shaft, hub, roles):
    """Chords of the shaft lie 0.0024 m within its circle, those of the hub reach 0.0015 m into the hole.

    As meshed, the pressure was between 0.15 and 14 for an interference of 0.002 m.
    """
    found, said = pressed(tmp_path, *orders(shaft, hub), *roles)
    assert found == pytest.approx(PRESSURE, rel=5e-3)
    body, height = ("shaft", "0.00241") if roles else ("hub", "0.00154")
    words = (
        f"straight facets of '{body}' are {height} m high for an interference of 0.002 m: pressures are right until "
        "the slave slides over them; take 'order: 2', or smaller cells"
    )
    straight = (shaft if roles else hub) == 1
    assert [text.split(": ", 1)[1] for text in said] == [words] * straight


@pytest.mark.parametrize("hub", [1, 2])
def test_straight_facets_that_slide(tmp_path, hub):
    """A shaft of chords, over the length of two of them: mean pressure and torque, by the work of friction, stay."""
    settings = *orders(1, hub), "time.step=0.25", "time.end=3", "verify=[]", "output.fields_every=0"
    done = fsci("run", CASE, "-o", tmp_path, *(word for setting in settings for word in ("--set", setting)))
    assert done.returncode == 0, done.stdout + done.stderr
    history = read_history(tmp_path / "history.csv")
    assert history["pressure"][4:] == pytest.approx(np.full(8, PRESSURE), rel=5e-3)
    torque = np.diff(history["contact.friction"][-4:]) / 0.025
    assert torque == pytest.approx(np.full(3, 3.73685), rel=5e-3)


def test_a_true_gap_stays(tmp_path):
    """One of 0.02 m, which facets do not explain, is closed by the first 0.02 m of the interference."""
    gap, most = "structure.bodies.shaft.mesh.outer_radius=1.98", "contact.pairs.fit.interference=0.03*min(t, 1)"
    assert pressed(tmp_path / "open", *orders(1, 1), gap)[0] == 0.0
    found, _ = pressed(tmp_path / "closed", *orders(1, 1), gap, most)
    assert found == pytest.approx(5 * PRESSURE, rel=0.15)


def test_order_where_contact_has_an_end():
    """A quarter of a fit that rubs has ends, where nodes may stick and slip in turn: first order."""
    part = [("structure.bodies.shaft.mesh.angle", "90"), ("structure.bodies.shaft.springs", "[]")]
    assert degree_of_cells(load_case(CASE, [*part, ("verify", "[]"), ("probes", "{}")]), "shaft") == 1


SAGITTA = 1 - np.cos(np.pi / 32)  # of an arc of the unit circle over one of 32 chords


@pytest.mark.parametrize(
    ("mesh", "surface", "exact"),
    [
        (shapes.disc(radius=1, cells=(32, 4)), "outer", SAGITTA),
        (shapes.disc(radius=1, cells=(32, 4), order=2), "outer", 0.0),
        (shapes.rectangle(size=(2, 1), cells=(4, 4)), None, 0.0),
        (shapes.ring(inner_radius=0.5, outer_radius=1, cells=(32, 2)), "inner", 0.5 * SAGITTA),
        (shapes.tube(inner_radius=0.5, outer_radius=1, height=2, cells=(32, 2, 4)), "outer", 2 * SAGITTA),
    ],
)
def test_height_of_facets(mesh, surface, exact):
    """In space at most the sum over the edges of a triangle, of which two are bent."""
    assert facet_height(mesh, surface and [surface]) == pytest.approx(exact, rel=0.05, abs=1e-12)
