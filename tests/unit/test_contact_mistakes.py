"""Mistakes in the contact section of a case: each has its message and its place."""

from __future__ import annotations

import pytest
from case_mistakes import assert_located, first_lines, refused
from contact_cases import PLATE

from fsci.case import load_case

PRESS = "    press: {slave: {body: block, on: top}, master: {obstacle: plate}}"


BOX_SURFACES = "(available: left, right, front, back, bottom, top)"


#: what is replaced, by what, the message with line and column, the text that stands there
MISTAKES = [
    (
        "  pairs:\n",
        "  film: {roughness: 0.1}\n  pairs:\n",
        "15:9: 'film' describes the fluid between surfaces and needs the section 'fluid'",
        "{rough",
    ),
    (
        "  pairs:\n",
        "  film: {seal: 1e-3}\n  pairs:\n",
        "15:9: 'film' describes the fluid between surfaces and needs the section 'fluid'",
        "{seal",
    ),
    ("  pairs:\n", "  film: {seal: 0}\n  pairs:\n", "15:16: 'seal' must be greater than 0, not 0", "0"),
    (
        "  pairs:\n",
        "  film: {seal: 1e-3, roughness: 0.1}\n  pairs:\n",
        "15:16: surfaces are either tight or let fluid pass: give 'seal', or 'transmissivity' or 'roughness'",
        "1e-3",
    ),
    ("body: block, on: top", "body: blok, on: top", "16:27: unknown body 'blok'; did you mean 'block'?", "blok"),
    (
        "body: block, on: top",
        "body: block, on: tpo",
        f"16:38: 'box' has no surface 'tpo'; did you mean 'top'? {BOX_SURFACES}",
        "tpo",
    ),
    ("obstacle: plate", "obstacle: plat", "16:63: unknown obstacle 'plat'; did you mean 'plate'?", "plat"),
    ("on: bottom\n", "on: botom\n", f"13:11: 'box' has no surface 'botom'; did you mean 'bottom'? {BOX_SURFACES}", "b"),
    (
        "{body: block, on: top}",
        "{obstacle: plate}",
        "16:20: the slave must be a surface of a body: make the obstacle the master; friction of two rigid bodies is"
        " in 'rigid_pairs'",
        "{obstacle",
    ),
    (
        "body: block, on: top",
        "body: block",
        "16:27: a side of a body needs the setting 'on', the name of its surface",
        "block",
    ),
    (
        "{obstacle: plate}",
        "{obstacle: plate, body: block, on: top}",
        "16:52: give either 'body' and 'on', or 'obstacle'",
        "{obstacle",
    ),
    ("{obstacle: plate}", "{on: top}", "16:52: give either 'body' and 'on', or 'obstacle'", "{on"),
    (
        "{obstacle: plate}",
        "{obstacle: plate, on: top}",
        "16:74: the surface of an obstacle is named in its own section under 'obstacles'; remove 'on' here",
        "top",
    ),
    ("  pairs:\n" + PRESS, "  pairs: {}", "15:10: 'contact' needs 'pairs', or 'bodies: all' for automatic pairs", "{}"),
    ("  pairs:\n" + PRESS + "\n", "", "9:1: 'contact' needs 'pairs', or 'bodies: all' for automatic pairs", "contact"),
    (
        "body: block, on: top",
        "body: block, on: [left, tpo]",
        f"16:45: 'box' has no surface 'tpo'; did you mean 'top'? {BOX_SURFACES}",
        "tpo",
    ),
    (
        "master: {obstacle: plate}",
        "master: {body: block, on: [left, top]}",
        "16:52: a surface that may touch itself is not a slave and a master: write 'self: {body, on}'",
        "{body",
    ),
    (
        "master: {obstacle: plate}",
        "master: {body: block, on: top}",
        "16:52: a surface that may touch itself is not a slave and a master: write 'self: {body, on}'",
        "{body",
    ),
    (", \"-0.2*sin(2*pi*t)^2\"]", "]", "14:15: 'motion' must have 3 entries in 3D, not 2", "["),
    ("contact:\n", "contact:\n  c_n: 0\n", "10:8: 'c_n' must be greater than 0, not 0", "0"),
    (
        "contact:\n",
        "contact:\n  gap: 1\n",
        "10:3: unknown setting 'gap' (available: pairs, bodies, friction, restitution, reach, rigid_pairs, obstacles,"
        " film, c_n)",
        "gap",
    ),
    (
        "quantity: displacement, at: [0.4, 0.5, 1]",
        "quantity: gap, pair: press, at: [0.4, 0.5, 1], extreme: least",
        "19:65: give either 'at' or 'extreme', not both",
        "least",
    ),
    (
        "quantity: displacement, at: [0.4, 0.5, 1]",
        "quantity: first_contact, pair: press, extreme: least",
        "19:56: 'first_contact' is measured on the whole pair: remove 'extreme'",
        "least",
    ),
    (
        "quantity: displacement, at: [0.4, 0.5, 1]",
        "quantity: pressure, pair: pres",
        "19:35: unknown pair 'pres'; did you mean 'press'?",
        "pres",
    ),
    (
        "quantity: displacement, at: [0.4, 0.5, 1]",
        "quantity: first_contact",
        "19:19: quantity 'first_contact' needs 'pair: PAIR'",
        "first",
    ),
    (
        "quantity: displacement, at: [0.4, 0.5, 1]",
        "quantity: gap, pair: press, on: top",
        "19:41: give either 'pair' or 'on', not both",
        "top",
    ),
]  # fmt: skip


@pytest.mark.usefixtures("in_new_folder")
@pytest.mark.parametrize(("old", "new", "message", "at"), MISTAKES, ids=[m[2] for m in MISTAKES])
def test_message(old, new, message, at):
    assert PLATE.count(old) >= 1
    text = PLATE.replace(old, new, 1)
    error = refused(text)
    assert first_lines(error) == [f"case.yaml:{message}"]
    assert_located(text, error, message, at)


def test_the_case_without_mistakes_loads(tmp_path):
    (tmp_path / "case.yaml").write_text(PLATE)
    assert load_case(tmp_path / "case.yaml").warnings == ()
