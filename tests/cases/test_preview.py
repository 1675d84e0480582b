"""`fsci preview`: what is drawn, distances of pairs, pictures in the plane and in space, refused cases."""

import shutil
import subprocess
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image
from programs import fsci

from fsci.case import load_case
from fsci.preview.draw import figure_of_plane
from fsci.preview.layout import closest, loops_of, name_place, opacity
from fsci.preview.legend import entries, handles
from fsci.preview.parts import DistantPair, NamedSurface, Preview, nearest, preview_of
from solvers.mesh.distance import distances_in_pairs

ANGLES = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
PLANE = """
title: All kinds
time: {step: 0.1, end: 1}
structure:
  bodies:
    block:
      mesh: {shape: ring, inner_radius: 0.1, outer_radius: 0.2, cells: [16, 2], translate: [0.5, 0.5]}
      material: {law: neo_hooke, E: 100, nu: 0.3, density: 1}
      supports: [{on: inner, displacement: [0, 0]}]
  dynamics: {rho_inf: 0.8}
fluid:
  density: 1
  viscosity: 1
  element: q1q1
  grid: {from: [0, 0], to: [2, 1], cells: [20, 10]}
  patches:
    inlet: {on: x-, velocity: ["y*(1-y)", 0]}
    walls: {on: [y-, y+], no_slip: true}
    outlet: {on: x+, outflow: true}
  bodies:
    still: {mesh: {shape: disc, radius: 0.1, cells: [16, 2], translate: [1, 0.5]}}
    moved: {mesh: {shape: disc, radius: 0.1, cells: [16, 2], translate: [1.4, 0.5]}, motion: {velocity: [0.1, 0]}}
    loose: {mesh: {shape: disc, radius: 0.1, cells: [16, 2], translate: [1.7, 0.3]}, free: {density: 2}}
contact:
  pairs: {stop: {slave: {body: block, on: outer}, master: {obstacle: still}}}
coupling: {scheme: monolithic}
probes:
  force: {body: block, quantity: force}
  here: {field: fluid, quantity: velocity, at: [1.9, 0.5]}
"""

SPACE = """
time: {step: 1, end: 1}
structure:
  bodies:
    low:
      mesh: {shape: box, size: [1, 1, 0.5], cells: [2, 2, 1]}
      material: {law: neo_hooke, E: 100, nu: 0.3}
      supports: [{on: bottom, displacement: [0, 0, 0]}]
    high:
      mesh: {shape: box, size: [0.4, 0.4, 0.5], origin: [0.25, 0.25, 0.52], cells: [2, 2, 1]}
      material: {law: neo_hooke, E: 100, nu: 0.3}
      supports: [{on: top, displacement: [0, 0, "-0.05*t"]}]
      pressures: [{on: front, value: 1}]
contact:
  pairs: {blocks: {slave: {body: high, on: bottom}, master: {body: low, on: top}}}
"""


def written(folder, text):
    (folder / "case.yaml").write_text(text)
    return load_case(folder)


def colours(path):
    """Pixels that are not white, by rough colour."""
    pixels = np.asarray(Image.open(path).convert("RGB")).reshape(-1, 3)
    return len(np.unique(pixels[pixels.min(axis=1) < 250] // 32, axis=0))


def test_all_parts_of_a_scene_in_the_plane(tmp_path):
    scene = preview_of(written(tmp_path, PLANE))
    assert {part.name: part.kind for part in scene.bodies} == {
        "block": "elastic", "still": "rigid", "moved": "moved", "loose": "free",
    }  # fmt: skip
    assert [(part.name, part.kind, len(part.corners)) for part in scene.marks] == [("block.inner", "support", 16)]
    assert [(part.name, part.kind, len(part.corners)) for part in scene.patches] == [
        ("inlet", "velocity", 1), ("walls", "no slip", 2), ("outlet", "outflow", 1),
    ]  # fmt: skip
    (pair,) = scene.pairs
    assert [side.name for side in pair.sides] == ["block.outer", "still"]
    assert pair.distance == pytest.approx(0.2)
    assert pair.ends == pytest.approx(np.array([[0.7, 0.5], [0.9, 0.5]]))
    assert scene.bodies[0].middle == pytest.approx([0.5, 0.5])
    assert list(scene.probes) == ["here"]
    words = [text for _, text, _ in entries(scene, "m")]
    assert "pair stop: block.outer, still, 0.2 m apart" in words
    assert {"block (elastic)", "loose (free)", "support on block.inner", "patch inlet (velocity)"} <= set(words)


@pytest.mark.parametrize(("text", "line"), [
    (PLANE, "pair stop: block.outer, still, 0.2 m apart"),
    (SPACE, "pair blocks: high.bottom, low.top, 0.02 m apart"),
])  # fmt: skip
def test_a_picture(tmp_path, text, line):
    (tmp_path / "case.yaml").write_text(text)
    ended = fsci("preview", tmp_path, "-o", tmp_path / "new" / "all.png")
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.splitlines() == [line, str(tmp_path / "new" / "all.png")]
    assert colours(tmp_path / "new" / "all.png") > 20
    assert {path.name for path in tmp_path.iterdir()} == {"case.yaml", "new"}


def test_settings_and_mistakes(tmp_path):
    (tmp_path / "case.yaml").write_text(SPACE)
    ended = fsci("preview", tmp_path, "-o", tmp_path / "a.png", "--set", "structure.bodies.high.supports.0.on=tip")
    assert ended.returncode == 2
    assert "tip" in ended.stderr
    assert not (tmp_path / "a.png").exists()


@pytest.mark.parametrize("dim", [2, 3])
def test_nearest_points_of_surfaces(dim):
    """Those of all corners to all facets."""
    rng = np.random.default_rng(3)
    for _ in range(5):
        one, other = (rng.random((n, 1, dim)) + 0.2 * rng.random((n, dim, dim)) for n in (40, 60))
        other = other + np.array([1.3, *[0.0] * (dim - 1)])
        exact = np.inf
        for points, facets in ((one, other), (other, one)):
            for point in points.reshape(-1, dim):
                exact = min(exact, distances_in_pairs(np.tile(point, (len(facets), 1)), facets).min())
        ends = nearest(one, other)
        assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(exact)
        assert ends[0, 0] < ends[1, 0]


def test_points_that_are_held_or_loaded(tmp_path):
    free = (
        "free: {density: 2, springs: [{at: [1.7, 0.4], stiffness: [1, 1]}], loads: [{force: [1, 0], at: [1.7, 0.2]}]}"
    )
    held = "[{on: inner, displacement: [0, 0]}, {at: [0.7, 0.5], displacement: [0, null]}]"
    text = PLANE.replace("free: {density: 2}", free).replace("[{on: inner, displacement: [0, 0]}]", held)
    scene = preview_of(written(tmp_path, text))
    assert [(point.name, point.kind, *point.at) for point in scene.points] == [
        ("block", "support", 0.7, 0.5), ("loose", "spring", 1.7, 0.4), ("loose", "force", 1.7, 0.2),
    ]  # fmt: skip
    words = [text for _, text, _ in entries(scene, "m")]
    assert {"support at a point of block", "spring at a point of loose", "force at a point of loose"} <= set(words)
    assert fsci("preview", tmp_path, "-o", tmp_path / "all.png").returncode == 0
    assert fsci("preview", tmp_path, "-o", tmp_path / "all.html").returncode == 0
    assert "force at a point of loose" in (tmp_path / "all.html").read_text()


LOADS = """supports: [{on: inner, displacement: [0, "0.1*sin(6*t)"]}]
      tractions: [{on: outer, value: ["t-2*t*t", 0]}]
      pressures: [{on: inner, value: 1}]
      point_forces: [{at: [0.7, 0.5], value: ["t", "-t"]}]"""
TURNED = """turned:
      mesh: {shape: rectangle, size: [0.4, 0.04], cells: [4, 1], origin: [1.2, 0.78]}
      motion: {rotation: {centre: [1.4, 0.8], angular_velocity: 3000}}
    loose: {"""
MOVED = (
    PLANE.replace("supports: [{on: inner, displacement: [0, 0]}]", LOADS)
    .replace("on: [y-, y+], no_slip", "on: [x-, y-, y+], no_slip")
    .replace('velocity: ["y*(1-y)", 0]}', 'velocity: ["exp(-t)*y*(1-y)", 0], where: "0.35-y"}')
    .replace("motion: {velocity: [0.1, 0]}", 'motion: {displacement: ["where(t < 0.5, 0, 0.1*(t-0.5))", 0]}')
    .replace("loose: {", TURNED)
)


def test_which_way_loads_act_and_motions_begin(tmp_path):
    """The traction is largest when it pulls back, turns begin along the circle, pressures in a ring cancel."""
    scene = preview_of(written(tmp_path, MOVED))
    found = {(arrow.kind, *np.round(arrow.at, 3)): arrow.direction for arrow in scene.arrows}
    (corner,) = [key for key in found if key[0] == "motion" and key[1] not in (0.5, 1.4)]
    assert corner[1:] in {(1.2, 0.78), (1.6, 0.78), (1.2, 0.82), (1.6, 0.82)}
    around = np.array([0.8 - corner[2], corner[1] - 1.4]) / np.hypot(corner[1] - 1.4, corner[2] - 0.8)
    assert found.pop(corner) @ around > 0.99
    assert found == {
        ("motion", 0.5, 0.5): pytest.approx([0, 1]),
        ("motion", 1.4, 0.5): pytest.approx([1, 0]),
        ("traction", 0.5, 0.5): pytest.approx([-1, 0]),
        ("force", 0.7, 0.5): pytest.approx([0.5**0.5, -(0.5**0.5)]),
        ("velocity", 0, 0.15): pytest.approx([1, 0]),
    }
    assert fsci("preview", tmp_path, "-o", tmp_path / "all.png").returncode == 0
    assert fsci("preview", tmp_path, "-o", tmp_path / "all.html").returncode == 0


def test_a_pressure_in_space(tmp_path):
    (arrow,) = [arrow for arrow in preview_of(written(tmp_path, SPACE)).arrows if arrow.kind == "pressure"]
    assert (*arrow.at, *arrow.direction) == pytest.approx((0.45, 0.25, 0.77, 0, 1, 0))


def test_a_patch_on_a_part_of_a_face_is_that_part(tmp_path):
    """Of cells whose middle is below 0.35."""
    (inlet,) = [part for part in preview_of(written(tmp_path, MOVED)).patches if part.name == "inlet"]
    assert inlet.corners.max(axis=(0, 1)) == pytest.approx([0, 0.3])


def test_surfaces_that_touch_but_for_rounding_touch(tmp_path):
    scene = preview_of(written(tmp_path, SPACE.replace("0.52]", "0.50000000000000011]")))
    assert "pair blocks: high.bottom, low.top, touching" in [text for _, text, _ in entries(scene, "m")]


def test_surfaces_that_touch_at_the_origin_touch():
    """What counts is the size of the surfaces, not of the coordinates where they touch."""
    ends = np.array([[0.0, 0.0], [0.0, 3e-14]])
    sides = [NamedSurface(name, "slave", np.array([[[0.0, y], [12.0, y]]])) for name, y in (("a", 0.0), ("b", 3e-14))]
    assert DistantPair("pair", (sides[0], sides[1]), ends).distance == 0.0


def circle(radius):
    points = radius * np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1)
    return np.stack([points, np.roll(points, -1, axis=0)], axis=1)


def test_the_name_of_a_ring_is_in_the_ring():
    """Its middle is in the hole; of what reaches out of the picture the name is in the picture."""
    ring = NamedSurface("ring", "elastic", np.concatenate([circle(1.0), circle(0.8)[:, ::-1]]))
    low, high = np.array([-2.0, -2.0]), np.array([2.0, 2.0])
    x, y = name_place(ring, low, high)
    assert 0.8 < np.hypot(x, y) < 1.0
    x, y = name_place(ring, np.array([0.9, -2.0]), high)
    assert 0.9 < x < 1.0


def test_what_would_hide_another_body_is_seen_through():
    corners = np.eye(3)[None] * np.array([1.0, 0.5])[:, None, None] + np.array([0.0, 0.1])[:, None, None]
    outer, inner = (NamedSurface(name, "elastic", facets[None]) for name, facets in zip("oi", corners, strict=True))
    assert opacity(outer, [outer, inner]) < opacity(inner, [outer, inner]) == 1.0


@pytest.mark.parametrize("size", [(10.0, 1.0), (1.0, 1.0), (1.0, 10.0)])
def test_scene_and_legend_share_the_picture(size):
    """The axes have the shape of the scene; the legend covers no part of them and is in the picture."""
    shown = handles(Preview("", [], [], [], [], {str(n): np.zeros(2) for n in range(20)}, [], []), "m")
    figure = figure_of_plane(np.array(size), shown)
    figure.draw_without_rendering()
    axes, legend = (found.get_window_extent() for found in (figure.axes[0], figure.legends[0]))
    assert axes.height / axes.width == pytest.approx(size[1] / size[0])
    assert not axes.overlaps(legend)
    assert figure.bbox.x0 <= legend.x0
    assert legend.x1 <= figure.bbox.x1
    assert figure.bbox.y0 <= legend.y0
    if size[0] > size[1]:
        assert axes.width > 0.9 * figure.bbox.width


def test_one_line_for_two_bodies(tmp_path):
    """Of pairs of the same bodies the nearest one is drawn."""
    more = "blocks: {slave: {body: high, on: bottom}, master: {body: low, on: top}}"
    text = SPACE.replace(more, f"far: {{slave: {{body: high, on: top}}, master: {{body: low, on: top}}}}, {more}")
    assert [pair.name for pair in closest(preview_of(written(tmp_path, text)).pairs)] == ["blocks"]


@pytest.fixture(scope="module")
def browser():
    found = shutil.which("chromium") or shutil.which("google-chrome")
    if found is None:
        pytest.skip("no Chromium is installed")

    def show(page, *options):
        command = [found, "--headless", "--no-sandbox", "--disable-gpu", "--window-size=1000,600", *options]
        return subprocess.run([*command, page.as_uri()], capture_output=True, text=True, timeout=60).stdout

    return show


def area_of(picture, colour):
    """Part of the pixels that have about this colour, shaded or not."""
    pixels = np.asarray(picture.convert("RGB")).reshape(-1, 3).astype(float)
    size = np.linalg.norm(pixels, axis=1)
    same = pixels @ colour / (np.maximum(size, 1.0) * np.linalg.norm(colour))
    return float(np.mean((same > 0.997) & (size > 0.3 * np.linalg.norm(colour))))


@pytest.mark.parametrize(("text", "words"), [
    (PLANE, ["pair stop: block.outer, still, 0.2 m apart", "loose (free)", "probe here", "patch inlet (velocity)"]),
    (SPACE, ["pair blocks: high.bottom, low.top, 0.02 m apart", "pressure on high.front", "low (elastic)"]),
])  # fmt: skip
def test_a_page_that_turns(tmp_path, browser, text, words):
    """Chromium shows bodies in their colours, and the words on pairs and parts; nothing is loaded from elsewhere."""
    (tmp_path / "case.yaml").write_text(text.replace("title: All kinds", "title: A <b>bold</b> scene"))
    page = tmp_path / "page.html"
    assert fsci("preview", tmp_path, "-o", page).returncode == 0
    assert "http" not in page.read_text()
    shown = browser(page, "--dump-dom")
    assert all(f"</i>{text}</label>" in shown for text in words)
    assert ("<h1>A &lt;b&gt;bold&lt;/b&gt; scene</h1>" in shown) == (text is PLANE)
    browser(page, f"--screenshot={tmp_path / 'page.png'}")
    picture = Image.open(tmp_path / "page.png")
    blue, orange, red = (np.array(x, dtype=float) for x in ((0, 114, 178), (213, 94, 0), (204, 0, 0)))
    if text is SPACE:
        assert area_of(picture, blue) > 0.05
        assert area_of(picture, orange) > 0.01
        assert area_of(picture, red) > 0.0
    else:
        canvas = picture.crop((0, 0, 620, 600))
        assert area_of(canvas, red) > 40 * 2 / (620 * 600), "the line of the pair, a tenth of the box long"
        black = np.asarray(canvas.convert("L")) < 40
        assert black.mean(axis=1).max() > 0.6, "a wall along the box"


def test_loops_of_a_body_with_a_hole_and_of_bodies_that_share_a_corner():
    ring = np.array([[0, 1], [1, 2], [2, 0], [5, 4], [4, 3], [3, 5]])
    assert loops_of(ring) == [[0, 1, 2, 0], [5, 4, 3, 5]]
    touching = np.array([[0, 1], [1, 2], [2, 0], [2, 3], [3, 4], [4, 2]])
    used = [pair for loop in loops_of(touching) for pair in pairwise(loop)]
    assert sorted(used) == sorted(map(tuple, touching.tolist()))
    assert all(loop[0] == loop[-1] for loop in loops_of(touching))
