"""The shape of bodies in cells: across them, and in the gaps between them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.flow.resolution.cells import BodyCells, GapCells
from solvers.fluid.flow.resolution.film_length import cells_along, ends_at_edges
from solvers.fluid.flow.resolution.gaps import SampledGaps, SurfaceSamples, WallPlane, gaps, samples_of
from solvers.fluid.grid.box import Grid
from solvers.fluid.terms.boundary.patch_kinds import PatchKind
from solvers.mesh.tessellation import unit_normals

#: Gaps up to so many cells count as such; the flow in wider ones is that around the body.
NARROW = 5.0
#: Cosine of the least angle between facets that meet in an edge of the body.
EDGE_OF_BODY = 0.7


def walls_of_box(patches: Iterable[tuple[Sequence[str], PatchKind]]) -> list[tuple[WallPlane, str]]:
    """Faces of the box that hold the normal velocity, with their names; those that hold no other one mirror the flow.

    patches: faces and kind of each.
    """
    return [
        (WallPlane("xyz".index(face[0]), int(face[1] == "+"), kind.prescribed == "normal"), face)
        for faces, kind in patches
        if kind.normal_given
        for face in faces
    ]


@dataclass(frozen=True)
class SurfaceScene:
    """Surfaces in the box, with the gaps in front of them."""

    bodies: list[str]
    faces: list[str]  #: names of the walls of the box, in the order of the planes
    corners: Array  #: of the facets of all bodies, (facets, dim, dim) [m]
    owner: NDArray[np.int64]  #: body of each facet
    samples: SurfaceSamples
    gaps: SampledGaps
    mirrors: list[tuple[int, float]]  #: axis and position [m] of the planes of symmetry
    ends: Array  #: of the box, beyond which nothing of a body counts, (2, dim) [m]; infinite along periods
    sharp: NDArray[np.bool_]  #: whether a body has edges

    def of_samples(self, by_facet: Array) -> Array:
        """Values that are spread over facets, at the samples: in proportion to their areas."""
        facet, area = self.samples.facet, self.samples.area
        return by_facet[facet] * area / np.bincount(facet, area, len(self.owner))[facet]


def scene_of(
    grid: Grid,
    walls: Sequence[tuple[WallPlane, str]],
    bodies: Sequence[tuple[str, Array]],
    wet: NDArray[np.bool_] | None = None,
    periodic: Sequence[int] = (),
) -> SurfaceScene:
    """Of bodies by (name, corners of their facets).

    walls: of the box, with names; wet: mask of the facets that count; periodic: axes of the box.
    """
    corners = np.concatenate([corners for _, corners in bodies])
    owner = np.repeat(np.arange(len(bodies)), [len(corners) for _, corners in bodies])
    samples = samples_of(grid, corners)
    if wet is not None:
        samples = samples[wet[samples.facet]]
    found = gaps(grid, samples, [plane for plane, _ in walls])
    mirrors = [(plane.axis, float(grid.edges[plane.axis][-plane.side])) for plane, _ in walls if plane.mirror]
    names, faces = [name for name, _ in bodies], [face for _, face in walls]
    wet_facets = np.unique(samples.facet)
    sharp = np.array([has_edges(corners[wet_facets[owner[wet_facets] == body]]) for body in range(len(names))])
    ends = np.array([[edge[0], edge[-1]] for edge in grid.edges]).T
    ends[:, list(periodic)] = [[-np.inf], [np.inf]]
    return SurfaceScene(names, faces, corners, owner, samples, found, mirrors, ends, sharp)


def at_start(
    grid: Grid,
    walls: Sequence[tuple[WallPlane, str]],
    bodies: Sequence[tuple[str, Array]],
    periodic: Sequence[int] = (),
) -> list[BodyCells]:
    """Of bodies as in `scene_of`, without a flow.

    Shares of the force are those of films: what acts is proportional to 1 / gap^2.
    """
    if not bodies:
        return []
    scene = scene_of(grid, walls, bodies, periodic=periodic)
    acting = scene.samples.area / np.minimum(scene.gaps.cells, 1e6) ** 2
    return [shape_of(scene, body, acting, acting) for body in present(scene)]


def present(scene: SurfaceScene) -> list[int]:
    """Numbers of the bodies with samples."""
    found: list[int] = np.unique(scene.owner[scene.samples.facet]).tolist()
    return found


def shape_of(
    scene: SurfaceScene, body: int, acting: Array, counts: Array, beyond: Mapping[int, float] | None = None
) -> BodyCells:
    """Of one body; acting: size of the force at each sample; counts: the part of it that shares are of.

    beyond: forces outside of films that they cause, by what is opposite; what several cause counts for each.
    """
    samples = scene.samples
    some = np.flatnonzero(scene.owner[samples.facet] == body)
    corners = scene.corners[np.unique(samples.facet[some])]
    per_length = _per_length(scene, some)
    edge = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean()
    whole = max(float(acting[some].sum()), 1e-300)
    share, caused = counts / whole, {film: force / whole for film, force in (beyond or {}).items()}
    narrow = is_narrow(scene, body)[some]
    return BodyCells(
        scene.bodies[body],
        across=_across(scene, body),
        layer=np.nan,
        sharp=bool(scene.sharp[body]),
        dim=corners.shape[2],
        facets=float(1.0 / (edge * per_length)),
        share=float(share[some[~narrow]].sum()),
        gaps=tuple(_gaps_of(scene, body, share, caused)),
    )


def is_narrow(scene: SurfaceScene, body: int) -> NDArray[np.bool_]:
    """Whether gaps in front of samples are films for a body: in one wider than the body the flow is that around it."""
    narrow: NDArray[np.bool_] = scene.gaps.cells < min(NARROW, _across(scene, body))
    return narrow


def _across(scene: SurfaceScene, body: int) -> float:
    """Cells across what is in the box of a body: the longer extent of a rectangle, the middle one in space."""
    points = np.clip(scene.corners[scene.owner == body].reshape(-1, scene.corners.shape[2]), *scene.ends)
    extent = np.ptp(points, axis=0)
    for axis, position in scene.mirrors:  # half of a body, or a quarter
        if np.abs(points[:, axis] - position).min() < 1e-6 * extent[axis]:
            extent[axis] *= 2.0
    some = np.flatnonzero(scene.owner[scene.samples.facet] == body)
    return float(np.sort(extent)[1] * _per_length(scene, some))


def _per_length(scene: SurfaceScene, some: NDArray[np.int64]) -> float:
    """Cells per length [1/m] along the normals of some samples, their mean."""
    return float(np.average(1.0 / scene.samples.across[some], weights=scene.samples.area[some]))


def films_of(scene: SurfaceScene, body: int) -> dict[int, NDArray[np.int64]]:
    """Samples of a body in front of narrow gaps, by what is opposite: a body, or the number of bodies + a face."""
    some = np.flatnonzero((scene.owner[scene.samples.facet] == body) & is_narrow(scene, body))
    opposite = _opposite(scene, some)
    return {other: some[opposite == other] for other in np.unique(opposite).tolist()}


def _opposite(scene: SurfaceScene, some: NDArray[np.int64]) -> NDArray[np.int64]:
    """What is opposite of samples, as in `films_of`."""
    partner = scene.gaps.partner[some]
    of_bodies = scene.owner[scene.samples.facet[np.maximum(partner, 0)]]
    return np.where(partner < 0, len(scene.bodies) - 1 - partner, of_bodies)


def _gaps_of(scene: SurfaceScene, body: int, share: Array, caused: Mapping[int, float]) -> Iterator[GapCells]:
    """Gaps of a body, by what is opposite. Planes of symmetry double what films cover.

    share: of the force on the body, at each sample; caused: the same outside of the film, by what is opposite.
    """
    samples, gap, names = scene.samples, scene.gaps.cells, [*scene.bodies, *scene.faces]
    faced = np.flatnonzero((scene.owner[samples.facet] == body) & np.isfinite(gap))
    opposite = _opposite(scene, faced)
    for other, here in films_of(scene, body).items():
        facing = faced[opposite == other]
        weight, cells = share[here], np.maximum(gap[here], 1e-6)
        total, least = float(weight.sum()), float(cells.min())
        mean = float(np.exp((weight * np.log(cells)).sum() / total)) if total > 0.0 else least
        behind = scene.gaps.partner[here]
        film = np.unique(np.concatenate([here, behind[behind >= 0]]))
        ends = ends_at_edges(samples.index, samples.normal, film, scene.sharp[scene.owner[samples.facet]])
        copies = 2.0 ** _mirrors_at(scene, here)
        if ends:
            along = float((copies * samples.covers[here].sum()) ** (1.0 / (scene.corners.shape[2] - 1)))
        else:
            along = cells_along(gap[facing], copies * samples.covers[facing], samples.normal[facing])
        yield GapCells(scene.bodies[body], names[other], mean, least, along, ends, total + caused.get(other, 0.0))


def _mirrors_at(scene: SurfaceScene, some: NDArray[np.int64]) -> int:
    """Number of the planes of symmetry at which some samples end."""
    x, length = scene.samples.x[some], scene.samples.area[some] ** (1.0 / (scene.corners.shape[2] - 1))
    return sum(bool((np.abs(x[:, axis] - position) < length).any()) for axis, position in scene.mirrors)


def has_edges(corners: Array) -> bool:
    """Whether facets meet at an angle; corners: (facets, dim, dim), those that meet have equal corners."""
    normal, dim = unit_normals(corners), corners.shape[2]
    _, vertex = np.unique(corners.reshape(-1, dim), axis=0, return_inverse=True)
    vertex = vertex.reshape(corners.shape[:2])
    # what two facets share: in 2D a vertex, in space an edge
    pairs = [[0], [1]] if dim == 2 else [[0, 1], [1, 2], [0, 2]]
    sides = np.sort(np.concatenate([vertex[:, pair] for pair in pairs]), axis=1)
    _, side = np.unique(sides, axis=0, return_inverse=True)
    order = np.argsort(side.ravel(), kind="stable")
    facet = np.tile(np.arange(len(corners)), len(pairs))[order]
    meet = np.diff(side.ravel()[order]) == 0
    return bool((np.einsum("ni,ni->n", normal[facet[1:]], normal[facet[:-1]])[meet] < EDGE_OF_BODY).any())
