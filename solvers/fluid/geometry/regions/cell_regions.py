"""Connected regions of the fluid in the cells that a surface cuts, in 3D: a thin body divides the fluid of a cell.

A region is bounded by polygons of surface and by regions on the cell's faces: it is a connected component of their
graph, found by names of edges and planes alone, without distances. A closed surface within a cell is a hole in another
region (docs/theory_fluid.md, Parts in 3D).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from solvers.api import Array, Indices
from solvers.fluid.geometry.regions.face_regions import (
    HOLE,
    FaceRegions,
    contains,
    edges_of,
    face_regions,
    facet_edges,
    in_cells,
    outline,
)
from solvers.fluid.geometry.regions.region_integrals import integral_from_0, over_faces, over_surfaces
from solvers.fluid.geometry.regions.sliced_facets import IN_PLANE, SlicedFacets, ragged, sliced_facets
from solvers.fluid.geometry.regions.wet_edges import EdgeLattice, WetEdges, corners_of, wet_edges
from solvers.fluid.grid.box import Grid


@dataclass(frozen=True)
class CellRegions:
    """Regions of fluid in the cells with surface, sorted by cell."""

    lattice: EdgeLattice
    polygons: SlicedFacets
    faces: FaceRegions
    edges: WetEdges
    cell: Indices  #: of each region
    share: Array  #: its volume, relative to the cell
    of_polygon: Indices  #: region of each polygon
    of_face: Indices  #: region below and above each region on a face, -1: none, shape (regions on faces, 2)
    doubtful: Indices  #: cells whose regions could not be found

    @cached_property
    def corners(self) -> Array:
        """Corners of the polygons in reference coordinates of their cells."""
        return in_cells(self.lattice, self.polygons.cell, self.polygons.corners)

    @cached_property
    def cells_beside(self) -> Indices:
        """Cells below and above each region on a face, -1: outside of the box, shape (regions on faces, 2)."""
        return cells_beside(self.lattice, self.faces.faces[self.faces.face])

    @cached_property
    def _polygons(self) -> tuple[Indices, Indices]:
        return _grouped(self.of_polygon, len(self.cell))

    @cached_property
    def _faces(self) -> tuple[Indices, Indices]:
        return _grouped(self.of_face.ravel(), len(self.cell))

    def facets_of(self, region: int) -> frozenset[int]:
        """Facets that bound a region."""
        order, ends = self._polygons
        return frozenset(self.polygons.facet[order[ends[region] : ends[region + 1]]].tolist())

    def triangles_of(self, region: int) -> Array:
        """The surface of a region in reference coordinates, normals into the fluid, shape (triangles, 3, 3)."""
        order, ends = self._polygons
        return self._triangles(order[ends[region] : ends[region + 1]])[0]

    def _triangles(self, polygons: Indices) -> tuple[Array, Indices]:
        """(triangles of polygons, as above, the polygon of each)."""
        of, step = ragged(self.polygons.count[polygons] - 2)
        at = polygons[of]
        corners = self.corners[at, 0 * step], self.corners[at, step + 1], self.corners[at, step + 2]
        return np.stack(corners, axis=1), at

    def integrals(self, points: Array) -> tuple[Array, Array]:
        """Integrals of the Lagrange basis on some points over the regions, and over the regions on faces.

        int L_q on the tensor points, the first direction fastest, shape (regions, points^3), as
        int l_a(x) l_b(y) l_c(z) = int over the surface of (int_0^x l_a) l_b l_c n_x; int l_a l_b relative to the face,
        a: in the axis after its own, b: in the next, shape (regions on faces, points, points).
        """
        key = points.tobytes()
        if key not in self._integrals:
            faces, count = self.faces, len(self.cell)
            far = faces.of_interval[faces.of_interval[:, 2] == 3]
            chords = faces.of_chord >= 0
            on_faces = over_faces(
                points,
                faces.chords.ends[chords],
                faces.of_chord[chords],
                self.edges.ends[far[:, 3]],
                far[:, 0],
                len(faces.face),
            )
            triangles, polygon = self._triangles(np.flatnonzero(self.of_polygon >= 0))
            total = -over_surfaces(points, triangles, self.of_polygon[polygon], count)
            right = (faces.faces[faces.face] // self.lattice.corners == 0) & (self.of_face[:, 0] >= 0)
            whole = integral_from_0(points, np.ones(1))[0]
            np.add.at(total, self.of_face[right, 0], np.swapaxes(on_faces[right], 1, 2)[..., None] * whole)
            self._integrals[key] = total.reshape(count, -1), on_faces
        return self._integrals[key]

    @cached_property
    def _integrals(self) -> dict[bytes, tuple[Array, Array]]:
        return {}

    def faces_of(self, region: int) -> list[tuple[int, int, int]]:
        """(axis, side, region on this face) for the faces of a region."""
        order, ends = self._faces
        found = []
        for entry in order[ends[region] : ends[region + 1]].tolist():
            number, above = divmod(entry, 2)
            face = self.faces.faces[self.faces.face[number]]
            found.append((int(face) // self.lattice.corners, 1 - above, number))
        return found


def cell_regions(
    grid: Grid,
    facets: Indices,
    x: Array,
    fraction: Array,
    polygons: SlicedFacets | None = None,
    known: tuple[Indices, Indices] | None = None,
) -> CellRegions:
    """Regions of the fluid around facets (m, 3) with vertices at x [m]; fraction: of solid in each cell of the box.

    polygons: `sliced_facets` of these, if they are known; known: of `wet_edges`.
    """
    lattice, polygons = EdgeLattice(grid), polygons or sliced_facets(grid, facets, x)
    cells = np.unique(polygons.cell)
    faces = np.unique([lattice.face(cells, axis, side) for axis in range(3) for side in (0, 1)])
    numbers = np.unique(edges_of(lattice, faces))
    edges = wet_edges(lattice, polygons, len(facets), numbers, fraction, known)
    on_faces = face_regions(lattice, polygons, x, facets, faces, edges)
    count, size = len(polygons.cell), len(on_faces.face)
    chords = on_faces.chords
    links = [
        np.stack([side, count + 2 * on_faces.of_chord + above], axis=1)[side >= 0]
        for above, side in enumerate((chords.below, chords.above))
    ]
    links.append(_at_wet_edges(lattice, cells, edges, on_faces) + count)
    polygon, _, _, kind = corners_of(polygons)
    polygon, kind = polygon[kind < IN_PLANE], kind[kind < IN_PLANE]
    key = polygons.cell[polygon] * facets.size + facet_edges(facets, len(x))[polygons.facet[polygon], kind]
    names, key = np.unique(key, return_inverse=True)
    links.append(np.stack([polygon, count + 2 * size + key], axis=1))
    ends = np.concatenate(links).T
    total = count + 2 * size + len(names)
    graph = sparse.coo_matrix((np.ones(ends.shape[1]), tuple(ends)), shape=(total, total))
    group = connected_components(graph, directed=False)[1][: count + 2 * size]
    axis = faces[on_faces.face] // lattice.corners
    beside = cells_beside(lattice, faces[on_faces.face])
    used = np.zeros(size, dtype=bool)
    used[on_faces.of_chord], used[on_faces.of_interval[:, 0]] = True, True
    cell_of = np.concatenate([polygons.cell, np.where(used[:, None] & np.isin(beside, cells), beside, -1).ravel()])
    group = np.where(cell_of < 0, -1, group)
    names, first, inverse = np.unique(group, return_index=True, return_inverse=True)
    shift = int(len(names) > 0 and names[0] < 0)
    order = np.lexsort((names[shift:], cell_of[first[shift:]]))
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    number = np.where(group < 0, -1, rank[np.maximum(inverse - shift, 0)])
    of_polygon, of_face = number[:count], number[count:].reshape(-1, 2)
    cell = cell_of[first[shift:]][order]
    share = _volumes(in_cells(lattice, polygons.cell, polygons.corners), polygons.count, of_polygon, len(cell))
    right = (axis == 0) & (of_face[:, 0] >= 0)
    np.add.at(share, of_face[right, 0], on_faces.area[right])
    doubtful = _doubtful(lattice, cells, edges, on_faces)
    found = CellRegions(lattice, polygons, on_faces, edges, cell, share, of_polygon, of_face, doubtful)
    return _with_holes(found)


def _grouped(owner: Indices, size: int) -> tuple[Indices, Indices]:
    """(entries sorted by owner, where those of each owner begin and end), without entries of negative owners."""
    order = np.argsort(owner, kind="stable")
    order = order[owner[order] >= 0]
    return order, np.searchsorted(owner[order], np.arange(size + 1))


def cells_beside(lattice: EdgeLattice, faces: Indices) -> Indices:
    """Cells below and above faces, -1: outside of the box, shape (faces, 2)."""
    shape = np.array(lattice.grid.shape)
    axis, corner = np.divmod(faces, lattice.corners)
    index = np.stack(np.unravel_index(corner, shape + 1, order="F"), axis=1)
    found = np.full((len(faces), 2), -1)
    for above in (0, 1):
        at = index.copy()
        at[np.arange(len(faces)), axis] += above - 1
        inside = ((at >= 0) & (at < shape)).all(axis=1)
        found[inside, above] = at[inside] @ np.cumprod([1, *shape[:-1]])
    return found


def _edges_of_cells(lattice: EdgeLattice, cells: Indices):
    """For the 12 edges of cells: (their numbers, and for both faces at them: number, side of the face, above it)."""
    corner, steps = lattice.corner(cells), lattice.strides
    for axis in range(3):
        p, q = (axis + 1) % 3, (axis + 2) % 3
        for side_p, side_q in np.ndindex(2, 2):
            number = axis * lattice.corners + corner + side_p * steps[p] + side_q * steps[q]
            one = (lattice.face(cells, p, side_p), 2 + side_q, 1 - side_p)
            two = (lattice.face(cells, q, side_q), side_p, 1 - side_q)
            yield number, one, two


def _at_wet_edges(lattice: EdgeLattice, cells: Indices, edges: WetEdges, on_faces: FaceRegions) -> Indices:
    """Pairs (2 region + above it) of regions on two faces of a cell that meet at a wet interval of its edge."""
    region, face, side, interval = on_faces.of_interval.T
    width = len(edges.wet)
    keys = (4 * face + side) * width + interval
    by_key = np.argsort(keys)
    keys, region = keys[by_key], region[by_key]
    found = [np.zeros((0, 2), dtype=np.int64)]
    for number, *sides in _edges_of_cells(lattice, cells):
        row = np.searchsorted(edges.edges, number)
        of, place = ragged(edges.count[row])
        at = edges.first[row][of] + place
        of, at = of[edges.wet[at]], at[edges.wet[at]]
        pair = []
        for face_number, its_side, above in sides:
            on = np.searchsorted(on_faces.faces, face_number)[of]
            pair.append(2 * region[np.searchsorted(keys, (4 * on + its_side) * width + at)] + above)
        found.append(np.stack(pair, axis=1))
    return np.concatenate(found)


def _doubtful(lattice: EdgeLattice, cells: Indices, edges: WetEdges, on_faces: FaceRegions) -> Indices:
    """Cells with a doubtful edge or face."""
    found = np.zeros(len(cells), dtype=bool)
    for number, one, two in _edges_of_cells(lattice, cells):
        found |= edges.doubtful[np.searchsorted(edges.edges, number)]
        for face_number, _, _ in (one, two):
            found |= on_faces.doubtful[np.searchsorted(on_faces.faces, face_number)]
    return cells[found]


def _volumes(corners: Array, count: Indices, of: Indices, size: int) -> Array:
    """int x n_x dA over the surface of each region, n out of the fluid, in reference coordinates."""
    polygon, step = ragged(count - 2)
    a, b, c = corners[polygon, 0], corners[polygon, step + 1], corners[polygon, step + 2]
    p, q = b - a, c - a
    projected = 0.5 * (p[:, 1] * q[:, 2] - p[:, 2] * q[:, 1])
    volume = np.zeros(size)
    np.add.at(volume, of[polygon], -projected * (a[:, 0] + b[:, 0] + c[:, 0]) / 3.0)
    return volume


def _with_holes(regions: CellRegions) -> CellRegions:
    """Closed surfaces around a solid within a cell become part of the smallest region around them."""
    holes = np.flatnonzero(regions.share < HOLE)
    if not len(holes):
        return regions
    into, doubtful = np.arange(len(regions.cell)), set(regions.doubtful.tolist())
    for hole in holes.tolist():
        mine = np.flatnonzero(regions.of_polygon == hole)
        others = np.flatnonzero((regions.cell == regions.cell[hole]) & (regions.share >= HOLE)).tolist()
        point = regions.corners[mine[0], 0] if len(mine) else None
        around = [r for r in others if point is not None and SpaceRegion(regions, r).contains(point)]
        if around:
            into[hole] = min(around, key=lambda r: regions.share[r])
        else:
            doubtful.add(int(regions.cell[hole]))
    share, kept = np.bincount(into, regions.share, len(into)), into == np.arange(len(into))
    number = np.append((np.cumsum(kept) - 1)[into], -1)
    return CellRegions(
        regions.lattice,
        regions.polygons,
        regions.faces,
        regions.edges,
        regions.cell[kept],
        share[kept],
        number[regions.of_polygon],
        number[regions.of_face],
        np.array(sorted(doubtful), dtype=np.int64),
    )


@dataclass(frozen=True)
class SpaceRegion:
    """One region: its volume, and integrals over it by Gauss' theorem."""

    regions: CellRegions
    number: int

    def integrals(self, points: Array) -> Array:
        """int L_q of the Lagrange basis on the tensor points, the first direction fastest, shape (points^3,)."""
        return np.asarray(self.regions.integrals(points)[0][self.number])

    def on_face(self, axis: int, side: int, points: Array) -> Array:
        """int l_a l_b over its part of a face, relative to the face; a: in the axis after its own, b: in the next."""
        on_faces = self.regions.integrals(points)[1]
        numbers = [face[2] for face in self.regions.faces_of(self.number) if face[:2] == (axis, side)]
        return np.asarray(on_faces[numbers].sum(axis=0))

    def contains(self, x: Array) -> bool:
        """Whether a point of the cell is in it: a ray from the point along the first axis leaves it once more."""
        triangles = self.regions.triangles_of(self.number)
        a, p, q = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
        twice, way = p[:, 1] * q[:, 2] - p[:, 2] * q[:, 1], x - a
        with np.errstate(divide="ignore", invalid="ignore"):
            s = (way[:, 1] * q[:, 2] - way[:, 2] * q[:, 1]) / twice
            t = (p[:, 1] * way[:, 2] - p[:, 2] * way[:, 1]) / twice
            crossed = (s >= 0.0) & (t >= 0.0) & (s + t < 1.0) & (a[:, 0] + s * p[:, 0] + t * q[:, 0] > x[0])
        count = int(crossed.sum())
        for axis, side, number in self.regions.faces_of(self.number):
            if (axis, side) == (0, 1):
                count += contains(*outline(self.regions.faces, self.regions.edges, number), x[1:])
        return count % 2 == 1
