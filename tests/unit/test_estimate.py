"""Sizes of built-in meshes estimated from their settings: those of the meshes themselves."""

import itertools
from typing import Any

import pytest
from pydantic import TypeAdapter

from fsci.case.shapes import AnyShape
from fsci.meshes.mesh import build_mesh

SHAPES: list[dict[str, Any]] = [
    {"shape": "rectangle", "size": [2, 1], "cells": [4, 3]},
    {"shape": "disc", "radius": 1, "cells": [8, 2]},
    {"shape": "ring", "inner_radius": 1, "outer_radius": 2, "cells": [6, 2]},
    {"shape": "ring", "inner_radius": 1, "outer_radius": 2, "cells": [6, 2], "angle": 90},
    {"shape": "tube", "inner_radius": 1, "outer_radius": 2, "height": 3, "cells": [6, 2, 2], "angle": 90},
    {"shape": "box", "size": [1, 2, 3], "cells": [1, 2, 3]},
    {"shape": "beam", "length": 3, "width": 1, "height": 1, "cells": [3, 1, 2]},
    {"shape": "cylinder", "radius": 1, "height": 2, "cells": [8, 1, 3]},
    {"shape": "tube", "inner_radius": 1, "outer_radius": 2, "height": 2, "cells": [5, 2, 3]},
    {"shape": "solid_torus", "major_radius": 3, "minor_radius": 1, "cells": [5, 16]},
    {"shape": "solid_torus", "major_radius": 3, "minor_radius": 1, "cells": [3, 16], "angle": 180},
    {"shape": "hollow_torus", "major_radius": 3, "inner_radius": 0.5, "outer_radius": 1, "cells": [6, 5, 2]},
    {"shape": "hollow_sphere", "inner_radius": 1, "outer_radius": 2, "cells": [3, 2]},
    {"shape": "sphere", "radius": 2, "cells": [3, 2]},
    {"shape": "leaflet", "radius": 1, "thickness": 0.06, "height": 1.2, "lip": 0.4, "post": 0.2, "cells": [4, 1, 3]},
]


def shape(settings):
    return TypeAdapter(AnyShape).validate_python(settings)


@pytest.mark.parametrize("settings", SHAPES, ids=[s["shape"] for s in SHAPES])
def test_cells_nodes_and_surfaces(settings, tmp_path):
    for order, simplex in itertools.product((1, 2), (False, True)):
        cell = {2: ("quad", "tri"), 3: ("hex", "tet")}[shape(settings).plan.dimension][simplex]
        model = shape(settings | {"order": order, "cell": cell})
        mesh = build_mesh(model, tmp_path)
        assert model.plan.counts == (len(mesh.cells), len(mesh.points))
        assert set(model.plan.surfaces) == set(mesh.surfaces)


@pytest.mark.parametrize("settings", SHAPES, ids=[s["shape"] for s in SHAPES])
def test_extents(settings):
    """One for each number in `cells`, and none is shorter than half of the thickness."""
    model = shape(settings)
    assert len(model.plan.extents) == len(model.cells)
    assert min(model.plan.extents) >= 0.5 * model.plan.thickness


def test_aspect():
    assert shape({"shape": "rectangle", "size": [2, 1], "cells": [2, 10]}).plan.aspect == pytest.approx(10)
    assert shape({"shape": "box", "size": [1, 1, 1], "cells": [1, 2, 4]}).plan.aspect == pytest.approx(4)
    # a sixth of the middle circle is 2 pi 1.5/6 = pi/2 long, the layers are 0.1 thick
    ring = {"shape": "ring", "inner_radius": 1, "outer_radius": 2, "cells": [6, 10]}
    assert shape(ring).plan.aspect == pytest.approx(5 * 3.14159265)
