"""Fluid that cannot be there, or cannot leave: boxes that bodies cover, and enclosed fluid with a net flow into it.

Incompressible fluid without an open boundary (outflow, pressure, traction) keeps its volume. What is prescribed must
keep it, too: velocities on patches and motions of rigid bodies. Elastic bodies may give way, and free ones move.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fsci.case import Case, CaseError
from fsci.case.expressions import face_middles, run_times
from fsci.case.fluid import FluidSection, PatchSection
from fsci.case.rigid_motion import rigid_motion
from fsci.case.shapes import ShapeSection
from fsci.expression import Expression
from fsci.meshes.nested import body_surface
from solvers.mesh.tessellation import area_vectors

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Surface = tuple[Array, NDArray[np.int64]]  #: points [m], segments or triangles

#: Share of the flows that their sum may have in enclosed fluid: the error of profiles on a grid, as the run's balance.
UNBALANCED = 0.005

#: Share of solid from which on a cell has no fluid.
FULL_OF_SOLID = 1.0 - 1e-9

#: Times of the run at which flows into enclosed fluid are added up.
ADDED_TIMES = 10


def require_outlet(case: Case) -> None:
    """Raises CaseError if bodies cover the box, or fluid is enclosed and its volume would have to change."""
    if case.fluid is None:
        return
    places = Places(case, case.fluid)
    if places.covered():
        message = "the bodies leave no fluid in the box: check their sizes, positions and units"
        raise case.error(("fluid", "bodies"), message)
    if any(patch.open for patch in case.fluid.patches.values()):
        _pockets(case, case.fluid, places)
    elif not case.elastic_bodies:
        _closed_box(case, case.fluid, places)


@dataclass
class Places:
    """Where the bodies of a flow are."""

    case: Case
    fluid: FluidSection
    _read: dict[str, Surface] = field(default_factory=dict)

    def surface(self, name: str) -> Surface:
        """Points and facets of a body in the place of its mesh. Raises CaseError."""
        if name not in self._read:
            self._read[name] = body_surface(self.case, name)
        return self._read[name]

    def names(self, *, moved: bool | None = None) -> list[str]:
        """Rigid bodies that the flow does not move; `moved`: only those with a motion, or without."""
        bodies = self.fluid.bodies.items()
        fixed = {name: body.motion is not None for name, body in bodies if body.free is None}
        return [name for name, moves in fixed.items() if moved is None or moves == moved]

    def at(self, name: str, t: float) -> tuple[Surface, Array]:
        """Surface of a rigid body at a time, and the velocities of its points [m/s]."""
        points, facets = self.surface(name)
        motion = self.fluid.bodies[name].motion if name in self.fluid.bodies else None
        if motion is None:
            return (points, facets), np.zeros_like(points)
        x, v = rigid_motion(points, motion, self.case.time.start, self.case.time.step)(t)
        return (x, facets), v

    def solid(self, surface: Surface) -> Array:
        """Share of solid of each cell of the grid, without its finer cells, one axis per direction."""
        from solvers import kernels
        from solvers.api import StepFailed
        from solvers.fluid.cut.images import Periods
        from solvers.fluid.geometry.pieces import in_planes
        from solvers.fluid.grid.box import Grid

        grid = Grid(self.fluid.grid.planes)
        try:
            images = Periods(grid, self.periodic).images(surface[1], surface[0], 0)
        except StepFailed as error:  # as long as the period
            raise self.case.error(("fluid", "bodies"), error.reason) from None
        moments = kernels.moments(grid.edges, np.array([0.25, 0.75]), in_planes(grid, images.x), images.facets)
        return np.nan_to_num(grid.as_box(moments.fraction))

    def reach_boundary(self, points: Array) -> bool:
        """Whether a body is not strictly inside of the box; along a period it is anywhere."""
        return not self.inside(points).all()

    @property
    def periodic(self) -> tuple[int, ...]:
        """Periodic axes of the box."""
        faces = {face for patch in self.fluid.patches.values() if patch.periodic for face in patch.on}
        return tuple(sorted({"xyz".index(face[0]) for face in faces}))

    def inside(self, points: Array) -> NDArray[np.bool_]:
        """Mask of points inside of the box; along a period they are anywhere."""
        low, high = np.array(self.fluid.grid.start), np.array(self.fluid.grid.to)
        within = (points > low) & (points < high)
        within[:, list(self.periodic)] = True
        found: NDArray[np.bool_] = within.all(axis=1)
        return found

    def covered(self) -> bool:
        """Whether the bodies fill the box at the start."""
        low, high = np.array(self.fluid.grid.start), np.array(self.fluid.grid.to)
        names, whole = [*self.fluid.bodies, *self.case.elastic_bodies], float(np.prod(high - low))
        if sum(self._most_volume(name) for name in names) < whole * (1.0 - 1e-9):
            return False
        surfaces = [self.at(name, self.case.time.start)[0] for name in names]
        shared = [np.minimum(x.max(axis=0), high) - np.maximum(x.min(axis=0), low) for x, _ in surfaces]
        if sum(float(np.prod(np.maximum(size, 0.0))) for size in shared) < whole * (1.0 - 1e-9):
            return False
        return bool(np.sum([self.solid(surface) for surface in surfaces], axis=0).min() >= FULL_OF_SOLID)

    def _most_volume(self, name: str) -> float:
        """The volume of a body is not larger: of a built-in shape by its extents, which need not be read."""
        mesh = self.case.elastic_bodies[name].mesh if name in self.case.elastic_bodies else self.fluid.bodies[name].mesh
        return (
            float(np.linalg.norm(mesh.plan.extents)) ** mesh.plan.dimension
            if isinstance(mesh, ShapeSection)
            else np.inf
        )


def _closed_box(case: Case, fluid: FluidSection, places: Places) -> None:
    """A box without an open boundary."""
    velocities = [name for name, patch in fluid.patches.items() if patch.velocity is not None]
    moved = [name for name in places.names(moved=True) if fluid.scheme != "steady"]
    times, step = run_times(case, ADDED_TIMES + 1)[1:], case.time.step
    largest, error = 0.0, None
    for t in times if velocities or moved else ():
        flows = {name: _flow(fluid, name, t) for name in velocities}
        rates = {name: _displaced(places, name, t - step, t) for name in moved}
        net = sum(flow for flow, _ in flows.values()) + sum(rate for rate, _ in rates.values())
        gross = sum(size for _, size in flows.values()) + sum(size for _, size in rates.values())
        if abs(net) > max(UNBALANCED * gross, largest * (1.0 + 1e-9)):
            parts: dict[tuple[str, ...], float] = {
                ("fluid", "patches", name): flow for name, (flow, _) in flows.items()
            }
            parts |= {("fluid", "bodies", name, "motion"): rate for name, (rate, _) in rates.items()}
            largest, error = abs(net), _unbalanced(case, parts, net, t)
    if error is not None:
        raise error


def _pockets(case: Case, fluid: FluidSection, places: Places) -> None:
    """Parts of a box with an open boundary that fixed bodies cut off from it at the start."""
    from scipy import ndimage

    inlets = [name for name, patch in fluid.patches.items() if patch.velocity is not None and _flows(patch.velocity)]
    if not inlets or any(patch.periodic for patch in fluid.patches.values()):
        return
    walls = {name: places.at(name, case.time.start)[0] for name in places.names()}
    if not any(places.reach_boundary(points) for points, _ in walls.values()):
        return
    fluid_cells = np.ones(fluid.grid.shape, dtype=bool)
    for surface in walls.values():
        fluid_cells &= places.solid(surface) < FULL_OF_SOLID
    labels, count = ndimage.label(fluid_cells, np.ones((3,) * fluid.grid.dimension))
    opened = {0} | {int(part) for patch in fluid.patches.values() if patch.open for part in _at(fluid, patch, labels)}
    for name in case.elastic_bodies:
        opened |= set(np.unique(labels[_box_of(fluid, places.surface(name)[0])]).tolist())
    # bodies that move may open a pocket later
    times = run_times(case, ADDED_TIMES + 1)[1:] if not places.names(moved=True) else [case.time.start + case.time.step]
    for part in range(1, count + 1):
        if part in opened:
            continue
        largest, error = 0.0, None
        for t in times:
            flows = {name: _flow(fluid, name, t, labels == part) for name in inlets}
            net, gross = (sum(values) for values in zip(*flows.values(), strict=True))
            if abs(net) > max(UNBALANCED * gross, largest * (1.0 + 1e-9)):
                parts: dict[tuple[str, ...], float] = {
                    ("fluid", "patches", name): flow for name, (flow, _) in flows.items()
                }
                largest, error = abs(net), _unbalanced(case, parts, net, t)
        if error is not None:
            raise error


def _flows(velocity: tuple[Expression, ...]) -> bool:
    return any(component.constant != 0.0 for component in velocity)


def _at(fluid: FluidSection, patch: PatchSection, labels: NDArray[np.int64]) -> list[int]:
    """Parts with cells at a patch."""
    found: list[int] = []
    for face in patch.on:
        axis, side = "xyz".index(face[0]), -1 if face[1] == "+" else 0
        along = np.take(labels, side, axis=axis).ravel()
        if patch.where is not None:
            along = along[_on(fluid, patch, face)]
        found += np.unique(along).tolist()
    return found


def _on(fluid: FluidSection, patch: PatchSection, face: str) -> Mask:
    """Which cells at a face of the box have a patch."""
    x = face_middles(fluid, face)
    where = patch.where
    return np.ones(x.shape[1], dtype=bool) if where is None else np.asarray(where(x, 0.0) > 0.0)


def _flow(fluid: FluidSection, name: str, t: float, part: Mask | None = None) -> tuple[float, float]:
    """(volume that leaves through a patch per time, integral of the size of its normal velocity) [m^dim/s].

    Gauss's rule with three points in each direction of a cell's face; `part`: only faces of these cells.
    """
    patch = fluid.patches[name]
    assert patch.velocity is not None
    gauss, weights = np.polynomial.legendre.leggauss(3)
    net = gross = 0.0
    for face in patch.on:
        axis, side = "xyz".index(face[0]), -1 if face[1] == "+" else 0
        chosen = _on(fluid, patch, face)
        if part is not None:
            chosen = chosen & np.take(part, side, axis=axis).ravel()
        lines, sizes = [], []
        for i, plane in enumerate(fluid.grid.planes):
            h = np.diff(plane)
            inner = 0.5 * (plane[1:] + plane[:-1])[:, None] + 0.5 * h[:, None] * gauss
            lines.append(plane[[side]] if i == axis else inner.ravel())
            sizes.append(np.ones(1) if i == axis else (0.5 * h[:, None] * weights).ravel())
        shape = [1 if i == axis else n for i, n in enumerate(fluid.grid.shape)]
        mask = chosen.reshape([n for i, n in enumerate(shape) if i != axis])
        for i in range(mask.ndim):
            mask = np.repeat(mask, 3, axis=i)
        x = np.stack([line.ravel() for line in np.meshgrid(*lines, indexing="ij")])
        area = np.prod(np.stack([size.ravel() for size in np.meshgrid(*sizes, indexing="ij")]), axis=0)
        speed = (1.0 if side else -1.0) * patch.velocity[axis](x, t) * area * mask.ravel()
        net, gross = net + float(speed.sum()), gross + float(np.abs(speed).sum())
    return net, gross


def _displaced(places: Places, name: str, begin: float, end: float) -> tuple[float, float]:
    """(minus the volume in the box that a body displaces, what its surface moves there) [m^dim/s].

    That is the integral of the speed, or the sum over cells where facets are larger than the box: their middles are
    outside.
    """
    (before, facets), _ = places.at(name, begin)
    (after, _), velocity = places.at(name, end)
    if not (places.reach_boundary(before) or places.reach_boundary(after)):
        return 0.0, 0.0
    planes = places.fluid.grid.planes
    volume = np.prod(np.stack(np.meshgrid(*(np.diff(plane) for plane in planes), indexing="ij")), axis=0)
    grown = (places.solid((after, facets)) - places.solid((before, facets))) * volume
    inside = places.inside(after[facets].mean(axis=1))
    area = np.linalg.norm(area_vectors(after[facets]), axis=1)
    speed = np.linalg.norm(velocity[facets].mean(axis=1), axis=1)
    moved = max(float((area * speed)[inside].sum()), float(np.abs(grown).sum()) / (end - begin))
    return -float(grown.sum()) / (end - begin), moved


def _box_of(fluid: FluidSection, points: Array) -> tuple[slice, ...]:
    """The cells around a body."""
    low, high = points.min(axis=0), points.max(axis=0)
    ends = [
        (np.searchsorted(p, a), np.searchsorted(p, b)) for p, a, b in zip(fluid.grid.planes, low, high, strict=True)
    ]
    return tuple(slice(max(int(a) - 1, 0), int(b) + 1) for a, b in ends)


def _unbalanced(case: Case, parts: Mapping[tuple[str, ...], float], net: float, t: float) -> CaseError:
    """The error about a sum of flows out of the fluid, at the largest of those that have its sign."""
    place = max(parts, key=lambda keys: parts[keys] * np.sign(net))
    flow = f"{abs(net):.3g} {case.units.length}^{case.dimension}/{case.units.time}"
    if place[1] == "bodies":
        what = "of the enclosed fluid are displaced" if net < 0.0 else "are withdrawn from the enclosed fluid"
    else:
        what = f"flow {'into' if net < 0.0 else 'out of'} the enclosed fluid"
    end = "cannot leave: give an outlet" if net < 0.0 else "nothing replaces them: give an inlet"
    kinds = "a patch with outflow, pressure or traction"
    return case.error(place, f"{flow} {what} at t = {t:.6g}, and {end} ({kinds})")
