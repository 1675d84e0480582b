"""Sizes from which on a body is thin or short for the fluid on its two sides; `fsci check` needs them, too."""

import math

THIN = 2  #: largest distance [cells] across a body at which a node or the cut penalty couples the fluid on two sides
THIN_IF_MOVING = 3  #: the same [cells] of bodies that move, with a strip of cells behind each side
AROUND_PAIR = 1  #: layers of cells, beyond this distance, in which fluid on both sides must not be connected


def free_length(dim: int, *, moves: bool) -> float:
    """Distance [cells] to the edge of a thin body in the fluid at which both sides surely have their own unknowns.

    Around an edge that is nearer they may be connected within the cells of `AROUND_PAIR`, in a diagonal direction.
    """
    return math.sqrt(dim) * ((THIN_IF_MOVING if moves else THIN) + AROUND_PAIR + 0.5)
