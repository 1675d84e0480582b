"""Components of Newton's method: bodies that touch, are tied or joined by springs, and a flow with its bodies."""

import numpy as np
import pytest
from mpi4py import MPI
from unconnected_scenes import Scene, bent, case_of, coupled, post, pressed, stacked, tied

from fsci.builder.build import build
from fsci.case import load_case
from solvers.timing import Timer


def linked(folder, text):
    """Those of a case at the first residual of its first step."""
    (folder / "case.yaml").write_text(text)
    scheme = build(load_case(folder / "case.yaml"), MPI.COMM_SELF, Timer()).scheme
    scheme.initialise(0.0, 0.1)
    getattr(scheme, "coupled", scheme).begin_step(0.0, 0.1)
    scheme.follow()
    scheme.residual()
    return scheme.linked().tolist()


@pytest.mark.parametrize(("kind", "found"), [(stacked, [0, 0, 2, 2]), (tied, [0, 0, 2, 2]), (pressed, [0, 1])])
def test_bodies_that_touch(tmp_path, kind, found):
    """Also if the first body lies on an obstacle, which links nothing."""
    scenes = [Scene("a", [0.0, 0.0], 1.0), Scene("b", [9.0, 0.0], 1.0)]
    for scene in scenes:
        kind(scene, np.random.default_rng(0))
    assert linked(tmp_path, case_of(scenes)) == found


BODY = "    {name}: {{mesh: {{shape: rectangle, size: [1, 1], cells: [2, 2], origin: [{x}, {y}]}}, {more}}}\n"


def body(name, x, y, more=""):
    elastic = "material: {law: neo_hooke, E: 100, nu: 0.3, density: 1}"
    return BODY.format(name=name, x=x, y=y, more=", ".join(part for part in (elastic, more) if part))


def rigid(name, x, y, more=""):
    return BODY.format(name=name, x=x, y=y, more=", ".join(part for part in ("density: 1", more) if part))


def spring(x, y, to):
    return f"springs: [{{at: [{x}, {y}], stiffness: 1, to: {to}}}]"


TIME = "time: {step: 0.1, end: 0.1}\n"
DYNAMIC = TIME + "structure:\n  dynamics: {rho_inf: 0.5}\n  bodies:\n"


def test_springs_between_elastic_bodies(tmp_path):
    joined = "point_" + spring(1, 0.5, "{body: c, at: [6, 0.5]}")
    text = DYNAMIC + body("a", 0, 0, joined) + body("b", 3, 0) + body("c", 6, 0)
    assert linked(tmp_path, text) == [0, 1, 0]


def test_free_rigid_bodies(tmp_path):
    """The parts are the elastic bodies a, b, c, then the rigid ones p, q, r, s.

    a presses p, which lies on q; b hangs on r by a spring; c and s are alone.
    """
    text = DYNAMIC + body("a", 0, 2) + body("b", 3, 0) + body("c", 6, 0)
    text += "rigid:\n  bodies:\n" + rigid("p", 0, 1) + rigid("q", 0, 0)
    text += rigid("r", 3, 3, spring(3.5, 3, "{body: b, at: [3.5, 1]}")) + rigid("s", 9, 0)
    text += "contact: {pairs: {press: {slave: {body: a, on: bottom}, master: {obstacle: p}}}}\n"
    assert linked(tmp_path, text) == [0, 1, 2, 0, 0, 1, 6]


def test_a_flow_with_its_bodies(tmp_path):
    """Two posts in the flow, and a beam outside of it."""
    rng, scenes = (
        np.random.default_rng(0),
        [Scene(name, [x, 0.0], 1.0) for name, x in zip("abc", (0, 5, 0.7), strict=True)],
    )
    for kind, scene in zip((post, bent, post), scenes, strict=True):
        kind(scene, rng)
    text = case_of(scenes, dynamics=True, end=0.3, **coupled("monolithic", dynamics=True))
    assert linked(tmp_path, text) == [0, 1, 0, 0]
