"""Every case in cases/: the first steps, on 1 and 2 processes, and whole runs of those with published numbers."""

from pathlib import Path

import numpy as np
import pytest
from programs import fsci, run_whole, warnings_of

from fsci.case import load_case
from fsci.case.verify import FIELD_COLUMNS
from fsci.running.history import read_history

CASES = sorted(path.parent for path in Path("cases").glob("*/case.yaml"))
LONG = ("torus_wall_fine", "valve_3d")
#: what makes the first steps quick without changing what they are about
SMALLER = {
    "cylinder_2d1": [
        "fluid.grid.x=[{to: 0.14, cells: 8, ratio: 0.1}, {to: 0.26, cells: 20}, {to: 2.2, cells: 24, ratio: 25}]",
        "fluid.grid.y=[{to: 0.14, cells: 10, ratio: 0.25}, {to: 0.26, cells: 20}, {to: 0.41, cells: 10, ratio: 4}]",
    ],
    **{
        name: [
            "fluid.element=q1q1",
            "fluid.grid.x=[{to: 0.14, cells: 5, ratio: 0.4}, {to: 0.64, cells: 36}, {to: 2.5, cells: 14, ratio: 15}]",
            "fluid.grid.y=[{to: 0.13, cells: 5, ratio: 0.45}, {to: 0.2725, cells: 14}, {to: 0.41, cells: 5, ratio: 2}]",
        ]
        for name in ("fsi1", "fsi3")
    },
    "cylinder_2d2": [
        "fluid.grid.x=[{to: 0.1288, cells: 6, ratio: 0.5}, {to: 0.2712, cells: 10}, {to: 2.2, cells: 16, ratio: 9}]",
        "fluid.grid.y=[{to: 0.1288, cells: 6, ratio: 0.5}, {to: 0.2712, cells: 10}, {to: 0.41, cells: 6, ratio: 2}]",
    ],
    "rebound_stokes": [
        *(f"fluid.grid.{axis}=[{{to: 0.6, cells: 2}}, {{to: 2, cells: 1}}]" for axis in "xy"),
        "fluid.grid.z=[{to: 1.2, cells: 4}, {to: 2.5, cells: 1}]",
        "structure.bodies.ball.mesh.parameters={fine: 0.1}",
    ],
    "torus_wall": ["fluid.grid.cells=[8, 8, 13]", "structure.bodies.torus.mesh.cells=[16, 8]"],
    "torus_rough": ["fluid.grid.cells=[12, 6, 20]", "structure.bodies.torus.mesh.cells=[12, 12]"],
    "sphere_tube": ["structure.bodies.tube.mesh.cells=[24, 1, 30]", "structure.bodies.sphere.mesh.cells=[5, 1]"],
    "thin_flag": ["fluid.grid.cells=[42, 14]"],
    "leaflet_pulsating": [
        "fluid.grid.x=[{to: 0.8, cells: 6, ratio: 0.4}, {to: 1.5, cells: 12}, {to: 8, cells: 20, ratio: 15}]",
        "fluid.grid.y=[{to: 1, cells: 16}]",
    ],
    "segre_silberberg": ["fluid.grid.cells=[24, 24]"],
    "hopper": ["fluid.grid.cells=[20, 32]", "solver.newton.residual=1e-15"],  # the leak sees what the iteration leaves
    "elastic_tube": ["fluid.grid.cells=[4, 4, 16]", "structure.bodies.wall.mesh.cells=[8, 1, 20]"],
    "falling_sphere": [
        f"fluid.grid.{axis}=[{{to: {near}, cells: {cells}}}, {{to: {far}, cells: 3, ratio: 4}}]"
        for axis, near, cells, far in (("x", 0.012, 3, 0.05), ("y", 0.012, 3, 0.05), ("z", 0.14, 12, 0.16))
    ],
}


SMALLER["falling_rigid_sphere"] = SMALLER["falling_sphere"]


#: cases that run on two processes in quick tests: each field, element, kind of body, of contact and of linear solver
#: once. The others do so in slow ones.
PARALLEL = (
    "cylinder_nested",  # nested cells, q2q1, steady
    "fsi3",  # q2q1, an elastic body on a given one, BDF2
    "elastic_tube",  # 3D, iterative, slip, planes of symmetry
    "falling_rigid_sphere",  # free body, graded cells
    "thin_flag",  # bodies without thickness
    "valve",  # contact of two bodies in a flow
    "torus_wall",  # contact with an obstacle in a flow in 3D
    "two_tori_friction",  # friction between bodies of solid shells
    "tied_cube",  # tied
    "self_contact_fold",  # a surface on itself
)


#: what the whole runs of cases take, where it is long [s]
SECONDS = {
    "cavity_flexible_bottom": 55, "cylinder_2d2": 200, "elastic_tube": 90, "falling_elastic_disc": 200, "flap": 90,
    "jeffery_orbit": 70, "leaflet_pulsating": 300, "segre_silberberg": 90, "thin_flag": 180, "torus_rough": 150,
    "torus_wall": 65, "two_tori_friction": 80,
}  # fmt: skip


def with_slow(names, slow, seconds=SECONDS):
    mark = pytest.mark.slow
    return [pytest.param(n, marks=[mark(seconds=seconds.get(n, 0))] if slow(n) else ()) for n in names]


NAMES = [folder.name for folder in CASES]
#: cases whose whole run takes seconds; FSI3 takes half an hour
SHORT = ("csm1", "csm2", "cavity", "cook_membrane", "sealed_plate", "cylinder_nested")


#: in space, with forms that no other quick test has; their whole runs are slow tests
DEAR = ("falling_sphere", "rebound_stokes", "sphere_tube", "torus_rough")
#: in the plane, with what other cases have, too; their whole runs are slow tests
DEAR += ("jeffery_orbit", "leaflet_pulsating", "falling_elastic_disc", "hopper")
OTHERS = [name for name in NAMES if name not in (*PARALLEL, *LONG, *SHORT)]


@pytest.mark.parametrize("name", with_slow(OTHERS, lambda name: name in DEAR, {}))
def test_first_steps(name, tmp_path):
    run_steps(name, tmp_path, 3)


@pytest.mark.parametrize("name", with_slow(NAMES, lambda name: name not in PARALLEL, {"valve_3d": 170}))
def test_first_steps_on_two_processes(name, tmp_path):
    """Probes, forces and balances are those of one process, in the first step and in one that has a past."""
    assert_same(*(run_steps(name, tmp_path / str(processes), 2, processes) for processes in (1, 2)))


def run_steps(name, out, steps, processes=1):
    """History of the first steps, in which no sentinel finds anything."""
    folder = Path("cases") / name
    done = fsci(*first_steps(folder, out, steps), processes=processes)
    assert done.returncode == 0, done.stdout + done.stderr
    assert warnings_of(out) == []
    history, time = read_history(out / "history.csv"), load_case(folder / "case.yaml").time
    assert len(history["step"]) == min(steps, round((time.end - time.start) / time.step))
    return history


def first_steps(folder, out, steps):
    """Arguments of `fsci` for so many steps."""
    case = load_case(folder / "case.yaml")
    time, residual = case.time, case.solver.newton.residual
    residual = 1e-10 if residual > 1e-8 else residual
    end = min(time.end, time.start + steps * time.step)
    # solved as exactly as they can be, so that what iterations leave over does not tell processes apart
    exact = ["solver.linear.tolerance=1e-12", f"solver.newton.residual={residual!r}"]
    settings = [f"time.end={end!r}", "verify=[]", *exact, *SMALLER.get(folder.name, [])]
    return ["run", str(folder), "-o", str(out), *(w for setting in settings for w in ("--set", setting))]


def assert_same(first, second):
    """Histories of 1 and 2 processes agree."""
    assert first.keys() == second.keys()
    one, two = ({name: np.nan_to_num(values) for name, values in history.items()} for history in (first, second))
    assert all(np.array_equal(np.isnan(first[name]), np.isnan(second[name])) for name in one)
    sizes = {name: np.abs(values).max() for name, values in one.items()}
    counts = {"iterations", "coupling.linear", "fluid.linear", "coupling.newton"}
    errors = {"residual", "interface.force", "interface.momentum", "fluid.loss", *FIELD_COLUMNS.values()}
    for name in one.keys() - {"wall", *counts, *errors}:
        # components of one vector are measured against the largest of them
        size = max(s for other, s in sizes.items() if other.partition(".")[0] == name.partition(".")[0])
        assert np.abs(one[name] - two[name]).max() <= 1e-8 * size + 1e-12, name


#: tests of their own run them to their end
WHOLE = ("double_arch", "falling_sphere", "ironing", "piston_impact", "rebound_stokes", "sphere_tube", "two_tori")
WHOLE += ("valve", "valve_thin", "valve_3d", "hopper")
#: earlier ends [s]: two of three maxima, one of four periods, after the largest force
EARLIER = {"flap": 2.6, "cavity_flexible_bottom": 56.0, "torus_rough": 0.42}
VERIFIED = [folder.name for folder in CASES if folder.name not in (*LONG, *WHOLE, "fsi3")]


@pytest.mark.parametrize("name", with_slow(VERIFIED, lambda name: name not in SHORT))
def test_published_numbers(name, tmp_path):
    """The published numbers, as the case itself verifies them."""
    run_whole(name, tmp_path, *([f"time.end={EARLIER[name]}"] if name in EARLIER else []), timeout=1800)


def test_every_case_is_documented():
    for folder in CASES:
        text = (folder / "README.md").read_text()
        assert text.startswith("# "), folder
        assert f"fsci run cases/{folder.name}" in text, folder
