"""Advice by the kind of a failure and its residuals, or by the parts that take most of the time of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from fsci.case.solver import Newton
from fsci.explain.residuals import convergence_of
from solvers.api import FailureKind

SHORTER = "a smaller time.step"
SMOOTH_LOADS = "loads and inflow that grow from zero, such as ramp(t, 0, 0.5)"
PARTING = "in a fluid: contact.film.roughness, where flat surfaces part and nothing else lets fluid between them"

OF_KIND: dict[FailureKind, tuple[str, ...]] = {
    FailureKind.NOT_FINITE: (SHORTER, SMOOTH_LOADS),
    FailureKind.NEWTON: (),  # as the residuals converge
    FailureKind.COUPLING: (
        "coupling.scheme=monolithic",
        "coupling.accelerator=iqn, or a larger coupling.max_iterations",
    ),
    FailureKind.ACTIVE_SET: (
        SHORTER,
        "slave and master exchanged: the slave should be the softer or finer side",
        "a finer slave surface at the edge of the contact zone",
        PARTING,
    ),
    FailureKind.SUCTION: ("contact.film.zone=wetted", PARTING),
    FailureKind.LIMIT_POINT: ("structure.dynamics: past a limit point a structure snaps, and has inertia",),
    FailureKind.UNSUPPORTED: (
        "supports or weak springs: a static body without them has no unique solution",
        "contact.pairs.NAME.adjust=GAP, or dynamics, where a body is free until it touches",
    ),
    FailureKind.INVERTED: (
        f"{SHORTER}: the load or the motion of a step is too large for the elements",
        "a finer mesh, or rounder corners, where the element is",
        "loads and E in the units of the case: 1 MPa is 1e6 Pa",
    ),
    FailureKind.LINEAR_SOLVER: ("solver.linear.method=direct", "solver.linear.tolerance=1e-6"),
    FailureKind.MOTION: (
        f"{SHORTER}: a body should cross less than two cells in a step, and turn by less than 180 degrees",
    ),
    FailureKind.DIVERGED: (SHORTER, SMOOTH_LOADS),
    FailureKind.COARSE_CELLS: ("fluid.grid.refine: a box that holds the body wherever it goes",),
    FailureKind.PERIODIC_FACES: ("a longer box, or an earlier time.end",),
    FailureKind.NO_ROOM: ("room for the bodies: one that is free or softer, or motions that leave a gap",),
    FailureKind.JAMMED: (
        "contact.friction: a smaller coefficient",
        "an elastic body in the place of a rigid one",
        SHORTER,
    ),
    FailureKind.PASSAGE: (f"{SHORTER}: contact finds what bodies touch within it",),
    FailureKind.NOT_HELD: ("a pair of contact for what should hold the body",),
}

#: Kinds of an iteration that has not reached its tolerance, so that the course of its residuals tells more.
NOT_CONVERGED = {
    FailureKind.NEWTON,
    FailureKind.COUPLING,
    FailureKind.ACTIVE_SET,
    FailureKind.SUCTION,
    FailureKind.LIMIT_POINT,
}

#: Convergence of the residuals -> meaning and advice.
OF_CONVERGENCE = {
    "not finite": ("the residual is not a number: it cannot be evaluated at the last iterate", ()),
    "diverges": ("the residuals grow", (SHORTER, SMOOTH_LOADS)),
    "oscillates": (
        "the residuals go up and down: the active set or an interface changes from iterate to iterate",
        (SHORTER, "a finer slave surface, or slave and master exchanged"),
    ),
    "stagnates": (
        "the residuals do not fall any more: rounding error, or a kink in a law or an expression",
        ("solver.newton.residual_absolute at the size where they stay", "expressions without kinks"),
    ),
}

#: Iterations more that are worth trying: as many as the default of `solver.newton.max_iterations`.
MOST_MORE = 25


def of_failure(kind: FailureKind, residuals: tuple[float, ...], newton: Newton) -> Iterator[str]:
    """Suggestions for a failed step, with the residuals of its last iteration."""
    yield from OF_KIND[kind]
    if kind not in NOT_CONVERGED:
        return
    convergence = convergence_of(residuals)
    yield from OF_CONVERGENCE.get(convergence.kind, ("", ()))[1]
    if kind is FailureKind.COUPLING:
        return
    if convergence.kind == "none":
        yield f"solver.newton.max_iterations={MOST_MORE}: a step of a nonlinear problem takes several iterations"
    goal = newton.residual * max(residuals, default=0.0)
    more = convergence.remaining(residuals[-1], goal) if residuals else None
    if more is not None and more <= MOST_MORE:
        most = newton.max_iterations + more
        yield f"solver.newton.max_iterations={most}: at this rate it takes {more} iterations more"


def of_run(summary: Mapping[str, Any]) -> Iterator[str]:
    """Suggestions for a run that is slow. The bounds are shares from which a part dominates."""
    steps, newton, wall = summary["steps"], summary["newton"], summary["wall"]
    if steps["retried"] > 0.1 * steps["accepted"]:
        yield "a smaller time.step: more than a tenth of the steps were repeated with half of it"
    if newton["total"] > 8 * max(steps["accepted"], 1):
        yield "a smaller time.step: more than 8 Newton iterations per step are rarely worth it"
    share = {name: seconds / wall["total"] for name, seconds in wall.items() if name != "total" and wall["total"]}
    if share.get("output", 0.0) > 0.2:
        yield "output.fields_every=10: writing fields takes more than a fifth of the time"
    if share.get("start", 0.0) > 0.5:
        yield "nothing: more than half of the time is the start; the next run finds its forms compiled"
    if share.get("solve", 0.0) > 0.6 and summary["processes"] == 1:
        yield "mpirun -n 2: linear systems take more than 60 % of the time"
    if share.get("contact", 0.0) > 0.4:
        yield "integration: elements in the contact pairs, or smaller slave surfaces: contact takes more than 40 %"
