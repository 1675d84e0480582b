"""Expressions of case files: values from mathematics, exact places of mistakes, nothing executed."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fsci.expression import FUNCTIONS, Expression, ExpressionError

POINTS = np.array([[0.0, 0.5, 2.0], [1.0, 1.0, -3.0], [0.0, 4.0, 9.0]])  # x, y, z of three points


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 0.001),
        (".5 + 1.", 1.5),
        ("1 - 2 - 3", -4),
        ("12/2/3", 2),
        ("2 + 3*4", 14),
        ("(2 + 3)*4", 20),
        ("-2**2", -4),
        ("2^3^2", 512),
        ("2**-1", 0.5),
        ("--3", 3),
        ("2*pi", 2 * math.pi),
        ("log(e**2)", 2),
        ("log10(1000)", 3),
        ("sqrt(2)**2", 2),
        ("sin(pi/6)", 0.5),
        ("cos(pi/3)", 0.5),
        ("tan(pi/4)", 1),
        ("asin(1)", math.pi / 2),
        ("acos(0)", math.pi / 2),
        ("atan(1)", math.pi / 4),
        ("atan2(1, -1)", 3 * math.pi / 4),
        ("exp(0)", 1),
        ("cosh(1)**2 - sinh(1)**2", 1),
        ("tanh(0)", 0),
        ("floor(-1.5) + 10*ceil(1.2)", 18),
        ("abs(-3)*sign(-3)", -3),
        ("min(3, 1, 2) + 10*max(3, 1, 2)", 31),
        ("where(1 < 2, 5, 1/0)", 5),
        ("1 < 2 < 3", 1),
        ("1 < 3 < 2", 0),
        ("(1 == 1) + (1 != 1) + (2 >= 2) + (2 <= 1)", 2),
        ("not 1 > 2 and 2 > 1", 1),
        ("0 and 0 or 1", 1),
        ("0 and (0 or 1)", 0),
        ("not not 5", 1),
        ("ramp(0, 1, 3) + 10*ramp(2, 1, 3) + 100*ramp(4, 1, 3)", 105),
        ("ramp(1.5, 1, 3)", (10 - 15 / 4 + 6 / 16) / 64),
    ],
)
def test_constants(text, value):
    assert Expression.parse(text).constant == pytest.approx(value, rel=1e-14)


def test_every_function_is_tested_above():
    table = next(mark for mark in test_constants.pytestmark if mark.name == "parametrize").args[1]
    tested = " ".join(text for text, _ in table)
    assert [name for name in FUNCTIONS if f"{name}(" not in tested] == []


def test_functions_of_the_user():
    functions = {"twice": lambda x: 2.0 * x}
    assert Expression.parse("twice(3) + 1", functions).constant == 7.0
    assert Expression.parse("twice(t)", functions).uses == {"t"}
    assert Expression.parse("twice(t)", functions).at_times([1.0, 2.0]).tolist() == [2.0, 4.0]
    with pytest.raises(ExpressionError, match="'twice' takes 1 argument, not 2"):
        Expression.parse("twice(1, 2)", functions)
    with pytest.raises(ExpressionError, match="did you mean 'twice'"):
        Expression.parse("twyce(1)", functions)


def test_numbers_are_expressions():
    assert Expression.parse(0.1).constant == 0.1
    assert Expression.parse(-7).constant == -7


def test_values_at_points():
    inflow = Expression.parse("1.5*4*y*(0.41-y)/0.1681*min(t/2,1)")
    assert inflow.uses == {"y", "t"}
    assert inflow.constant is None
    heights = np.array([[0.3, 0.9], [0.205, 0.41]])
    np.testing.assert_allclose(inflow(heights, 1.0), [0.75, 0.0], atol=1e-15)  # half of the maximum 1.5, and the wall
    np.testing.assert_allclose(inflow(heights, 5.0), [1.5, 0.0], atol=1e-15)


def test_shape_of_values():
    assert Expression.parse("3")(POINTS, 0.0).shape == (3,)
    np.testing.assert_array_equal(Expression.parse("x + y*z")(POINTS, 0.0), [0.0, 4.5, -25.0])
    np.testing.assert_array_equal(Expression.parse("x + z")(POINTS[:2], 0.0), [0.0, 0.5, 2.0])
    assert Expression.parse("x")(np.empty((3, 0)), 0.0).shape == (0,)


def test_values_can_be_changed_without_changing_the_points():
    points = POINTS.copy()
    Expression.parse("x")(points, 0.0)[:] = 7.0
    np.testing.assert_array_equal(points, POINTS)


def test_where_decides_at_each_point():
    np.testing.assert_array_equal(Expression.parse("where(x > 0.1, 1/x, -1)")(POINTS, 0.0), [-1.0, 2.0, 0.5])


def test_long_sums_do_not_nest():
    assert Expression.parse("x" + "+x" * 20000)(np.ones((2, 1)), 0.0) == [20001.0]


@pytest.mark.parametrize(
    ("text", "column", "message"),
    [
        ("", 1, "the expression ends where a number, a name or '(' is expected"),
        ("1 +", 4, "the expression ends where a number, a name or '(' is expected"),
        ("(1 + 2", 7, "the expression ends where ')' is expected"),
        ("2x", 2, "found 'x' where an operator such as + or * is expected"),
        ("x = 2", 3, "found '=' where an operator such as + or * is expected ('==' compares)"),
        ("1 $ 2", 3, "found '$' where an operator such as + or * is expected"),
        ("3*sine(x)", 3, "unknown function 'sine'; did you mean 'sin'?"),
        ("3*q", 3, "unknown name 'q' (known: x, y, z, t, pi, e)"),
        ("1 + sin", 5, "'sin' is a function: write sin(...)"),
        ("x(3)", 1, "'x' is not a function; write 'x*(' to multiply"),
        ("min(t)", 1, "'min' takes at least 2 arguments, not 1"),
        ("2*where(x > 0, 1)", 3, "'where' takes 3 arguments, not 2"),
        ("1/0", 1, "'1/0' has no finite value"),
        ("9**9**9**9", 1, "'9**9**9**9' has no finite value"),
        ("sqrt(-1)", 1, "'sqrt(-1)' has no finite value"),
        ("and", 1, "found 'and' where a number, a name or '(' is expected"),
        ("x.__class__", 2, "found '.' where an operator such as + or * is expected"),
        ("(" * 5000 + "x", 1, "the expression is nested too deeply"),
        ("-" * 5000 + "x", 1, "the expression is nested too deeply"),
    ],
)
def test_mistakes(text, column, message):
    with pytest.raises(ExpressionError) as caught:
        Expression.parse(text)
    assert (caught.value.column, caught.value.message) == (column, message)


@pytest.mark.parametrize(
    "text", ["__import__('os')", "open('a')", "[1, 2]", "lambda: 1", "x if x else 1", "f'{x}'", "a:=1"]
)
def test_python_is_not_executed(text):
    with pytest.raises(ExpressionError):
        Expression.parse(text)


@given(st.text(alphabet="xyzt019.e+-*/^()<>=!, andorsqrtmi", max_size=30) | st.text(max_size=20))
def test_any_text_is_an_expression_or_a_mistake_with_a_column(text):
    try:
        value = Expression.parse(text)(POINTS, 0.5)
    except ExpressionError as error:
        column = error.column
    else:
        column = 1
        assert value.shape == (3,)
    assert 1 <= column <= len(text) + 1
