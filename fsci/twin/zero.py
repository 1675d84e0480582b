"""What is zero but for rounding, by the size of other numbers of a run: a moment by a force."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from fsci.case import Case
from fsci.case.units import OF_FORCE, Powers
from fsci.plot.units import INTENSIVE

#: Difference, relative to the largest value of its unit, that rounding explains: solvers stop at the same iterate.
ROUNDING = 1e-8
#: The same of a direct solver, on whose grid a value is zero by symmetry.
ZERO_BESIDE = 1e-12

SPEED: Powers = (1, 0, -1)
PURE_NUMBER: Powers = (0, 0, 0)
OF_GEOMETRY = (0, 0)  #: powers of mass and time of lengths, areas and volumes


@dataclass(frozen=True)
class CharacteristicScales:
    """What numbers of different units are compared by.

    With the length L of the box and the density r of a flow, moments and energies are of the size of a force times L,
    stresses of a force over L^2 (in 2D, per depth, over L) or of r v^2 with velocities v, flow rates of v L^2. Pure
    numbers, as coefficients of drag, are of the size of 1. Without a flow, and of lengths, areas and volumes, only
    numbers of one unit are compared: displacements may be much smaller than the box.
    """

    powers: Mapping[str, Powers] = field(default_factory=dict)  #: by column; in 2D per depth
    length: float | None = None  #: L [m]
    density: float = 1.0  #: r [kg/m^3]

    def scale(self, name: str, own: float, sizes: Mapping[str, float]) -> float:
        """What changes of a column are relative to, by the largest numbers of its probe and of all columns.

        That of its probe, but not less than ROUNDING of what others say; what is zero beside these has their
        size.
        """
        unit = self.powers.get(name)
        if unit is None:
            return own
        others = max(self._as(unit, self.powers.get(other), size) for other, size in sizes.items())
        return others if own <= ZERO_BESIDE * others else max(own, ROUNDING * others)

    def _as(self, unit: Powers, other: Powers | None, size: float) -> float:
        """The size of a number in another unit; 0 where nothing follows."""
        if other == unit:
            return size
        if unit == PURE_NUMBER:
            return 1.0
        if self.length is None or other is None or unit[1:] == OF_GEOMETRY:
            return 0.0
        if other[1:] == unit[1:]:
            return size * self.length ** (unit[0] - other[0])
        inertia = other == SPEED and unit[1:] == OF_FORCE[1:]
        return self.density * size**2 * self.length ** (unit[0] + 1) if inertia else 0.0


def scales(case: Case) -> CharacteristicScales:
    """Of the columns of the probes of a case."""
    dimension = case.dimension or 3
    powers: dict[str, Powers] = {}
    for key, probe in case.probes.items():
        per_depth = int(dimension == 2 and probe.measured.name not in INTENSIVE)
        for name in probe.columns(key, dimension):
            length, mass, time = probe.powers(key, name)
            powers[name] = length - per_depth, mass, time
    if case.fluid is None:
        return CharacteristicScales(powers)
    grid = case.fluid.grid
    return CharacteristicScales(
        powers, max(b - a for a, b in zip(grid.start, grid.to, strict=True)), case.fluid.density
    )
