"""Several bodies in one case, of different cells, give what each gives alone, on one process and on two."""

import pytest
from programs import fsci

from fsci.running.history import read_history

BODIES = {
    "bar": """
      mesh: {shape: box, size: [3, 1, 1], cells: [6, 2, 2], cell: hex}
      material: {law: neo_hooke, E: 100, nu: 0.3, density: 1}
      supports: [{on: left, displacement: [0, 0, 0]}]
      tractions: [{on: right, value: [0, 0, "-0.4*t"]}]
""",
    "block": """
      mesh: {shape: box, size: [1, 1, 2], cells: [2, 2, 3], cell: tet, order: 2, translate: [5, 0, 0]}
      material: {law: st_venant_kirchhoff, E: 50, nu: 0.2, density: 2}
      supports: [{on: bottom, displacement: [0, 0, 0]}, {on: left, symmetry: true}]
      pressures: [{on: top, value: "2*t"}]
      gravity: [0, 0.5, 0]
""",
}
POINTS = {"bar": "[3, 0.5, 1]", "block": "[6, 1, 2]"}


def history(folder, bodies, *, dynamics, processes=1):
    text = f"time: {{step: 0.25, end: 1}}\nstructure:\n  {dynamics}\n  bodies:\n"
    text += "".join(f"    {name}:{BODIES[name]}" for name in bodies)
    text += "probes:\n"
    for name in bodies:
        text += f"  tip_{name}: {{body: {name}, quantity: displacement, at: {POINTS[name]}}}\n"
        text += f"  mass_{name}: {{body: {name}, quantity: centre}}\n"
    (folder / "case.yaml").write_text(text)
    out = folder / "out"
    done = fsci("run", folder, "-o", out, "--set", "solver.newton.residual=1e-11", processes=processes)
    assert done.returncode == 0, done.stdout + done.stderr
    return read_history(out / "history.csv")


@pytest.mark.parametrize(
    "dynamics",
    [
        pytest.param("# static", id="static", marks=pytest.mark.slow),
        pytest.param("dynamics: {rho_inf: 0.8}", id="dynamic"),
    ],
)
def test_bodies_do_not_influence_each_other(dynamics, tmp_path):
    alone = {name: history(tmp_path, [name], dynamics=dynamics) for name in BODIES}
    for processes in (1, 2):
        both = history(tmp_path, list(BODIES), dynamics=dynamics, processes=processes)
        for name, single in alone.items():
            columns = [column for column in single if column.startswith(("tip_", "mass_"))]
            assert len(columns) == 6
            for column in columns:
                assert both[column] == pytest.approx(single[column], rel=1e-8, abs=1e-9), (processes, column)
            assert abs(single[f"tip_{name}.z"][-1]) > 0.01
