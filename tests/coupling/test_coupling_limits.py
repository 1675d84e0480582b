"""Limits with a known answer, and how hard the coupling is: stiff bodies, no fluid, heavy and light fluid, 3D."""

from __future__ import annotations

import numpy as np
import pytest
from case_text import section, with_section
from coupled_case import POST
from test_coupled_run import BLOCK, run

from fsci.case import load_case
from fsci.running.run import FINISHED, run_case

SHORT = ("time.end", "0.1"), ("verify", "[]")


FLUID, STRUCTURE, REST = (section(POST, name) for name in ("fluid", "structure", "probes"))
COUPLING = "coupling: {scheme: monolithic}\n"
TIP = "  tip: {quantity: displacement, at: [0.735, 0.41]}\n"


def test_a_stiff_body_is_a_rigid_one(tmp_path):
    """E = 1e9: the flow and its force are those of a rigid body that may move but does not.

    The post goes through the floor, so that there are no facets on it, which the coupled run leaves dry. With backward
    Euler, since flows of second order have another start when they are coupled.
    """
    first_order = ("fluid.scheme", "backward_euler")
    mesh = "mesh: {shape: rectangle, size: [0.23, 0.46], origin: [0.62, -0.05], cells: [3, 5]}"
    structure = with_section(STRUCTURE, f"      {mesh}\n", "structure", "bodies", "post", "mesh")
    coupled = run(
        POST.replace(STRUCTURE, structure),
        tmp_path / "coupled",
        *SHORT,
        first_order,
        ("structure.bodies.post.material.E", "1e9"),
    )
    body = f"  bodies: {{post: {{{mesh}, motion: {{displacement: [1e-15*t, 0]}}}}}}\n"
    text = POST.replace(STRUCTURE, "").replace(COUPLING, "").replace(TIP, "").replace(FLUID, FLUID + body)
    rigid = run(text, tmp_path / "rigid", *SHORT, first_order)
    assert np.abs(coupled["tip.x"]).max() < 1e-6
    for name in ("force.x", "force.y", "outflow"):
        assert np.abs(coupled[name] - rigid[name]).max() < 1e-4 * np.abs(rigid["force.x"]).max(), name


def test_without_fluid_the_structure_is_alone(tmp_path):
    """Density and viscosity 1e-9: the post swings as it does in nothing."""
    swinging = POST.replace("      supports:", '      initial_velocity: ["0.5*y", 0]\n      supports:')
    thin = ("fluid.density", "1e-9"), ("fluid.viscosity", "1e-9")
    coupled = run(swinging, tmp_path / "coupled", *SHORT, *thin)
    dry = run(swinging.replace(FLUID, "").replace(COUPLING, "").replace(REST, "probes:\n" + TIP), tmp_path, *SHORT)
    moved = np.abs(dry["tip.x"]).max()
    assert moved > 5e-3
    assert np.abs(coupled["tip.x"] - dry["tip.x"]).max() < 1e-6 * moved


def test_a_heavy_fluid_is_no_harder_for_the_monolithic_scheme(tmp_path):
    """Newton steps per time step with a structure of 0.1 times the fluid's density, and of 10 times."""
    needed = {}
    for density in ("10", "0.1"):
        found = run(POST, tmp_path, *SHORT, ("structure.bodies.post.material.density", density))
        needed[density] = found["iterations"].max()
    assert needed["0.1"] <= needed["10"] + 1
    assert needed["0.1"] <= 7


@pytest.mark.slow
@pytest.mark.parametrize(
    "text", [POST, BLOCK.replace("cells: [1, 2, 2]", "cells: [1, 2, 2], order: 1")], ids=["2d", "3d"]
)
def test_both_schemes_over_50_steps(text, tmp_path):
    """The same trajectory to 10 times the tolerance of the coupling; IQN needs few iterations."""
    long = ("time.end", "1.0"), ("verify", "[]")
    one = run(text, tmp_path / "monolithic", *long)
    partitioned = text.replace("coupling: {scheme: monolithic}", "coupling: {scheme: partitioned}")
    two = run(partitioned, tmp_path / "partitioned", *long)
    assert len(one["step"]) == len(two["step"]) == 50
    moved = np.abs(one["tip.x"]).max()
    assert np.abs(one["tip.x"] - two["tip.x"]).max() < 1e-5 * moved
    assert two["iterations"].mean() <= 8


@pytest.mark.slow
def test_ring_in_a_fluid_ten_times_as_heavy(tmp_path):
    """omega within 2 % of 1.804513 rad/s, from 2.555042 dry: cases/ring_added_mass with 140 kg/m^3."""
    heavy = ("fluid.density", "140"), ("time.end", "7.5"), ("verify.0.reference", "1.804513/(2*pi)")
    assert run_case(load_case("cases/ring_added_mass", heavy), tmp_path) == FINISHED
