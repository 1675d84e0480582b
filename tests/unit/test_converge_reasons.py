"""Reasons for slow or irregular errors, by what a case has and what its run has done."""

from pathlib import Path

import numpy as np
import pytest

from fsci.case import load_case
from fsci.converge.reasons import first_order, indicative, unseen

CASES = Path(__file__).parents[2] / "cases"


def both(name, active=(), resolution=(), changes=()):
    case = load_case(CASES / name, changes)
    history = {"contact.active": np.array(active)} if len(active) else {}
    summary = {"resolution": list(resolution)}
    return first_order(case, history, summary), indicative(case, history, summary)


def test_none():
    assert both("cylinder_2d1") == ([], [])
    assert both("tied_cube", active=[3, 3]) == ([], [])  # statics


def test_backward_euler():
    slow = ["the scheme is backward_euler", "'block' has sharp edges in the flow"]
    assert both("hydrostatic_contact") == (slow, [])


@pytest.mark.parametrize(
    ("active", "impact"), [([0, 0, 2], True), ([2, 2, 0], True), ([2, 2, 2], False), ([0, 0, 0], False)]
)
def test_impacts(active, impact):
    slow, told = both("two_tori", active=active)
    assert ("an impact" in slow, "an impact" in told) == (impact, impact)


RIGID = """
time: {step: 0.1, end: 2}
rigid: {bodies: {ball: {mesh: {shape: disc, radius: 0.1, cells: [24, 1]}, density: 1}}}
probes: {ball: {body: ball, quantity: displacement, at: [0, 0]}}
"""


def test_impacts_of_rigid_bodies(tmp_path):
    (tmp_path / "case.yaml").write_text(RIGID)
    case = load_case(tmp_path)
    history = {"contact.active": np.array([0, 1, 0])}
    assert first_order(case, history, {}) == indicative(case, history, {}) == ["an impact"]


FLOW = """
time: {step: 0.1, end: 2}
fluid:
  density: 1
  viscosity: 1
  grid: {from: [0, 0], to: [4, 2], cells: [32, 16]}
  patches: {inlet: {on: x-, velocity: [1, 0]}, outlet: {on: x+, outflow: true}, walls: {on: [y-, y+], no_slip: true}}
  bodies: {post: {mesh: MESH}}
probes: {drag: {body: post, quantity: force}}
"""


@pytest.mark.parametrize(
    ("mesh", "sharp"),
    [
        ("{shape: rectangle, size: [0.5, 0.6], cells: [1, 1], origin: [1, 0.7]}", True),
        ("{shape: rectangle, size: [0.5, 0.6], cells: [3, 2], origin: [1, -0.1]}", True),  # two of four corners
        ("{shape: rectangle, size: [0.5, 2.2], cells: [1, 1], origin: [3.8, -0.1]}", False),  # none
        ("{shape: rectangle, size: [0.5, 2], cells: [1, 1], origin: [1, 0]}", False),  # on the walls
        ("{shape: disc, radius: 0.3, cells: [12, 1], translate: [1, 1]}", False),
    ],
)
def test_sharp_edges_in_the_flow(tmp_path, mesh, sharp):
    (tmp_path / "case.yaml").write_text(FLOW.replace("MESH", mesh))
    case = load_case(tmp_path)
    assert first_order(case, {}, {}) == ["'post' has sharp edges in the flow"] * sharp
    assert indicative(case, {}, {}) == []


def film(body, to, cells, warns=True):
    return {"body": body, "to": to, "cells": cells, "warns": warns}


def test_films():
    """A gap once, with the smaller count; what does not warn is resolved, and a body itself is no film."""
    found = [film("a", "b", 1.6), film("b", "a", 1.2), film("a", "wall", 9.0, warns=False), film("a", "", 2.0)]
    slow, told = both("cylinder_2d1", resolution=found)
    assert slow == told == ["1.2 cells in the film between a and b"]


def test_starts():
    assert "a start: 5 steps" in both("cylinder_2d2", changes=[("time.step", "1.0"), ("time.end", "5.0")])[1]


def test_errors_that_no_level_shows():
    assert unseen([], []) == []
    assert unseen(["ring (ring.inp)"], ["cells of mesh files", "step"]) == [
        "the facets of curved surfaces in mesh files are the same on all levels: ring (ring.inp)",
        "no level changes the cells of mesh files, step",
    ]
