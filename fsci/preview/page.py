"""The page of a preview: the scene turns under the mouse; it needs no other file, server or graphics card."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from fsci.preview.layout import FILLED, arrow_ends, closest, extent, loops_of, name_place, opacity
from fsci.preview.legend import MARK_COLOURS, NEAR, OTHER_PATCH, PATCHES, colours_of, words_of
from fsci.preview.parts import NamedSurface, Preview
from fsci.running.files import write_text
from solvers.api import Array

PAGE_DIGITS = 6  #: of coordinates
PATCH_OPACITY = 0.08  #: of faces of the box

PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>TITLE</title><style>
body { margin: 0; font: 14px sans-serif; display: flex; height: 100vh; }
canvas { flex: 1; min-width: 0; cursor: grab; }
aside { width: 24em; overflow: auto; padding: 1em; border-left: 1px solid #ccc; }
h1 { font-size: 1.2em; margin-top: 0; } label { display: block; margin: 0.3em 0; }
i { display: inline-block; width: 1em; height: 1em; margin: 0 0.4em; vertical-align: -0.15em; }
</style></head><body><canvas></canvas><aside><h1>TITLE</h1><div></div>
<p>Drag turns, with Shift it moves, the wheel brings nearer.</p></aside><script>
const scene = SCENE;
const canvas = document.querySelector("canvas"), pen = canvas.getContext("2d");
let [turn, tilt, zoom, shift] = [scene.flat ? 0 : -0.6, scene.flat ? 0 : -1.1, 1, [0, 0]];
const ranges = [0, 1, 2].map(k => scene.parts.flatMap(p => p.points.map(x => x[k])).reduce(
  ([a, b], x) => [Math.min(a, x), Math.max(b, x)], [Infinity, -Infinity]));
const centre = ranges.map(([a, b]) => (a + b) / 2), size = Math.hypot(...ranges.map(([a, b]) => b - a)) || 1;

function view(point) {  // turned about z, then tilted: to the right, upwards, towards the eye
  const [x, y, z] = point.map((c, k) => c - centre[k]), c = Math.cos(turn), s = Math.sin(turn);
  const [u, v] = [c * x - s * y, s * x + c * y], d = Math.cos(tilt), e = Math.sin(tilt);
  return [u, d * v - e * z, e * v + d * z];
}

function shade(colour, corners) {
  if (scene.flat || corners.length < 3) return colour;
  const [p, q, r] = corners, a = q.map((x, k) => x - p[k]), b = r.map((x, k) => x - p[k]);
  const n = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const light = 0.5 + 0.5 * Math.abs(n[2]) / (Math.hypot(...n) || 1);
  const part = k => Math.round(light * parseInt(colour.slice(k, k + 2), 16));
  return `rgb(${part(1)}, ${part(3)}, ${part(5)})`;
}

function draw() {
  const [width, height] = [canvas.width, canvas.height] = [canvas.clientWidth, canvas.clientHeight];
  const scale = 0.9 * zoom * Math.min(width, height) / size;
  const at = ([x, y]) => [width / 2 + shift[0] + scale * x, height / 2 + shift[1] - scale * y];
  const items = [];
  for (const part of scene.parts.filter(part => !part.hidden)) {
    const seen = part.points.map(view);
    for (const loops of part.faces) {
      const corners = loops[0].map(k => seen[k]);
      items.push({part, loops: loops.map(loop => loop.map(k => at(seen[k]))), fill: shade(part.colour, corners),
        depth: corners.reduce((sum, x) => sum + x[2], 0) / corners.length});
    }
    for (const line of part.lines) items.push({part, line: line.map(k => at(seen[k])), depth: part.top ? Infinity :
      line.reduce((sum, k) => sum + seen[k][2], 0) / line.length});
  }
  items.sort((a, b) => a.depth - b.depth);
  for (const {part, loops, line, fill} of items) {
    pen.globalAlpha = line ? 1 : part.opacity;
    pen.fillStyle = fill || part.colour;
    pen.strokeStyle = line ? part.colour : fill;
    pen.lineWidth = line ? part.width : 0.5;
    pen.beginPath();
    for (const loop of loops || [line]) loop.forEach((x, k) => k ? pen.lineTo(...x) : pen.moveTo(...x));
    if (loops) { pen.closePath(); pen.fill("evenodd"); }
    pen.stroke();
  }
  pen.globalAlpha = 1;
  pen.textAlign = "center";
  pen.font = "13px sans-serif";
  for (const part of scene.parts.filter(part => part.label && !part.hidden)) {
    const [x, y] = at(view(part.label)), wide = pen.measureText(part.name).width;
    pen.fillStyle = "rgba(255, 255, 255, 0.75)";
    pen.fillRect(x - wide / 2 - 3, y - 12, wide + 6, 17);
    pen.fillStyle = "black";
    pen.fillText(part.name, x, y);
  }
}

for (const part of scene.parts.filter(part => part.words)) {
  const [row, box, sample] = ["label", "input", "i"].map(name => document.createElement(name));
  Object.assign(box, {type: "checkbox", checked: true, onchange: () => { part.hidden = !box.checked; draw(); }});
  sample.style.background = part.colour;
  row.append(box, sample, part.words);
  document.querySelector("aside div").append(row);
}
canvas.onpointerdown = event => canvas.setPointerCapture(event.pointerId);
canvas.onpointermove = event => {
  if (!event.buttons) return;
  if (event.shiftKey) shift = [shift[0] + event.movementX, shift[1] + event.movementY];
  else [turn, tilt] = [turn + 0.008 * event.movementX, tilt + 0.008 * event.movementY];
  draw();
};
canvas.onwheel = event => { event.preventDefault(); zoom *= Math.exp(-0.001 * event.deltaY); draw(); };
window.onresize = draw;
draw();
</script></body></html>
"""


def write_page(path: Path, scene: Preview, units: Mapping[str, str]) -> None:
    """Write the page as HTML."""
    parts = list(_parts(scene, units["length"]))
    flat = len(scene.bodies[0].corners[0, 0]) == 2 if scene.bodies else scene.box is not None and len(scene.box[0]) == 2
    data = json.dumps({"flat": flat, "parts": parts}, separators=(",", ":")).replace("<", "\\u003c")
    write_text(path, PAGE.replace("TITLE", escape(scene.title or "preview")).replace("SCENE", data))


def _parts(scene: Preview, unit: str) -> Iterator[dict[str, Any]]:
    """What is drawn, each with its line of the legend; the first ones are covered by later ones in the plane."""
    low, high = extent(scene)
    if scene.box is not None:
        yield _part("grid", "#d8d8d8", *_grid(scene), width=0.5, words="grid")
    for part in scene.patches:
        words = f"patch {part.name} ({part.kind})"
        yield _surface(part, PATCHES.get(part.kind, OTHER_PATCH), PATCH_OPACITY, words)
    for part, colour in zip(scene.bodies, colours_of(scene.bodies), strict=True):
        label = _in_space(name_place(part, low, high)[None])[0].tolist()
        yield {**_surface(part, colour, opacity(part, scene.bodies), f"{part.name} ({part.kind})"), "label": label}
    for part in scene.marks:
        yield _surface(part, MARK_COLOURS[part.kind], 0.8, f"{part.kind} on {part.name}", lines=True)
    drawn = {pair.name for pair in closest(scene.pairs)}
    for pair in scene.pairs:
        lines = [[0, 1]] if pair.name in drawn else []
        yield {**_part(pair.name, NEAR, pair.ends, lines, width=3, words=f"pair {words_of(pair, unit)}"), "top": True}
    size = 0.01 * float((high - low).max())
    for ends, kind in arrow_ends(scene, 100.0 * size):
        yield {**_part(kind, MARK_COLOURS[kind], *_head(ends), width=3, words=""), "top": True}
    points = [(p.name, MARK_COLOURS[p.kind], p.at, f"{p.kind} at a point of {p.name}") for p in scene.points]
    points += [(name, "black", point, f"probe {name}") for name, point in scene.probes.items()]
    for name, colour, point, words in points:
        cross = np.concatenate([_in_space(point[None]) + size * sign * np.eye(3) for sign in (-1, 1)])
        yield {**_part(name, colour, cross, [[0, 3], [1, 4], [2, 5]], width=2, words=words), "top": True}


def _surface(part: NamedSurface, colour: str, opacity: float, words: str, *, lines: bool = False) -> dict[str, Any]:
    """Triangles, in the plane the area within the segments, or, of patches and marks, the segments themselves."""
    dim = part.corners.shape[2]
    points, numbers = np.unique(part.corners.reshape(-1, dim), axis=0, return_inverse=True)
    facets = numbers.reshape(-1, dim)
    if dim == 3:
        return _part(part.name, colour, points, [], [[face] for face in facets.tolist()], opacity, words=words)
    closed = part.kind in FILLED and not lines
    loops = [loops_of(facets)] if closed else []
    return _part(part.name, colour, points, facets.tolist(), loops, opacity, width=1.5 if closed else 4, words=words)


def _part(
    name: str,
    colour: str,
    points: Array,
    lines: list[list[int]],
    faces: list[list[list[int]]] | None = None,
    opacity: float = 1.0,
    *,
    width: float = 1.0,
    words: str,
) -> dict[str, Any]:
    from matplotlib.colors import to_hex

    rounded = [[float(f"{c:.{PAGE_DIGITS}g}") for c in x] for x in _in_space(points).tolist()]
    drawn = {"points": rounded, "lines": lines, "faces": faces or [], "opacity": opacity, "width": width}
    return {"name": name, "colour": to_hex(colour), **drawn, "words": words}


def _grid(scene: Preview) -> tuple[Array, list[list[int]]]:
    """Ends of lines: of all cells in the plane, in space the edges of the box."""
    assert scene.box is not None
    low, high = scene.box
    if len(low) == 3:
        corners = np.array(
            [[(low, high)[i][0], (low, high)[j][1], (low, high)[k][2]] for i, j, k in np.ndindex(2, 2, 2)]
        )
        return corners, [[a, a + step] for step in (1, 2, 4) for a in range(8) if not a & step]
    if scene.cells:
        boxes = np.array([[(a, b), (c, b), (c, d), (a, d)] for (a, b), (c, d) in scene.cells]).reshape(-1, 2)
        return boxes, [[*range(4 * n, 4 * n + 4), 4 * n] for n in range(len(scene.cells))]
    ends = [[(x, low[1]), (x, high[1])] for x in scene.planes[0]] + [
        [(low[0], y), (high[0], y)] for y in scene.planes[1]
    ]
    return np.array(ends).reshape(-1, 2), [[2 * n, 2 * n + 1] for n in range(len(ends))]


def _head(ends: Array) -> tuple[Array, list[list[int]]]:
    """Points and lines of an arrow with two barbs, in space four."""
    start, end = _in_space(ends)
    along = end - start
    across = np.cross(along, [0.0, 0.0, 1.0] if ends.shape[1] == 2 else np.eye(3)[np.abs(along).argmin()])
    across *= np.linalg.norm(along) / np.linalg.norm(across)
    sides = [across] if ends.shape[1] == 2 else [across, np.cross(along, across) / np.linalg.norm(along)]
    barbs = [end - 0.25 * along + 0.12 * sign * side for side in sides for sign in (1.0, -1.0)]
    return np.array([start, end, *barbs]), [[0, 1], *([1, 2 + number] for number in range(len(barbs)))]


def _in_space(points: Array) -> Array:
    points = np.asarray(points, dtype=float)
    return np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
