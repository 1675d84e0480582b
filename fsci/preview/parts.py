"""What a preview shows of a case: bodies, grid, and where supports, loads, pairs, patches and probes are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from fsci.case import Case, CaseError
from fsci.case.contact import PairSection
from fsci.check.meshes import check_meshes
from fsci.expression import Expression
from fsci.meshes.nested import read_grid
from fsci.meshes.of_case import read_body, read_obstacle, read_rigid_body, read_rigid_side
from fsci.preview.arrows import (
    Arrow,
    arrow_of_moved,
    arrow_of_pressure,
    arrow_of_support,
    arrow_of_vector,
    moments,
)
from solvers.api import Array
from solvers.mesh.distance import nearest_points
from solvers.mesh.mesh import Mesh
from solvers.mesh.tessellation import area_vectors, tessellate

SAME_PLACE = 1e-13  #: of coordinates, relative to the largest of them
FACETS_TRIED = 8  #: by their middles, to which the distance of a corner is computed


@dataclass(frozen=True)
class NamedSurface:
    """A surface with a name: segments or triangles with these corners, shape (n, dim, dim) [m]."""

    name: str
    kind: str  #: elastic, rigid, moved, free or obstacle; support, load, or the kind of a patch
    corners: Array

    @property
    def middle(self) -> Array:
        """The mean of its facets, by their sizes [m], shape (dim,)."""
        sizes = np.linalg.norm(area_vectors(self.corners), axis=1)
        weights = sizes if sizes.sum() > 0.0 else np.ones(len(sizes))
        return np.asarray(np.average(self.corners.mean(axis=1), axis=0, weights=weights))


@dataclass(frozen=True)
class NamedPoint:
    """A point of a body with a support, a spring or a force."""

    name: str
    kind: str  #: support, spring or force
    at: Array  #: [m], shape (dim,)


@dataclass(frozen=True)
class DistantPair:
    """Two surfaces in contact, and where they are nearest."""

    name: str
    sides: tuple[NamedSurface, NamedSurface]
    ends: Array  #: the nearest points [m], shape (2, dim)

    @property
    def distance(self) -> float:
        """[m]; zero where it is the rounding of coordinates."""
        found = float(np.linalg.norm(self.ends[1] - self.ends[0]))
        largest = max(float(np.abs(side.corners).max()) for side in self.sides)
        return found if found > SAME_PLACE * largest else 0.0


@dataclass(frozen=True)
class Preview:
    """All that is drawn; positions in [m]."""

    title: str
    bodies: list[NamedSurface]
    marks: list[NamedSurface]  #: supports and loads
    patches: list[NamedSurface]
    pairs: list[DistantPair]
    probes: dict[str, Array]
    points: list[NamedPoint]  #: that are held, or that springs and forces act at
    arrows: list[Arrow]  #: of loads, motions and prescribed velocities
    box: tuple[Array, Array] | None = None
    planes: tuple[Array, ...] = ()  #: of the grid, along each axis
    cells: list[Array] = field(default_factory=list)  #: (low, high) corners of nested cells


def preview_of(case: Case) -> Preview:
    """Reads the meshes of a case. Raises CaseError with all that `fsci check` finds in them."""
    found = check_meshes(case)
    if found.problems:
        raise CaseError(found.problems)
    bodies = list(_bodies(case))
    probes = {name: np.asarray(probe.at) for name, probe in case.probes.items() if probe.at is not None}
    pairs = [pair for name, settings in found.pairs.items() if (pair := _pair(case, name, settings)) is not None]
    points = [*_points_of_elastic(case), *_points_of_free(case)]
    marks, arrows = list(_marks(case)), list(_arrows(case, bodies))
    if case.fluid is None:
        return Preview(case.title, bodies, marks, [], pairs, probes, points, _drawn(arrows))
    section = case.fluid.grid
    low, high = np.asarray(section.start, dtype=float), np.asarray(section.to, dtype=float)
    planes = tuple(np.asarray(edge) for edge in section.planes)
    patches = []
    # A patch on a part of a face is drawn over one on all of it.
    for name, patch in sorted(case.fluid.patches.items(), key=lambda item: item[1].where is not None):
        facets = [_face(planes, face, patch.where) for face in patch.on]
        patches.append(NamedSurface(name, patch.kind.replace("_", " "), np.concatenate(facets)))
        if patch.velocity is not None:
            arrows += [arrow_of_vector("velocity", part, patch.velocity, moments(case)) for part in facets if len(part)]
    cells = list(_nested_cells(case)) if section.refine else []
    return Preview(
        case.title, bodies, marks, patches, pairs, probes, points, _drawn(arrows), (low, high), planes, cells
    )


def _drawn(arrows: Sequence[Arrow | None]) -> list[Arrow]:
    return [arrow for arrow in arrows if arrow is not None]


def _bodies(case: Case) -> Iterator[NamedSurface]:
    for name in case.elastic_bodies:
        yield _surface(read_body(case, name), None, name, "elastic")
    given = {} if case.fluid is None else case.fluid.bodies
    for name in case.rigid_surfaces:
        _, points, facets = read_rigid_body(case, name)
        moved = name in given and given[name].motion is not None
        kind = "free" if name in (case.rigid or ()) else "moved" if moved else "rigid"
        yield NamedSurface(name, kind, points[facets])
    for name, obstacle in ({} if case.contact is None else case.contact.obstacles).items():
        if obstacle.free is None:
            yield _surface(read_obstacle(case, name), None, name, "obstacle")


def _surface(mesh: Mesh, names: Sequence[str] | None, name: str, kind: str) -> NamedSurface:
    return NamedSurface(name, kind, _corners(mesh, names))


def _marks(case: Case) -> Iterator[NamedSurface]:
    """Surfaces of elastic bodies with supports, springs, tractions and pressures."""
    kinds = {"supports": "support", "springs": "spring", "tractions": "traction", "pressures": "pressure"}
    for name, body in case.elastic_bodies.items():
        mesh = read_body(case, name)
        for setting, kind in kinds.items():
            for item in getattr(body, setting):
                on = [surface for surface in item.on or () if surface in mesh.surfaces]
                if on:
                    yield _surface(mesh, on, f"{name}.{' + '.join(on)}", kind)


def _arrows(case: Case, bodies: Sequence[NamedSurface]) -> Iterator[Arrow | None]:
    """Of loads and motions."""
    times = moments(case)
    for name, body in case.elastic_bodies.items():
        mesh = read_body(case, name)
        known = set(mesh.surfaces)
        for support in body.supports:
            if support.at is not None:
                yield arrow_of_support(np.asarray(support.at)[None, None], support, times)
            elif set(support.on or ()) <= known:
                yield arrow_of_support(_corners(mesh, support.on), support, times)
        for traction in body.tractions:
            yield arrow_of_vector("traction", _corners(mesh, traction.on), traction.value, times)
        for pressure in body.pressures:
            yield arrow_of_pressure(_corners(mesh, pressure.on), pressure.value, times)
        for load in body.point_forces:
            if load.at is not None:
                yield arrow_of_vector("force", np.asarray(load.at)[None, None], load.value, times)
    for part in bodies:
        if part.kind in ("moved", "obstacle"):
            yield arrow_of_moved(case, part.name, np.unique(part.corners.reshape(-1, part.corners.shape[2]), axis=0))
    centres = {part.name: part.middle for part in bodies}
    for name, free in (case.rigid or {}).items():
        for given in free.loads:
            if given.force is not None:
                at = centres[name] if given.at is None else np.asarray(given.at)
                yield arrow_of_vector("force", at[None, None], given.force, times)


def _corners(mesh: Mesh, on: Sequence[str] | None) -> Array:
    facets, nodes = tessellate(mesh, on)
    return mesh.points[nodes][facets]


def _points_of_elastic(case: Case) -> Iterator[NamedPoint]:
    """Supports and forces at points of elastic bodies."""
    for name, body in case.elastic_bodies.items():
        for support in body.supports:
            if support.at is not None:
                yield NamedPoint(name, "support", np.asarray(support.at))
        for load in body.point_forces:
            if load.at is not None:
                yield NamedPoint(name, "force", np.asarray(load.at))


def _points_of_free(case: Case) -> Iterator[NamedPoint]:
    """Points of free rigid bodies that springs and forces act at."""
    for name, free in (case.rigid or {}).items():
        for spring in free.springs:
            yield NamedPoint(name, "spring", np.asarray(spring.at))
        for load in free.loads:
            if load.at is not None:
                yield NamedPoint(name, "force", np.asarray(load.at))


def _pair(case: Case, name: str, settings: PairSection) -> DistantPair | None:
    """None for a surface on itself."""
    if settings.itself is not None:
        return None
    parts = []
    for role, side in settings.sides:
        if side.body in case.elastic_bodies:
            mesh, on = read_body(case, side.body), side.on
        else:
            mesh, on = read_rigid_side(case, side.body or side.obstacle or "")
        where = f"{side.body or side.obstacle}{'.' if on else ''}{' + '.join(on or ())}"
        parts.append(_surface(mesh, on, where, role))
    return DistantPair(name, (parts[0], parts[1]), nearest(parts[0].corners, parts[1].corners))


def nearest(one: Array, other: Array) -> Array:
    """The nearest points of two surfaces [m], shape (2, dim): one of both is a corner.

    Edges of triangles that cross each other in space may be nearer.
    """
    best: tuple[float, Array] = (np.inf, np.zeros((2, one.shape[2])))
    for first, (corners, facets) in enumerate(((one, other), (other, one))):
        points = np.unique(corners.reshape(-1, corners.shape[2]), axis=0)
        count = min(FACETS_TRIED, len(facets))
        middles = cKDTree(facets.mean(axis=1))
        away, _ = middles.query(points)
        size = float(np.linalg.norm(facets - facets.mean(axis=1)[:, None], axis=2).max())
        close = points[away <= away.min() + 2.0 * size]
        _, numbers = middles.query(close, k=count)
        for point, candidates in zip(close, np.asarray(numbers).reshape(len(close), count), strict=True):
            foot = nearest_points(point[None], facets[candidates])[0]
            if (distance := float(np.linalg.norm(foot - point))) < best[0]:
                best = distance, np.stack([point, foot][:: 1 - 2 * first])
    return best[1]


def _face(planes: Sequence[Array], face: str, where: Expression | None) -> Array:
    """A face of the box, such as x-, as segments or triangles; of cells in whose middle `where` is positive."""
    axis, dim = "xyz".index(face[0]), len(planes)
    place = planes[axis][0 if face[1] == "-" else -1]
    others = [edges if where is not None else edges[[0, -1]] for i, edges in enumerate(planes) if i != axis]
    low = np.stack(np.meshgrid(*(edges[:-1] for edges in others), indexing="ij"), axis=-1).reshape(-1, dim - 1)
    high = np.stack(np.meshgrid(*(edges[1:] for edges in others), indexing="ij"), axis=-1).reshape(-1, dim - 1)
    if where is not None:
        inside = where(np.insert((low + high) / 2.0, axis, place, axis=1).T, 0.0) > 0.0
        low, high = low[inside], high[inside]
    steps = np.array(np.meshgrid(*([[0, 1]] * (dim - 1)), indexing="ij")).reshape(dim - 1, -1).T
    corners = np.insert(low[:, None] + steps * (high - low)[:, None], axis, place, axis=2)
    simplices = [[0, 1]] if dim == 2 else [[0, 1, 3], [0, 3, 2]]
    return corners[:, simplices].reshape(-1, dim, dim)


def _nested_cells(case: Case) -> Iterator[Array]:
    """Corners (low, high) of all cells of a grid with nested ones."""
    mesh = read_grid(case).picture()  # type: ignore[attr-defined]
    points = mesh.points[mesh.cells]
    yield from np.stack([points.min(axis=1), points.max(axis=1)], axis=1)
