"""What `fsci check` says about a good case."""

from __future__ import annotations

from math import ceil

from fsci.case import Case
from fsci.case.mesh import Shape
from fsci.estimate import size


def summary(case: Case) -> str:
    """A few lines: steps, bodies with their size where it is known, probes, checks."""
    time, structure = case.time, case.structure
    steps = ceil((time.end - time.start) / time.step - 1e-9)
    motion = "static"
    if structure.dynamics is not None:
        rho_inf = structure.dynamics.rho_inf
        motion = "generalised-alpha" + ("" if rho_inf is None else f", rho_inf {rho_inf:g}")
    rows = [
        ("title", case.title),
        ("time", f"{time.start:g} to {time.end:g} {case.units.time}, {_count(steps, 'step')} of {time.step:g}"),
        ("structure", motion + (f", plane {structure.plane}" if case.dimension != 3 else "")),
    ]
    total, known = 0, True
    for name, body in structure.bodies.items():
        law = body.material.law
        if isinstance(body.mesh, Shape):
            cells, nodes = size(body.mesh)
            total += nodes * body.mesh.dimension
            kind = f"order {body.mesh.order} {body.mesh.cell}"
            rows.append((f"body {name}", f"{body.mesh.shape}, {law}, {_count(cells, 'cell')} ({kind})"))
        else:
            known = False
            rows.append((f"body {name}", f"{body.mesh.file}, {law}"))
    if known:
        rows.append(("dofs", f"{total:,}"))
    if case.probes:
        rows.append(("probes", ", ".join(case.probes)))
    if case.verify:
        rows.append(("verify", _count(len(case.verify), "value")))
    width = max(len(word) for word, _ in rows)
    return "\n".join(f"  {word:<{width}}  {text}" for word, text in rows if text)


def _count(number: int, word: str) -> str:
    return f"{number:,} {word}" + "s" * (number != 1)
