"""Mesh files: gmsh's own and UNV through gmsh, any other format through meshio, to one `Mesh` with named parts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import chdir, nullcontext, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.meshes.parts import beside
from fsci.meshes.scripts import GMSH, MESHES, SCRIPTS, RefusedScript, require_harmless
from fsci.meshes.serendipity import COMPLETE, complete
from fsci.meshes.surface import BadSurface, cones, split
from fsci.meshes.thickened import BadSheet, Sheet, thickened
from solvers.mesh.cell_types import CELL_TYPES, reference_nodes
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import boundary_facets, find_facets, signed_volumes

Indices = NDArray[np.int64]

#: Types of cells that a mesh may have.
CAD_ENDINGS = (".step", ".stp", ".iges", ".igs", ".brep")  #: endings of files of CAD without cells
MESHED = tuple(name for name, cell_type in CELL_TYPES.items() if cell_type.facet)


class MeshError(Exception):
    """A mesh that cannot be built; the message gives the user the reason."""

    def __init__(self, message: str, *keys: str | int):
        super().__init__(message)
        self.keys = keys  #: from the section of the mesh to the setting that is wrong


def unknown(kind: str, name: str, names: Iterable[str]) -> MeshError:
    """The error of a name that is not among the names there are."""
    there = sorted(names)
    close = get_close_matches(name, there, n=1)
    hint = f"; did you mean '{close[0]}'?" if close else ""
    return MeshError(f"unknown {kind} '{name}'{hint} (available: {', '.join(there) or 'none'})")


@dataclass(frozen=True)
class Block:
    """Cells of one type in a file, of any dimension."""

    cell_type: str
    dim: int
    nodes: Indices  #: shape (cells, nodes per cell)

    @property
    def first_order(self) -> str:
        """Type of the cell of the corners; none of an unknown type."""
        known = CELL_TYPES.get(self.cell_type)
        return "" if known is None else known.first_order


@dataclass(frozen=True)
class Content:
    """The content of a mesh file, before the cells of the highest dimension are extracted."""

    points: NDArray[np.float64]
    blocks: list[Block]
    groups: list[tuple[str, int, Indices]]  #: name, block, cells of this block
    point_sets: dict[str, Indices] = field(default_factory=dict)  #: name -> nodes


def read_mesh(
    path: Path,
    order: int | None = None,
    parameters: Mapping[str, float] | None = None,
    size_factor: float = 1.0,
    *,
    rigid: bool = False,
    sheet: Sheet | None = None,
) -> Mesh:
    """The mesh of a file; `order` (1 or 2), `parameters` (for DefineConstant) and `size_factor` are for .geo scripts.

    rigid: a closed surface is enough; sheet: the file is a surface, which becomes a body of layers.

    Raises MeshError: file missing or unreadable, unknown parameter, several cell types or a foreign one, a script that
    would do more than make a mesh.
    """
    if not path.is_file():
        raise MeshError(f"{path} is not a file" if path.exists() else f"there is no mesh file {path}")
    if path.suffix in GMSH:
        try:
            require_harmless(path)
        except RefusedScript as refused:
            raise MeshError(str(refused)) from None
    if path.suffix in SCRIPTS:
        content = _read_gmsh(path, order, parameters or {}, size_factor)
    elif parameters:
        raise MeshError(f"parameters are for .geo files, {path.name} has none")
    elif size_factor != 1.0:
        raise MeshError(f"'size_factor' is for .geo files, the cells of {path.name} have their sizes")
    elif path.suffix in MESHES:
        content = _read_gmsh(path, None, {})
    else:
        content = _read_meshio(path)
    try:
        if sheet is not None:
            return _layered(content, sheet)
        if rigid and _in_space(content):
            return _enclosed(content)
        return _mesh(content, scripted=path.suffix in SCRIPTS)
    except (MeshError, BadSurface, BadSheet) as error:
        raise MeshError(f"{path.name}: {error}") from None


def _mesh(content: Content, *, scripted: bool) -> Mesh:
    content, note = _completed(content)
    dim = max((block.dim for block in content.blocks), default=0)
    if dim < 2:
        raise MeshError("the file has no cells of two or three dimensions")
    types = sorted({block.cell_type for block in content.blocks if block.dim == dim})
    if len(types) > 1 or types[0] not in MESHED:
        allowed = ", ".join(MESHED)
        raise MeshError(f"the cells are {' and '.join(types)}; all must be of one type, one of {allowed}")
    cell_type = types[0]

    cells = np.concatenate([block.nodes for block in content.blocks if block.dim == dim])
    given = len(cells)
    cells, place, kept = _once(cells)
    used, nodes = np.unique(cells, return_inverse=True)
    _require_positions(content.points, used)
    mesh = Mesh(_positions(content.points[used], dim), nodes.reshape(cells.shape), cell_type)
    cells, turned = _positive(mesh)
    mesh = replace(mesh, cells=cells, numbers=kept + 1 if len(kept) < given else None)

    index = np.full(len(content.points), -1)
    index[used] = np.arange(len(used))
    return replace(
        mesh,
        regions=_regions(content, dim, place),
        surfaces=_surfaces(content, mesh, index),
        lines=_lines(content, index) if dim == 3 else {},
        nodes=_nodes(content, index),
        note="; ".join(filter(None, (note, "" if scripted else turned))),
    )


def _in_space(content: Content) -> bool:
    """Whether the cells are a surface in space."""
    faces = [block.nodes for block in content.blocks if block.dim == 2]
    if not faces or any(block.dim == 3 for block in content.blocks):
        return False
    points = content.points[np.unique(np.concatenate([nodes.ravel() for nodes in faces]))]
    return points.shape[1] > 2 and not _is_plane(points)


def _enclosed(content: Content) -> Mesh:
    """The body in a closed surface of triangles and quadrilaterals, with its groups as surfaces."""
    points = np.asarray(content.points[:, :3], dtype=float)  # behind them there may be colours
    triangles: list[Indices] = []
    numbers: list[Indices] = []
    starts, count = {}, 0
    for number, block in enumerate(content.blocks):
        if block.dim != 2:
            continue
        if block.cell_type not in ("triangle", "quad"):
            raise MeshError(f"the facets are {block.cell_type}; those of a surface are triangle and quad")
        _require_positions(points, np.unique(block.nodes))
        nodes = block.nodes if block.cell_type == "triangle" else split(points, block.nodes)
        each = len(nodes) // len(block.nodes)
        starts[number] = len(np.concatenate(triangles)) if triangles else 0, each
        numbers.append(count + 1 + np.repeat(np.arange(len(block.nodes)), each))
        triangles.append(nodes)
        count += len(block.nodes)
    surfaces: dict[str, Indices] = {}
    for name, number, cells in content.groups:
        if number in starts:
            start, each = starts[number]
            those = start + (each * cells[:, None] + np.arange(each)).ravel()
            surfaces[name] = np.union1d(surfaces.get(name, those), those)
    return cones(points, np.concatenate(triangles), np.concatenate(numbers), surfaces)


def _layered(content: Content, sheet: Sheet) -> Mesh:
    """The body of layers around the surface of a file, or in the plane around its lines."""
    dim = max((block.dim for block in content.blocks), default=0)
    faces = [(k, block) for k, block in enumerate(content.blocks) if block.dim == dim]
    first_order = {block.first_order for _, block in faces}
    if dim not in (1, 2) or not first_order <= ({"line"} if dim == 1 else {"triangle", "quad"}):
        there = " and ".join(sorted({block.cell_type for _, block in faces})) or "none"
        raise MeshError(
            f"'thickness' takes a surface of triangles or quadrilaterals, or lines in 2D; its cells: {there}"
        )
    points = np.asarray(content.points[:, :3], dtype=float)
    if dim == 1 and not _is_plane(points):
        raise MeshError("'thickness' takes lines in the plane z = 0; these are lines in space")
    points = points[:, : dim + 1]
    if points.shape[1] <= dim:
        points = np.column_stack([points, np.zeros(len(points))])
    corners = [block.nodes[:, : CELL_TYPES[block.first_order].corners] for _, block in faces]
    _require_positions(points, np.unique(np.concatenate([nodes.ravel() for nodes in corners])))
    if len({nodes.shape[1] for nodes in corners}) > 1:
        corners = [split(points, nodes) if nodes.shape[1] == 4 else nodes for nodes in corners]
    rims: dict[str, Indices] = {}
    for name, number, cells in content.groups:
        block = content.blocks[number]
        if block.dim == dim - 1:
            nodes = block.nodes[cells, :dim]
            rims[name] = np.concatenate([rims[name], nodes]) if name in rims else nodes
    facets, _, _ = _once(np.concatenate(corners))
    return thickened(points, facets, sheet, rims)


def _completed(content: Content) -> tuple[Content, str]:
    """Convert cells of 8 and 20 nodes to those of 9 and 27, with a note to the user."""
    types = sorted({(-block.dim, block.cell_type) for block in content.blocks if block.cell_type in COMPLETE})
    if not types:
        return content, ""
    points, done = complete(content.points, [(block.cell_type, block.nodes) for block in content.blocks])
    blocks = [replace(b, cell_type=name, nodes=nodes) for b, (name, nodes) in zip(content.blocks, done, strict=True)]
    note = f"its {types[0][1]} cells became {COMPLETE[types[0][1]]}: nodes were added in the middle of cells and faces"
    return replace(content, points=points, blocks=blocks), note


def _once(cells: Indices) -> tuple[Indices, Indices, Indices]:
    """(distinct cells, index of each given cell among them, the given ones that are kept).

    Some formats repeat a cell for each of its groups.
    """
    _, first, same = np.unique(np.sort(cells, axis=1), axis=0, return_index=True, return_inverse=True)
    kept = np.sort(first)
    return cells[kept], np.searchsorted(kept, first[same]), kept


def _require_positions(points: NDArray[np.float64], used: Indices) -> None:
    """Nodes of cells are somewhere."""
    wrong = used[~np.isfinite(points[used]).all(axis=1)]
    if len(wrong):
        others = f" (and of {len(wrong) - 1:,} more)" if len(wrong) > 1 else ""
        place = ", ".join(f"{x:g}" for x in points[wrong[0]])
        raise MeshError(f"the position of node {wrong[0] + 1}{others} is not finite: ({place}); correct the file")


def _positions(points: NDArray[np.float64], dim: int) -> NDArray[np.float64]:
    """A mesh of plane cells keeps x and y only."""
    if dim == 2 and not _is_plane(points):
        raise MeshError(
            "the cells are a surface in space; an elastic body needs cells of its volume, or the same z everywhere; "
            "of a rigid body or an obstacle a closed surface is enough"
        )
    return np.ascontiguousarray(points[:, :dim], dtype=float)


def _is_plane(points: NDArray[np.float64]) -> bool:
    """Whether points have the same z."""
    across = points[:, 2:]
    return not across.size or bool(np.ptp(across, axis=0).max() <= 1e-9 * np.ptp(points, axis=0).max())


def _positive(mesh: Mesh) -> tuple[Indices, str]:
    """The cells, those of negative volume turned inside out, with a note to the user: files number them either way."""
    volumes = signed_volumes(mesh)
    if (volumes == 0).any():
        raise MeshError(f"cells without volume: {np.count_nonzero(volumes == 0)}")
    inside_out = volumes < 0.0
    if not inside_out.any():
        return mesh.cells, ""
    count = "its cells" if inside_out.all() else f"{np.count_nonzero(inside_out):,} of its {len(inside_out):,} cells"
    order = "clockwise" if mesh.points.shape[1] == 2 else "inside out"
    cells = np.where(inside_out[:, None], mesh.cells[:, CELL_TYPES[mesh.cell_type].mirror], mesh.cells)
    return cells, f"{count} are numbered {order}: they were turned round"


def _regions(content: Content, dim: int, place: Indices) -> dict[str, Indices]:
    """Groups of cells; place: index in the mesh of each cell of the file."""
    sizes = [len(block.nodes) if block.dim == dim else 0 for block in content.blocks]
    start = np.cumsum([0, *sizes])
    parts: dict[str, list[Indices]] = {}
    for name, block, cells in content.groups:
        if content.blocks[block].dim == dim and len(cells):
            parts.setdefault(name, []).append(place[start[block] + cells])
    return {name: np.unique(np.concatenate(cells)) for name, cells in parts.items()}


def _surfaces(content: Content, mesh: Mesh, index: Indices) -> dict[str, Indices]:
    """Groups of facets, and sets of points that cover facets; `index` takes the file's nodes to the mesh's."""
    facet_type = CELL_TYPES[mesh.cell_type].facet
    count = CELL_TYPES[facet_type].corners
    parts: dict[str, list[Indices]] = {}
    for name, block, cells in content.groups:
        if content.blocks[block].first_order == CELL_TYPES[facet_type].first_order:
            parts.setdefault(name, []).append(index[content.blocks[block].nodes[cells, :count]])
    surfaces = {}
    for name, corners in parts.items():
        # overlapping groups of one name must not count a facet twice
        surfaces[name] = np.unique(find_facets(mesh, np.concatenate(corners))[:, :count], axis=0)
    if content.point_sets:
        boundary = boundary_facets(mesh)[:, :count]
        for name, nodes in content.point_sets.items():
            inside = np.isin(boundary, index[nodes]).all(axis=1)
            surfaces.setdefault(name, boundary[inside])
    return {name: facets for name, facets in surfaces.items() if len(facets)}


def _lines(content: Content, index: Indices) -> dict[str, Indices]:
    """Groups of lines, those that lie in the mesh; `index` takes the file's nodes to the mesh's."""
    parts: dict[str, list[Indices]] = {}
    for name, block, cells in content.groups:
        if content.blocks[block].first_order == "line":
            parts.setdefault(name, []).append(index[content.blocks[block].nodes[cells]])
    lines = {name: np.unique(np.concatenate(nodes), axis=0) for name, nodes in parts.items()}
    inside = {name: nodes[(nodes >= 0).all(axis=1)] for name, nodes in lines.items()}
    return {name: nodes for name, nodes in inside.items() if len(nodes)}


def _nodes(content: Content, index: Indices) -> dict[str, Indices]:
    """Groups of points and sets of them, those that are nodes of the mesh; `index` as above."""
    parts = {name: [nodes] for name, nodes in content.point_sets.items()}
    for name, block, cells in content.groups:
        if content.blocks[block].cell_type == "vertex":
            parts.setdefault(name, []).append(content.blocks[block].nodes[cells, 0])
    found = {name: np.unique(index[np.concatenate(nodes)]) for name, nodes in parts.items()}
    inside = {name: nodes[nodes >= 0] for name, nodes in found.items()}
    return {name: nodes for name, nodes in inside.items() if len(nodes)}


def _read_gmsh(path: Path, order: int | None, parameters: Mapping[str, float], size_factor: float = 1.0) -> Content:
    import gmsh

    # interruptible would take the signal handlers that end a run cleanly
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        if parameters:
            _set_parameters(path, parameters)
        _merge(path)
        if path.suffix not in MESHES:
            _check_parameters(path, parameters)
            if order is not None:
                gmsh.option.setNumber("Mesh.ElementOrder", order)
                gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 0)
            if size_factor != 1.0:
                own = gmsh.option.getNumber("Mesh.MeshSizeFactor")
                gmsh.option.setNumber("Mesh.MeshSizeFactor", size_factor * own)
                gmsh.option.setNumber("Mesh.FlexibleTransfinite", 1)  # so that it counts for transfinite curves, too
            gmsh.model.mesh.generate(gmsh.model.getDimension())
        return _gmsh_content()
    except MeshError:
        raise
    except Exception as error:  # gmsh raises nothing more special
        raise MeshError(f"{path.name}: gmsh says: {error}") from None
    finally:
        gmsh.finalize()


def _merge(path: Path) -> None:
    """Load a file into the current model: unlike open, this keeps parameters that are set already."""
    import gmsh

    # an exception in the middle of a script would leave gmsh's parser there, to trip over the next file
    gmsh.option.setNumber("General.AbortOnError", 0)
    gmsh.logger.start()
    try:
        gmsh.merge(str(path))
        errors = [line.removeprefix("Error: ") for line in gmsh.logger.get() if line.startswith("Error")]
    finally:
        gmsh.logger.stop()
        gmsh.option.setNumber("General.AbortOnError", 2)
    if errors:
        raise MeshError(f"{path.name}: gmsh says: {errors[0]}")


def _set_parameters(path: Path, parameters: Mapping[str, float]) -> None:
    import gmsh

    _merge(path)
    names = sorted(gmsh.parser.getNames())
    gmsh.clear()
    for name, value in parameters.items():
        if name not in names:
            raise unknown(f"parameter of {path.name}", name, names)
        gmsh.parser.setNumber(name, [value])


def _check_parameters(path: Path, parameters: Mapping[str, float]) -> None:
    import gmsh

    for name, value in parameters.items():
        if list(gmsh.parser.getNumber(name)) != [value]:
            raise MeshError(f"{path.name} sets '{name}' itself; DefineConstant[ {name} = ... ]; makes it a parameter")


def _gmsh_content() -> Content:
    """The current model of gmsh: its physical groups, or all cells of the highest dimension if it has none."""
    import gmsh

    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    number = np.zeros(int(tags.max(initial=0)) + 1, dtype=np.int64)
    number[tags] = np.arange(len(tags))

    names: dict[tuple[int, int], list[str]] = {}
    for dim, tag in gmsh.model.getPhysicalGroups():
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag):
            names.setdefault((dim, entity), []).append(gmsh.model.getPhysicalName(dim, tag))
    top = gmsh.model.getDimension()
    if not any(dim == top for dim, _ in names):
        names |= {entity: [] for entity in gmsh.model.getEntities(top)}

    blocks: list[Block] = []
    groups: list[tuple[str, int, Indices]] = []
    for (dim, entity), entity_names in names.items():
        for kind, elements, nodes in zip(*gmsh.model.mesh.getElements(dim, entity), strict=True):
            cell_type, order = _gmsh_type(kind)
            groups += [(name, len(blocks), np.arange(len(elements))) for name in entity_names if name]
            blocks.append(Block(cell_type, dim, number[nodes.reshape(len(elements), -1)[:, order]]))
    return Content(coordinates.reshape(-1, 3), blocks, groups)


def _gmsh_type(kind: int) -> tuple[str, Indices]:
    """Name of one of gmsh's element types (gmsh's own if unknown here), and its nodes in VTK's order."""
    import gmsh

    names = {1: "line", 2: "triangle", 3: "quad", 4: "tetra", 5: "hexahedron"}
    names |= {8: "line3", 9: "triangle6", 10: "quad9", 11: "tetra10", 12: "hexahedron27"}
    names |= {16: "quad8", 17: "hexahedron20"}
    name, dim, _, count, positions, _ = gmsh.model.mesh.getElementProperties(kind)
    if name == "Point":
        return "vertex", np.arange(count)
    if kind not in names:
        return name, np.arange(count)
    ours = reference_nodes(COMPLETE.get(names[kind], names[kind]))[:count]
    theirs = positions.reshape(count, dim)
    if not name.startswith(("Triangle", "Tetrahedron")):
        theirs = (theirs + 1) / 2  # from -1 to 1, as gmsh has lines, quadrilaterals and hexahedra
    return names[kind], np.abs(ours[:, None] - theirs).sum(axis=2).argmin(axis=1)


def _read_meshio(path: Path) -> Content:
    import meshio

    if path.suffix.lower() in CAD_ENDINGS:
        script = f'SetFactory("OpenCASCADE"); Merge "{path.name}"; MeshSize {{:}} = 0.1;'
        raise MeshError(f"{path.name}: this is a geometry without a mesh; name a file .geo with the lines {script}")
    printed = StringIO()
    path = path.absolute()
    try:
        with redirect_stdout(printed), redirect_stderr(printed), chdir(path.parent) if beside(path) else nullcontext():
            mesh = meshio.read(path)
    except (Exception, SystemExit) as error:  # meshio prints and exits when no reader takes the file
        reason = printed.getvalue().strip() or str(error) or type(error).__name__
        raise MeshError(f"{path.name}: meshio says: {' '.join(reason.split())}") from None
    blocks = [Block(block.type, block.dim, np.asarray(block.data, dtype=np.int64)) for block in mesh.cells]
    if any(block.nodes.min(initial=0) < 0 or block.nodes.max(initial=-1) >= len(mesh.points) for block in blocks):
        raise MeshError(f"{path.name}: cells name nodes that are not there, or count them from the end; write it anew")
    point_sets = {name: np.asarray(nodes, dtype=np.int64) for name, nodes in mesh.point_sets.items()}
    return Content(np.asarray(mesh.points), blocks, list(_meshio_groups(mesh)), point_sets)


def _meshio_groups(mesh: Any) -> Iterator[tuple[str, int, Indices]]:
    """Cell sets, numbers of cells that have names (gmsh's groups, Netgen's indices), and families (MED)."""
    for name, parts in mesh.cell_sets.items():
        for block, cells in enumerate(parts):
            if cells is not None:
                yield name, block, np.asarray(cells, dtype=np.int64)
    for key in mesh.cell_data.keys() & {"gmsh:physical", "netgen:index"}:
        for name, (tag, dim) in mesh.field_data.items():
            for block, data in enumerate(mesh.cell_data[key]):
                if mesh.cells[block].dim == dim:
                    yield name, block, np.flatnonzero(data == tag)
    for tag, names in getattr(mesh, "cell_tags", {}).items():
        for block, data in enumerate(mesh.cell_data["cell_tags"]):
            for name in names:
                yield name, block, np.flatnonzero(data == tag)
