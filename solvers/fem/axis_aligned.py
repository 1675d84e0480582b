"""Forms over cells with edges along the axes: their Jacobian is diagonal, which the form compiler does not know.

With the inverse of a full matrix each derivative along an axis becomes three along the edges of the reference cell. A
tangent of the flow takes 1.5 times as long then.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import reduce
from typing import Any
from unittest.mock import patch

import ufl
from ufl.algorithms import apply_geometry_lowering as lowering


@contextmanager
def axis_aligned() -> Iterator[None]:
    """Let the form compiler take Jacobians of cells for diagonal ones, while it compiles."""
    inverse, determinant = lowering.inverse_expr, lowering.determinant_expr

    def diagonal_inverse(J: Any) -> Any:
        if not _of_cell(J):
            return inverse(J)
        dim = J.ufl_shape[0]
        return ufl.as_matrix([[1.0 / J[i, i] if i == j else 0.0 for j in range(dim)] for i in range(dim)])

    def diagonal_determinant(J: Any) -> Any:
        if not _of_cell(J):
            return determinant(J)
        return reduce(lambda product, i: product * J[i, i], range(1, J.ufl_shape[0]), J[0, 0])

    with ExitStack() as stack:
        stack.enter_context(patch.object(lowering, "inverse_expr", diagonal_inverse))
        stack.enter_context(patch.object(lowering, "determinant_expr", diagonal_determinant))
        yield


def _of_cell(J: Any) -> bool:
    """Whether it is the Jacobian of a cell; that of a facet has another shape, or is of another type."""
    return isinstance(J, ufl.classes.Jacobian)
