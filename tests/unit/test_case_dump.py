"""The text of a case with overrides has just these settings, whatever its sections share; comments stay."""

from pathlib import Path

import pytest

from fsci.case.document import Document, override
from fsci.case.yaml_text import parse_yaml

SHARED = """\
# the head
a: {m: &m {E: 1, nu: 0.3}, x: 1}  # first
b: {m: *m, x: 2}  # second
"""
MERGED = """\
base: &b
  m: {E: 1, nu: 2}  # c
  l: [1, {q: 2}]
c:
  <<: *b
  y: 1
d:
  <<: [*b]
e: *b
"""
LISTS = """\
x: &s [{on: left, d: [0, 0]}, {on: right}]
y: *s
z: &t {q: *s}
w: {<<: *t}
"""
CASES = [
    (SHARED, {"b.m.E": "5"}),
    (SHARED, {"a.m.E": "5"}),
    (SHARED, {"a.m.E": "5", "b.m.nu": "0.1", "b.m.E": "6"}),
    (SHARED, {"b.m": "{E: 3}", "b.new.one": "[1, 2]"}),
    (MERGED, {"c.m.E": "7"}),
    (MERGED, {"base.m.E": "7"}),
    (MERGED, {"d.l.1.q": "9", "e.m.E": "8", "base.l.0": "3"}),
    (MERGED, {"c.y": "2", "base.l": "[]", "c.more.x": "1"}),
    (LISTS, {"y.0.on": "top"}),
    (LISTS, {"w.q.0.d.1": "3"}),
    (LISTS, {"x.1.on": "a", "z.q.0.on": "b", "w.q.1.on": "c"}),
    ("a: &x 1\nb: *x\nc: {d: *x}\n", {"a": "2", "c.d": "3"}),
    ("a: &x {b: &y {c: 1}}\nd: {<<: *x}\ne: *y\n", {"d.b.c": "2", "e.c": "3"}),
    ("a: &x {k: 1}\nb: &x {k: 2}\nc: *x\n", {"c.k": "3"}),
    ("a: .nan\nb: &x [.inf, 1]\nc: *x\n", {"c.1": "2"}),
    ("a: |\n  text\nb: &x {k: 'on', l: 0x10, m: 1_000}\nc: *x\n", {"c.l": "2020-01-01"}),
    # what the writer of YAML makes of it is something else: without comments then
    ("t: {k: &n [&n [{}, 1], [true], *n]}\n", {"t.k.0.1": "{x: {y: 1}}", "t.k.1": "&z {a: 1}"}),
]


@pytest.mark.parametrize(("text", "changes"), CASES)
def test_settings(text, changes):
    document = Document(Path("case.yaml"), text, parsed=parse_yaml(text, "case.yaml"))
    for name, value in changes.items():
        document = override(document, name, value)
    dumped = document.dump()
    assert repr(sorted(parse_yaml(dumped, "").data.items())) == repr(sorted(document.data.items())) or (
        parse_yaml(dumped, "").data == document.data
    )
    if "#" in text:
        assert [word for word in text.split("#")[1:] if word.split()[0] not in dumped] == []


def test_without_changes_it_is_the_text():
    assert Document(Path("case.yaml"), MERGED, parsed=parse_yaml(MERGED, "")).dump() == MERGED
