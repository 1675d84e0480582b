"""Advice by the reason of a failure and its residuals, or by the parts that take most of the time of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from fsci.case import Case
from fsci.explain.residuals import Convergence

#: Part of a reason -> advice.
REASONS = {
    "inverted": (
        "a smaller time.step: the load or the motion of a step is too large for the elements",
        "a finer mesh, or rounder corners, where the element is",
    ),
    "far larger than the body": ("supports or weak springs: a static body without them has no unique solution",),
    "no equilibrium beyond": ("structure.dynamics: past a limit point a structure snaps, and has inertia",),
    "active set cycles": (
        "a smaller time.step",
        "slave and master exchanged: the slave should be the softer or finer side",
        "a finer slave surface at the edge of the contact zone",
        "in a fluid: contact.film.roughness, where flat surfaces part and nothing else lets fluid between them",
    ),
    "pulls at bodies that are dry": ("contact.film.zone=wetted",),
    "cells in one step": ("a smaller time.step: a body should cross less than two cells in a step",),
    "periodic faces": ("a longer box, or an earlier time.end",),
    "coupling iteration did not converge": (
        "coupling.scheme=monolithic",
        "coupling.accelerator=iqn, or a larger coupling.max_iterations",
    ),
    "not finite": ("a smaller time.step", "loads and inflow that grow from zero, such as ramp(t, 0, 0.5)"),
    "not a number": ("a smaller time.step", "loads and inflow that grow from zero, such as ramp(t, 0, 0.5)"),
    "singular": ("supports or weak springs: a static body without them has no unique solution",),
    "linear solver": ("solver.linear.method=direct", "solver.linear.tolerance=1e-6"),
}

#: Convergence of the residuals -> meaning and advice.
OF_CONVERGENCE = {
    "not finite": ("the residual is not a number: it cannot be evaluated at the last iterate", ()),
    "diverges": ("the residuals grow", ("a smaller time.step", "loads that grow from zero: ramp(t, 0, 0.5)")),
    "oscillates": (
        "the residuals go up and down: the active set or an interface changes from iterate to iterate",
        ("a smaller time.step", "a finer slave surface, or slave and master exchanged"),
    ),
    "stagnates": (
        "the residuals do not fall any more: rounding error, or a kink in a law or an expression",
        ("solver.newton.residual_absolute at the size where they stay", "expressions without kinks"),
    ),
}

#: Iterations more that are worth trying: as many as the default of `solver.newton.max_iterations`.
MOST_MORE = 25


def of_failure(reason: str, convergence: Convergence, residuals: tuple[float, ...], case: Case) -> Iterator[str]:
    """Suggestions for a failed step."""
    for part, words in REASONS.items():
        if part in reason:
            yield from words
    if convergence.kind in OF_CONVERGENCE and "did not converge" in reason:
        yield from OF_CONVERGENCE[convergence.kind][1]
    if convergence.kind == "none" and "Newton did not converge" in reason:
        yield f"solver.newton.max_iterations={MOST_MORE}: a step of a nonlinear problem takes several iterations"
    goal = case.solver.newton.residual * max(residuals, default=0.0)
    more = convergence.remaining(residuals[-1], goal) if residuals else None
    if more is not None and more <= MOST_MORE:
        most = case.solver.newton.max_iterations + more
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
