"""Statics of bodies that are nearer to what their load leads away from than to what carries them."""

import numpy as np
import pytest
from programs import fsci
from ruamel.yaml import YAML

from fsci.running.history import read_history

FRICTION = {"friction": {"coefficient": 0.3}}


def reactions(folder, case):
    """The history of a run."""
    with (folder / "case.yaml").open("w") as file:
        YAML().dump(case | {"time": {"step": 0.5, "end": 1}, "output": {"fields_every": 0}}, file)
    done = fsci("run", folder / "case.yaml", "-o", folder / "out")
    assert done.returncode == 0, done.stdout + done.stderr
    return read_history(folder / "out" / "history.csv")


def boxed(low, high, dim=2, down=1, friction=False, slave="block"):
    """A cube of weight 100, with a floor below and a ceiling above it at these distances, or a wall on each side."""
    shape, sides = {2: "rectangle", 3: "box"}[dim], ("left", "right") if down == 0 else ("bottom", "top")
    weight, across = np.zeros(dim), [0 if axis != down else None for axis in range(dim)]
    weight[down] = -100.0
    held = [{"on": side, "displacement": across} for side in sides[:1]]
    block = {
        "mesh": {"shape": shape, "size": [1] * dim, "cells": [2] * dim},
        "material": {"law": "neo_hooke", "E": 1e4, "nu": 0.3, "density": 1},
        "gravity": weight.tolist(),
        **({} if friction else {"supports": held}),
    }
    obstacles, pairs = {}, {}
    for name, on, off, at in (("floor", sides[0], sides[1], -1 - low), ("ceiling", sides[1], sides[0], 1 + high)):
        size, origin = [3.0] * dim, [-1.0] * dim
        size[down], origin[down] = 1, at
        obstacles[name] = {"mesh": {"shape": shape, "size": size, "cells": [1] * dim, "origin": origin}, "on": off}
        pairs[name] = {"slave": {"body": "block", "on": on}, "master": {"obstacle": name}}
    contact = {"obstacles": obstacles, "pairs": pairs, **(FRICTION if friction else {})}
    return {"structure": {"bodies": {"block": block}}, "contact": contact}


@pytest.mark.parametrize("friction", [False, True])
@pytest.mark.parametrize(("dim", "down"), [(2, 1), (2, 0), (3, 2)])
@pytest.mark.parametrize(("low", "high"), [(0.1, 0.02), (0.02, 0.1), (0.8, 0.5), (0.1, 0.1), (0.3, 0.0)])
def test_a_block_below_a_ceiling_stands_on_the_floor(tmp_path, low, high, dim, down, friction):
    found, axis = reactions(tmp_path, boxed(low, high, dim, down, friction)), "xyz"[down]
    np.testing.assert_allclose(found[f"contact.floor.{axis}"], 100.0, rtol=1e-8)
    np.testing.assert_array_equal(found[f"contact.ceiling.{axis}"], 0.0)


def test_a_load_that_turns_changes_the_side(tmp_path):
    """Down on the floor first, then up below the ceiling."""
    case = boxed(0.1, 0.02)
    case["structure"]["bodies"]["block"]["gravity"] = [0, "200*t - 150"]
    found = reactions(tmp_path, case)
    np.testing.assert_allclose(found["contact.floor.y"], [50.0, 0.0], atol=1e-8)
    np.testing.assert_allclose(found["contact.ceiling.y"], [0.0, -50.0], atol=1e-8)


@pytest.mark.parametrize("friction", [False, True])
def test_a_stack_below_a_ceiling(tmp_path, friction):
    """Two loose blocks, the upper one nearest to the ceiling, the lower one to the upper one: each carries its load."""
    case = boxed(0.5, 0.3, friction=friction)
    bodies, contact = case["structure"]["bodies"], case["contact"]
    upper = bodies["upper"] = {**bodies["block"]}
    upper["mesh"] = {**upper["mesh"], "translate": [0, 1.1]}
    contact["pairs"]["joint"] = {"slave": {"body": "block", "on": "top"}, "master": {"body": "upper", "on": "bottom"}}
    contact["pairs"]["ceiling"]["slave"]["body"] = "upper"
    contact["obstacles"]["ceiling"]["mesh"]["origin"][1] = 2.12
    found = reactions(tmp_path, case)
    np.testing.assert_allclose(found["contact.floor.y"], 200.0, rtol=1e-8)
    np.testing.assert_allclose(found["contact.joint.y"], -100.0, rtol=1e-8)
    np.testing.assert_array_equal(found["contact.ceiling.y"], 0.0)


@pytest.mark.parametrize(("low", "high"), [(0.1, 0.02), (0.02, 0.1), (0.9, 0.4)])
def test_a_tool_between_two_plates_is_carried_by_the_lower_one(tmp_path, low, high):
    """The tool is the master of both; its load leads away from the nearer plate."""
    plate = {"material": {"law": "neo_hooke", "E": 1e4, "nu": 0.3}}
    size = {"shape": "rectangle", "size": [3, 1], "cells": [6, 2]}
    bodies = {
        "lower": {
            **plate,
            "mesh": {**size, "origin": [-1, -1 - low]},
            "supports": [{"on": "bottom", "displacement": [0, 0]}],
        },
        "upper": {
            **plate,
            "mesh": {**size, "origin": [-1, 1 + high]},
            "supports": [{"on": "top", "displacement": [0, 0]}],
        },
    }
    tool = {
        "mesh": {"shape": "rectangle", "size": [1, 1], "cells": [1, 1]},
        "free": {"density": 1, "held": ["x", "rotation"], "loads": [{"force": [0, -100]}]},
    }
    pairs = {
        "lower": {"slave": {"body": "lower", "on": "top"}, "master": {"obstacle": "tool"}},
        "upper": {"slave": {"body": "upper", "on": "bottom"}, "master": {"obstacle": "tool"}},
    }
    contact = {"obstacles": {"tool": tool}, "pairs": pairs}
    found = reactions(tmp_path, {"structure": {"bodies": bodies}, "contact": contact})
    np.testing.assert_allclose(found["contact.lower.y"], -100.0, rtol=1e-8)
    np.testing.assert_array_equal(found["contact.upper.y"], 0.0)


def test_a_disc_in_a_ring_lies_at_its_bottom(tmp_path):
    """One pair has both sides: the disc is nearest to the top of the ring."""
    disc = {
        "mesh": {"shape": "disc", "radius": 0.5, "cells": [24, 3], "translate": [0, 0.08]},
        "material": {"law": "neo_hooke", "E": 1e4, "nu": 0.3, "density": 1},
        "gravity": [0, -100],
        "supports": [{"at": [0, 0.08], "displacement": [0, None]}, {"at": [0, 0.58], "displacement": [0, None]}],
    }
    ring = {"mesh": {"shape": "ring", "inner_radius": 0.6, "outer_radius": 0.8, "cells": [48, 1]}, "on": "inner"}
    pairs = {"ring": {"slave": {"body": "disc", "on": "outer"}, "master": {"obstacle": "ring"}}}
    found = reactions(
        tmp_path, {"structure": {"bodies": {"disc": disc}}, "contact": {"obstacles": {"ring": ring}, "pairs": pairs}}
    )
    np.testing.assert_allclose(found["contact.ring.y"], 25.0 * np.pi, rtol=1e-4)  # the mesh is a polygon of parabolas
