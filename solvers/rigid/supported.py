"""What is said where statics does not determine the motion of a free body."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from solvers.api import FailureKind, StepFailed

NOTHING_HOLDS = (
    "nothing holds a free body in statics: it needs contact with an elastic body, springs or 'held', and springs where "
    "it is near other rigid bodies"
)


@contextmanager
def supported() -> Iterator[None]:
    """Within it, a singular matrix raises StepFailed: a body without inertia has no stiffness of its own."""
    try:
        yield
    except (np.linalg.LinAlgError, RuntimeError):  # of dense blocks, and of sparse factors
        raise StepFailed("rigid bodies", FailureKind.UNSUPPORTED, NOTHING_HOLDS) from None
