"""Pairs of all laws meet, part and meet again in any order in one structure, each as if it were alone, and resumed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from contact_setup import make_body, make_contact, solve_step
from structure_setup import constant

from fsci import shapes
from solvers.contact.law.coulomb import Coulomb
from solvers.contact.law.frictionless import Frictionless
from solvers.contact.law.law import Law
from solvers.contact.law.tied import Tied
from solvers.contact.law.tresca import Tresca
from solvers.contact.surface import Surface
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Support

ZERO = constant(0)
STEPS = 7
SETTINGS = SolverSettings(Tolerance(residual=1e-12, residual_absolute=1e-11, max_iterations=20), linear="direct")

#: Where a stamp is at the end of a step: aside and above the block that it presses [m].
PLACES = {
    "far": (0.0, 5.0),
    "near": (0.05, 0.04),
    "pressed": (0.0, -0.02),
    "dragged": (0.1, -0.02),
    "slid": (0.2, -0.03),
}

LAWS: dict[str, Law] = {
    "frictionless": Frictionless(),
    "coulomb": Coulomb(0.3),
    "other coulomb": Coulomb(0.1),
    "tresca": Tresca(3.0),
    "tied": Tied(),
}


def stamp(left: float, places: Sequence[str]) -> Surface:
    """A rigid plate above a block whose lower left corner is at `left`, at one of PLACES at the end of each step."""
    points = np.array([[left - 0.7, 0.5], [left + 1.7, 0.5]])
    way = np.array([PLACES["far"], *(PLACES[name] for name in places)])

    def motion(t: float):
        return points + [np.interp(t, np.arange(len(way)), along) for along in way.T]

    return Surface(f"stamp at {left}", points, np.array([[0, 1]]), "line", None, motion=motion)


def parts(number: int, law: str, places: Sequence[str]):
    """(bodies, pairs): a block under a stamp; "tied": two tied blocks under a stamp without friction."""
    left = 3.0 * number
    lower = make_body(
        f"block {number}", shapes.rectangle([1.0, 0.5], [4, 2], [left, 0.0]), supports=[Support("bottom", (ZERO, ZERO))]
    )
    if law != "tied":
        return [lower], [((lower.name, "top"), stamp(left, places), LAWS[law])]
    middle = make_body(f"middle {number}", shapes.rectangle([1.0, 0.25], [4, 1], [left, 0.0]), supports=lower.supports)
    upper = make_body(f"upper {number}", shapes.rectangle([1.0, 0.25], [5, 1], [left, 0.25]))
    tie = ((upper.name, "bottom"), (middle.name, "top"), Tied())
    return [middle, upper], [tie, ((upper.name, "top"), stamp(left, places), Frictionless())]


def build(scenes):
    together = [parts(number, *scene) for number, scene in scenes]
    structure, contact = make_contact(
        [body for bodies, _ in together for body in bodies],
        [pair for _, pairs in together for pair in pairs],
        settings=SETTINGS,
    )
    structure.initialise(0.0, 1.0)
    return structure, contact


def displacements(structure):
    found = zip(structure.bodies, structure.split(structure.now.u), strict=True)
    return {body.name: u.copy() for body, u in found}


def run(scenes, *, resumed: Sequence[int] = ()):
    """Displacements by body and energy of friction at the end of each step; resumed: steps that begin in a new run."""
    structure, contact = build(scenes)
    found = []
    for step in range(STEPS):
        if step in resumed:
            state = structure.save()
            structure, contact = build(scenes)
            structure.restore(state)
        solve_step(structure, float(step), first=False)
        found.append((displacements(structure), contact.friction_work))
    return found


@pytest.mark.parametrize("seed", [0, 1, 3, 5, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 4))])
def test_pairs_meet_and_part_as_if_each_were_alone(seed):
    rng = np.random.default_rng(seed)
    laws = rng.permutation(list(LAWS))[: 2 + seed % 4]
    scenes = [(n, (law, rng.choice(list(PLACES), STEPS).tolist())) for n, law in enumerate(laws.tolist())]
    together = run(scenes)
    alone = [run([scene]) for scene in scenes]
    touched = 0
    for step, (found, friction) in enumerate(together):
        for single in alone:
            for name, u in single[step][0].items():
                assert found[name] == pytest.approx(u, abs=1e-9), (step, name, scenes)
                touched += bool(np.abs(u).max() > 1e-3)
        assert friction == pytest.approx(sum(single[step][1] for single in alone), rel=1e-8, abs=1e-9), (step, scenes)
    assert touched > 0

    again = run(scenes, resumed=np.flatnonzero(rng.random(STEPS) < 0.5).tolist())
    for step, ((found, friction), (other, work)) in enumerate(zip(together, again, strict=True)):
        assert friction == work, (step, scenes)
        assert all(np.array_equal(found[name], other[name]) for name in found), (step, scenes)
