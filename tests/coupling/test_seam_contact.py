"""Contact through a periodic face: as in the middle of the box, and one period as two of them."""

import numpy as np
import pytest
from mpi4py import MPI

from fsci.builder.build import build
from fsci.case import load_case
from solvers.march import march
from solvers.timing import Timer

CHANNEL = """\
time: {{step: 0.02, end: 1}}
fluid:
  density: 1
  viscosity: 0.05
  gravity: [0, -2]
  grid: {{from: [0, 0], to: [{length}, 1], cells: [{cells}, 8]}}
  patches: {{ends: {{on: [x-, x+], periodic: true}}, floor: {{on: y-, no_slip: true}}, lid: {{on: y+, no_slip: true}}}}
{bodies}coupling: {{scheme: {scheme}}}
contact: {{bodies: all, friction: {{coefficient: 0.3}}}}
solver: {{newton: {{residual: 1.0e-11}}}}
"""
SCHEMES = ["monolithic", "partitioned"]


def discs(*places, speeds):
    """Free discs that meet; their places are those of the middles along the channel."""
    rows = [
        f"    d{k}: {{mesh: {{shape: disc, radius: 0.2, cells: [20, 1], translate: [{x}, {y}]}}, "
        f"free: {{density: 20, initial_velocity: [{speed}, 0]}}}}\n"
        for k, ((x, y), speed) in enumerate(zip(places, speeds, strict=True))
    ]
    return "  bodies:\n" + "".join(rows)


def motion(folder, bodies, *, length=2, steps=3, scheme="monolithic"):
    """Displacements of all vertices after each step, and the columns of contact."""
    path = folder / "case.yaml"
    path.write_text(CHANNEL.format(bodies=bodies, length=length, cells=8 * length, scheme=scheme))
    found = build(load_case(path), MPI.COMM_SELF, Timer())
    ways, columns = [], []
    for *_, info in march(found.scheme, 0.02 * steps, steps):
        ways.append(found.scheme.coupled.solid.displacement())
        columns.append({name: value for name, value in info.numbers.items() if name.startswith("contact.")})
    return np.array(ways), columns


PLACES = (0.79, 0.47), (1.21, 0.535)


def same(found, expected, tolerance=1e-8):
    (ways, columns), (known, rows) = found, expected
    assert np.abs(ways - known).max() < tolerance
    for own, row in zip(columns, rows, strict=True):
        scale = max(abs(value) for value in row.values())
        assert own.keys() == row.keys()
        assert all(abs(own[name] - row[name]) <= 1e-6 * scale for name in row)


def pair(x):
    return discs(*((a + x, y) for a, y in PLACES), speeds=(1, -1))


@pytest.mark.parametrize("scheme", ["monolithic", pytest.param("partitioned", marks=pytest.mark.slow)])
def test_two_free_discs(tmp_path, scheme):
    """Across the end, and each in another period."""
    known = motion(tmp_path, pair(0.0), scheme=scheme)
    assert max(row["contact.active"] for row in known[1]) > 0.0
    same(motion(tmp_path, pair(1.0), scheme=scheme), known)
    (first, second), speeds = PLACES, (1, -1)
    far = discs((first[0] + 3.0, first[1]), (second[0] - 5.0, second[1]), speeds=speeds)
    same(motion(tmp_path, far, scheme=scheme), known)


@pytest.mark.slow
def test_one_period_is_as_two_of_them(tmp_path):
    """With two pairs that both meet, one of them across the end."""
    one, columns = motion(tmp_path, pair(1.0))
    places = [(x + shift, y) for shift in (1.0, 3.0) for x, y in PLACES]
    two, rows = motion(tmp_path, discs(*places, speeds=(1, -1, 1, -1)), length=4)
    count = one.shape[1]
    assert np.abs(two[:, :count] - one).max() < 1e-8
    assert np.abs(two[:, count:] - one).max() < 1e-8
    assert sum(row["contact.active"] for row in columns) > 0.0
    assert [row["contact.active"] for row in rows] == [2.0 * row["contact.active"] for row in columns]


SOFT = """\
structure:
  dynamics: {{}}
  bodies:
{disc}"""
DRY = """\
time: {{step: 0.005, end: 1}}
structure:
  dynamics: {{}}
  bodies:
{discs}contact: {{bodies: all, friction: {{coefficient: 0.3}}}}
solver: {{newton: {{residual: 1.0e-11}}}}
"""
ELASTIC = """\
    e{k}:
      mesh: {{shape: disc, radius: 0.2, cells: [20, 3], translate: [{x}, {y}]}}
      material: {{law: neo_hooke, E: {E}, nu: 0.3, density: 20}}
      initial_velocity: ["{speed}", "0"]
"""
FREE = """\
rigid:
  bodies:
    ball: {{mesh: {{shape: disc, radius: 0.2, cells: [20, 1], translate: [{x}, {y}]}}, density: 20, \
initial_velocity: [{speed}, 0]}}
"""


def dry(folder, shifts=(0.0, 0.0), *, pairs=1, free=False, steps=14, stiffness=(400, 400)):
    """Ways of the nodes and contact columns of discs that meet, the first one of each pair perhaps free and rigid.

    shifts: of both discs of the first pair along x [m]; each further pair is 2 m from the one before.
    """
    places = [
        (x + shifts[k] + 2.0 * n, y) for n in range(pairs) for k, (x, y) in enumerate(((0.79, 0.47), (1.21, 0.53)))
    ]
    settings = [
        {"k": k, "x": x, "y": y, "E": stiffness[k % 2], "speed": (1, -1)[k % 2]} for k, (x, y) in enumerate(places)
    ]
    text = DRY.format(discs="".join(ELASTIC.format(**one) for one in settings[int(free) :]))
    path = folder / "case.yaml"
    path.write_text(text + (FREE.format(**settings[0]) if free else ""))
    found = build(load_case(path), MPI.COMM_SELF, Timer())
    start = {f"e{one['k']}": one["x"] for one in settings} | {"ball": settings[0]["x"]}
    ways, columns = [], []
    for _, info in march(found.scheme, 0.005 * steps, steps):
        parts = {one.name: one.points - np.array([start[one.name], 0.0, 0.0]) for one in found.snapshots()}
        ways.append(np.concatenate([parts[name] for name in sorted(parts)]))
        columns.append({name: value for name, value in info.numbers.items() if name.startswith("contact.")})
    return np.array(ways), columns


def repeats(monkeypatch, length):
    """Let space repeat along x: cases have periods with a flow only."""
    for module in ("contact", "rigid_contact", "automatic_pairs", "sentinels"):
        monkeypatch.setattr(f"fsci.builder.{module}.periods", lambda case: np.array([length, np.inf]))


@pytest.mark.parametrize(
    ("free", "stiffness"),
    [
        (False, (400, 400)),
        pytest.param(False, (400, 4000), marks=pytest.mark.slow),
        pytest.param(False, (4000, 400), marks=pytest.mark.slow),
        (True, (0, 400)),
    ],
)
def test_dry_discs(tmp_path, monkeypatch, free, stiffness):
    """Elastic slaves and masters with friction, and a free rigid master: the pair in one place, and periods apart."""
    known = dry(tmp_path, free=free, stiffness=stiffness)
    assert any(row["contact.active"] for row in known[1])
    repeats(monkeypatch, 2.0)
    for shifts in ((2.0, 0.0), (-4.0, 6.0)):
        ways, columns = dry(tmp_path, shifts, free=free, stiffness=stiffness)
        assert np.abs(ways - known[0]).max() < 1e-8
        for own, row in zip(columns, known[1], strict=True):
            scale = max(abs(value) for value in row.values())
            assert all(abs(own[name] - row[name]) <= 1e-6 * scale for name in row if not name.endswith("changes"))


def test_without_periods_they_do_not_meet(tmp_path):
    """As far apart as some periods."""
    assert not any(row["contact.active"] for row in dry(tmp_path, (2.0, 0.0))[1])


def wet(x, free):
    """A free disc or an elastic one meets an elastic one in the flow, at the middle x + 1 [m]."""
    ((a, b), (c, d)), speeds = PLACES, (1, -1)
    first = ELASTIC.format(k=0, x=a + x, y=b, E=400, speed=speeds[0])
    second = ELASTIC.format(k=1, x=c + x, y=d, E=400, speed=speeds[1])
    elastic = SOFT.format(disc=second if free else first + second)
    return discs((a + x, b), speeds=speeds[:1]) + elastic if free else elastic


@pytest.mark.parametrize(
    ("free", "scheme"),
    [
        (False, "monolithic"),
        pytest.param(True, "monolithic", marks=pytest.mark.slow),
        pytest.param(False, "partitioned", marks=pytest.mark.slow),
    ],
)
def test_elastic_discs_in_a_flow(tmp_path, free, scheme):
    """They touch right at the end of the channel, and some periods away."""
    known = motion(tmp_path, wet(0.0, free), scheme=scheme)
    assert max(row["contact.active"] for row in known[1]) > 1.0
    for x in (1.0, -5.0):
        same(motion(tmp_path, wet(x, free), scheme=scheme), known, 1e-7 if scheme == "partitioned" else 1e-8)


FLOOR = """\
    e{k}:
      mesh: {{shape: disc, radius: 0.2, cells: [20, 3], translate: [{x}, 0.205]}}
      material: {{law: neo_hooke, E: 400, nu: 0.3, density: 20}}
      initial_velocity: ["0.3", "-1"]
"""


@pytest.mark.slow
def test_an_elastic_disc_on_the_floor_of_another_period(tmp_path):
    """Walls go on along the periods."""
    known = motion(tmp_path, SOFT.format(disc=FLOOR.format(k=0, x=0.913)))
    assert max(row["contact.active"] for row in known[1]) > 0.0
    for x in (4.913, -7.087):
        same(motion(tmp_path, SOFT.format(disc=FLOOR.format(k=0, x=x))), known)


def test_walls_and_the_box_go_on_along_periods(tmp_path):
    """A part of the floor is where it is in the box; a body some periods away has not left this."""
    path = tmp_path / "case.yaml"
    text = CHANNEL.format(bodies=pair(0.0), length=2, cells=16, scheme="monolithic")
    path.write_text(
        text.replace(
            "floor: {on: y-, no_slip: true}",
            "rest: {on: y-, outflow: true}, floor: {on: y-, no_slip: true, where: x < 1}",
        )
    )
    found = build(load_case(path), MPI.COMM_SELF, Timer())
    solid = found.scheme.coupled.solid
    floor = next(one.other for one in solid.contact.pairs if getattr(one.other, "name", "") == "floor")
    assert np.isfinite(floor.gaps(np.array([[x, 0.1] for x in (0.5, 4.5, -1.5)])).gap).all()
    assert np.isinf(floor.gaps(np.array([[x, 0.1] for x in (1.5, 5.5, -0.5)])).gap).all()
    walls = found.sentinels["walls"]
    walls.start(0.0)
    solid.begin_step(0.0, 0.1)
    moved = solid.increments()
    moved[:, 0] += 5.0
    solid.set_increments(moved)
    assert walls.look(0.1, 0.1) == []
