"""What a scene does not need is not imported, searched, cut, assembled or written: shown by counting."""

import os
import subprocess
import sys
from collections import Counter

import numpy as np
import pytest
from fluid_setup import body, circle, field, loop, make_fluid, solve_steady
from mpi4py import MPI
from small_scenes import BEAM, BLOCK, FLOW, POST

import solvers.fluid.cut.cut
import solvers.fluid.solve.pressure_level
import solvers.fluid.solve.system
from fsci.builder.build import build
from fsci.case import load_case
from fsci.running.run import FINISHED, Run, run_case
from solvers.contact.mortar import Mortar
from solvers.fluid.grid.box import uniform
from solvers.fluid.solve.system import FlowSystem
from solvers.fluid.terms.boundary.patches import Patch
from solvers.mesh.search import Search
from solvers.structure.field import Structure
from solvers.timing import Timer

DISC = """\
  bodies:
    disc: {mesh: {shape: disc, radius: 0.2, cells: [16, 2], translate: [0.78, 0.51]}MOTION}
"""
RESTING, MOVING = DISC.replace("MOTION", ""), DISC.replace("MOTION", ', motion: {displacement: ["0.1*sin(t)", 0]}')
FAR = BLOCK.replace("0.001", "5")
PLOTTING = ("pyvista", "matplotlib", "gmsh")
#: numbers that `fsci check` needs, too
LIGHT = (
    "solvers.structure.elastic_constants",
    "solvers.fluid.grid",
    "solvers.fluid.grid.box",
    "solvers.fluid.surfaces",
    "solvers.fluid.surfaces.fast_bodies",
    "solvers.fluid.terms",
    "solvers.fluid.terms.boundary",
    "solvers.fluid.terms.boundary.patch_kinds",
    "solvers.fluid.geometry",
    "solvers.fluid.geometry.thin",
    "solvers.fluid.geometry.thin.thickness",
)


def written(tmp_path, text, end):
    (tmp_path / "case.yaml").write_text("title: a scene\n" + text)
    return load_case(tmp_path, [("time.end", str(end))])


def counted(monkeypatch, **methods):
    """Counts calls of CLASS__METHOD=class."""
    calls = Counter()
    for name, owner in methods.items():
        method = name.split("__", 1)[1]
        original = getattr(owner, method)

        def counting(*arguments, _name=name, _original=original, **keywords):
            calls[_name] += 1
            return _original(*arguments, **keywords)

        monkeypatch.setattr(owner, method, counting)
    return calls


def iterations_of(case, steps):
    """Newton steps of a few time steps."""
    simulation = build(case, MPI.COMM_WORLD, Timer())
    dt = case.time.step
    simulation.initialise(0.0, dt)
    return [simulation.scheme.step(n * dt, dt).iterations for n in range(steps)]


@pytest.mark.parametrize(
    ("text", "absent"),
    [
        (BEAM, ("solvers.fluid.", "solvers.contact", "solvers.rigid", "coupling")),
        (BLOCK, ("solvers.fluid.", "solvers.rigid", "coupling.monolithic", "coupling.partitioned")),
        (FLOW, ("solvers.structure.", "solvers.contact", "solvers.rigid", "coupling")),
        (FLOW + POST + "contact: none\n", ("solvers.contact.contact", "solvers.contact.mortar")),
    ],
    ids=["beam", "block", "flow", "post"],
)
def test_modules_of_absent_parts_are_not_imported(text, absent, tmp_path):
    written(tmp_path, text, 0.05)
    code = (
        "import sys; from fsci.cli import execute;"
        "execute(['run', sys.argv[1], '-o', sys.argv[1] + '/out', '--set', 'time.end=0.05']); print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code, tmp_path], capture_output=True, text=True, env=os.environ)
    modules = done.stdout.splitlines()[-1].split()
    assert "solvers.newton" in modules, done.stdout + done.stderr
    assert [name for name in modules if name.startswith((*absent, *PLOTTING)) and name not in LIGHT] == []


def test_bodies_far_apart_are_searched_once(tmp_path, monkeypatch):
    """Then the ways of the nodes are added up, until they could have met: no box, no search, no integrals."""
    calls = counted(monkeypatch, search__pairs=Search, mortar___kernel=Mortar)
    assert len(iterations_of(written(tmp_path, FAR, 0.05), 3)) == 3
    assert calls == {"search__pairs": 1}


@pytest.mark.parametrize("law", ["", ", friction: {coefficient: 0.3}"])
def test_bodies_that_come_near_are_searched_in_time(law, tmp_path, monkeypatch):
    """A block is thrown onto a floor: bit for bit as if every iterate were searched."""
    text = BLOCK.replace("0.001", "1.3").replace("{obstacle: floor}", f"{{obstacle: floor}}{law}")
    fall = written(tmp_path, text.replace("gravity: [0,", "initial_velocity: [0, -8]\n      gravity: [0,"), 0.2)
    found, searched = [], []
    for always in (False, True):
        calls = counted(monkeypatch, search__pairs=Search)
        if always:
            never = property(lambda mortar: -np.inf, lambda mortar, way: None)
            monkeypatch.setattr(Mortar, "clear_until", never, raising=False)
        simulation = build(fall, MPI.COMM_WORLD, Timer())
        simulation.initialise(0.0, 0.005)
        active = [simulation.scheme.step(n * 0.005, 0.005).numbers["contact.active"] for n in range(40)]
        found.append((active, simulation.snapshots()[0].points.tobytes()))
        searched.append(calls["search__pairs"])
    assert found[0] == found[1]
    assert max(found[0][0]) > 0.0
    assert searched[0] < searched[1]


def test_bodies_at_rest_are_cut_once(tmp_path, monkeypatch):
    calls = Counter()
    moments = solvers.fluid.cut.cut.kernels.moments

    def counting(*arguments, **keywords):
        calls["moments"] += 1
        return moments(*arguments, **keywords)

    monkeypatch.setattr(solvers.fluid.cut.cut.kernels, "moments", counting)
    iterations_of(written(tmp_path, FLOW + RESTING, 0.1), 4)
    assert calls["moments"] == 2  # to look for thin bodies, and the cut
    iterations_of(written(tmp_path, FLOW + MOVING, 0.1), 4)
    assert calls["moments"] > 4


def test_a_body_outside_of_the_box_changes_nothing(tmp_path, monkeypatch):
    """A disc at rest there: the same flow, bit for bit; no pocket is looked for."""
    monkeypatch.setattr(solvers.fluid.solve.pressure_level, "find_pockets", None)
    found = []
    for text in (FLOW, FLOW + RESTING.replace("0.78, 0.51", "5, 5")):
        simulation = build(written(tmp_path, text, 0.1), MPI.COMM_WORLD, Timer())
        simulation.initialise(0.0, 0.02)
        iterations = [simulation.scheme.step(n * 0.02, 0.02).iterations for n in range(3)]
        found.append((iterations, simulation.dofs, simulation.scheme.flow.tobytes()))
    assert found[0] == found[1]


@pytest.mark.parametrize(
    ("where", "motion", "count"),
    [("5, 5", "", 1), ("5, 5", ', motion: {displacement: ["0.1*t", 0]}', 1), ("0.78, 0.51", "", 4)],
    ids=["outside", "moved outside", "inside"],
)
def test_surfaces_that_cut_no_cell_have_no_terms(where, motion, count, tmp_path, monkeypatch):
    """The first step finds that all of them are zero; those of surfaces in the flow follow its scales in each step."""
    made, terms = [], solvers.fluid.solve.system.InterfaceTerms
    monkeypatch.setattr(solvers.fluid.solve.system, "InterfaceTerms", lambda *a: made.append(terms(*a)) or made[-1])
    text = FLOW + DISC.replace("0.78, 0.51", where).replace("MOTION", motion)
    iterations_of(written(tmp_path, text, 0.1), 4)
    assert len(made) == count


def test_the_cells_of_a_flow_without_bodies_are_chosen_once(tmp_path):
    simulation = build(written(tmp_path, FLOW, 0.1), MPI.COMM_WORLD, Timer())
    simulation.initialise(0.0, 0.02)
    cuts = []
    for n in range(3):
        simulation.scheme.step(n * 0.02, 0.02)
        cuts.append(simulation.scheme.cut)
    assert cuts[0] is cuts[1] is cuts[2]


def test_a_body_that_enters_the_box_has_terms_again(tmp_path):
    """Outside at first, then in the flow: it displaces volume, which leaves the box."""
    motion = ', motion: {displacement: ["-2*t", 0]}'
    text = FLOW + DISC.replace("0.78, 0.51", "2.24, 0.51").replace("MOTION", motion)
    simulation = build(written(tmp_path, text, 0.2), MPI.COMM_WORLD, Timer())
    simulation.initialise(0.0, 0.02)
    forces = []
    for n in range(5):
        simulation.scheme.step(n * 0.02, 0.02)
        forces.append(np.abs(simulation.scheme.force()["disc"]).sum())
    assert forces[0] == 0.0
    assert forces[-1] > 0.0


def test_no_tangent_where_only_a_residual_is_needed(tmp_path, monkeypatch):
    """A Newton step needs one tangent, convergence none."""
    calls = counted(monkeypatch, flow__tangent=FlowSystem, flow__residual=FlowSystem)
    iterations = sum(iterations_of(written(tmp_path, FLOW + RESTING, 0.1), 3))
    assert calls["flow__tangent"] <= iterations
    assert calls["flow__residual"] <= iterations + 3


def test_no_stiffness_where_only_a_residual_is_needed(tmp_path, monkeypatch):
    """Of a structure, too: a stiffness for each Newton step that keeps none, one residual more for each time step."""
    calls = counted(monkeypatch, structure__tangent=Structure, structure__residual=Structure)
    kept, advance = [], Structure.advance

    def recorded(self, *, keep=False, reduction=0.0):
        kept.append(keep)
        return advance(self, keep=keep, reduction=reduction)

    monkeypatch.setattr(Structure, "advance", recorded)
    iterations = iterations_of(written(tmp_path, BEAM, 0.2), 4)
    assert any(kept)
    assert calls["structure__tangent"] == sum(iterations) - sum(kept)
    assert calls["structure__residual"] == sum(iterations) + len(iterations)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (BEAM, {"assembly", "contact", "solve"}),
        (FLOW, {"assembly", "cut", "weights", "solve"}),
        (FLOW + POST, {"assembly", "contact", "cut", "weights", "coupling", "solve"}),
    ],
    ids=["beam", "flow", "post"],
)
def test_time_goes_to_parts_that_are_there(text, parts, tmp_path):
    """What is timed; the time of parts that are absent is that of asking."""
    timer, case = Timer(), written(tmp_path, text, 0.2)
    simulation = build(case, MPI.COMM_WORLD, timer)
    simulation.initialise(0.0, case.time.step)
    simulation.scheme.step(0.0, case.time.step)
    assert timer.seconds.keys() == parts
    absent = {"contact"} if "contact" in parts else {"cut"}  # no pairs; no bodies
    assert sum(timer.seconds[part] for part in absent) < 0.05 * sum(timer.seconds.values())


def test_a_pair_that_never_meets_changes_nothing(tmp_path):
    """The same Newton steps and motion as without it: only boxes are compared."""
    found = []
    for text in (FAR, BLOCK.replace("0.001", "5").split("contact:")[0]):
        case = written(tmp_path, text, 0.05)
        simulation = build(case, MPI.COMM_WORLD, Timer())
        simulation.initialise(0.0, case.time.step)
        iterations = [simulation.scheme.step(n * case.time.step, case.time.step).iterations for n in range(5)]
        found.append((iterations, simulation.snapshots()[0].points))
    assert found[0][0] == found[1][0]
    assert np.abs(found[0][1] - found[1][1]).max() < 1e-12


def test_probes_only_when_asked(tmp_path):
    for text in (BEAM, FLOW + RESTING, FLOW + POST):
        simulation = build(written(tmp_path, text, 0.2), MPI.COMM_WORLD, Timer())
        simulation.initialise(0.0, 0.01)
        assert simulation.probes() == {}


def test_output_only_when_asked(tmp_path, monkeypatch):
    calls = counted(monkeypatch, run___write_fields=Run, run___write_checkpoint=Run)
    case = written(tmp_path, BEAM + "output: {fields_every: 0}\n", 0.2)
    assert run_case(case, tmp_path / "out") == FINISHED
    assert calls["run___write_fields"] == 2  # the first and the last state
    assert calls["run___write_checkpoint"] == 1  # the last one


def test_rigid_bodies_have_no_unknowns(tmp_path):
    def unknowns(text):
        return build(written(tmp_path, text, 0.1), MPI.COMM_WORLD, Timer()).dofs

    assert unknowns(FLOW + RESTING) == unknowns(FLOW)


def test_cells_in_a_body_have_no_integrals_and_no_equations(monkeypatch):
    """Cells are those that have fluid; rows of other unknowns hold a single one, which is their diagonal."""
    tangents, original = [], FlowSystem.tangent

    def kept(system, *arguments, **keywords):
        tangents.append(original(system, *arguments, **keywords))
        return tangents[-1]

    monkeypatch.setattr(FlowSystem, "tangent", kept)
    disc = body("disc", circle([0.5, 0.5], 0.3, 200), loop(200))
    box = Patch("box", ("x-", "x+", "y-", "y+"), "velocity", field(1, 0))
    fluid = make_fluid(uniform([0, 0], [1, 1], [16, 16]), [box], [disc], scheme="steady", convection=False)
    solve_steady(fluid)
    assert sum(map(len, fluid.system.cells)) == len(fluid.cut.active) < len(fluid.grid.numbers) - 40
    inside = ~fluid.system.active_dofs
    assert inside.sum() > 100
    assert fluid.iterate.held[inside].all()
    starts, _, values = tangents[-1].getValuesCSR()
    assert (np.diff(starts)[inside] == 1).all()
    assert (values[starts[:-1][inside]] != 0.0).all()
    assert np.diff(starts)[~inside].min() > 1


def test_slow_flow_has_no_convection(tmp_path):
    """Without convection the equations are linear: one Newton step each."""
    case = written(tmp_path, FLOW.replace("density: 1", "density: 1\n  flow: stokes") + RESTING, 0.1)
    assert iterations_of(case, 3) == [1, 1, 1]
