"""Data with formulas of parameters: what becomes a value, a text, nothing, or an error."""

import pytest

from fsci.expression import ExpressionError
from fsci.template import fill, value_of

PARAMETERS = {"n": 3, "solid density": 2.5, "size": [1.0, 4.0], "law": {"E": 5}, "on": True, "nothing": None}


@pytest.mark.parametrize(
    ("data", "filled"),
    [
        ("{2*n}", 6),
        ("{n/2}", 1.5),
        ("{round(n/2)}", 2),
        ("{solid_density*size[1]}", 10),
        ("{-n}*t", "-3*t"),
        ("min(t/{n/2}, 1)", "min(t/1.5, 1)"),
        ("{law}", {"E": 5}),
        ("{size[1]}", 4.0),
        ("{on}", True),
        ("x-", "x-"),
        ({"{n} cells": ["{n}", 1]}, {"3 cells": [3, 1]}),
        ({"a": "{nothing}", "b": 1}, {"b": 1}),
        ({"a": {"when": "n > 2", "b": 1}, "c": {"when": "not on"}}, {"a": {"b": 1}}),
        ([{"when": "n == 2", "b": 1}, None], [None]),
        ("{1e-3*n}", 0.003),
    ],
)
def test_values(data, filled):
    assert fill(data, PARAMETERS) == filled


def test_negative_numbers_keep_their_sign():
    assert value_of("n**2 - m", {"n": -3.0, "m": -1.0}) == 10


@pytest.mark.parametrize(("formula", "message"), [("2*m", "unknown name 'm'"), ("2*t", "is no number"), ("2*", "ends")])
def test_mistakes(formula, message):
    with pytest.raises(ExpressionError, match=message):
        value_of(formula, PARAMETERS)
