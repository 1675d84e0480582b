"""Whatever happens to a valid case file, checking it ends with a summary or with located problems."""

import copy
import io

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML

from fsci.case import CaseError, load_case
from fsci.check.check import summary
from fsci.stress.mutants import settings_of

CASES = [
    """\
title: two bodies # comment
units: {length: mm, mass: t, time: s}
time: {start: 0, step: "1/10", end: 1, retry: {halvings: 2, recover_after: 3}}
structure:
  dynamics: {alpha_m: 0.5, alpha_f: 0.5, beta: 0.25, gamma: 0.5, predictor: constant_velocity, damping: {mass: 0.1}}
  bodies:
    tube: &tube
      mesh: {shape: tube, inner_radius: 1, outer_radius: 2, height: 3, cells: [8, 1, 2], order: 2, cell: tet,
        rotate: [{axis: [0, 0, 1], angle: 90}, {axis: [1, 0, 0], angle: "180/2"}], translate: [1, 2, 3]}
      material: {law: mooney_rivlin, c10: 1, c01: "2 + x", bulk: 1e3, density: 1e-9}
      supports:
        - {on: [bottom, top], displacement: [0, null, "sin(2*pi*t)"]}
        - {on: inner, symmetry: true}
      gravity: [0, 0, -9810]
      body_force: [0, "where(z > 1, x, y)", 0]
      pressures: [{on: outer, value: "t^2"}]
      initial_displacement: [0, 0, 0]
      initial_velocity: ["x", "y", "z"]
    ball:
      <<: *tube
      mesh: {shape: hollow_sphere, inner_radius: 1, outer_radius: 2, cells: [4, 1]}
      supports: []
      pressures: []
probes:
  total: {quantity: momentum}
  inside: {body: tube, quantity: area, on: inner}
output: {fields_every: 2, checkpoint_every: 5, residuals: [1, 2]}
verify: [{value: total.x, from: 0.5, reference: 0, absolute: 1e-9}]
solver: {newton: {residual: 1e-9, increment: null, line_search: true}, linear: {method: iterative}}
""",
    """\
time: {step: 0.1, end: 1}
structure:
  plane: stress
  bodies:
    disc:
      mesh: {shape: disc, radius: 1, cells: [8, 2]}
      material: {law: st_venant_kirchhoff, lambda: 1e6, mu: 1e6}
      supports:
        - on: outer
          displacement: [0, 0.1]
probes:
  middle: {quantity: displacement, at: [0, 0]}
""",
    """\
time: {step: 0.1, end: 1}
fluid:
  density: 1
  viscosity: 0.1
  grid: {from: [0, 0], to: [4, 1], cells: [null, 9], x: [{to: 1, cells: 4}, {to: 4, cells: 6, ratio: 3}]}
  patches:
    inlet: {on: x-, velocity: ["y*(1 - y)", 0]}
    outlet: {on: x+, where: "y - 0.45", outflow: true}
    walls: {on: [y-, y+], no_slip: true}
    above: {on: x+, where: "0.45 - y", traction: [0, t]}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.3, cells: [8, 2], translate: [1, 0.5]}
      on: outer
      motion: {displacement: [0, "sin(t)/9"], rotation: {centre: [0, 0], angle: 3*t}}
  gravity: [0, -9.81]
probes:
  force: {quantity: moment, body: disc, about: [1, 0.5]}
  dp: {quantity: pressure, at: [0, 0.5], minus: [4, 0.5]}
  out: {field: fluid, quantity: flow_rate, through: outlet}
verify: [{value: out, reference: 1, relative: 0.1}]
""",
]

#: other values for settings, of all kinds
VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 3) | st.sampled_from([10**20, -(10**400)]),
    st.floats(),
    st.sampled_from(
        ["", "x", "left", "1/0", "min(", "disc", "tube.x", "2001-01-01", "\x00", "a\nb", "*", "{", "9**9**9"]
    ),
    st.text(max_size=5),
    st.sampled_from([[], {}, [[]], {"": {}}, [None], {"a": [1]}, ["x", "y", "z"], {"file": "a" * 300}, {"shape": []}]),
)
MUTATIONS = st.lists(
    st.tuples(st.sampled_from(["delete", "rename", "replace", "wrap", "copy"]), st.integers(0, 10**6), VALUES),
    min_size=1,
    max_size=3,
)
EDITS = st.lists(
    st.tuples(st.integers(0, 10**6), st.integers(0, 8), st.text(alphabet="\t\n :-[]{}&*!'\"#|>%@?,.a0", max_size=4)),
    min_size=1,
    max_size=3,
)
LIMITS = settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def mutate(data, kind, where, value):
    """Delete, rename, replace, wrap or copy one setting."""
    all_settings = settings_of(data)
    if not all_settings:
        return
    container, key = all_settings[where % len(all_settings)]
    if kind == "delete":
        del container[key]
    elif kind == "rename" and isinstance(container, dict):
        container[f"{key}{value}"[:20]] = container.pop(key)
    elif kind == "wrap":
        container[key] = [container[key]]
    elif kind == "copy":
        other, name = all_settings[(where // 7) % len(all_settings)]
        if not isinstance(other[name], dict | list):
            container[key] = other[name]
    else:
        container[key] = copy.deepcopy(value)  # else it may become a part of itself


def check(path, overrides=()):
    """What `fsci check` does; the text it prints."""
    try:
        case = load_case(path, overrides)
    except CaseError as error:
        problems = error.problems
    else:
        return "\n".join([summary(case), *case.warnings])
    assert problems
    assert all(problem.message and problem.place.source for problem in problems)
    return "\n".join(str(problem) for problem in problems)


def dump(data):
    stream = io.StringIO()
    YAML(typ="safe", pure=True).dump(data, stream)
    return stream.getvalue()


@pytest.mark.parametrize("text", CASES)
def test_the_cases_are_valid(text, tmp_path):
    (tmp_path / "case.yaml").write_text(text, encoding="utf-8")
    load_case(tmp_path)


@LIMITS
@given(st.sampled_from(CASES), MUTATIONS)
def test_changed_settings(tmp_path, text, mutations):
    data = YAML(typ="safe", pure=True).load(text)
    for mutation in mutations:
        mutate(data, *mutation)
    path = tmp_path / "case.yaml"
    path.write_text(dump(data), encoding="utf-8", errors="replace")
    check(path)


@LIMITS
@given(st.sampled_from(CASES), EDITS)
def test_changed_text(tmp_path, text, edits):
    for where, length, new in edits:
        at = where % (len(text) + 1)
        text = text[:at] + new + text[at + length :]
    path = tmp_path / "case.yaml"
    path.write_text(text, encoding="utf-8")
    check(path)


@LIMITS
@given(
    st.sampled_from(
        ["time.end", "structure.bodies.tube.supports.0", "solver.newton", "probes.new.quantity", "a.b", "..", ""]
    ),
    st.text(alphabet="\t\n :-[]{}&*!'\"#|>%@?,.a0", max_size=8),
)
def test_any_override(tmp_path, name, value):
    path = tmp_path / "case.yaml"
    path.write_text(CASES[0], encoding="utf-8")
    check(path, [(name, value)])


@LIMITS
@given(st.binary(max_size=30))
def test_any_bytes(tmp_path, data):
    path = tmp_path / "case.yaml"
    path.write_bytes(data)
    check(path)
