"""Types of values of settings; each reader explains in plain words why it rejects a value."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    PlainValidator,
    ValidationInfo,
    WithJsonSchema,
)
from pydantic_core import CoreSchema
from pydantic_core.core_schema import no_info_before_validator_function

from fsci.case.errors import did_you_mean, listed
from fsci.case.section import fault
from fsci.expression import VARIABLES, Expression, ExpressionError
from solvers.values import Value

#: Size above which cubes of a number and products of three overflow.
LARGEST_NUMBER = 1e100


def describe_value(value: Any) -> str:
    """A value as an error message names it."""
    match value:
        case None:
            return "empty"
        case bool():
            return "true" if value else "false"
        case int() | float():
            return f"{value:.12g}" if abs(value) <= sys.float_info.max else "a number without bound"
        case str():
            text = value if len(value) <= 40 else value[:37] + "..."
            return f"'{text}'"
        case dict():
            return "a section"
        case _:
            return "a list"


def value_of(expression: Expression) -> Value:
    """A number if the expression is constant, else the expression, a function of position and time."""
    return expression if expression.constant is None else float(expression.constant)


def _expression(value: Any, wanted: str, variables: str, functions: Mapping[str, Any] | None = None) -> Expression:
    """An expression of the given variables and the user's functions, from a number or text."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise fault(f"must be {wanted}, not {describe_value(value)}")
    if isinstance(value, int | float) and not abs(value) < math.inf:
        raise fault("must be a finite number")
    try:
        expression = Expression.parse(value, functions)
    except ExpressionError as error:
        raise fault(f": {error.message}", column=error.column) from None
    if extra := sorted(expression.uses - set(variables)):
        hint = " (it must be a constant)" if not variables else ""
        raise fault(f"must not depend on {' or '.join(extra)}{hint}")
    return expression


def _number(allowed: Callable[[float], bool], words: str) -> BeforeValidator:
    """A plain number, or constant arithmetic such as 2*pi, that is allowed."""

    def read(value: Any) -> float:
        number = _expression(value, "a number", "").constant
        assert number is not None, "an expression without variables is constant"
        if not allowed(number):
            raise fault(f"must be {words}, not {describe_value(float(number))}")
        if abs(number) > LARGEST_NUMBER:
            raise fault(f"must be at most {LARGEST_NUMBER:g} in size, not {describe_value(float(number))}")
        return float(number)

    return BeforeValidator(read)


def _whole(least: int) -> BeforeValidator:
    """A whole number, or constant arithmetic with such a result."""

    def read(value: Any) -> int:
        number = _expression(value, "a whole number", "").constant
        assert number is not None, "an expression without variables is constant"
        if number != round(number) or abs(number) > 2**53:
            raise fault(f"must be a whole number, not {describe_value(value)}")
        if number < least:
            raise fault(f"must be at least {least}, not {describe_value(int(number))}")
        return int(number)

    return BeforeValidator(read)


def _formula(variables: str, allowed: Callable[[float], bool] = lambda _: True, words: str = "") -> PlainValidator:
    """An expression of the given variables; if it is constant, its value must be allowed."""
    wanted = f"a number or an expression of {', '.join(variables)}"

    def read(value: Any, info: ValidationInfo) -> Expression:
        functions = (info.context or {}).get("functions")
        expression = value if isinstance(value, Expression) else _expression(value, wanted, variables, functions)
        if expression.constant is not None and not allowed(expression.constant):
            raise fault(f"must be {words}, not {describe_value(float(expression.constant))}")
        return expression

    return PlainValidator(read)


def _schema(words: str, **keywords: Any) -> WithJsonSchema:
    """JSON schema of a number that may be written as an expression; the comment names it in the reference."""
    return WithJsonSchema({"type": ["number", "string"], "$comment": words, **keywords})


Number = Annotated[float, _number(lambda _: True, ""), _schema("number")]
Positive = Annotated[float, _number(lambda v: v > 0, "greater than 0"), _schema("number > 0", exclusiveMinimum=0)]
NotNegative = Annotated[float, _number(lambda v: v >= 0, "at least 0"), _schema("number >= 0", minimum=0)]
Share = Annotated[
    float, _number(lambda v: 0 <= v <= 1, "from 0 to 1"), _schema("number from 0 to 1", minimum=0, maximum=1)
]
Count = Annotated[int, _whole(1), _schema("whole number >= 1", minimum=1)]
CountOrZero = Annotated[int, _whole(0), _schema("whole number >= 0", minimum=0)]


def _order(value: Any) -> Any:
    if value not in ("auto", 1, 2) or isinstance(value, bool):
        raise fault(f"must be 1, 2 or auto, not {describe_value(value)}")
    return value if value == "auto" else int(value)


Order = Annotated[Literal["auto", 1, 2], BeforeValidator(_order)]


_SPACE, _VARIABLES = "xyz", "".join(VARIABLES)
Formula = Annotated[Expression, _formula(_VARIABLES), _schema("expression of x, y, z, t")]
SpaceFormula = Annotated[Expression, _formula(_SPACE), _schema("expression of x, y, z")]
TimeFormula = Annotated[Expression, _formula("t"), _schema("expression of t")]
PositiveFormula = Annotated[
    Expression,
    _formula(_SPACE, lambda v: v > 0, "greater than 0"),
    _schema("expression of x, y, z, > 0", exclusiveMinimum=0),
]
NotNegativeFormula = Annotated[
    Expression,
    _formula(_SPACE, lambda v: v >= 0, "at least 0"),
    _schema("expression of x, y, z, >= 0", minimum=0),
]
PoissonFormula = Annotated[
    Expression,
    _formula(_SPACE, lambda v: -1 < v < 0.5, "above -1 and below 0.5"),
    _schema("expression of x, y, z, above -1 and below 0.5", exclusiveMinimum=-1, exclusiveMaximum=0.5),
]
Dispersion = Annotated[
    Expression,
    _formula(_SPACE, lambda v: 0 <= 3 * v <= 1, "from 0 to 1/3"),
    _schema("expression of x, y, z, from 0 to 1/3", minimum=0, maximum=1 / 3),
]


@dataclass(frozen=True)
class EntryCount:
    """A list of so many entries."""

    fewest: int
    most: int | None  #: None: any number

    def __call__(self, value: Any) -> Any:
        words = f"{self.fewest}" if self.fewest == self.most else f"{self.fewest} or {self.most or 'more'}"
        if not isinstance(value, list | tuple):
            raise fault(f"must be a list of {words} entries, not {describe_value(value)}")
        if len(value) < self.fewest or (self.most is not None and len(value) > self.most):
            raise fault(f"must have {words} entries, not {len(value)}")
        return value

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return no_info_before_validator_function(self, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        most = {} if self.most is None else {"maxItems": self.most}
        return handler(schema) | {"minItems": self.fewest, **most}


class OneOrMany:
    """A list; a single value stands for a list of one."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return no_info_before_validator_function(
            lambda value: list(value) if isinstance(value, list | tuple) else [value], handler(source)
        )

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        many = handler(schema)
        return {"anyOf": [many["items"], many]}


@dataclass(frozen=True)
class OrNone:
    """A section, or the word `none` for no section, or for another value."""

    meaning: Any = None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return no_info_before_validator_function(
            lambda value: self.meaning if value == "none" else value, handler(source)
        )

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        section = handler(schema)
        return {**section, "anyOf": [*section["anyOf"], {"const": "none"}]}


Vector = Annotated[tuple[Formula, ...], EntryCount(2, 3)]
SpaceVector = Annotated[tuple[SpaceFormula, ...], EntryCount(2, 3)]
TimeVector = Annotated[tuple[TimeFormula, ...], EntryCount(2, 3)]
NumberVector = Annotated[tuple[Number, ...], EntryCount(2, 3)]


def _text(value: Any) -> str:
    if not isinstance(value, str):
        hint = " (put it in quotes)" if isinstance(value, int | float) else ""
        raise fault(f"must be a text, not {describe_value(value)}{hint}")
    if not value.strip():
        raise fault("must be a text, not an empty one")
    return value


def _name(value: Any) -> str:
    name = _text(value)
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_-]*", name):
        raise fault(
            f"must be a name of letters, digits, '_' and '-' that begins with a letter, not {describe_value(name)}"
        )
    return name


def _switch(value: Any) -> bool:
    if not isinstance(value, bool):
        raise fault(f"must be true or false, not {describe_value(value)}")
    return value


def _switch_or_number(value: Any) -> bool | float:
    if isinstance(value, bool):
        return value
    number = _expression(value, "true, false or a number", "").constant
    assert number is not None, "an expression without variables is constant"
    if number < 0:
        raise fault(f"must be true, false or a number of at least 0, not {describe_value(float(number))}")
    return float(number)


Text = Annotated[str, BeforeValidator(_text)]
Name = Annotated[str, BeforeValidator(_name)]
Switch = Annotated[bool, BeforeValidator(_switch)]
SwitchOrNotNegative = Annotated[
    bool | float,
    PlainValidator(_switch_or_number),
    WithJsonSchema({"type": ["boolean", "number", "string"], "minimum": 0, "$comment": "true, false or a number >= 0"}),
]
Surfaces = Annotated[tuple[Text, ...], EntryCount(1, None), OneOrMany()]


def chosen(key: str, names: Sequence[str], *others: str) -> BeforeValidator:
    """A section whose other settings depend on `key`, which is one of the names; `others` are words for what else."""

    def check(value: Any) -> Any:
        if not isinstance(value, dict):
            raise fault(f"must be a section with '{key}', not {describe_value(value)}")
        if key not in value:
            raise fault(f"needs the setting '{key}' (available: {', '.join((*names, *others))})")
        word = value[key]
        if not isinstance(word, str):
            raise fault(f"must be {listed((*names, *others))}, not {describe_value(word)}", key)
        if word not in names:
            raise fault(f"unknown {key} '{word}'{did_you_mean(word, (*names, *others))}", key)
        return value

    return BeforeValidator(check)
