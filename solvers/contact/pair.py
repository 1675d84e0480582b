"""A contact pair: a slave and a master surface, or one surface in self contact."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.contact.law.frictionless import Frictionless
from solvers.contact.law.law import Law
from solvers.contact.mortar import Integration
from solvers.contact.surface import Surface


@dataclass(frozen=True)
class Pair:
    """The slave carries the multipliers; laws of pairs with the same slave: the same, or friction and none.

    Self contact: the master is the same object as the slave.
    """

    slave: Surface
    master: Surface
    integration: Integration = "segments"
    law: Law = Frictionless()
    #: facets (slave, master) in numbers of the surfaces that lie deep in each other's body at the start, shape (p, 2)
    deep: NDArray[np.int32] | None = None
    interference: Callable[[float], float] | None = None  #: time [s] -> overlap [m] of the bodies as meshed; None: zero
    off_curve: float = 0.0  #: largest gap [m] of the meshes that is none, see `as_meshed`; 0: all of them are
    always: bool = False  #: present in all steps, so that its surfaces never have mass
    others: bool = False  #: its forces are given as those on the master

    def exchanged(self) -> Pair:
        """The same with the other side as the slave, and its forces on the same side as before."""
        deep = None if self.deep is None else np.ascontiguousarray(self.deep[:, ::-1])
        return replace(self, slave=self.master, master=self.slave, deep=deep, others=not self.others)
