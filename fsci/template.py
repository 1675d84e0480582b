"""Data with formulas of parameters in braces, such as `cells: ["{4*n}", "{n}"]`: cases of benchmarks and of stress.

A text that is one formula in braces becomes its value; formulas in a longer text become numbers in it, as in
`"{press}*t"`. The name of a parameter alone, or of one of its entries (`size[1]`), stands for what it is: a list or a
mapping, too. A mapping that has `when: FORMULA` is there if the formula is not zero, and an entry of a mapping that
becomes null is not there. Formulas have the grammar of cases (fsci/expression.py) and `round`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from fsci.expression import Expression, ExpressionError

FORMULA = re.compile(r"\{([^{}]*)\}")
NAME = re.compile(r"(?<![\w.])([A-Za-z_]\w*)(?:\[(\d+)\])?")
ABSENT = object()


def fill(data: Any, parameters: Mapping[str, Any]) -> Any:
    """The data with the values of all formulas; blanks in names of parameters are `_` there. Raises ExpressionError."""
    return _filled(data, {name.replace(" ", "_"): value for name, value in parameters.items()})


def value_of(formula: str, parameters: Mapping[str, Any]) -> Any:
    """The value of one formula; whole numbers are integers. Raises ExpressionError."""
    return _value(formula, {name.replace(" ", "_"): value for name, value in parameters.items()})


def _filled(data: Any, values: Mapping[str, Any]) -> Any:
    if isinstance(data, str):
        if (whole := FORMULA.fullmatch(data)) is not None:
            return _filled(_value(whole[1], values), {})
        return FORMULA.sub(lambda found: str(_value(found[1], values)), data)
    if isinstance(data, Mapping):
        if "when" in data and not _value(str(data["when"]), values):
            return ABSENT
        inner = {_filled(name, values): _filled(value, values) for name, value in data.items() if name != "when"}
        return {name: value for name, value in inner.items() if value is not ABSENT and value is not None}
    if isinstance(data, list):
        return [value for value in (_filled(value, values) for value in data) if value is not ABSENT]
    return data


def _value(formula: str, values: Mapping[str, Any]) -> Any:
    whole = NAME.fullmatch(formula.strip())
    if whole is not None and whole[1] in values:
        return _looked_up(whole, values)
    text = NAME.sub(lambda found: _number(found, values), formula)
    number = Expression.parse(text, {"round": np.rint}).constant
    if number is None:
        raise ExpressionError(f"'{formula}' is no number", 1)
    return int(number) if number == int(number) and abs(number) < 1e9 else float(number)


def _looked_up(name: re.Match[str], values: Mapping[str, Any]) -> Any:
    value = values[name[1]]
    return value if name[2] is None else value[int(name[2])]


def _number(name: re.Match[str], values: Mapping[str, Any]) -> str:
    if name[1] not in values:
        return name[0]
    value = _looked_up(name, values)
    return f"({float(value)!r})"
