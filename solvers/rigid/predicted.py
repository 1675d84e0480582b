"""The contact of the predictor of rigid bodies in a flow: they do not enter others.

Bodies that keep their velocity enter what they reach in the step. The facets there are not those that meet, and where
corners pass each other, Newton's method takes many iterates to find these. Here they are found without the flow: the
predicted increments u_p are moved to the nearest ones without overlap, in the norm of the tangent A,

    A (u - u_p) = B^T z,    with the gaps, forces z and B of `solvers.rigid.contact`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from solvers.algebra.sparse import Sparse
from solvers.api import Array, StepFailed
from solvers.rigid.contact import RigidContact
from solvers.rigid.coulomb import solver
from solvers.rigid.supported import supported

#: Iterates of the contact of the predictor, and their last increment relative to the way of the step. Newton's method
#: finds the rest, so that results do not depend on it.
PREDICTIONS, PREDICTED = 8, 1e-3


def leave_others(
    contact: RigidContact,
    way: Array,
    measure: Callable[[], None],
    upright: Sparse,
    move: Callable[[Array], object],
) -> None:
    """Move bodies out of what they enter; where they have no room, as far as found.

    way: predicted increments by unknown; measure: sets the gaps of the iterate; upright: its tangent, in which forces
    do not turn; move: adds an increment to it.
    """
    moved = np.zeros_like(way)
    for _ in range(PREDICTIONS):
        measure()
        back = -(upright @ moved)
        try:
            with supported():
                contact.press(upright + contact.stiffness, lambda: upright, back)
                increment = solver(contact.tangent)(back + contact.force)
        except StepFailed:
            break
        move(increment)
        moved += increment
        if float(np.abs(increment).max()) <= PREDICTED * float(np.abs(way).max()):
            break
    contact.end_prediction()
