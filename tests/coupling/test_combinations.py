"""Every pair of what a flow around bodies can have works together: kinds of bodies, dimension, element, grid,
processes, linear solver, and a run that is resumed.

Scenes are a covering set: each pair of values is in one of them. Where all moves alike, or rests, the velocity is that
of the bodies, and the force the difference of the pressures. Elastic bodies are compared with a twin: one process, a
direct solver, not resumed.
"""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
import pytest
from programs import fsci

from fsci.running.history import read_history

FACTORS = {
    "body": ("thin at rest", "thin moved", "thin elastic", "touching", "overlapping", "film", "contact", "free"),
    "dim": (2, 3),
    "element": ("q1q1", "q2q1"),
    "grid": ("uniform", "stretched", "nested", "periodic"),
    "processes": (1, 2, 3),
    "solver": ("direct", "iterative"),
    "resumed": (False, True),
}
NAMES = tuple(FACTORS)
SPEED, DT = 0.3, 0.1


def pairs(scene) -> set:
    return {(a, b, scene[a], scene[b]) for a, b in combinations(range(len(NAMES)), 2)}


def covering() -> list[tuple]:
    """Scenes one after the other, each with most of the pairs that are left."""
    scenes, everything = [], list(product(*FACTORS.values()))
    np.random.default_rng(0).shuffle(everything := np.array(everything, dtype=object))
    everything = [tuple(scene) for scene in everything]
    left = set().union(*map(pairs, everything))
    while left:
        best = max(everything, key=lambda scene: len(pairs(scene) & left))
        scenes.append(best)
        left -= pairs(best)
    return scenes


SCENES = [dict(zip(NAMES, scene, strict=True)) for scene in covering()]


def test_each_pair_is_in_a_scene():
    expected = sum(len(FACTORS[a]) * len(FACTORS[b]) for a, b in combinations(NAMES, 2))
    assert len(set().union(*(pairs(tuple(scene.values())) for scene in SCENES))) == expected
    assert len(SCENES) <= 36


# ------------------------------------------------------------------------------------------------------ the scenes


def grid(scene, around) -> str:
    """Cells of an eighth of the height."""
    dim, kind = scene["dim"], scene["grid"]
    size, cells = ([2, 1], [16, 8]) if dim == 2 else ([1.5, 0.75, 0.75], [12, 6, 6])
    text = f"from: {[0] * dim}, to: {size}, "
    if kind == "nested":
        refine = ", ".join(f"{{around: {body}, layers: 4, level: 1}}" for body in around)
        return text + f"cells: {[count // 2 for count in cells]}, refine: [{refine}]"
    if kind == "stretched":
        half, count = size[0] / 2, cells[0] // 2
        stretches = f"[{{to: {half}, cells: {count}, ratio: 0.8}}, {{to: {size[0]}, cells: {count}, ratio: 1.3}}]"
        return text + f"cells: {['null', *cells[1:]]}, x: {stretches}".replace("'", "")
    return text + f"cells: {cells}"


def vector(*components, dim) -> str:
    return str(list(components) + [0] * (dim - len(components))).replace("'", '"')


def shape(dim, low, size, *, at=(), angle=0.0, cells=(1, 1), depth=None) -> str:
    """A rectangle, or a box through the whole depth of the domain."""
    low, size, cells = list(low), list(size), list(cells)
    if dim == 3:
        low, size, cells = [*low, depth[0] if depth else -1], [*size, depth[1] if depth else 3], [*cells, cells[1]]
    turn = f", rotate: {{angle: {angle}{', axis: [0, 0, 1]' if dim == 3 else ''}}}" if angle else ""
    place = f", translate: {vector(*at, dim=dim)}" if at else ""
    name = "rectangle" if dim == 2 else "box"
    return f"{{shape: {name}, size: {size}, cells: {cells}, origin: {low}{turn}{place}}}"


THICKNESS = 0.03  # a quarter of a cell
PLATE = (-THICKNESS / 2, -1.4), (THICKNESS, 2.8)
HALVES = {
    "touching": [((-THICKNESS / 2, -1.4), (THICKNESS, 1.4)), ((-THICKNESS / 2, 0.0), (THICKNESS, 1.4))],
    "overlapping": [((-THICKNESS / 2, -1.4), (THICKNESS, 1.4)), ((-THICKNESS / 2, -0.08), (THICKNESS, 1.4))],
    "film": [((-0.25, -0.2), (0.5, 0.2)), ((-0.25, 0.035), (0.5, 0.2))],
}
MIDDLE = {2: (0.71, 0.47), 3: (0.59, 0.36)}


def immersed(scene) -> dict[str, str]:
    """Bodies of the flow with what moves them."""
    kind, dim = scene["body"], scene["dim"]
    moved = f"motion: {{displacement: {vector(f'{SPEED}*t', *['0'] * (dim - 1), dim=dim)}}}"
    if kind in ("thin at rest", "thin moved"):
        text = f"mesh: {shape(dim, *PLATE, at=MIDDLE[dim], angle=7)}"
        return {"plate": text if kind == "thin at rest" else f"{text}, {moved}"}
    if kind == "free":
        ball = "disc, cells: [24, 1]" if dim == 2 else "sphere, cells: [4, 1]"
        mesh = f"{{shape: {ball}, radius: 0.19, translate: {vector(*MIDDLE[dim], 0.37, dim=3)[:-1]}]}}"
        if dim == 2:
            mesh = mesh.replace(", 0.37]", "]")
        return {"ball": f"mesh: {mesh}, free: {{density: 1, initial_velocity: {vector(SPEED, dim=dim)}}}"}
    halves = HALVES.get(kind, [])
    angle = 7 if kind != "film" else 4
    return {
        f"half_{number}": f"mesh: {shape(dim, *half, at=MIDDLE[dim], angle=angle)}, {moved}"
        for number, half in enumerate(halves)
    }


def elastic(scene) -> str:
    """A plate across the channel, or a block that is pressed on its floor."""
    kind, dim = scene["body"], scene["dim"]
    height, depth = (1.0, None) if dim == 2 else (0.75, (0, 0.75))
    if kind == "thin elastic":
        mesh = shape(dim, (0.71, 0), (THICKNESS, height), cells=(1, 6), depth=depth)
        support, contact = f"{{on: [bottom, top], displacement: {[0] * dim}}}", ""
    else:
        low, size, depth = ((0.53, 0.01), (0.41, 0.3), None) if dim == 2 else ((0.53, 0.2), (0.41, 0.33), (0.01, 0.3))
        mesh = shape(dim, low, size, cells=(3, 2), depth=depth)
        down = vector(*["0"] * (dim - 1), "-0.03*min(5*t,1)", dim=dim)
        floor = shape(2, (-1, -0.1), (4, 0.1)) if dim == 2 else shape(3, (-1, -1), (4, 3), depth=(-0.1, 0.1))
        support = f"{{on: top, displacement: {down}}}"
        contact = f"""
contact:
  obstacles: {{floor: {{mesh: {floor}, on: top}}}}
  pairs: {{floor: {{slave: {{body: soft, on: bottom}}, master: {{obstacle: floor}}}}}}
  film: {{zone: seeping, transmissivity: 1e-6}}"""
    return f"""
structure:
  dynamics: {{rho_inf: 0.5}}
  bodies:
    soft:
      mesh: {mesh}
      material: {{law: neo_hooke, E: 2e4, nu: 0.3, density: 1}}
      supports: [{support}]{contact}
coupling: {{scheme: monolithic}}"""


def case(scene) -> str:
    kind, dim = scene["body"], scene["dim"]
    soft, bodies = kind in ("thin elastic", "contact"), immersed(scene)
    names = list(bodies) or ["soft"]
    p = {"thin at rest": (2.0, 0.7), "free": (0, 0), "film": (0, 0), "contact": (0.2, 0.0)}.get(kind, (1.0, 0.7))
    ends = f"""
    in: {{on: x-, traction: {vector(p[0], dim=dim)}}}
    out: {{on: x+, traction: {vector(-p[1], dim=dim)}}}"""
    force = ""
    if scene["grid"] == "periodic":
        ends = "\n    ends: {on: [x-, x+], periodic: true}"
        force = f"  body_force: {vector(0.65, dim=dim)}\n" if kind == "thin at rest" or soft else ""
    coupled = elastic(scene) if soft else "\ncoupling: {scheme: monolithic}" if kind == "free" else ""
    walls = ["y-", "y+", "z-", "z+"][: 2 * dim - 2]
    at = [1.31, 0.43, 0.31][:dim]
    start = SPEED if not soft and kind != "thin at rest" else 0.0
    immersed_text = "".join(f"\n    {name}: {{{text}}}" for name, text in bodies.items())
    listed = f"\n  bodies:{immersed_text}" if bodies else ""
    probes = "".join(f"\n  {name}: {{body: {name}, quantity: force}}" for name in names)
    method = "{method: direct}" if scene["solver"] == "direct" else "{method: iterative, tolerance: 1e-11}"
    return f"""
time: {{step: {DT}, end: {4 * DT if soft else 2 * DT}}}
fluid:
  density: 1
  viscosity: 0.05
  scheme: backward_euler
  element: {scene["element"]}
  initial_velocity: {vector(start, dim=dim)}
{force}  grid: {{{grid(scene, names)}}}
  patches:{ends}
    walls: {{on: [{", ".join(walls)}], {"no_slip" if kind == "contact" else "slip"}: true}}{listed}{coupled}
probes:{probes}
  flow: {{quantity: flow_rate, plane: {{point: {at}, normal: {vector(1, dim=dim)}}}}}
  speed: {{field: fluid, quantity: velocity, at: {at}}}
  energy: {{quantity: kinetic_energy}}
solver: {{newton: {{residual: 1e-11}}, linear: {method}}}
output: {{fields_every: 0}}
"""


# ------------------------------------------------------------------------------------------------------- the oracles


def history_of(folder, scene):
    """What a scene finds, in two parts if it is resumed."""
    folder.mkdir()
    text = case(scene)
    (folder / "case.yaml").write_text(text)
    end = 4 * DT if scene["body"] in ("thin elastic", "contact") else 2 * DT
    first = ("--set", f"time.end={end / 2}") if scene["resumed"] else ()
    done = fsci("run", folder, "-o", folder / "out", *first, processes=scene["processes"])
    assert done.returncode == 0, done.stdout + done.stderr
    if scene["resumed"]:
        done = fsci("resume", folder / "out", "--set", f"time.end={end}", processes=scene["processes"])
        assert done.returncode == 0, done.stdout + done.stderr
    return read_history(folder / "out" / "history.csv")


def assert_known(scene, history):
    """The velocity is that of all bodies, and the force the difference of the pressures on the whole section."""
    kind, dim = scene["body"], scene["dim"]
    speed, section = (0.0 if kind == "thin at rest" else SPEED), 1.0 if dim == 2 else 0.75**2
    np.testing.assert_allclose(history["speed.x"], speed, atol=1e-7)
    np.testing.assert_allclose(history["speed.y"], 0.0, atol=1e-7)
    np.testing.assert_allclose(history["flow"], speed * section, atol=1e-7)
    fall = {"thin at rest": 1.3, "free": 0.0, "film": 0.0}.get(kind, 0.3)
    if scene["grid"] == "periodic":
        length, slant = (2.0, 1.5)[dim - 2], THICKNESS / np.cos(np.radians(7))
        fall = 0.65 * (length - slant) if kind == "thin at rest" else 0.0
    force = sum(history[f"{name}.x"] for name in immersed(scene))
    np.testing.assert_allclose(force, fall * section, atol=1e-6)


def words(scene) -> str:
    return "-".join(str(value).replace(" ", "_") for value in scene.values())


def is_quick(scene) -> bool:
    """In the plane, on two processes at most, and not run twice."""
    return scene["dim"] == 2 and scene["processes"] < 3 and scene["body"] not in ("thin elastic", "contact")


@pytest.mark.parametrize(
    "scene", [pytest.param(s, id=words(s), marks=() if is_quick(s) else pytest.mark.slow) for s in SCENES]
)
def test_combination(tmp_path, scene):
    history = history_of(tmp_path / "scene", scene)
    assert np.abs(history["fluid.mass"]).max() < 1e-8
    if scene["body"] not in ("thin elastic", "contact"):
        assert_known(scene, history)
        return
    plain = scene | {"processes": 1, "solver": "direct", "resumed": False}
    if plain == scene:
        plain = scene | {"resumed": True}
    twin = history_of(tmp_path / "twin", plain)
    assert np.abs(twin["soft.x"]).max() > 1e-3
    assert scene["body"] == "thin elastic" or twin["contact.active"][-1] > 0
    for name in ("soft.x", "soft.y", "flow", "energy"):
        size = np.abs(twin[name]).max()
        np.testing.assert_allclose(history[name], twin[name], rtol=0.0, atol=1e-7 * size + 1e-9, err_msg=name)
