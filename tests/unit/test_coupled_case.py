"""The section `coupling` of a case: each mistake with its message and the text it points at."""

import pytest
from case_mistakes import assert_located, load, refused
from case_text import section
from coupled_case import POST

from fsci.check.check import summary

COUPLING = "coupling: {scheme: monolithic}"
STRUCTURE, FLUID = section(POST, "structure"), section(POST, "fluid")
RIGID = "  bodies: {post: {mesh: {shape: disc, radius: 0.1, cells: [8, 1], translate: [1.5, 0.5]}}}\nstructure:"

#: what is replaced, by what, the message with line and column, the text that stands there
MISTAKES = [
    (COUPLING, "coupling: {sceme: monolithic}", "19:12: unknown setting 'sceme'; did you mean 'scheme'?", "sceme"),
    (COUPLING, "coupling: {scheme: both}", "19:20: 'scheme' must be 'monolithic' or 'partitioned', not 'both'", "both"),
    (COUPLING, "coupling: {reuse: 3}", "19:19: 'reuse' applies only to the partitioned scheme", "3"),
    (
        COUPLING,
        "coupling: {scheme: partitioned, relaxation: 0}",
        "19:45: 'relaxation' must be greater than 0, not 0",
        "0}",
    ),
    (
        COUPLING,
        "coupling: {scheme: partitioned, accelerator: iqn-ils}",
        "19:46: 'accelerator' must be 'iqn', 'aitken' or 'constant', not 'iqn-ils'",
        "iqn-ils",
    ),
    (
        COUPLING,
        "coupling: {scheme: partitioned, max_iterations: 0}",
        "19:49: 'max_iterations' must be at least 1, not 0",
        "0}",
    ),
    (
        COUPLING,
        "coupling: {wetted: {pots: top}}",
        "19:27: unknown body 'pots'; did you mean 'post'?",
        "top",
    ),
    (
        COUPLING,
        "coupling: {wetted: {post: [top, lfet]}}",
        "19:33: 'rectangle' has no surface 'lfet'; did you mean 'left'? (available: left, right, bottom, top)",
        "lfet",
    ),
    (STRUCTURE, "", "12:11: 'coupling' needs the section 'structure'", "{scheme"),
    (FLUID, "", "10:11: 'coupling' needs the section 'fluid'", "{scheme"),
    (
        "structure:",
        RIGID,
        "12:18: 'post' is already the name of an elastic body; give this rigid body another one",
        "{mesh",
    ),
    (
        "  viscosity: 0.05\n",
        "  viscosity: 0.05\n  scheme: steady\n",
        "6:11: a steady flow needs a static structure: remove 'dynamics', or choose the scheme bdf2",
        "steady",
    ),
    (
        "  dynamics: {rho_inf: 0.8}\n",
        "",
        "3:1: a flow in time needs 'dynamics' in 'structure', or choose the scheme steady",
        "fluid",
    ),
    (
        "{quantity: force}",
        "{quantity: force, body: pots}",
        "22:34: unknown body 'pots'; did you mean 'post'?",
        "pots",
    ),
    ("value: tip.x", "value: interface.wrok", "25:13: there is no value 'interface.wrok'; did you mean", "interface"),
]


pytestmark = pytest.mark.usefixtures("in_new_folder")


@pytest.mark.parametrize(("old", "new", "message", "at"), MISTAKES, ids=[m[2] for m in MISTAKES])
def test_message(old, new, message, at):
    assert POST.count(old) == 1
    text = POST.replace(old, new)
    assert_located(text, refused(text), message, at)


def test_the_case_without_mistakes_loads():
    case = load(POST)
    assert [str(warning).partition(": ")[2].partition(",")[0] for warning in case.warnings] == [
        "the body is 0.23 thick"
    ]
    text = summary(case)
    for words in ("monolithic", "693", "48", "body post"):
        assert words in text
    partitioned = load(POST.replace("scheme: monolithic", "scheme: partitioned, accelerator: aitken"))
    assert "partitioned, aitken" in summary(partitioned)
