"""Springs and dampers between elastic and free rigid bodies: what they add to the system of both.

Either field has the force on its own end, from the present motion of the other end. The derivatives by the motion of
the own end are in the tangents of the fields, those by the other end here.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from petsc4py import PETSc

from solvers.rigid import motion
from solvers.rigid.field import RigidBodies
from solvers.rigid.line_springs import LineSpring, by_unknowns
from solvers.structure.field import Structure
from solvers.structure.point_springs import SpringEnd, added_entries


@dataclass(frozen=True)
class _Joint:
    """A spring with one end on a rigid body."""

    spring: int  #: number among those of the structure
    side: int  #: which end is on the elastic body
    body: int  #: index of the rigid body
    end: SpringEnd  #: the other end


class RigidSprings:
    """All springs of a structure that lead to free rigid bodies; these get them, too."""

    def __init__(self, structure: Structure, bodies: RigidBodies):
        self._structure, self._bodies = structure, bodies
        numbers = {body.name: index for index, body in enumerate(bodies.bodies)}
        self._joints = [
            _Joint(number, 1 - side, numbers[end.body], end)
            for number, spring in enumerate(structure.springs.springs)
            for side, end in enumerate(spring.ends)
            if end.motion is not None and end.body is not None
        ]
        new = [
            LineSpring(
                joint.body,
                joint.end.at,
                partial(structure.springs.motion, structure, joint.spring, joint.side),
                joint.end.at,
                structure.springs.springs[joint.spring].law,
            )
            for joint in self._joints
        ]
        bodies.springs = [*bodies.springs, *new]

    @property
    def any(self) -> bool:
        """Whether there are any."""
        return bool(self._joints)

    def linked(self) -> list[tuple[int, int]]:
        """(elastic piece, rigid body) of each (collective)."""
        structure, springs = self._structure, self._structure.springs
        pieces = [springs.number(structure, structure.pieces.of_dofs, j.spring, j.side) for j in self._joints]
        return [(int(piece[0]), joint.body) for piece, joint in zip(pieces, self._joints, strict=True)]

    def follow(self) -> None:
        """Let the forces on rigid bodies belong to the present motion of the elastic ones (collective)."""
        if self._joints:
            self._bodies.set_increments(self._bodies.increments())

    def added_to(self, matrix: PETSc.Mat) -> PETSc.Mat:
        """The tangent of both with the derivatives by the other ends; a new one if there are any (collective)."""
        if not self._joints:
            return matrix
        structure, bodies = self._structure, self._bodies
        slope, dim, of_body = structure.springs.slope(structure), structure.dim, len(bodies.components)
        rows, columns, entries = [], [], []
        for joint in self._joints:
            own = structure.springs.place(structure, joint.spring, joint.side, slope)
            other = structure.springs.place(structure, joint.spring, 1 - joint.side)
            _, by_d, by_rate = structure.springs.springs[joint.spring].law.force(own.x - other.x, own.v - other.v)
            old, now, u = bodies.old[joint.body], bodies.now[joint.body], bodies.increments()[joint.body]
            rate = motion.velocity_rate(bodies.scheme, old, now, u[3:], bodies.current.dt)
            place, speed = (part[:, bodies.components] for part in by_unknowns(bodies, joint.body, joint.end.at, rate))
            dofs = own.dofs.ravel()
            unknowns = bodies.first + joint.body * of_body + np.arange(of_body)
            on_elastic = structure.time.force_weight * own.rows(dim).T @ (by_d @ place + by_rate @ speed)
            on_rigid = bodies.force_weight * place.T @ (by_d @ own.rows(dim) + by_rate @ own.rates(dim))
            for row, column, block in ((dofs, unknowns, on_elastic), (unknowns, dofs, on_rigid)):
                rows.append(np.repeat(row, len(column)))
                columns.append(np.tile(column, len(row)))
                entries.append(block.ravel())
        return added_entries(matrix, rows, columns, entries)
