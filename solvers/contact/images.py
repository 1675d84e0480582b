"""Images of masters in a space that repeats: a slave may touch the master itself, or an image some periods further.

A mortar has each master twice along every axis that repeats: the image whose middle is the last one before that of the
slave, and the next one. Surfaces that are no longer than a period touch no others. The images have the nodes of the
master, so that forces on them and derivatives are those of the master; in a step their ways are constant.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.contact.surface import Surface
from solvers.mesh.periods import box_of, periods_before, without_longer

#: Of an axis along which a master has no images.
ALONE = -1


def images_of(slave: Surface, master: Surface, periods: Array | None) -> list[tuple[int, ...]]:
    """Numbers of the images of the master by axis, 0 and 1 or `ALONE`; first the master itself, as it is meshed.

    A flow has bodies shorter than its period, which do not touch themselves. A rigid surface that is longer covers its
    images.
    """
    dim = master.points.shape[1]
    own_body = master is slave or (master.dofs is not None and master.body == slave.body)
    if periods is None or own_body:
        return [(ALONE,) * dim]
    repeats = np.isfinite(without_longer(master.points, periods))
    found = product(*((0, 1) if axis else (ALONE,) for axis in repeats))
    own = -periods_before(box_of(slave.points), box_of(master.points), periods)
    return sorted(found, key=lambda one: any(k not in (ALONE, a) for k, a in zip(one, own, strict=True)))


def ways(slave: Array, masters: Array, pair: NDArray[np.int64], image: NDArray[np.int64], periods: Array) -> Array:
    """Ways [m] from the nodes of masters to those of their images, shape (n, dim).

    slave: positions of the slave [m], (k, dim); masters: of the nodes of the masters; pair: of each node; image: its
    number by axis, shape (n, dim).
    """
    found = np.zeros_like(masters)
    around = box_of(slave)
    for one in np.unique(pair):
        own = np.flatnonzero(pair == one)
        numbers = periods_before(around, box_of(masters[own]), periods) + image[own]
        found[own] = np.where(image[own] == ALONE, 0.0, numbers * np.where(np.isfinite(periods), periods, 0.0))
    return found
